# SPDX-License-Identifier: BSD-3-Clause
"""Whatever people call with: an error is one line that names the argument, what is
expected and what was given."""

import inspect
import math
import re

import numpy as np
import pytest

import dual_proxy as dp
from dual_proxy import _core, systems
from dual_proxy.panda import PandaModel

EYE, ZERO = np.eye(3), np.zeros(3)
SEEDS = r"an integer in \[0, 18446744073709551615\]"


def require_line(call, kind, pattern):
    with pytest.raises(kind) as caught:
        call()
    text = str(caught.value)
    assert re.search(pattern, text), text
    assert "\n" not in text
    assert len(text) < 1000


MAKERS = {
    "Filter": dp.ForceSpaceParticleFilter,
    "Filter.reset": dp.ForceSpaceParticleFilter().reset,
    "FilterAlgorithm": dp.ForceSpaceParticleFilterAlgorithm().make_state,
    "Channel": dp.CommunicationChannel().make_state,
    "Sensor": dp.ForceTorqueSensor().make_state,
    "RobotSide": dp.RobotSide().make_state,
    "RobotSide, angular": lambda seed: dp.RobotSide().make_state(angular_seed=seed),
    "run_filter_trial": dp.run_filter_trial,
    "systems.Filter": systems.ForceSpaceParticleFilter,
    "systems.Channel": systems.CommunicationChannel,
    "systems.Sensor": systems.ForceTorqueSensor,
    "systems.RobotSide": systems.RobotSide,
}


@pytest.mark.parametrize("name", MAKERS)
def test_every_seed_is_checked_alike(name):
    make = MAKERS[name]
    key = "angular_seed" if "angular" in name else "seed"

    def call(seed):
        return make(seed) if key == "angular_seed" else make(seed=seed)

    for value in (-1, 2**64):
        require_line(
            lambda value=value: call(value),
            ValueError,
            f"`{key}` expected {SEEDS}, got {value}$",
        )
    for value in (1.5, "x", None, True):
        require_line(
            lambda value=value: call(value),
            TypeError,
            f"`{key}` expected an integer, got {value!r}$",
        )
    call(np.int64(3))
    call(2**64 - 1)


def algorithms():
    """Classes made of parameters, which have defaults."""
    for name, item in sorted(vars(_core).items()):
        if inspect.isclass(item) and hasattr(item, "params"):
            yield name, item
    for name in systems.__all__:
        item = getattr(systems, name)
        if inspect.isclass(item) and "params" in inspect.signature(item).parameters:
            yield f"systems.{name}", item


@pytest.mark.parametrize("cls", dict(algorithms()).values(), ids=dict(algorithms()))
def test_every_class_says_which_parameters_it_takes(cls):
    others = {
        dp.SimulatedArm: {"arm": dp.ArmModelParams()},
        dp.LinkEnd: {"sends": "to_robot"},
        systems.SimulatedHapticDevice: {"path": dp.OperatorPath([0], np.zeros((3, 1)))},
    }.get(cls, {})
    for value in (3, "x", dp.GuidanceParams()):
        require_line(
            lambda value=value: cls(params=value, **others),
            TypeError,
            r"`params` expected \w+Params, got ",
        )


@pytest.mark.parametrize(
    ("call", "kind", "pattern"),
    [
        (lambda: systems.SensorReaction(-1), ValueError, "integer >= 0, got -1"),
        (lambda: systems.SensorReaction(1.5), TypeError, "an integer, got 1.5"),
        (lambda: systems.SensorReaction(math.nan), TypeError, "an integer, got nan"),
        (lambda: systems.SensorReaction("x"), TypeError, "an integer, got 'x'"),
        (
            lambda: systems.SensorReaction(2**40),
            ValueError,
            r"`sensor_joint` expected an integer in \[-2147483648, 2147483647\], got",
        ),
        (lambda: dp.WindowMean(window="x"), TypeError, "`window` expected a number"),
        (lambda: dp.WindowMean(1e300), ValueError, r"`window`.*1e\+11\], got 1e\+300"),
        (lambda: systems.WindowMean(1e300), ValueError, r"`window`.*, got 1e\+300"),
        (lambda: systems.WindowMean(period="x"), TypeError, "`period` expected"),
        (
            lambda: systems.RobotSide(q_start=[1e300] * 7),
            ValueError,
            r"`q_start\[0\]` expected a number in \[-1000, 1000\], got 1e\+300",
        ),
        (
            lambda: systems.CommunicationChannel(rate=1e300),
            ValueError,
            r"`rate` expected a number in \(0, 1/period = 1000\], got 1e\+300",
        ),
        (
            lambda: systems.SimulatedHapticDevice(None),
            TypeError,
            "`path` expected OperatorPath, got None",
        ),
        (
            lambda: systems.TeleopLoop(None, None, 0),
            TypeError,
            "`model` expected PandaModel, got None",
        ),
        (
            lambda: systems.TeleopLoop(None, PandaModel(), 0),
            TypeError,
            "`scenario` expected Scenario, got None",
        ),
        (lambda: systems.RobotSide(model=3), TypeError, "expected PandaModel, got 3"),
        (lambda: systems.ArmKinematics(0), TypeError, "expected PandaModel, got 0"),
        (lambda: dp.saturate([3, 4, 0], -1), ValueError, "`max_norm`.*>= 0, got -1"),
        (lambda: dp.saturate(ZERO, math.nan), ValueError, "`max_norm`.*, got nan"),
        (lambda: dp.saturate(ZERO, "x"), TypeError, "`max_norm` expected a number"),
        (lambda: dp.rate_limit(ZERO, ZERO, -1), ValueError, "`max_step`.*, got -1"),
        (
            lambda: dp.rate_limit(ZERO, ZERO, math.nan),
            ValueError,
            "max_step.*, got nan",
        ),
        (
            lambda: dp.run("plane", overrides=3),
            dp.ScenarioError,
            "overrides: expected a mapping of dotted keys, got 3",
        ),
        (
            lambda: dp.load_scenario("plane").with_overrides([("a", 1)]),
            dp.ScenarioError,
            "overrides: expected a mapping",
        ),
        (
            lambda: dp.WindowMean(1.0).update("x", ZERO, None),
            TypeError,
            "`time` expected a number, got 'x'",
        ),
        (
            lambda: dp.WindowMean(1.0).update(0.0, ZERO, None),
            TypeError,
            "`state` expected WindowMeanState, got None",
        ),
        (
            lambda: dp.HapticSide().signals(dp.RobotSide().make_state()),
            TypeError,
            "`state` expected HapticSideState, got <",
        ),
        (
            lambda: dp.decode_frame("text", "to_robot"),
            TypeError,
            "`data` expected bytes, got 'text'",
        ),
        (
            lambda: setattr(dp.LinkFrame(), "session", -1),
            ValueError,
            r"`session` expected an integer in \[0, \d+\], got -1",
        ),
        (
            lambda: setattr(dp.Message(), "sequence", "x"),
            TypeError,
            "`sequence` expected an integer, got 'x'",
        ),
        (
            lambda: setattr(dp.PoseMessage(), "pose", 3),
            TypeError,
            "`pose` expected Pose, got 3",
        ),
        (
            lambda: setattr(dp.ForceSpaceParticleFilter(), "state", 3),
            TypeError,
            "`state` expected ForceSpaceParticleFilterState, got 3",
        ),
    ],
)
def test_an_argument_that_cannot_be_is_named(call, kind, pattern):
    require_line(call, kind, pattern)


@pytest.mark.parametrize(
    ("call", "pattern"),
    [
        (
            lambda: dp.WindowMean(),
            r"WindowMean\(\) misses `window`, expected \(window\)",
        ),
        (
            lambda: dp.WindowMean(1.0).update(0.0, ZERO),
            r"update\(\) misses `state`, expected \(time, value, state\)",
        ),
        (
            lambda: dp.ForceSpaceParticleFilter(sed=1),
            r"has no argument 'sed', expected \(params=..., seed=...\)",
        ),
        (
            lambda: dp.ForceSpaceParticleFilter(None, 0, 5),
            r"got 3 arguments without a name, expected \(params=..., seed=...\)",
        ),
        (lambda: dp.WindowMean(1.0, window=2.0), "got 'window' twice"),
        (lambda: dp.LinkParams(3), r"LinkParams\(\) got 1 arguments without a name"),
        (lambda: dp.saturate(ZERO), r"saturate\(\) misses `max_norm`"),
        (lambda: dp.HapticSide().make_state(1), r"make_state\(\) got 1 arguments"),
        (
            lambda: dp.RobotSide().update(0.0, dp.PoseMessage()),
            r"update\(\) misses `robot_position`, expected \(time, message, ",
        ),
    ],
)
def test_arguments_that_are_missing_or_unknown_are_named(call, pattern):
    require_line(call, TypeError, pattern)


def test_signatures_tell_what_is_expected():
    doc = dp.WindowMean.update.__doc__
    start = "update(self: dual_proxy._core.WindowMean, time: typing.SupportsFloat"
    assert doc.startswith(start)
    assert "Overloaded" not in doc
    assert "Takes a sample, (3,)" in doc


@pytest.mark.parametrize(
    "message", [dp.ForceMessage(), dp.ForceMessage(sequence=3)], ids=["empty", "full"]
)
def test_a_proxy_takes_poses_only(message):
    robot, haptic = dp.RobotSideProxy(), dp.HapticSideProxy()
    robot_state, haptic_state = robot.make_state(), haptic.make_state()
    pattern = r"`message` expected a PoseMessage, got ForceMessage\("
    require_line(
        lambda: robot.update(0.0, message, ZERO, EYE, EYE, EYE, None, robot_state),
        TypeError,
        pattern,
    )
    require_line(
        lambda: haptic.update(0.0, message, ZERO, EYE, haptic_state),
        TypeError,
        pattern,
    )
    for nothing in (dp.Message(), dp.PoseMessage()):
        robot.update(0.0, nothing, ZERO, EYE, EYE, EYE, None, robot_state)
        haptic.update(0.0, nothing, ZERO, EYE, haptic_state)


@pytest.mark.parametrize("number", [0.0, 0.25, np.float32(0.25), np.array(0.25), 1])
def test_a_number_of_any_kind_is_a_number(number):
    np.testing.assert_allclose(
        dp.saturate([3.0, 4.0, 0.0], number), np.array([0.6, 0.8, 0.0]) * float(number)
    )


def test_a_bound_may_be_infinite():
    np.testing.assert_array_equal(dp.saturate([3, 4, 0], math.inf), [3, 4, 0])
    np.testing.assert_array_equal(dp.rate_limit(ZERO, [3, 4, 0], math.inf), [3, 4, 0])
