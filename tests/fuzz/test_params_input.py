# SPDX-License-Identifier: BSD-3-Clause
"""Whatever a field of a class of parameters, or of a message, is set to: it holds
the value, or an error says field, value and what is allowed."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import ARRAYS, DATA, FLOATS, INTEGERS, TEXTS, require_line, same

import dual_proxy as dp
from dual_proxy import _core

PARAMS = [item for item in vars(_core).values() if hasattr(item, "__fields__")]
FIELDS = [(params, field) for params in PARAMS for field in params.__fields__]
ODD = st.one_of(DATA, FLOATS, ARRAYS, st.just(1j), st.just(b"1"), st.just(object()))


@given(st.sampled_from(FIELDS), ODD | TEXTS | INTEGERS)
def test_a_field_takes_what_it_says_or_tells_why_not(item, value):
    params, field = item
    dut = params()
    before = getattr(dut, field.name)
    try:
        setattr(dut, field.name, value)
    except (TypeError, ValueError) as error:
        require_line(
            error, rf"(`{field.name}(\[\d+\])*`|{field.name}:) expected .*, got "
        )
        assert np.all(np.asarray(getattr(dut, field.name) == before))
        return
    now = getattr(dut, field.name)
    if isinstance(now, np.ndarray):
        np.testing.assert_array_equal(now, np.asarray(value, dtype=np.float64))
    elif isinstance(now, tuple):
        assert len(now) == len(value)
    elif np.ndim(value) == 0 and not isinstance(value, np.ndarray):
        assert same(value, now)


@given(st.sampled_from(FIELDS), FLOATS)
def test_a_number_is_in_the_range_or_the_error_says_so(item, number):
    params, field = item
    if field.type is not float:
        return
    dut = params()
    setattr(dut, field.name, number)
    try:
        dut.validate()
    except ValueError as error:
        # Of it, or of one whose range depends on it.
        require_line(error, r"`[\w.\[\]]+` expected .*, got ")
        return
    assert math.isfinite(number)


@given(ODD | st.lists(FLOATS, max_size=50), INTEGERS, INTEGERS, FLOATS)
def test_any_message(body, tag, sequence, send_time):
    message = dp.Message()
    for name, value in (("tag", tag), ("sequence", sequence)):
        try:
            setattr(message, name, value)
        except (TypeError, ValueError) as error:
            require_line(error, rf"`{name}` expected an integer in .*, got ")
            continue
        assert getattr(message, name) == value
    message.send_time = send_time
    try:
        message.body = body
    except ValueError as error:
        require_line(error, "body: expected")
        assert message.body.shape == (0,)
    else:
        np.testing.assert_array_equal(message.body, np.asarray(body, np.float64))
    feed(message)


@given(
    st.integers(-1, 2**63 - 1), FLOATS, st.lists(FLOATS, min_size=12, max_size=12), ODD
)
def test_any_pose_message(sequence, send_time, numbers, selection):
    pose = dp.Pose(p=numbers[:3], R=np.reshape(numbers[3:], (3, 3)))
    try:
        message = dp.PoseMessage(sequence, send_time, pose, selection)
    except (TypeError, ValueError) as error:
        require_line(error, "force_selection: expected")
        message = dp.PoseMessage(sequence, send_time, pose)
    feed(message)


def feed(message: object) -> None:
    """Both sides and a channel take it, and give what is finite."""
    haptic = dp.HapticSide()
    state = haptic.make_state()
    eye, zero = np.eye(3), np.zeros(3)
    for time in (0.0, 0.001):
        haptic.update(time, message, zero, eye, np.zeros(6), state)
        start = haptic.layout["device_force"].start
        force = haptic.signals(state)[start : start + 3]
        assert np.all(np.isfinite(force))
        assert np.linalg.norm(force) <= (1 + 1e-9) * haptic.params.controller.max_force
    robot = dp.RobotSide()
    memory = robot.make_state()
    terms = (np.eye(6, 7), np.eye(7), np.zeros(7), np.zeros(7), np.zeros(6))
    robot.update(
        *(0.0, message, zero, eye, *terms, np.zeros(7), np.zeros(7)),
        *(None, None, np.zeros(6), memory),
    )
    torque = robot.signals(memory)[robot.layout["torque"]]
    assert np.all(np.abs(torque) <= robot.params.controller.torque_limit)
    channel = dp.CommunicationChannel()
    under_way = channel.make_state(1)
    channel.send(0.0, message, under_way)
    received = channel.receive(0.0, under_way)
    assert received.sequence in (-1, message.sequence)
    repr(received)


@given(st.sampled_from(["device_position", "device_rotation", "device_velocity"]), ODD)
def test_any_measurement(name, value):
    haptic = dp.HapticSide()
    state = haptic.make_state()
    inputs = {
        "device_position": np.zeros(3),
        "device_rotation": np.eye(3),
        "device_velocity": np.zeros(6),
        name: value,
    }
    try:
        haptic.update(0.0, dp.PoseMessage(), **inputs, state=state)
    except (TypeError, ValueError) as error:
        require_line(error, f"{name}: expected")
        return
    start = haptic.layout["device_force"].start
    assert np.all(np.isfinite(haptic.signals(state)[start : start + 3]))


@pytest.mark.parametrize("text", ["\ud800", "a\udcffb"])
def test_a_string_that_is_no_text(text):
    with pytest.raises(TypeError, match="`recording` expected a string, got '"):
        dp.OperatorParams(recording=text)
    with pytest.raises(ValueError, match=r"`tool` expected one of .*, got '"):
        dp.SceneParams(tool=text)
    with pytest.raises(dp.ScenarioError, match=r"plane.robot: expected .*, got '"):
        dp.load_scenario("plane").with_overrides({"robot": text})
