# SPDX-License-Identifier: BSD-3-Clause
"""The proxies' algorithms through Python."""

import copy
import pickle

import numpy as np
import pytest
import ruckig
from scipy.spatial.transform import Rotation

import dual_proxy as dp

EYE = np.eye(3)
NONE = np.zeros((3, 3))
PERIOD = 0.001


def direction(*n: float) -> np.ndarray:
    return np.outer(n, n) / np.dot(n, n)


def send(sequence: int, time: float, p, R=EYE, selection=NONE) -> dp.PoseMessage:
    return dp.PoseMessage(sequence, time, dp.Pose(p, R), selection, NONE)


def test_workspace_map_equations():
    rng = np.random.default_rng(0)
    for _ in range(20):
        R_DB, R_cw, R_h, R_r = Rotation.random(4, random_state=rng).as_matrix()
        p_cw, x_h, x_r = rng.normal(size=(3, 3))
        s = rng.uniform(0.5, 5)
        dut = dp.WorkspaceMap(R_DB=R_DB, p_cw=p_cw, R_cw=R_cw, scale=s)
        x_pr, R_pr = dut.robot_proxy(x_h, R_h)
        np.testing.assert_allclose(x_pr, p_cw + s * R_DB.T @ x_h, atol=1e-13)
        np.testing.assert_allclose(R_pr, R_DB.T @ R_h @ R_DB @ R_cw, atol=1e-13)
        x_ph, R_ph = dut.haptic_proxy(x_r, R_r)
        np.testing.assert_allclose(x_ph, R_DB @ (x_r - p_cw) / s, atol=1e-13)
        np.testing.assert_allclose(R_ph, R_DB @ R_r @ R_cw.T @ R_DB.T, atol=1e-13)
        Omega = direction(*rng.normal(size=3))
        np.testing.assert_allclose(
            dut.haptic_selection(Omega), R_DB @ Omega @ R_DB.T, atol=1e-13
        )
        back, R_back = dut.haptic_proxy(x_pr, R_pr)
        np.testing.assert_allclose(back, x_h, atol=1e-13)
        np.testing.assert_allclose(R_back, R_h, atol=1e-13)


def test_workspace_map_defaults_and_params():
    dut = dp.WorkspaceMap()
    assert dut.params == dp.WorkspaceMapParams()
    assert dut.params.scale == 2.5
    params = dp.WorkspaceMapParams(scale=3.0, p_cw=[1, 2, 3])
    assert dp.WorkspaceMap(params).params == params
    np.testing.assert_array_equal(
        dp.WorkspaceMap(params).robot_proxy(x_h=[1, 0, 0], R_h=EYE)[0], [4, 2, 3]
    )


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("R_DB", -EYE),
        ("R_DB", 2 * EYE),
        ("R_DB", np.zeros(9)),
        ("R_cw", np.full((3, 3), np.nan)),
        ("p_cw", [0, 0, np.inf]),
        ("p_cw", [0, 0]),
        ("scale", 0.0),
        ("scale", -1.0),
        ("scale", np.nan),
    ],
)
def test_workspace_map_errors_name_the_field(field, value):
    with pytest.raises(ValueError, match=field):
        dp.WorkspaceMap(**{field: value})
    with pytest.raises(ValueError, match=field):
        dp.WorkspaceMapParams(**{field: value})


def test_workspace_map_wrong_shapes_name_the_argument():
    dut = dp.WorkspaceMap()
    with pytest.raises(ValueError, match=r"x_h: .*\(3,\).*\(3, 1\)"):
        dut.robot_proxy(np.zeros((3, 1)), EYE)
    with pytest.raises(ValueError, match=r"R_r: .*\(3, 3\)"):
        dut.haptic_proxy(np.zeros(3), np.zeros(3))
    with pytest.raises(ValueError, match="Omega"):
        dut.haptic_selection(np.zeros((2, 2)))


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        ("none", [9, 0, 9]),
        ("box", [0.1, 0, 0.3]),
        ("sphere", np.array([1, 0, 1]) / np.sqrt(2)),
        ("cylinder", [1, 0, 0.4]),
    ],
)
def test_workspace_limits(shape, expected):
    dut = dp.WorkspaceLimits(
        dp.WorkspaceLimitsParams(
            shape=shape, half_size=[0.1, 0.2, 0.3], radius=1.0, half_height=0.4
        )
    )
    np.testing.assert_allclose(dut.clamp([9, 0, 9]), expected)
    assert dut.contains(expected)
    assert dut.contains([9, 0, 9]) == (shape == "none")
    assert dut.params.shape == shape


def test_enums_are_strings_and_errors_list_them():
    with pytest.raises(
        ValueError, match=r'`shape`.*"none", "box", "sphere", "cylinder"'
    ):
        dp.WorkspaceLimitsParams(shape="torus")
    with pytest.raises(ValueError, match=r'`handover`.*"printed", "bumpless"'):
        dp.RobotSideProxyParams(handover="smooth")
    assert dp.RobotSideProxyParams().handover == "bumpless"
    assert dp.RobotSideProxyParams(handover="printed").handover == "printed"


def test_rate_limit_and_saturate():
    np.testing.assert_allclose(dp.rate_limit([0, 0, 0], [3, 4, 0], 0.5), [0.3, 0.4, 0])
    np.testing.assert_array_equal(dp.rate_limit([0, 0, 0], [3, 4, 0], 5), [3, 4, 0])
    np.testing.assert_allclose(dp.saturate([3, 4, 0], 1), [0.6, 0.8, 0])
    with pytest.raises(ValueError, match="target"):
        dp.rate_limit([0, 0, 0], [1, 2], 1.0)


def test_trajectory_limiter_agrees_with_ruckig():
    limits = dp.TrajectoryLimiterParams()
    dut = dp.TrajectoryLimiter(limits)
    state = dut.make_state([0, 0, 0], EYE)
    oracle = ruckig.Ruckig(3, PERIOD)
    given = ruckig.InputParameter(3)
    given.synchronization = ruckig.Synchronization.No
    given.max_velocity = [limits.max_velocity] * 3
    given.max_acceleration = [limits.max_acceleration] * 3
    result = ruckig.OutputParameter(3)
    rng = np.random.default_rng(1)
    target = np.zeros(3)
    for i in range(3000):
        if i % 20 == 0:
            target = 0.03 * rng.normal(size=3)
        given.target_position = list(target)
        assert oracle.update(given, result) >= 0
        result.pass_to_input(given)
        dut.update(target, EYE, state)
        # Both add up the rounding of 3000 ticks.
        np.testing.assert_allclose(state.pose.p, result.new_position, atol=1e-9)
        np.testing.assert_allclose(state.v, result.new_velocity, atol=1e-7)


def test_trajectory_limiter_turns_and_stops():
    dut = dp.TrajectoryLimiter()
    state = dut.make_state([0, 0, 0], EYE)
    target = Rotation.from_rotvec([0, 0.3, 0]).as_matrix()
    for _ in range(200):
        dut.update([0, 0, 0], target, state)
    assert np.linalg.norm(state.w) == pytest.approx(1.0)
    for _ in range(60):
        dut.stop(state)
    np.testing.assert_array_equal(state.w, 0)
    dut.update([np.nan, 0, 0], EYE, state)
    assert state.bad_inputs == 1
    for _ in range(2000):
        dut.update([0, 0, 0], target, state)
    np.testing.assert_array_equal(state.pose.R, target)


def test_virtual_spring_hands_over_from_the_sensed_force():
    for handover, expected in (("bumpless", -7.0), ("printed", 0.0)):
        dut = dp.VirtualSpring(dp.VirtualSpringParams(handover=handover))
        state = dut.make_state()
        dut.update([0, 0, 0.01], direction(0, 0, 1), [3, 0, -7], True, state)
        assert state.reference[2] == pytest.approx(expected, abs=0.05 + 1e-9)
        assert state.reference[0] == pytest.approx(0, abs=1e-9)
    state = dut.make_state()
    dut.update([0, 0, 0.01], direction(0, 0, 1), None, True, state)
    assert np.linalg.norm(state.reference) == pytest.approx(0.05)


def run_robot_side(seed: int) -> tuple[np.ndarray, dp.RobotSideProxyState]:
    """A hand that jumps about, a lossy link, a filter that changes its mind."""
    dut = dp.RobotSideProxy(dp.RobotSideProxyParams())
    state = dut.make_state()
    channel = dp.CommunicationChannel(
        dp.CommunicationChannelParams(delay=0.15, jitter=0.05, loss=0.3)
    )
    link = channel.make_state(seed)
    rng = np.random.default_rng(seed)
    rows = []
    selection = NONE
    for i in range(4000):
        time = PERIOD * i
        if i % 20 == 0 and not 1500 <= i < 2500:
            p = 0.01 * rng.normal(size=3)
            channel.send(time, send(i // 20, time, p), link)
        if i % 67 == 0:
            selection = [NONE, direction(*rng.normal(size=3)), EYE][rng.integers(3)]
        dut.update(
            time,
            channel.receive(time, link),
            [0, 0, np.nan if i % 501 == 500 else 0],
            EYE,
            selection,
            NONE,
            None,
            state,
        )
        output = state.output
        rows.append(
            [
                *output.reference_force,
                *output.proxy_pose.p,
                *output.motion_error,
                int(output.link_status),
                *selection.ravel(),
            ]
        )
    return np.array(rows), state


def test_robot_side_never_steps():
    rows, state = run_robot_side(3)
    assert np.isfinite(rows).all()
    force_steps = np.linalg.norm(np.diff(rows[:, :3], axis=0), axis=1)
    assert force_steps.max() <= 50 * PERIOD + 1e-12
    assert force_steps.max() > 0.04
    proxy, motion_error = rows[:, 3:6], np.linalg.norm(rows[:, 6:9], axis=1)
    selections = rows[:, 10:].reshape(-1, 3, 3)
    # The only steps of the proxy: without a link, it is taken out to the robot,
    # which is at zero, along what the force space loses, and nowhere else.
    jumps = np.diff(proxy, axis=0)
    alone = rows[1:, 9] != int(dp.LinkStatus.CONNECTED)
    released = alone & np.any(selections[1:] != selections[:-1], axis=(1, 2))
    assert np.abs(jumps[~released]).max() <= 0.2 * PERIOD + 1e-12
    ways = np.array(
        [
            (EYE - now) @ last @ -p
            for p, last, now in zip(
                proxy[:-1], selections[:-1], selections[1:], strict=True
            )
        ]
    )
    moves = jumps[released] - ways[released]
    assert np.abs(moves).max() <= 0.2 * PERIOD + 1e-12
    assert np.linalg.norm(ways[released], axis=1).max() > 0.01
    # So the robot is pulled no harder than before.
    assert motion_error.max() <= 0.02 + 1e-12
    pulls = np.diff(motion_error)[released]
    assert pulls.max() <= np.sqrt(3) * 0.2 * PERIOD + 1e-12
    assert state.link.losses >= 1
    assert state.link.status == dp.LinkStatus.CONNECTED
    assert state.bad_inputs == 7


@pytest.mark.parametrize(
    "bad",
    [
        None,
        "sensed_wrench",
        "robot_position",
    ],
)
def test_robot_side_without_a_link_never_presses_with_what_it_lost(bad):
    dut = dp.RobotSideProxy()
    state = dut.make_state()
    for i in range(2000):
        time = PERIOD * i
        if i < 1000:
            newest = send(i, time, [0, 0, -0.004])
        values = {"sensed_wrench": [0, 0, -5.0, 0, 0, 0], "robot_position": [0, 0, 0]}
        # The direction is lost in the very tick in which a value is none.
        if i == 1800 and bad:
            values[bad] = np.full(len(values[bad]), np.nan)
        selection = direction(0, 0, 1) if i < 1800 else NONE
        dut.update(
            time,
            newest,
            robot_rotation=EYE,
            force_selection=selection,
            moment_selection=NONE,
            state=state,
            **values,
        )
        if i == 1799:
            assert state.output.link_status == dp.LinkStatus.LOST
            np.testing.assert_allclose(state.output.proxy_pose.p, [0, 0, -0.01])
    assert state.bad_inputs == (bad is not None)
    np.testing.assert_allclose(state.output.motion_error, 0, atol=1e-12)


def test_robot_side_is_deterministic():
    np.testing.assert_array_equal(run_robot_side(3)[0], run_robot_side(3)[0])


def test_robot_side_settles_at_equation_4():
    dut = dp.RobotSideProxy()
    state = dut.make_state()
    for i in range(1000):
        time = PERIOD * i
        dut.update(
            time,
            send(i, time, [0.002, 0, -0.004]),
            robot_position=[0, 0, 0],
            robot_rotation=EYE,
            force_selection=direction(0, 0, 1),
            moment_selection=NONE,
            sensed_wrench=None,
            state=state,
        )
    output = state.output
    np.testing.assert_allclose(output.proxy_pose.p, [0.005, 0, -0.01], atol=1e-12)
    np.testing.assert_allclose(output.motion_error, [-0.005, 0, 0], atol=1e-12)
    np.testing.assert_allclose(output.reference_force, [0, 0, -5], atol=1e-9)
    assert output.link_status == dp.LinkStatus.CONNECTED


def test_robot_side_bumpless_handover_needs_the_sensed_wrench():
    for wrench, expected in (([0, 0, -7, 0, 0, 0], -7.0), (None, 0.0)):
        dut = dp.RobotSideProxy()
        state = dut.make_state()
        args = ([0, 0, 0], EYE)
        dut.update(0, send(0, 0, [0, 0, 0]), *args, NONE, NONE, wrench, state)
        dut.update(
            PERIOD,
            send(0, 0, [0, 0, 0]),
            *args,
            direction(0, 0, 1),
            NONE,
            wrench,
            state,
        )
        assert state.output.reference_force[2] == pytest.approx(expected, abs=0.051)


def test_haptic_side_is_force_matched_and_fades_when_the_link_is_lost():
    dut = dp.HapticSideProxy()
    assert dut.stiffness == 1250.0
    assert dp.HapticSideProxy(dp.HapticSideProxyParams(stiffness=200.0)).stiffness == (
        200.0
    )
    state = dut.make_state()
    forces = []
    for i in range(2000):
        sequence = min(i, 800)
        message = send(sequence, PERIOD * sequence, [0, 0, 0], EYE, direction(0, 0, 1))
        dut.update(PERIOD * i, message, [0.01, 0, -0.004], EYE, state)
        forces.append(state.output.reference_force)
        if i == 700:
            np.testing.assert_allclose(forces[-1], [0, 0, 5], atol=1e-9)
    assert state.link.status == dp.LinkStatus.LOST
    np.testing.assert_array_equal(forces[-1], 0)
    steps = np.linalg.norm(np.diff(forces, axis=0), axis=1)
    # 20 N/s, and 120 to go without a link.
    assert steps[:1200].max() <= 20 * PERIOD + 1e-12
    assert steps.max() <= 120 * PERIOD + 1e-12


def test_haptic_side_refuses_nan():
    dut = dp.HapticSideProxy()
    state = dut.make_state()
    dut.update(0.0, send(0, 0, [0, 0, 0]), [np.nan, 0, 0], EYE, state)
    dut.update(0.001, send(1, 0, [0, np.nan, 0]), [0, 0, 0], EYE, state)
    assert (state.bad_inputs, state.link.bad_inputs) == (1, 1)
    np.testing.assert_array_equal(state.output.reference_force, 0)


def test_states_are_copied_by_value():
    dut = dp.HapticSideProxy()
    state = dut.make_state()
    before = copy.deepcopy(state)
    output = state.output
    dut.update(0.0, send(0, 0, [0, 0, 0], EYE, EYE), [0.01, 0, 0], EYE, state)
    np.testing.assert_array_equal(before.output.reference_force, 0)
    np.testing.assert_array_equal(output.reference_force, 0)
    assert state.output.reference_force[0] < 0
    assert before.link.status == dp.LinkStatus.WAITING


@pytest.mark.parametrize(
    ("cls", "field"),
    [
        (dp.WorkspaceLimitsParams, "radius"),
        (dp.TrajectoryLimiterParams, "max_velocity"),
        (dp.VirtualSpringParams, "rate"),
        (dp.RobotSideProxyParams, "force_rate"),
        (dp.RobotSideProxyParams, "max_motion_error"),
        (dp.HapticSideProxyParams, "max_force"),
    ],
)
def test_params_out_of_range_name_the_field(cls, field):
    with pytest.raises(ValueError, match=f"{cls.__name__}: field `{field}`.*-1"):
        cls(**{field: -1.0})


@pytest.mark.parametrize(
    "params",
    [
        dp.WorkspaceMapParams(scale=3.0),
        dp.WorkspaceLimitsParams(shape="sphere"),
        dp.TrajectoryLimiterParams(max_velocity=0.1),
        dp.VirtualSpringParams(handover="bumpless"),
        dp.RobotSideProxyParams(
            link=dp.LinkMonitorParams(timeout=1.0), handover="printed"
        ),
        dp.HapticSideProxyParams(stiffness=200.0),
    ],
)
def test_params_round_trip(params):
    for other in (pickle.loads(pickle.dumps(params)), copy.deepcopy(params)):
        assert other == params
        assert repr(other) == repr(params)
    assert params != type(params)()
    with pytest.raises(TypeError, match="speed"):
        type(params)(speed=1.0)


def test_nested_params_can_be_set_in_place():
    params = dp.RobotSideProxyParams()
    params.map.scale = 4.0
    params.workspace.shape = "box"
    assert dp.RobotSideProxy(params).params.map.scale == 4.0
    assert dp.RobotSideProxy(params).params.workspace.shape == "box"
    params.map.scale = -4.0
    with pytest.raises(ValueError, match="WorkspaceMapParams: field `scale`"):
        dp.RobotSideProxy(params)
