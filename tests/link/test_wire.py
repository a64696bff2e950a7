# SPDX-License-Identifier: BSD-3-Clause
"""Frames, clocks and ends of a link through Python."""

import copy
import struct

import numpy as np
import pytest

import dual_proxy as dp

# docs/link.md: all but the body.
HEAD = struct.Struct("<4sHBBQQdQddIIiIqdd")


def frame(sequence=3, send_time=1.5):
    result = dp.LinkFrame()
    result.direction = "to_robot"
    result.session = 2**63 + 5
    result.number = 7
    result.time = 2.5
    result.echo_session, result.echo_time, result.echo_age = 9, 0.25, 0.125
    result.flags = dp.LinkFrame.CLUTCH | dp.LinkFrame.FAULT
    result.message = dp.PoseMessage(
        sequence=sequence, send_time=send_time, pose=dp.Pose([1, 2, 3])
    )
    return result


def test_bytes_are_what_the_table_says():
    data = dp.encode_frame(frame())
    assert len(data) == dp.LinkFrame.SIZE == HEAD.size + 8 * 40 == 416
    head = HEAD.unpack_from(data)
    assert head[:-1] == (
        *(b"DPXY", dp.LinkFrame.VERSION, 1, 0, 2**63 + 5, 7, 2.5, 9, 0.25, 0.125),
        *(5, dp.PoseMessage.TAG, 39, 0, 3, 1.5),
    )
    assert np.isnan(head[-1])
    body = np.frombuffer(data, "<f8", offset=HEAD.size)
    np.testing.assert_array_equal(body[:3], [1, 2, 3])
    back = dp.decode_frame(data, "to_robot")
    assert dp.encode_frame(back) == data
    assert back.message.sequence == 3
    assert copy.copy(back).session == 2**63 + 5


def test_bytes_that_are_no_frame_say_why():
    data = dp.encode_frame(frame())
    for bad, said in (
        (b"", "not as many as a frame has"),
        (b"JUNK" + data[4:], "do not begin with"),
        (data[:4] + b"\2" + data[5:], "have another version of the format"),
        (data[:-1], "not as many"),
    ):
        with pytest.raises(ValueError, match=f"decode_frame: the bytes .*{said}"):
            dp.decode_frame(bad, "to_robot")
    with pytest.raises(ValueError, match="go the other way"):
        dp.decode_frame(data, "to_haptic")
    with pytest.raises(ValueError, match='expected one of "to_robot", "to_haptic"'):
        dp.decode_frame(data, "up")
    assert "another version" in dp.describe_wire_error("version")


def test_clock_offset_is_the_half_of_both_ways():
    dut = dp.ClockOffset()
    state = dut.make_state()
    for i in range(20):
        dut.update(
            0.05 * i + 0.03,
            0.05 * i,
            echo_age=0.01,
            peer_time=9.02 + 0.05 * i,
            state=state,
        )
        assert state.estimated == state.trusted == (i >= 9)
    assert state.offset == pytest.approx(9.0)
    assert state.round_trip == pytest.approx(0.02)
    assert dp.ClockOffset.to_local(10.0, state) == pytest.approx(1.0)
    dut.update(np.nan, 0, 0, 0, state)
    assert (state.bad_inputs, state.jumps) == (1, 0)


def test_two_ends_hand_messages_over():
    robot, haptic = dp.LinkEnd("to_haptic"), dp.LinkEnd("to_robot")
    one, two = robot.make_state(1), haptic.make_state(2)
    verdicts = []
    for i in range(40):
        time = 0.02 * i
        sent = dp.PoseMessage(sequence=i, send_time=100 + time)
        data = haptic.send(100 + time, sent, dp.LinkFrame.CLUTCH, two)
        verdicts.append(robot.receive(time + 0.005, data, one))
        back = robot.send(time + 0.01, dp.ForceMessage(i, time), 0, one)
        haptic.receive(100 + time + 0.015, back, two)
    assert verdicts[0] == "unproven"
    assert verdicts[-1] == "accepted"
    assert robot.send(time + 0.011, dp.ForceMessage(i, time), 0, one) is None
    assert one.message.sequence == 39
    assert one.message.send_time == pytest.approx(time)
    assert one.flags == dp.LinkFrame.CLUTCH
    assert one.clock.offset == pytest.approx(100)
    assert (one.session, one.peer, one.sent, one.lost) == (1, 2, 40, 0)
    assert robot.receive(time, b"junk", one) == "malformed"
    assert one.verdicts["malformed"] == one.malformed["length"] == 1
    assert robot.is_connected(time, one)
    assert not robot.is_connected(time + 1, one)


def test_parameters_name_the_field():
    with pytest.raises(ValueError, match="field `interval` expected"):
        dp.LinkEnd("to_robot", params=dp.LinkEndParams(interval=0))
    with pytest.raises(ValueError, match="field `share` expected"):
        dp.ClockOffsetParams(share=2)
