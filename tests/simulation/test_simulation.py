# SPDX-License-Identifier: BSD-3-Clause
"""The simulated operator, device, sensor, surfaces and point robot from Python."""

import copy
import pickle

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

import dual_proxy as dp

ZERO = np.zeros(3)
EYE = np.eye(3)
DOWN = np.array([0.0, 0.0, -1.0])


def test_operator_path_agrees_with_scipy():
    rng = np.random.default_rng(1)
    times = np.cumsum(rng.uniform(0.05, 0.5, size=12))
    points = rng.normal(size=(3, 12))
    path = dp.OperatorPath(
        dp.OperatorPathParams(times=times, points=points, interpolation="cubic")
    )
    # Slopes of the parabolas through three points; at rest at both ends.
    slopes = np.gradient(points, times, axis=1)
    slopes[:, [0, -1]] = 0
    expected = CubicHermiteSpline(times, points.T, slopes.T)
    for time in np.linspace(times[0], times[-1], 300)[1:-1]:
        position, velocity = path.calc(time)
        np.testing.assert_allclose(position, expected(time), atol=1e-12)
        np.testing.assert_allclose(velocity, expected.derivative()(time), atol=1e-10)


def test_operator_path_params():
    params = dp.OperatorPathParams(times=[0, 1], points=[[0, 1], [0, 0], [0, 2]])
    assert params.interpolation == "minimum_jerk"
    assert list(params.fields) == [
        "times",
        "points",
        "interpolation",
        "rotations",
        "clutch",
        "home",
        "force_scale",
        "gripper",
    ]
    assert pickle.loads(pickle.dumps(params)) == params
    assert params != dp.OperatorPathParams()
    position, velocity = dp.OperatorPath(params).calc(0.5)
    np.testing.assert_allclose(position, [0.5, 0, 1])
    np.testing.assert_allclose(velocity, [1.875, 0, 3.75])
    path = dp.OperatorPath(params.times, params.points, "minimum_jerk")
    assert path.params == params
    np.testing.assert_array_equal(path.calc_rotation(0.5), np.eye(3))
    turning = dp.OperatorPath(
        params.times, params.points, rotations=[[0, 0], [0, 0], [0, np.pi]]
    )
    np.testing.assert_allclose(
        turning.calc_rotation(0.5), [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15
    )
    with pytest.raises(ValueError, match="read-only"):
        params.times[0] = 5
    with pytest.raises(ValueError, match=r"points: .*\(3, n\).*\(2, 3\)"):
        dp.OperatorPathParams(points=np.zeros((2, 3)))
    with pytest.raises(ValueError, match=r"times: .*\(n,\).*\(1, 2\)"):
        dp.OperatorPathParams(times=[[0, 1]])
    with pytest.raises(ValueError, match="`points` expected one column per time"):
        dp.OperatorPathParams(times=[0, 1])
    with pytest.raises(ValueError, match="`interpolation` expected one of"):
        dp.OperatorPathParams(interpolation="quintic")


def test_haptic_device_agrees_with_a_matrix_exponential():
    params = dp.SimulatedHapticDeviceParams(hand_stiffness=300, hand_damping=15)
    device = dp.SimulatedHapticDevice(params)
    state = device.make_state(position=[0.01, 0.02, 0])
    mass = params.hand_mass + params.device_mass
    A = np.array(
        [
            [0, 1, 0],
            [-300 / mass, -(15 + params.device_damping) / mass, 1],
            [0, 0, 0],
        ]
    )
    transition = expm(A * 0.2)
    force = np.array([1.0, -2, 3])
    start = np.vstack([[0.01, 0.02, 0], ZERO, force / mass])
    for _ in range(200):
        device.update(ZERO, EYE, ZERO, np.concatenate([force, ZERO]), state)
    np.testing.assert_allclose(state.pose.p, (transition @ start)[0], atol=1e-14)
    np.testing.assert_allclose(state.velocity, (transition @ start)[1], atol=1e-13)
    np.testing.assert_allclose(
        state.hand_force, -300 * state.pose.p - 15 * state.velocity
    )


def test_haptic_device_reads_and_copies():
    device = dp.SimulatedHapticDevice()
    R = Rotation.from_rotvec([0.1, 0.2, -0.3]).as_matrix()
    state = device.make_state(rotation=R)
    device.update([0.01, 0, 0], R, [0.1, 0, 0], np.zeros(6), state)
    saved = copy.copy(state)
    device.update([0.01, 0, 0], R, [0.1, 0, 0], np.zeros(6), state)
    assert state.pose.p[0] > saved.pose.p[0]
    assert abs(state.read_pose.p[0] - state.pose.p[0]) <= 0.5e-5
    assert state.read_velocity.shape == (6,)
    np.testing.assert_array_equal(state.read_pose.R, R)
    device.update([np.nan, 0, 0], R, ZERO, np.zeros(6), state)
    assert state.bad_inputs == 1
    np.testing.assert_array_equal(state.intended.p, [0.01, 0, 0])
    assert np.isfinite(state.pose.p).all()


@pytest.mark.parametrize(
    ("argument", "value", "message"),
    [
        ("intended_position", np.zeros(2), r"\(3,\).*\(2,\)"),
        ("intended_rotation", np.zeros(9), r"\(3, 3\).*\(9,\)"),
        ("intended_velocity", np.zeros((3, 1)), r"\(3,\).*\(3, 1\)"),
        ("device_wrench", np.zeros(3), r"\(6,\).*\(3,\)"),
    ],
)
def test_haptic_device_shapes(argument, value, message):
    device = dp.SimulatedHapticDevice()
    inputs = {
        "intended_position": ZERO,
        "intended_rotation": EYE,
        "intended_velocity": ZERO,
        "device_wrench": np.zeros(6),
        "state": device.make_state(),
    }
    device.update(**inputs)
    with pytest.raises(ValueError, match=f"^{argument}: .*{message}"):
        device.update(**{**inputs, argument: value})


def test_force_torque_sensor_moves_the_wrench_to_the_tool_point():
    params = dp.ForceTorqueSensorParams(
        force_noise_std=0, moment_noise_std=0, tool_mass=0.5, tool_com=[0, 0, 0.05]
    )
    sensor = dp.ForceTorqueSensor(params)
    state = sensor.make_state()
    R_BS = Rotation.from_rotvec([2.0, 0.3, -1]).as_matrix()
    p_SE_B = R_BS @ [0, 0, 0.1]
    force = np.array([1.0, -2, -8])
    weight = np.array([0, 0, -0.5 * 9.81])
    moment_at_S = np.cross(p_SE_B, force) - np.cross(R_BS @ [0, 0, 0.05], weight)
    reaction = np.concatenate([R_BS.T @ (force - weight), R_BS.T @ moment_at_S])
    wrench = sensor.update(reaction, ZERO, R_BS, R_BS.T @ p_SE_B, state)
    np.testing.assert_allclose(wrench, [*force, 0, 0, 0], atol=1e-13)
    np.testing.assert_array_equal(state.wrench, wrench)


def test_force_torque_sensor_noise_is_seeded():
    sensor = dp.ForceTorqueSensor()

    def run(seed):
        state = sensor.make_state(seed=seed)
        return [sensor.update(np.zeros(6), ZERO, EYE, ZERO, state) for _ in range(2000)]

    np.testing.assert_array_equal(run(1), run(1))
    noise = np.array(run(2))
    assert not np.array_equal(noise, run(1))
    np.testing.assert_allclose(noise.std(axis=0), [0.2] * 3 + [0.005] * 3, rtol=0.1)


def test_contact_scene():
    floor = dp.ContactSurfaceParams()
    wall = dp.ContactSurfaceParams(
        shape="box", position=[0.5, 0, 0], half_size=[0.1, 1, 1], friction=0.3
    )
    params = dp.ContactSceneParams(surfaces=[floor, wall], tool_radius=0.02)
    assert params.surfaces == (floor, wall)
    assert pickle.loads(pickle.dumps(params)) == params
    scene = dp.ContactScene(params)
    assert scene.calc([0, 0, 0.1], ZERO).dimension == 0
    corner = scene.calc([0.381, 0, 0.019], [0, 0.1, 0])
    assert corner.count == corner.dimension == 2
    np.testing.assert_allclose(corner.normals, [[0, 1], [0, 0], [-1, 0]], atol=1e-14)
    np.testing.assert_allclose(corner.normal_forces, [5, 5])
    np.testing.assert_allclose(corner.force, [5, 1.5, -5])
    np.testing.assert_allclose(corner.normal, np.array([1, 0, -1]) / np.sqrt(2))
    surface = dp.ContactSurface(wall).calc([0.381, 0, 0.5], ZERO, 0.02)
    np.testing.assert_allclose(surface.normal, [1, 0, 0])
    assert surface.penetration == pytest.approx(0.001)
    with pytest.raises(TypeError, match="surfaces"):
        dp.ContactSceneParams(surfaces=[1])
    with pytest.raises(ValueError, match="`shape` expected one of"):
        dp.ContactSurfaceParams(shape="torus")
    with pytest.raises(ValueError, match=r"`surfaces` expected at most 8.*got 9"):
        dp.ContactSceneParams(surfaces=[floor] * 9)


def test_point_robot_agrees_with_its_equation():
    robot = dp.PointRobot(dp.PointRobotParams(mass=2, substeps=1))
    state = robot.make_state(position=[0, 0, 1])
    position, velocity = np.array([0, 0, 1.0]), np.zeros(3)
    rng = np.random.default_rng(0)
    for _ in range(100):
        force = rng.normal(size=3)
        robot.update(force, state)
        velocity = velocity + 1e-3 * force / 2
        position = position + 1e-3 * velocity
    np.testing.assert_allclose(state.position, position, atol=1e-14)
    np.testing.assert_allclose(state.velocity, velocity, atol=1e-14)
    assert state.contact.count == 0
    with pytest.raises(ValueError, match=r"^control_force: .*\(3,\).*\(4,\)"):
        robot.update(np.zeros(4), state)


def test_filter_finds_the_normal_of_a_cylinder_that_the_robot_slides_on():
    """Surface, robot, sensor and filter in one loop.

    The robot presses with 8 N where the filter says and follows a line around
    the cylinder at 2 cm/s. The paper's filter lags behind the turning normal, so
    the cylinder is a wide one.
    """
    cylinder = dp.ContactSurfaceParams(shape="cylinder", radius=0.3)
    robot = dp.PointRobot(scene=dp.ContactSceneParams(surfaces=[cylinder]))
    state = robot.make_state([0, -0.04, 0.3])
    sensor = dp.ForceTorqueSensor()
    sensor_state = sensor.make_state(0)
    dut = dp.ForceSpaceParticleFilter(seed=0)
    means = np.zeros((4, 3))
    errors = []
    dimensions = []
    for i in range(1, 4001):
        goal = np.array([0, -0.04 + 2e-5 * max(0, i - 500), 0.25])
        error = np.clip(goal - state.position, -0.012, 0.012)
        motion = dut.motion_selection @ (500 * error - 40 * state.velocity)
        push = 8 * dut.singular_vectors[:, 0] - 40 * state.velocity
        contact = dut.force_selection @ push
        robot.update(motion + contact, state)
        reaction = np.concatenate([state.contact.force, ZERO])
        wrench = sensor.update(reaction, ZERO, EYE, ZERO, sensor_state)
        means += np.array([wrench[:3], state.velocity, motion, contact]) / 67
        if i % 67 == 0:
            dut.update(*means)
            means[:] = 0
        if i > 1000:
            dimensions.append(dut.dimension)
            cosine = dut.singular_vectors[:, 0] @ state.contact.normal
            errors.append(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
    assert state.position[1] > 0.01
    assert np.mean(np.array(dimensions) == 1) > 0.95
    assert np.mean(errors) < 5
