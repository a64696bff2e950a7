# SPDX-License-Identifier: BSD-3-Clause
"""The fused sides from Python: one call per cycle, one flat vector state."""

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


@pytest.mark.parametrize("side", [dp.RobotSide(), dp.HapticSide()])
def test_layout_covers_the_signals(side):
    stop = 0
    for part in side.layout.values():
        assert part.start == stop
        stop = part.stop
    signals = side.signals(side.make_state())
    assert signals.shape == (stop,)
    assert signals.dtype == np.float64


def test_signals_are_those_that_the_scheme_has():
    layouts = {}
    for scheme in dp.scenario.SCHEMES:
        params = dp.RobotSideParams(scheme=scheme)
        params.perception.angular_filter.enabled = True
        layouts[scheme] = set(dp.RobotSide(params).layout)
    found = {"dimension", "force_direction", "moment_dimension", "moment_selection"}
    assert found <= layouts["dual_proxy"]
    for scheme in ("position_force", "position_position"):
        assert not found & layouts[scheme]
        assert layouts[scheme] < layouts["dual_proxy"]


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
    vector = dut.signals(state)
    assert np.all(np.isfinite(vector))
    layout = dut.layout
    for name, value in {
        "robot_position": [0.4, 0.0, 0.3],
        "robot_orientation": [1.0, 0.0, 0.0, 0.0],
        "robot_proxy_position": state.proxy_position,
        "robot_proxy_velocity": state.proxy_velocity[:3],
        "motion_error": state.motion_error,
        "rotation_error": state.rotation_error,
        "reference_force": state.reference_force,
        "sensed_force": [0.0, 0.0, -5.0],
        "motion_force": state.controller.motion_force,
        "force_space_force": state.controller.contact_force,
        "force_selection": ALONG_Z.ravel(),
        "torque": state.torque,
        "observed_energy": [state.controller.observed_energy],
        "injected_damping": [state.controller.injected_damping],
        "robot_link_status": [1.0],
        "robot_link_age": [state.link.age],
    }.items():
        np.testing.assert_array_equal(vector[layout[name]], value, err_msg=name)
    assert state.reference_force[2] < -1
    assert state.message.sequence == 4
    np.testing.assert_array_equal(state.message.force_selection, ALONG_Z)


@pytest.mark.parametrize("given", [None, ALONG_Z, np.diag([1.0, 0.0, 0.0])])
def test_selection_is_that_of_the_filter_unless_somebody_else_knows_it(given):
    dut = dp.RobotSide()
    state = dut.make_state(seed=3)
    for i in range(300):
        dut.update(
            **robot_arguments(
                time=0.001 * i,
                force_selection=given,
                moment_selection=None,
                sensed_wrench=np.array([0, 0, -9.0, 0, 0, 0]),
            ),
            state=state,
        )
    if given is None:
        assert state.filter.dimension == 1
        np.testing.assert_array_equal(
            state.force_selection, state.filter.force_selection
        )
        assert state.force_selection[2, 2] > 0.9
        np.testing.assert_allclose(state.filter_means.sensed, [0, 0, -9.0], rtol=1e-12)
    else:
        assert state.filter.dimension == 0
        np.testing.assert_array_equal(state.force_selection, given)
    np.testing.assert_array_equal(state.message.force_selection, state.force_selection)


def test_a_planner_takes_its_directions_over():
    dut = dp.RobotSide()
    state = dut.make_state()
    planner = dp.PlannerReference(
        selection=ALONG_Z, position=[9.0, 9.0, 0.3], force=[9.0, 9.0, -3.0]
    )

    def update(i, reference):
        arguments = robot_arguments(
            time=0.001 * i,
            message=message(i // 20, 0.02 * (i // 20), [0.0, 0.0, -0.1]),
            force_selection=ALONG_Z,
        )
        dut.update(**arguments, state=state, planner_reference=reference)

    for i in range(500):
        update(i, planner if i > 100 else None)
    np.testing.assert_array_equal(state.planner_selection, ALONG_Z)
    np.testing.assert_array_equal(state.reference_force, [0.0, 0.0, -3.0])
    np.testing.assert_array_equal(state.message.force_selection, ZERO33)
    with pytest.raises(TypeError, match="`planner_reference` expected Planner"):
        update(500, ALONG_Z)


def test_robot_outputs_are_copies():
    dut = dp.RobotSide()
    state = dut.make_state()
    dut.update(**robot_arguments(), state=state)
    torque = state.controller.torque
    sent = state.message
    before = torque.copy()
    for i in range(1, 30):
        dut.update(
            **robot_arguments(time=0.001 * i, message=message(0, 0.0, (0.2, 0.0, 0.2))),
            state=state,
        )
    np.testing.assert_array_equal(torque, before)
    assert np.any(state.controller.torque != before)
    assert sent.sequence == 0
    assert state.message.sequence == 1


def test_robot_state_is_copied_by_value():
    dut = dp.RobotSide()
    state = dut.make_state()
    values = robot_arguments(message=message(0, 0.0, (0.2, 0.0, 0.2)))
    dut.update(**values, state=state)
    fork = copy.deepcopy(state)
    values["time"] = 0.001
    dut.update(**values, state=state)
    dut.update(**values, state=fork)
    np.testing.assert_array_equal(dut.signals(fork), dut.signals(state))


def test_robot_refuses_what_is_not_finite():
    dut = dp.RobotSide()
    state = dut.make_state()
    dut.update(**robot_arguments(sensed_wrench=np.full(6, np.nan)), state=state)
    assert state.bad_inputs == 1
    np.testing.assert_array_equal(state.torque, np.zeros(7))


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
    # Force-matched: 2.5 x 500 N/m. The robot is at the origin of its base.
    np.testing.assert_allclose(state.reference_force, [0, 0, 5.0], atol=1e-9)
    np.testing.assert_allclose(state.device_wrench, [0, 0, 5.0, 0, 0, 0], atol=1e-9)
    layout = dut.layout
    vector = dut.signals(state)
    np.testing.assert_array_equal(
        vector[layout["device_force"]], state.device_wrench[:3]
    )
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
    params = dp.RobotSideParams()
    params.perception.filter.period = 1e-4
    with pytest.raises(ValueError, match=r"`perception.filter.period`.*the control"):
        dp.RobotSide(params)


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
        np.testing.assert_array_equal(twist, state.velocity)
        np.testing.assert_allclose(twist, jacobian @ v, rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("scheme", ["position_force", "position_position"])
def test_the_state_of_another_scheme_is_refused(scheme):
    robot, haptic = dp.RobotSide(), dp.HapticSide()
    with pytest.raises(ValueError, match=r"`state` expected .* the same scheme"):
        dp.RobotSide(dp.RobotSideParams(scheme=scheme)).update(
            **robot_arguments(), state=robot.make_state()
        )
    with pytest.raises(ValueError, match=r"`state` expected .* the same scheme"):
        dp.HapticSide(dp.HapticSideParams(scheme=scheme)).update(
            **device_arguments(), state=haptic.make_state()
        )
