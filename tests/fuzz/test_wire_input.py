# SPDX-License-Identifier: BSD-3-Clause
"""Whatever bytes come over the link: an error that says why, or a frame that is all
right by a second reading of docs/link.md; and nothing that the link end lets through
but what its peer has sent."""

import math
import struct
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import FLOATS, require_line

import dual_proxy as dp

HEAD = struct.Struct("<4sHBBQQdQddIIiIqdd")
#: Of each example; 30 examples: a hundred thousand.
MUTANTS = 3400
# Numbers that a byte or a number may be set to.
BYTES = [0, 1, 2, 39, 40, 41, 127, 128, 240, 255]
NUMBERS = [0.0, -0.0, 1.0, -1.0, 1e11, 1.1e11, 1e300, 5e-324, math.inf, math.nan]


def is_frame(data: bytes, direction: int) -> bool:
    """Read as docs/link.md has it."""
    if len(data) != 416:
        return False
    (
        magic,
        version,
        way,
        zero,
        session,
        _,
        time,
        _,
        echo_time,
        echo_age,
        flags,
        tag,
    ) = HEAD.unpack_from(data)[:12]
    size, reserved, sequence, send_time = HEAD.unpack_from(data)[12:16]
    times = (time, echo_time, echo_age, send_time)
    if (magic, version, way, zero, reserved) != (b"DPXY", 1, direction, 0, 0):
        return False
    if session == 0 or flags > 7 or not 0 <= size <= 40 or sequence < -1:
        return False
    if (tag == 0) != (sequence == -1) or (sequence == -1 and size != 0):
        return False
    if not all(abs(number) <= 1e11 for number in times) or echo_age < 0:
        return False
    body = struct.unpack_from("<40d", data, HEAD.size)
    return all(map(math.isfinite, body[:size])) and not any(data[96 + 8 * size :])


def good(sequence: int = 5) -> bytes:
    frame = dp.LinkFrame()
    frame.session, frame.number, frame.time = 77, 10, 3.0
    frame.echo_session, frame.echo_time, frame.echo_age = 1, 2.0, 0.5
    frame.message = dp.PoseMessage(
        sequence=sequence, send_time=3.0, pose=dp.Pose([0.1, 0.2, 0.3])
    )
    return dp.encode_frame(frame)


def decodes(data: bytes, direction: str) -> bool:
    try:
        frame = dp.decode_frame(data, direction)
    except ValueError as error:
        require_line(error, "decode_frame: the bytes ")
        return False
    assert dp.encode_frame(frame) == data
    return True


def mutants(random: Random, count: int) -> list[bytes]:
    """Frames with bytes and numbers changed, cut, or nothing but noise."""
    results = []
    original = good()
    for _ in range(count):
        data = bytearray(original)
        kind = random.randrange(6)
        for _ in range(random.randrange(1, 4)):
            at = random.randrange(416)
            if kind == 0:
                data[at] ^= 1 << random.randrange(8)
            elif kind == 1:
                data[at] = random.choice(BYTES)
            elif kind == 2:
                at -= at % 8
                data[at : at + 8] = struct.pack("<d", random.choice(NUMBERS))
            elif kind == 3:
                del data[at:]
            elif kind == 4:
                data[at:] = random.randbytes(416 - at)
            else:
                data += random.randbytes(at)
        results.append(bytes(data))
    return results


@given(st.integers(0, 2**32))
def test_a_hundred_thousand_mutants_are_frames_only_where_they_are(seed):
    end = dp.LinkEnd("to_haptic")
    state = end.make_state(1)
    taken = 0
    for data in mutants(Random(seed), MUTANTS):
        expected = is_frame(data, 1)
        assert decodes(data, "to_robot") == expected, data.hex()
        verdict = end.receive(3.0, data, state)
        assert (verdict == "malformed") != expected, (verdict, data.hex())
        taken += expected
    # Some of the changes leave a frame; that is what a hundred thousand are for.
    assert 0 < taken < MUTANTS
    counts = state.verdicts
    assert sum(counts.values()) == MUTANTS
    assert sum(state.malformed.values()) == counts["malformed"] == MUTANTS - taken


@given(st.binary(max_size=1000))
def test_noise_is_no_frame(data):
    assert decodes(data, "to_robot") == is_frame(data, 1)


@given(
    st.tuples(FLOATS, FLOATS, FLOATS, FLOATS, FLOATS),
    st.integers(0, 2**64 - 1),
    st.integers(-(2**63), 2**63 - 1),
    st.integers(0, 2**32 - 1),
    st.lists(FLOATS, max_size=40),
)
def test_any_frame_is_encoded_and_taken_only_if_it_is_one(
    numbers, session, sequence, flags, body
):
    frame = dp.LinkFrame()
    message = dp.Message()
    frame.session = frame.number = frame.echo_session = session
    frame.time, frame.echo_time, frame.echo_age = numbers[:3]
    frame.flags = message.tag = flags
    message.send_time, message.gripper_opening = numbers[3:]
    message.sequence = sequence
    message.body = body
    frame.message = message
    data = dp.encode_frame(frame)
    assert decodes(data, "to_robot") == is_frame(data, 1)


@given(st.integers(0, 2**32))
def test_a_link_end_lets_nothing_through_but_what_its_peer_has_sent(seed):
    """Mutants of true frames, old ones, and true ones out of order, between."""
    random = Random(seed)
    often = dp.LinkEndParams(interval=0.01)
    robot = dp.LinkEnd("to_haptic", params=often)
    haptic = dp.LinkEnd("to_robot", params=often)
    # What nobody guesses.
    one, two = robot.make_state(random.getrandbits(64)), haptic.make_state(2)
    sent = []
    newest = -1
    for i in range(60):
        time = 0.02 * i
        message = dp.PoseMessage(
            sequence=i, send_time=50 + time, pose=dp.Pose([0.01 * i, 0, 0])
        )
        data = haptic.send(50 + time, message, 0, two)
        sent.append(data)
        offered = [*mutants(random, 5), *random.choices(sent, k=3), data]
        random.shuffle(offered)
        for offer in offered:
            verdict = robot.receive(time + 0.005, offer, one)
            if verdict == "accepted":
                assert offer == data
                assert one.message.sequence == i > newest
                assert one.message.send_time == pytest.approx(time, abs=1e-6)
                newest = i
        haptic.receive(
            50.015 + time, robot.send(time + 0.01, dp.Message(), 0, one), two
        )
    assert newest == 59
