# SPDX-License-Identifier: BSD-3-Clause
"""The fused sides from Python: one call per cycle, one flat vector out."""

import copy

import numpy as np
import pytest

import dual_proxy as dp

EYE3 = np.eye(3)
ZERO33 = np.zeros((3, 3))
ALONG_Z = np.diag([0.0, 0.0, 1.0])


def message(sequence, send_time, position=(0.0, 0.0, 0.0), selection=ZERO33):
    pose = dp.Pose()
    pose.p = np.asarray(position)
    return dp.PoseMessage(
        sequence=sequence, send_time=send_time, pose=pose, force_selection=selection
    )


def robot_arguments(**kwargs):
    """An arm whose first six joints are the tool's freedoms, 7 kg each."""
    values = {
        "time": 0.0,
        "message": dp.PoseMessage(),
        "robot_position": np.array([0.4, 0.0, 0.3]),
        "robot_rotation": EYE3,
        "jacobian": np.eye(6, 7),
        "mass": 7.0 * np.eye(7),
        "bias": np.zeros(7),
        "gravity": np.zeros(7),
        "jdot_v": np.zeros(6),
        "q": dp.OperationalSpaceControllerParams().q_rest,
        "v": np.zeros(7),
        "force_selection": ZERO33,
        "moment_selection": ZERO33,
        "sensed_wrench": np.zeros(6),
    }
    assert set(kwargs) <= set(values)
    return values | kwargs


def device_arguments(**kwargs):
    values = {
        "time": 0.0,
        "message": dp.PoseMessage(),
        "device_position": np.zeros(3),
        "device_rotation": EYE3,
        "device_velocity": np.zeros(6),
    }
    assert set(kwargs) <= set(values)
    return values | kwargs


@pytest.mark.parametrize("side", [dp.RobotSide, dp.HapticSide])
def test_layout_covers_the_vector(side):
    stop = 0
    for part in side.output_layout().values():
        assert part.start == stop
        stop = part.stop
    assert stop == side.output_size()
    vector = side().make_state().output.as_vector()
    assert vector.shape == (stop,)
    assert vector.dtype == np.float64


def test_robot_vector_holds_the_attributes():
    dut = dp.RobotSide()
    state = dut.make_state()
    for i in range(100):
        dut.update(
            **robot_arguments(
                time=0.001 * i,
                message=message(i // 20, 0.001 * (i // 20 * 20), (0.16, 0.0, 0.115)),
                force_selection=ALONG_Z,
                sensed_wrench=np.array([0, 0, -5.0, 0, 0, 0]),
            ),
            state=state,
        )
    out = state.output
    vector = out.as_vector()
    assert np.all(np.isfinite(vector))
    layout = dp.RobotSide.output_layout()
    for name, value in {
        "robot_position": [0.4, 0.0, 0.3],
        "robot_orientation": [1.0, 0.0, 0.0, 0.0],
        "robot_proxy_position": out.proxy_position,
        "robot_proxy_velocity": out.proxy_velocity,
        "motion_error": out.motion_error,
        "rotation_error": out.rotation_error,
        "reference_force": out.reference_force,
        "sensed_force": [0.0, 0.0, -5.0],
        "motion_force": out.controller.motion_force,
        "force_space_force": out.controller.contact_force,
        "force_selection": ALONG_Z.ravel(),
        "torque": out.torque,
        "observed_energy": [out.controller.observed_energy],
        "injected_damping": [out.controller.injected_damping],
        "robot_link_status": [1.0],
        "robot_link_age": [out.link_age],
        "mean_sensed_force": out.filter_means.sensed_force,
        "mean_velocity": out.filter_means.velocity,
        "mean_motion_force": out.filter_means.motion_force,
        "mean_contact_force": out.filter_means.contact_force,
    }.items():
        np.testing.assert_array_equal(vector[layout[name]], value, err_msg=name)
    assert out.reference_force[2] < -1
    assert out.message.sequence == 4
    np.testing.assert_array_equal(out.message.force_selection, ALONG_Z)


def test_robot_outputs_are_copies():
    dut = dp.RobotSide()
    state = dut.make_state()
    dut.update(**robot_arguments(), state=state)
    torque = state.output.controller.torque
    sent = state.output.message
    before = torque.copy()
    for i in range(1, 30):
        dut.update(
            **robot_arguments(time=0.001 * i, message=message(0, 0.0, (0.2, 0.0, 0.2))),
            state=state,
        )
    np.testing.assert_array_equal(torque, before)
    assert np.any(state.output.controller.torque != before)
    assert sent.sequence == 0
    assert state.output.message.sequence == 1


def test_robot_state_is_copied_by_value():
    dut = dp.RobotSide()
    state = dut.make_state()
    values = robot_arguments(message=message(0, 0.0, (0.2, 0.0, 0.2)))
    dut.update(**values, state=state)
    fork = copy.deepcopy(state)
    values["time"] = 0.001
    dut.update(**values, state=state)
    dut.update(**values, state=fork)
    np.testing.assert_array_equal(fork.output.as_vector(), state.output.as_vector())


def test_robot_refuses_what_is_not_finite():
    dut = dp.RobotSide()
    state = dut.make_state()
    dut.update(**robot_arguments(sensed_wrench=np.full(6, np.nan)), state=state)
    assert state.output.bad_inputs == 1
    np.testing.assert_array_equal(state.output.torque, np.zeros(7))


def test_haptic_side_pushes_the_hand_out_of_the_force_space():
    dut = dp.HapticSide()
    state = dut.make_state()
    for i in range(2000):
        dut.update(
            **device_arguments(
                time=0.001 * i,
                message=message(i // 20, 0.001 * (i // 20 * 20), selection=ALONG_Z),
                device_position=np.array([0.01, 0.0, -0.004]),
            ),
            state=state,
        )
    out = state.output
    # Force-matched: 2.5 x 500 N/m. The robot is at the origin of its base.
    np.testing.assert_allclose(out.reference_force, [0, 0, 5.0], atol=1e-9)
    np.testing.assert_allclose(out.device_wrench, [0, 0, 5.0, 0, 0, 0], atol=1e-9)
    layout = dp.HapticSide.output_layout()
    vector = out.as_vector()
    np.testing.assert_array_equal(vector[layout["device_force"]], out.device_wrench[:3])
    np.testing.assert_array_equal(vector[layout["device_position"]], [0.01, 0, -0.004])
    np.testing.assert_array_equal(
        vector[layout["haptic_force_selection"]], ALONG_Z.ravel()
    )


@pytest.mark.parametrize(
    ("side", "values", "name"),
    [
        (dp.RobotSide, robot_arguments(sensed_wrench=np.zeros(3)), "sensed_wrench"),
        (dp.RobotSide, robot_arguments(jacobian=np.eye(7)), "jacobian"),
        (dp.HapticSide, device_arguments(device_velocity=np.zeros(3)), "device_vel"),
    ],
)
def test_bad_shapes_are_named(side, values, name):
    dut = side()
    with pytest.raises(ValueError, match=name):
        dut.update(**values, state=dut.make_state())


def test_params_are_checked_together():
    params = dp.RobotSideParams()
    params.controller.period = 0.002
    with pytest.raises(ValueError, match=r"`controller.period` expected the proxy's"):
        dp.RobotSide(params)
    with pytest.raises(ValueError, match=r"`filter_period`"):
        dp.RobotSideParams(filter_period=0.0)


def test_window_mean():
    dut = dp.WindowMean(window=0.1)
    assert dut.window == 0.1
    state = dut.make_state()
    np.testing.assert_array_equal(state.mean, np.zeros(3))
    dut.update(0.0, [1, 2, 3], state)
    dut.update(0.05, np.array([3.0, 2.0, 1.0]), state)
    dut.update(0.06, [np.nan, 0, 0], state)
    np.testing.assert_array_equal(state.mean, [2, 2, 2])
    assert (state.samples, state.bad_inputs) == (2, 1)
    fork = copy.deepcopy(state)
    dut.update(0.1, [7, 8, 9], state)
    np.testing.assert_array_equal(state.mean, [7, 8, 9])
    np.testing.assert_array_equal(fork.mean, [2, 2, 2])
    with pytest.raises(ValueError, match=r"value: expected shape \(3,\), got \(2,\)"):
        dut.update(0.1, np.zeros(2), state)
    with pytest.raises(ValueError, match=r"WindowMean: field `window`.*got -1"):
        dp.WindowMean(-1.0)


def test_twist_is_the_one_that_update_uses():
    random = np.random.default_rng(3)
    for _ in range(20):
        jacobian, v = random.normal(size=(6, 7)), random.normal(size=7)
        state = dp.RobotSide().make_state()
        dp.RobotSide().update(**robot_arguments(jacobian=jacobian, v=v), state=state)
        twist = dp.RobotSide.calc_twist(jacobian, v)
        np.testing.assert_array_equal(twist, state.output.velocity)
        np.testing.assert_allclose(twist, jacobian @ v, rtol=1e-12, atol=1e-14)
