# SPDX-License-Identifier: BSD-3-Clause
"""The link's algorithms through Python."""

import copy
import pickle

import numpy as np
import pytest

import dual_proxy as dp

EYE = np.eye(3)
NONE = np.zeros((3, 3))


def message(sequence: int, send_time: float = 0.0) -> dp.PoseMessage:
    return dp.PoseMessage(
        sequence=sequence, send_time=send_time, pose=dp.Pose(p=[sequence, 0, 0])
    )


def transmit(params: dp.CommunicationChannelParams, seed: int) -> list[int]:
    channel = dp.CommunicationChannel(params)
    state = channel.make_state(seed)
    received = []
    for i in range(4000):
        time = 0.001 * i
        if i % 20 == 0:
            channel.send(time, message(i // 20, time), state)
        received.append(channel.receive(time, state).sequence)
    return received


def test_messages_keep_their_values_through_copy_and_pickle():
    original = dp.PoseMessage(
        sequence=3,
        send_time=0.25,
        pose=dp.Pose(p=[1, 2, 3], R=EYE),
        force_selection=np.diag([0, 0, 1]),
        moment_selection=np.diag([1, 0, 0]),
    )
    for other in (
        copy.copy(original),
        copy.deepcopy(original),
        pickle.loads(pickle.dumps(original)),
    ):
        assert other is not original
        assert other.sequence == 3
        assert other.send_time == 0.25
        np.testing.assert_array_equal(other.pose.p, [1, 2, 3])
        np.testing.assert_array_equal(other.pose.R, EYE)
        np.testing.assert_array_equal(other.force_selection, np.diag([0, 0, 1]))
        np.testing.assert_array_equal(other.moment_selection, np.diag([1, 0, 0]))
    other = copy.deepcopy(original)
    other.pose.p = [9, 9, 9]
    np.testing.assert_array_equal(original.pose.p, [1, 2, 3])
    force = pickle.loads(pickle.dumps(dp.ForceMessage(1, 0.5, [1, 2, 3])))
    np.testing.assert_array_equal(force.force, [1, 2, 3])
    assert (force.sequence, force.send_time) == (1, 0.5)


def test_empty_messages_carry_no_sequence():
    assert dp.PoseMessage().sequence == -1
    assert dp.ForceMessage().sequence == -1
    assert dp.PoseMessage().is_valid()
    assert not dp.PoseMessage(force_selection=2 * EYE).is_valid()
    assert not dp.ForceMessage(force=[np.nan, 0, 0]).is_valid()


def test_wrong_shapes_name_the_argument():
    with pytest.raises(ValueError, match=r"p: expected .*\(3,\).*\(2,\)"):
        dp.Pose(p=[1, 2])
    with pytest.raises(ValueError, match=r"force_selection: .*\(3, 3\).*\(9,\)"):
        dp.PoseMessage(force_selection=np.zeros(9))
    with pytest.raises(ValueError, match="force: "):
        dp.ForceMessage(force="push")


def test_arrays_of_messages_cannot_be_changed_by_mistake():
    original = dp.PoseMessage()
    with pytest.raises(ValueError, match="read-only"):
        original.force_selection[0, 0] = 1.0
    original.force_selection = EYE
    assert original.force_selection[0, 0] == 1.0


def test_sender_averages_and_keeps_its_rate():
    sender = dp.PoseSender(dp.PoseSenderParams(rate=50.0))
    state = sender.make_state()
    for i in range(21):
        newest = sender.update(0.001 * i, [i, 0, 0], EYE, NONE, EYE, state)
    assert newest.sequence == 1
    assert newest.pose.p[0] == pytest.approx(10.5, abs=1e-12)
    np.testing.assert_array_equal(newest.moment_selection, EYE)
    # What was taken from a state does not change with it.
    kept = state.message
    for i in range(21, 41):
        sender.update(0.001 * i, [i, 0, 0], EYE, NONE, EYE, state)
    assert kept.sequence == 1
    assert state.message.sequence == 2


def test_force_sender():
    sender = dp.ForceSender(dp.PoseSenderParams(average=False))
    state = sender.make_state()
    for i in range(21):
        newest = sender.update(0.001 * i, [0, 0, i], state)
    assert newest.force[2] == 20.0
    sender.update(0.021, [np.nan, 0, 0], state)
    assert state.bad_inputs == 1


def test_channel_delays():
    params = dp.CommunicationChannelParams(delay=0.1)
    channel = dp.CommunicationChannel(params)
    state = channel.make_state()
    channel.send(0.0, message(0), state)
    assert channel.receive(0.099, state).sequence == -1
    assert channel.receive(0.1, state).sequence == 0
    assert (state.sent, state.lost, state.in_flight) == (1, 0, 1)


def test_channel_is_deterministic_by_seed():
    params = dp.CommunicationChannelParams(delay=0.15, jitter=0.05, loss=0.2)
    assert transmit(params, 1) == transmit(params, 1)
    assert transmit(params, 1) != transmit(params, 2)


def test_a_copied_channel_continues_alike():
    params = dp.CommunicationChannelParams(delay=0.15, jitter=0.05, loss=0.2)
    channel = dp.CommunicationChannel(params)
    states = [channel.make_state(5)]
    for k in range(100):
        channel.send(0.02 * k, message(k), states[0])
    states.append(copy.deepcopy(states[0]))
    for state in states:
        for k in range(100, 200):
            channel.send(0.02 * k, message(k), state)
    assert states[0].lost == states[1].lost > 0
    times = np.arange(4.0, 5.0, 0.001)
    received = [[channel.receive(t, s).sequence for t in times] for s in states]
    assert received[0] == received[1]


def test_channel_carries_any_kind_of_message():
    channel = dp.CommunicationChannel()
    other = dp.Message()
    other.tag, other.sequence, other.body = 7, 2, [1.0, 2.0]
    for sequence, sent in enumerate(
        (dp.PoseMessage(0), dp.ForceMessage(1, force=[1, 2, 3]), other)
    ):
        state = channel.make_state(0)
        channel.send(0.0, sent, state)
        received = channel.receive(0.0, state)
        assert type(received) is type(sent)
        assert received.sequence == sequence
        for field in ("force", "body"):
            if hasattr(sent, field):
                np.testing.assert_array_equal(
                    getattr(received, field), getattr(sent, field)
                )
    with pytest.raises(TypeError, match="expected a Message, got 3"):
        channel.send(0.0, 3, state)


def test_a_message_of_any_kind_keeps_its_numbers():
    message = dp.Message()
    assert (message.tag, message.sequence, message.body.size) == (0, -1, 0)
    message.tag, message.sequence, message.send_time = 7, 3, 0.25
    message.body = np.arange(40.0)
    for other in (copy.deepcopy(message), pickle.loads(pickle.dumps(message))):
        assert (other.tag, other.sequence, other.send_time) == (7, 3, 0.25)
        np.testing.assert_array_equal(other.body, np.arange(40.0))
    assert message.describe() == "a message with tag 7"
    with pytest.raises(ValueError, match=r"body: expected shape \(n,\), n <= 40"):
        message.body = np.zeros(41)
    # Of another kind: no receiver takes it for valid.
    assert not dp.PoseMessage.from_message(message).is_valid()


def test_link_monitor():
    monitor = dp.LinkMonitor(dp.LinkMonitorParams(timeout=0.2))
    state = monitor.make_state()
    assert state.status == dp.LinkStatus.WAITING
    assert monitor.update(1.0, 4, 0.9, True, state)
    assert state.status == dp.LinkStatus.CONNECTED
    assert state.age == pytest.approx(0.1)
    assert not monitor.update(1.1, 3, 0.8, True, state)
    assert not monitor.update(1.15, 5, 1.1, False, state)
    assert (state.received, state.dropped, state.bad_inputs) == (1, 1, 1)
    monitor.update(1.3, 5, 1.1, False, state)
    assert state.status == dp.LinkStatus.LOST
    assert state.losses == 1


def test_link_status_is_complete():
    assert {s.name: int(s) for s in dp.LinkStatus} == {
        "WAITING": 0,
        "CONNECTED": 1,
        "LOST": 2,
    }


@pytest.mark.parametrize(
    ("params", "field", "value"),
    [
        (dp.PoseSenderParams, "rate", 0.0),
        (dp.PoseSenderParams, "rate", 1001.0),
        (dp.PoseSenderParams, "period", -1.0),
        (dp.CommunicationChannelParams, "delay", -0.1),
        (dp.CommunicationChannelParams, "jitter", np.nan),
        (dp.CommunicationChannelParams, "loss", 1.5),
        (dp.LinkMonitorParams, "timeout", 0.0),
        (dp.LinkMonitorParams, "max_age", -1.0),
        (dp.LinkMonitorParams, "spike_threshold", 0.0),
    ],
)
def test_params_out_of_range_name_the_field(params, field, value):
    with pytest.raises(ValueError, match=f"{params.__name__}: field `{field}`"):
        params(**{field: value})


@pytest.mark.parametrize(
    ("cls", "fields"),
    [
        (dp.PoseSenderParams, ["rate", "average", "period"]),
        (
            dp.CommunicationChannelParams,
            ["delay", "jitter", "loss", "reordering", "outages"],
        ),
        (dp.LinkMonitorParams, ["timeout", "max_age", "spike_threshold"]),
    ],
)
def test_params_are_complete_and_round_trip(cls, fields):
    assert list(cls.fields) == fields
    params = cls()
    assert pickle.loads(pickle.dumps(params)) == params
    with pytest.raises(TypeError, match="speed"):
        cls(speed=1.0)
