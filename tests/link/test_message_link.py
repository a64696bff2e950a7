# SPDX-License-Identifier: BSD-3-Clause
"""Two sides in two processes, what goes wrong between them, and what is said of it."""

from __future__ import annotations

import contextlib
import json
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from free_port import free_port

import dual_proxy as dp
from dual_proxy.link import LinkError

try:
    from intruder import Intruder

    from dual_proxy.link import keys, transport
    from dual_proxy.link.agreement import describe_side
    from dual_proxy.link.message_link import MessageLink
    from dual_proxy.link.transport import RING, Transport
except ImportError as error:
    pytest.skip(str(error), allow_module_level=True)

HERE = Path(__file__).parent
SIDE = HERE / "link_side.py"
INTRUDER = HERE / "intruder.py"
PATIENT = 10.0  # s, that a busy machine may take for what takes a fraction of it.


@pytest.fixture(autouse=True)
def hasty(monkeypatch):
    """What closes while it tries to connect waits for that."""
    monkeypatch.setattr(transport, "_OPENING", 500)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("keys") / "new"
    keys.make_keys(folder)
    return folder


def free_address():
    return f"127.0.0.1:{free_port()}"


@pytest.fixture
def address():
    return free_address()


class Process:
    """A side in a process of its own, and what it says."""

    def __init__(self, side, how, address, folder):
        command = [sys.executable, str(SIDE), side, how, address, str(folder)]
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.lines = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self.process.stdout:
            self.lines.append(json.loads(line))

    @property
    def last(self):
        return self.lines[-1] if self.lines else {}

    def wait_for(self, what):
        end = time.monotonic() + PATIENT
        while not (self.lines and what(self.last)):
            assert time.monotonic() < end, self.last
            time.sleep(0.01)

    def signal(self, number):
        self.process.send_signal(number)

    def end(self):
        self.process.kill()
        self.process.wait()
        with contextlib.suppress(BrokenPipeError):
            self.process.stdin.close()
        self._reader.join(5)
        self.process.stdout.close()


@pytest.fixture
def start():
    started = []

    def run(*arguments):
        started.append(Process(*arguments))
        return started[-1]

    yield run
    for process in started:
        process.end()


class Loop:
    """A side in this process, in a loop."""

    def __init__(self, link, period=0.002):
        self.link = link
        self.period = period
        self.sequence = -1
        self.received = []
        self.ages = []
        self.work = []
        self.trouble = ""

    def step(self):
        now = time.monotonic()
        message = self.link.receive(now)
        if message is not None:
            self.received.append(message)
            self.ages.append(now - message.send_time)
        self.sequence += 1
        pose = dp.Pose([1e-3 * self.sequence, 0, 0])
        self.link.send(
            time.monotonic(),
            dp.PoseMessage(sequence=self.sequence, send_time=now, pose=pose),
        )
        self.trouble = self.link.trouble(now)
        self.work.append(time.monotonic() - now)
        time.sleep(self.period)

    def until(self, what, limit=PATIENT):
        """Run until `what()`; return after how many seconds."""
        start = time.monotonic()
        while not what():
            assert time.monotonic() - start < limit, (
                self.trouble,
                self.link.statistics(),
            )
            self.step()
        return time.monotonic() - start

    def run(self, duration):
        end = time.monotonic() + duration
        self.until(lambda: time.monotonic() > end)

    def connected(self):
        return self.link.connected(time.monotonic())


def test_two_processes_exchange_messages(made, address, start, capsys):
    """The one that connects is there first."""
    other = start("haptic", "connect", address, made / "haptic")
    other.wait_for(lambda line: line["time"] > 0.3)
    with MessageLink("robot", listen=address, keys=made / "robot") as link:
        loop = Loop(link)
        connected_after = loop.until(lambda: len(loop.received) >= 200)
        loop.until(lambda: other.last.get("connected"))
        statistics = link.statistics()
        assert statistics["peers"] == ["dual-proxy haptic"]
        assert link.flags == dp.LinkFrame.CLUTCH
    sequences = [message.sequence for message in loop.received]
    assert sequences == sorted(set(sequences))
    for message in loop.received:
        content = dp.PoseMessage.from_message(message)
        assert content.is_valid()
        np.testing.assert_array_equal(content.pose.p, [1e-3 * message.sequence, 0, 0])
    assert statistics["malformed"] == statistics["other_session"] == 0
    assert statistics["clock_estimated"]
    # One machine, one clock.
    assert abs(statistics["clock_offset_s"]) <= statistics["round_trip_s"]
    with capsys.disabled():
        print(
            f"\nround trip {1e3 * statistics['round_trip_s']:.2f} ms of loops at 500 "
            f"Hz, clock error {1e6 * statistics['clock_offset_s']:.0f} us, age "
            f"{1e3 * np.median(loop.ages):.2f} ms, 200 messages after "
            f"{connected_after:.2f} s, work {1e6 * np.median(loop.work):.0f} us, "
            f"{1e6 * max(loop.work):.0f} us worst"
        )


def test_why_there_is_no_other_side_is_said_within_two_seconds(made, tmp_path, start):
    """Where it has other keys, is not there, is this side once more."""
    address, nobody, third = (free_address() for _ in range(3))
    keys.make_keys(tmp_path / "others")
    stranger = start("haptic", "connect", address, tmp_path / "others" / "haptic")
    twin = start("robot", "connect", third, made / "robot")
    with (
        MessageLink("robot", listen=address, keys=made / "robot") as one,
        MessageLink("haptic", connect=nobody, keys=made / "haptic") as two,
        MessageLink("robot", listen=third, keys=made / "robot") as three,
    ):
        robot, alone, doubled = Loop(one), Loop(two), Loop(three)

        def all_said():
            alone.step()
            doubled.step()
            return (
                robot.trouble
                and alone.trouble
                and "twice" in doubled.trouble
                and stranger.last.get("trouble")
                and twin.last.get("trouble")
            )

        begin = time.monotonic()
        robot.until(lambda: all_said() or robot.trouble)
        said_after = time.monotonic() - begin
        robot.until(all_said)
        assert one.statistics()["peers"] == []
        assert two.statistics()["peers"] == []
    assert not robot.received + alone.received + doubled.received
    assert 1.8 < said_after < 4
    assert "no haptic side for" in robot.trouble
    assert f", listening on {address}: " in robot.trouble
    assert "keys were not made together" in robot.trouble
    # It knows that something is there, so this comes first.
    said = stranger.last["trouble"].partition(address)[2]
    assert said.startswith(": its keys were not made together with these")
    assert "nothing takes UDP on port" in alone.trouble
    assert "robot side is not started" in alone.trouble


def test_a_side_that_is_killed_comes_back_by_itself(made, address, start):
    other = start("haptic", "listen", address, made / "haptic")
    with MessageLink("robot", connect=address, keys=made / "robot") as link:
        loop = Loop(link)
        loop.until(lambda: len(loop.received) > 100)
        other.end()
        died = link._state.peer
        loop.until(lambda: not loop.connected())
        other = start("haptic", "listen", address, made / "haptic")
        count = len(loop.received)
        loop.until(lambda: len(loop.received) > count + 10)
        assert link._state.peer != died
        loop.until(lambda: other.last.get("connected"))


def test_of_a_backlog_nothing_old_is_taken(made, address, start):
    """A process stands still, and then finds what was sent to it meanwhile."""
    other = start("haptic", "connect", address, made / "haptic")
    with MessageLink("robot", listen=address, keys=made / "robot") as link:
        loop = Loop(link)
        loop.until(lambda: len(loop.received) > 100)
        loop.until(lambda: other.last.get("connected"))
        other.signal(signal.SIGSTOP)
        loop.until(lambda: not loop.connected())
        loop.run(1.0)
        other.signal(signal.SIGCONT)
        at = len(other.lines)
        loop.until(lambda: loop.connected() and len(other.lines) > at + 5)
        loop.until(lambda: other.last["connected"])
    # The link's timeout, and what its loops take.
    assert max(line["worst_age"] for line in other.lines) < 0.6
    assert other.last["statistics"]["clock_jumps"] == 0
    taken = [number for line in other.lines for number in line["received"]]
    assert taken == sorted(taken)
    assert max(np.diff(taken)) > 200


@pytest.fixture
def pair(address, monkeypatch):
    """Both sides in this process, and what the haptic side has sent."""
    recorded = []
    send = Transport.send

    def record(self, data):
        if self._side == "haptic":
            recorded.append(data)
        send(self, data)

    monkeypatch.setattr(Transport, "send", record)
    with (
        MessageLink("robot", listen=address, insecure=True) as robot_link,
        MessageLink("haptic", connect=address, insecure=True) as haptic_link,
    ):
        robot, haptic = Loop(robot_link), Loop(haptic_link)

        def until(what):
            robot.until(lambda: haptic.step() or what())

        until(lambda: len(robot.received) > 50 and len(haptic.received) > 50)
        yield robot, haptic, recorded, until


def test_what_was_recorded_reflected_or_forged_is_refused(pair, address):
    robot, haptic, recorded, until = pair
    intruder = Intruder(address)
    counts = robot.link.statistics

    def refused(frames, verdict, how_many=20):
        before = counts()[verdict]
        taken = len(robot.received)
        feed = iter(frames * 50)
        until(
            lambda: intruder.put(next(feed)) or counts()[verdict] >= before + how_many
        )
        # What is true still comes, in order and nothing else.
        until(lambda: len(robot.received) > taken + 20)

    old = recorded[:100]
    refused(old, "replayed")
    frame = dp.decode_frame(recorded[-1], "to_robot")
    true_session = frame.session
    reflected = dp.LinkFrame()
    reflected.direction, reflected.session = "to_haptic", 5
    refused([dp.encode_frame(reflected)], "malformed_direction")
    frame.session = 99
    frame.number += 10**6
    refused([dp.encode_frame(frame)], "other_session")
    refused([b"", bytes(416), b"DPXY" + bytes(412)], "malformed")
    refused([recorded[-1][:-1]], "malformed_length")
    sequences = [message.sequence for message in robot.received]
    assert sequences == sorted(set(sequences))
    assert robot.link._state.peer == true_session
    # When the true sender is gone, what it has sent is still no proof.
    haptic.link.close()
    robot.until(lambda: not robot.connected())
    taken = len(robot.received)
    before = counts()
    # Nobody can guess what the robot side calls itself.
    frame.echo_session = 12345
    for data in [*old, dp.encode_frame(frame)]:
        intruder.put(data)
        robot.step()
    for verdict in ("replayed", "unproven"):
        robot.until(
            lambda verdict=verdict: (
                intruder.put(dp.encode_frame(frame))
                or counts()[verdict] > before[verdict]
            )
        )
    robot.run(0.2)
    assert len(robot.received) == taken
    assert not robot.connected()
    intruder.session.close()


def test_a_flood_of_ten_thousand_a_second_stops_nothing(address, start, capsys):
    start("haptic", "connect", address, "-")
    frame = dp.LinkFrame()
    frame.session = 99
    junk = [dp.encode_frame(frame), bytes(416), b"x" * 100]

    def measure(duration):
        """Messages and junk a second, and what a cycle takes."""
        loop.work.clear()
        before, taken = loop.link.statistics(), len(loop.received)
        begin = time.monotonic()
        loop.until(lambda: time.monotonic() > begin + duration)
        took = time.monotonic() - begin
        after = loop.link.statistics()
        looked_at = sum(
            after[name] - before[name] for name in ("malformed", "other_session")
        )
        taken = len(loop.received) - taken
        return taken / took, looked_at / took, 1e6 * np.array(loop.work)

    with MessageLink("robot", listen=address, insecure=True) as link:
        loop = Loop(link, period=0.001)
        loop.until(lambda: len(loop.received) > 50)
        usual, _, quiet = measure(0.5)
        flooder = subprocess.Popen(
            [sys.executable, INTRUDER, address], stdin=subprocess.PIPE, text=True
        )
        flooder.stdin.write("\n".join(data.hex() for data in junk))
        flooder.stdin.close()
        loop.until(lambda: link.statistics()["malformed"] > 10)
        flooded, looked_at, work = measure(1.5)
        flooder.kill()
        flooder.wait()
        assert loop.connected()
    with capsys.disabled():
        print(
            f"\nflood of 10000 a second, of which {looked_at:.0f} are looked at: "
            f"{flooded:.0f} messages a second (before, {usual:.0f}); a cycle's work "
            f"{np.median(work):.0f} us (before, {np.median(quiet):.0f}), "
            f"{np.quantile(work, 0.99):.0f} us 99 % (before, "
            f"{np.quantile(quiet, 0.99):.0f}); {len(work) / 1.5:.0f} cycles a second"
        )
    assert looked_at > 300
    assert flooded > 10
    sequences = [message.sequence for message in loop.received]
    assert sequences == sorted(set(sequences))


def test_a_call_looks_at_sixteen_messages_at_most(address):
    with Transport("robot", listen=address, insecure=True) as end_of_robot:
        intruder = Intruder(address)
        end = time.monotonic() + PATIENT
        while not end_of_robot.peers() and time.monotonic() < end:
            time.sleep(0.01)
        numbers = []
        # The newest, in order; some may be lost, and on a busy machine come late.
        while not (numbers and numbers[-1] > 400) and time.monotonic() < end:
            for number in range(500):
                intruder.put(str(number).encode())
            time.sleep(0.3)
            taken = end_of_robot.receive()
            assert len(taken) <= RING
            numbers = [int(data) for data in taken]
        assert numbers == sorted(numbers)
        assert numbers[-1] > 400
        time.sleep(0.3)
        while end_of_robot.receive():
            assert time.monotonic() < end
        assert end_of_robot.receive() == []
        intruder.session.close()


def test_bytes_without_end_do_not_come_in(pair, address):
    robot, _, _, until = pair
    intruder = Intruder(address)
    for _ in range(5):
        intruder.put(bytes(10**6))
        taken = len(robot.received)
        until(lambda taken=taken: len(robot.received) > taken + 5)
    assert robot.connected()
    intruder.session.close()


@pytest.mark.parametrize("side", ["robot", "haptic"])
def test_only_the_haptic_sides_certificate_may_send_to_the_robot(made, address, side):
    """Of the same authority, and yet the robot's own certificate is no use."""
    with Transport("robot", listen=address, keys=made / "robot") as end_of_robot:
        intruder = Intruder(address.replace("127.0.0.1", "localhost"), made / side)
        end = time.monotonic() + PATIENT
        while not end_of_robot.peers() and time.monotonic() < end:
            time.sleep(0.01)
        assert end_of_robot.peers() == [f"dual-proxy {side}"]
        came = []
        end = time.monotonic() + (0.5 if side == "robot" else PATIENT)
        while not came and time.monotonic() < end:
            intruder.put(b"move")
            time.sleep(0.01)
            came = end_of_robot.receive()
        assert bool(came) == (side == "haptic")
        intruder.session.close()


def test_without_keys_only_this_machine(address, capsys):
    for host in ("0.0.0.0", "192.0.2.1", "[::]"):
        with pytest.raises(LinkError, match=r"--insecure is for 127\.0\.0\.1"):
            Transport("robot", listen=f"{host}:7447", insecure=True)
    assert capsys.readouterr().err == ""
    port = address.partition(":")[2]
    with Transport("robot", listen=f"localhost:{port}", insecure=True):
        said = capsys.readouterr().err
    assert "warning: insecure link on 127.0.0.1" in said


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"side": "left"}, "side: expected one of robot, haptic, got 'left'"),
        ({"connect": "a:1"}, "to listen on or one to connect to, got both"),
        ({"listen": None}, "to listen on or one to connect to, got neither"),
        ({"insecure": False}, r"`dual-proxy keys` makes it.* got neither"),
        ({"keys": Path("/nowhere")}, "got both"),
        ({"listen": "127.0.0.1"}, "--listen: expected HOST:PORT, got '127.0.0.1'"),
        (
            {"listen": None, "connect": "127.0.0.1"},
            "--connect: expected HOST:PORT, got '127.0.0.1'",
        ),
        ({"listen": "127.0.0.1:0"}, r"expected a port in \[1, 65535\], got 0"),
        ({"listen": "127.0.0.1:x"}, "expected HOST:PORT"),
        ({"listen": "::1:5"}, "expected HOST:PORT"),
        ({"listen": "tcp/127.0.0.1:5"}, "expected HOST:PORT"),
        ({"listen": "nowhere.invalid:5"}, r"--listen: nowhere\.invalid: "),
    ],
)
def test_what_makes_no_link_is_refused(arguments, said):
    usual = {"side": "robot", "listen": "127.0.0.1:7447", "insecure": True}
    with pytest.raises(LinkError, match=said):
        Transport(**{**usual, **arguments})


def test_no_certificate_is_checked_of_an_ipv6_address(made):
    with pytest.raises(LinkError, match="IPv6 address, got ::1; connect to a name"):
        Transport("haptic", connect="[::1]:7447", keys=made / "haptic")


def test_a_link_that_is_closed_takes_and_gives_nothing(address):
    link = MessageLink("robot", listen=address, insecure=True)
    link.close()
    link.close()
    link.send(1.0, dp.PoseMessage(sequence=0))
    assert link.receive(1.0) is None
    assert link.trouble(1.0) == ""
    assert "haptic side is not started" in link.trouble(9.0)
    assert link.statistics()["peers"] == []


def test_an_address_in_use_is_said(made, address):
    with (
        Transport("robot", listen=address, keys=made / "robot"),
        pytest.raises(LinkError) as refused,
    ):
        Transport("robot", listen=address, keys=made / "robot")
    said = f"--listen: cannot listen on {address}: the port is in use"
    assert str(refused.value) == said


def test_an_address_of_another_machine_is_said(made):
    with pytest.raises(LinkError, match="it is no address of this machine"):
        Transport("robot", listen="192.0.2.1:7447", keys=made / "robot")


def made_of(**overrides):
    return describe_side(dp.load_scenario("plane").with_overrides(overrides))


def insecure(side, address, **arguments):
    how = "listen" if side == "robot" else "connect"
    return Loop(MessageLink(side, **{how: address}, insecure=True, **arguments))


def together(*loops):
    """Return what runs all of them until something."""
    first, *others = loops

    def until(what):
        return first.until(lambda: [loop.step() for loop in others] and what())

    return until


@pytest.mark.parametrize("secure", [False, True])
def test_sides_made_of_different_things_do_not_follow(made, address, secure):
    """Until the one that was started with another scheme is started again."""
    access = [{"insecure": True}] * 2
    if secure:
        access = [{"keys": made / side} for side in ("robot", "haptic")]

    def haptic_side(**overrides):
        link = MessageLink(
            "haptic", connect=address, made_of=made_of(**overrides), **access[1]
        )
        return Loop(link)

    with MessageLink(
        "robot", listen=address, made_of=made_of(), **access[0]
    ) as robot_link:
        robot, haptic = Loop(robot_link), haptic_side(scheme="tdpa")
        until = together(robot, haptic)
        until(lambda: "has" in robot.trouble and "has" in haptic.trouble)
        assert robot.trouble == (
            "the haptic side has scheme tdpa, this one dual_proxy: give both the same "
            "scenario"
        )
        assert haptic.trouble == (
            "the robot side has scheme dual_proxy, this one tdpa: give both the same "
            "scenario"
        )
        end = time.monotonic() + 0.3
        until(lambda: time.monotonic() > end)
        for loop in (robot, haptic):
            assert loop.link.statistics()["accepted"] > 0
            assert not loop.received
            assert not loop.connected()
            assert loop.link.flags == 0
        haptic.link.close()
        with haptic_side().link as link:
            haptic = Loop(link)
            until = together(robot, haptic)
            until(lambda: haptic.received and not haptic.trouble)
            until(lambda: robot.received and not robot.trouble)
            assert robot.connected()
            assert haptic.connected()


def test_a_side_that_does_not_tell_what_it_is_made_of_is_not_followed(address):
    robot = insecure("robot", address, made_of=made_of())
    haptic = insecure("haptic", address)
    until = together(robot, haptic)
    with robot.link, haptic.link:
        begin = time.monotonic()
        until(lambda: "another version" in robot.trouble)
        assert time.monotonic() - begin > 1.8
        assert robot.trouble == (
            "the haptic side does not tell what it is made of: it is another version "
            "of dual-proxy"
        )
        assert not robot.received
        assert haptic.received


def test_malformed_words_beside_the_frames_are_counted(address):
    robot = insecure("robot", address, made_of=made_of())
    haptic = insecure("haptic", address, made_of=made_of())
    until = together(robot, haptic)
    with robot.link, haptic.link:
        until(lambda: robot.received)

        def malformed():
            haptic.link._transport.send_beside(b"x" * 500)
            return robot.link.statistics()["malformed_beside"] > 20

        until(malformed)
        taken = len(robot.received)
        until(lambda: len(robot.received) > taken + 5)
        assert robot.trouble == ""


def test_a_second_haptic_side_and_the_robot_side_say_what_it_is(address):
    robot, first = insecure("robot", address), insecure("haptic", address)
    with robot.link, first.link:
        together(robot, first)(lambda: first.connected() and robot.connected())
        second = insecure("haptic", address)
        with second.link:
            until = together(robot, first, second)
            until(lambda: robot.trouble and second.trouble)
            assert robot.connected()
            assert first.connected()
            assert first.trouble == ""
        assert robot.trouble == (
            "a second haptic side is there: only the first one is heard"
        )
        assert second.trouble.endswith(
            ": connected, but another haptic side is heard there already"
        )
        together(robot, first)(lambda: not robot.trouble)


def test_a_robot_side_without_keys_says_that_the_other_is_one_too(address):
    robot = insecure("robot", address)
    other = Loop(MessageLink("robot", connect=address, insecure=True))
    with robot.link, other.link:
        until = together(robot, other)
        until(lambda: "twice" in robot.trouble and "twice" in other.trouble)
        assert robot.trouble.endswith(
            ": connected, but to a robot side: the same side is started twice, and no "
            "haptic side"
        )
