# SPDX-License-Identifier: BSD-3-Clause
"""What goes wrong between the sides' processes, and what happens within how long."""

import contextlib
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from free_port import free_port
from settings_process import SettingsProcess

import dual_proxy as dp
from dual_proxy.hardware.events import cycle_text
from dual_proxy.hardware.robot_side import ROBOT_COLUMNS
from dual_proxy.hardware.side_log import read_side_log
from dual_proxy.panda import PandaModel

try:
    from rig import HAND_SPEED, PRESS, TRAVEL, HapticRig, Rig, SideProcess

    from dual_proxy.link.keys import make_keys
except ImportError as error:
    pytest.skip(str(error), allow_module_level=True)

HERE = Path(__file__).parent
RELAY = HERE / "udp_relay.py"
INTRUDER = HERE.parent / "link" / "intruder.py"
BAD_NETWORK = {
    "loss": 0.05,
    "delay": 0.05,
    "jitter": 0.01,
    "duplicate": 0.05,
    "corrupt": 0.02,
    "reorder": 0.05,
}


@pytest.fixture
def start(tmp_path):
    """Start sides' processes that end with the test."""
    with contextlib.ExitStack() as stack:

        def run(side, *options, clock=0.0):
            process = SideProcess(side, tmp_path, *options, scenario=PRESS)
            process.start(clock)
            stack.callback(process.kill)
            return process

        yield run


@pytest.fixture(scope="module")
def keys(tmp_path_factory):
    """Ours; others'; and of ours and others' what somebody may have gathered."""
    folder = tmp_path_factory.mktemp("keys")
    make_keys(folder / "ours")
    make_keys(folder / "others")
    # They know our authority, and do not mind who answers.
    none = folder / "none"
    none.mkdir()
    stranger = folder / "stranger"
    shutil.copytree(folder / "others" / "haptic", stranger)
    for gathered in (none, stranger):
        shutil.copy(folder / "ours" / "robot" / "ca.pem", gathered / "ca.pem")
    return folder


@contextlib.contextmanager
def intruder(port, frames, *folder):
    process = subprocess.Popen(
        [sys.executable, INTRUDER, f"127.0.0.1:{port}", *folder],
        stdin=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    process.stdin.write("\n".join(data.hex() for data in frames))
    process.stdin.close()
    try:
        yield
        assert process.poll() is None
    finally:
        process.kill()
        process.wait()


class Record:
    """What came to a rig's link, while it is on."""

    def __init__(self, rig):
        self.frames = []
        self.on = False
        receive = rig.link._transport.receive

        def take():
            taken = receive()
            if self.on:
                self.frames += taken
            return taken

        rig.link._transport.receive = take


def travel(rig, begin, end):
    """How far it went by itself while it had to hold, and the forces; 0.4 s longer,
    for what happens when it follows again."""
    settled = int(np.searchsorted(rig.times, rig.times[end] + 0.4))
    before, after = rig.force_before(begin), rig.most_force(begin, settled)
    went = rig.travelled(begin, end)
    assert went < TRAVEL
    assert after < 1.5 * before
    return (
        f"{1e3 * went:.2f} mm by itself; {before:.1f} N before, {after:.1f} N at most"
    )


def going_on(rig, begin, end):
    """The same where it may follow: a hand that is not heard for up to the link's
    timeout is caught up with."""
    before, after = rig.force_before(begin), rig.most_force(begin, end)
    strayed = rig.strayed(begin, end)
    assert strayed < TRAVEL + 0.5 * HAND_SPEED
    assert after < 1.5 * before
    return (
        f"does not follow for {100 * rig.held_share(begin, end):.0f} % of it, "
        f"{1e3 * strayed:.2f} mm from the hand's way; {before:.1f} N before, "
        f"{after:.1f} N at most"
    )


def forged(frames):
    """Of recorded frames: they again, of another session, what is none, far away."""
    frame = dp.decode_frame(frames[-1], "to_robot")
    frame.session = 99
    frame.number += 10**6
    other = dp.encode_frame(frame)
    noise = np.random.default_rng(1).bytes(416)
    head = frames[-1][:96]
    return [*frames, other, noise, bytes(416), head + noise[:320], b"x" * 100]


def test_a_bad_network(port, keys, start):
    """In contact: nothing gets through for a second; loss, delay and damage; strangers
    who want to connect; a haptic side that stands still for 5 s and then sends on."""
    relay = SettingsProcess(RELAY, f"127.0.0.1:{port}")
    haptic = start(
        *("haptic", "--device", "simulated", "--keys", keys / "ours" / "haptic"),
        *("--connect", f"127.0.0.1:{relay.ports['port']}"),
    )
    rig = Rig(port, scenario=PRESS, keys=keys / "ours" / "robot")
    record = Record(rig)
    marks = {}
    peers = []

    def mark(name):
        marks[name] = rig.mark()

    def story(rig):
        yield rig.contact(haptic.press)
        mark("cut")
        relay.set(cut=True)
        yield rig.hold("no_link")
        mark("held")
        yield rig.passed(1 - rig.took(marks["cut"], -1) / 1e3)
        mark("uncut")
        relay.set(cut=False)
        yield rig.follow()
        mark("follows")
        yield rig.passed(0.5)
        yield rig.contact(haptic.press)
        mark("bad")
        relay.set(**BAD_NETWORK)
        yield rig.passed(2)
        mark("good")
        marks["did"] = relay.set(**dict.fromkeys(BAD_NETWORK, 0.0))
        record.on = True
        yield rig.passed(0.3)
        yield rig.contact(haptic.press)
        record.on = False
        marks["counts"] = rig.link.statistics()
        mark("intruders")
        with (
            intruder(port, record.frames, keys / "stranger"),
            intruder(port, record.frames, keys / "none"),
        ):
            end = rig.passed(1.5)
            yield lambda: peers.extend(rig.link.statistics()["peers"]) or end()
        mark("left")
        marks["counts after"] = rig.link.statistics()
        yield rig.contact(haptic.press)
        mark("stopped")
        haptic.signal(signal.SIGSTOP)
        yield rig.passed(5)
        mark("resumed")
        haptic.signal(signal.SIGCONT)
        yield rig.follow()
        mark("again")
        yield rig.moved(0.002)
        mark("end")

    try:
        assert rig.run(story)
    finally:
        relay.close()
    held = travel(rig, marks["cut"], marks["follows"])
    print(
        f"cut for 1 s: holds after {rig.took(marks['cut'], marks['held']):.0f} ms, "
        f"follows {rig.took(marks['uncut'], marks['follows']):.0f} ms after it;",
        held,
    )

    did = marks["did"]
    print(
        f"5 % loss, 50 ms, damage: of {did['taken']} datagrams {did['lost']} lost, "
        f"{did['corrupted']} damaged, {did['reordered']} late;",
        going_on(rig, marks["bad"], marks["good"]),
    )
    assert min(did[what] for what in ("lost", "corrupted", "reordered")) > 0

    old, new = marks["counts"], marks["counts after"]
    print(
        f"strangers without our keys: {sorted(set(peers))} connected, "
        f"{new['malformed'] - old['malformed']} bad frames;",
        going_on(rig, marks["intruders"], marks["left"]),
        cycle_text(rig.side.work),
    )
    assert set(peers) == {"dual-proxy haptic"}
    for verdict in ("malformed", "replayed", "other_session"):
        assert new[verdict] == old[verdict]

    stopped = travel(rig, marks["stopped"], marks["again"])
    lost = rig.holds.index("no_link", marks["stopped"])
    start = rig.side.events._start
    told = next(
        start + event.time - rig.times[marks["stopped"]]
        for event in rig.side.events.all
        if start + event.time > rig.times[marks["stopped"]] and event.kind == "link"
    )
    print(
        f"haptic side stopped for 5 s: holds after "
        f"{rig.took(marks['stopped'], lost):.0f} ms, said after {1e3 * told:.0f} ms, "
        f"follows {rig.took(marks['resumed'], marks['again']):.0f} ms after it;",
        stopped,
    )
    assert told < 3


def test_messages_that_are_forged_and_clocks_that_jump(port, start):
    """Without keys, in contact: ten thousand frames a second, recorded ones and others;
    then the haptic process starts again with another clock, which jumps."""
    options = ("--device", "simulated", "--connect", f"127.0.0.1:{port}", "--insecure")
    haptic = start("haptic", *options, clock=1e6)
    rig = Rig(port, scenario=PRESS)
    record = Record(rig)
    marks = {}

    def mark(name):
        marks[name] = rig.mark()

    def story(rig):
        yield rig.contact(haptic.press)
        record.on = True
        yield rig.passed(0.3)
        record.on = False
        marks["counts"] = rig.link.statistics()
        mark("flood")
        with intruder(port, forged(record.frames)):
            yield rig.passed(2)
            mark("dry")
        marks["counts after"] = rig.link.statistics()
        yield rig.contact(haptic.press)
        mark("killed")
        haptic.kill()
        yield rig.hold("no_link")
        mark("held")
        haptic.start(clock=-1e6)
        yield rig.follow()
        mark("restarted")
        yield rig.passed(0.5)
        for jump in (5, -5):
            yield rig.contact(haptic.press)
            mark(jump)
            jumps = rig.link.statistics()["clock_jumps"]
            haptic.tell(f"clock {jump}")
            yield lambda n=jumps: rig.link.statistics()["clock_jumps"] > n
            yield rig.passed(0.5)
            yield rig.follow()
            mark(f"{jump} over")
        yield rig.moved(0.002)
        mark("end")

    assert rig.run(story)
    old, new = marks["counts"], marks["counts after"]
    came = {
        name: new[name] - old[name]
        for name in ("accepted", "malformed", "replayed", "other_session")
    }
    print(
        f"10000 forged frames a second for 2 s: {came};",
        going_on(rig, marks["flood"], marks["dry"]),
        cycle_text(rig.side.work),
    )
    for name in ("malformed", "replayed", "other_session"):
        assert came[name] > 0
    print(
        f"haptic side killed, started with a clock 2e6 s behind: holds after "
        f"{rig.took(marks['killed'], marks['held']):.0f} ms, follows "
        f"{rig.took(marks['held'], marks['restarted']):.0f} ms after it is started;",
        travel(rig, marks["killed"], marks["restarted"]),
    )
    for jump in (5, -5):
        begin, end = marks[jump], marks[f"{jump} over"]
        held = [i for i in range(begin, end) if rig.holds[i] != "none"]
        text = "goes on"
        if held:
            text = (
                f"holds after {rig.took(begin, held[0]):.0f} ms, for "
                f"{rig.took(held[0], held[-1]):.0f} ms"
            )
        print(
            f"clock of the haptic side jumps by {jump} s: {text};",
            going_on(rig, begin, end),
        )


class RobotLog:
    """What a robot side's process did, by its log."""

    def __init__(self, path):
        _, cycles = read_side_log(path, {"robot": ROBOT_COLUMNS})
        model = PandaModel(1e-3)
        column = ROBOT_COLUMNS.index
        self.times, self.places, self.forces, self.kinds = [], [], [], []
        for cycle in cycles:
            values = cycle.values
            self.times.append(values[0])
            self.places.append(model.calc(values[1:8], np.zeros(7)).p_BE)
            self.forces.append(values[column("fx") : column("fz") + 1])
            self.kinds.append(cycle.kinds)
        # It begins in the air, where it feels the tool's weight alone.
        self.places = np.array(self.places)
        weight = np.mean(self.forces[:100], axis=0)
        self.forces = np.linalg.norm(self.forces - weight, axis=1)

    def before(self, time):
        """The last cycle before it."""
        return int(np.searchsorted(self.times, time)) - 1

    def first(self, kind, begin):
        """The cycle before which something of a kind happened."""
        return next(
            (i for i in range(begin, len(self.kinds)) if kind in self.kinds[i]), None
        )


def test_a_robot_side_that_stalls_is_killed_and_starts_again(port, start):
    """The hand is here, and the robot's process is held up for 10 ms, for 100 ms, and
    killed."""
    robot = start(
        *("robot", "--arm", "simulated", "--yes"),
        *("--listen", f"127.0.0.1:{port}", "--insecure"),
    )
    rig = HapticRig(port, PRESS)
    marks, stalls = {}, {}

    def mark(name):
        marks[name] = rig.mark()

    def stall(milliseconds):
        robot.signal(signal.SIGSTOP)
        stalls[milliseconds] = time.monotonic()
        time.sleep(1e-3 * milliseconds)
        robot.signal(signal.SIGCONT)

    def story(rig):
        yield rig.contact(rig.hand.press)
        yield rig.passed(1.5)
        for milliseconds in (10, 100):
            mark(milliseconds)
            stall(milliseconds)
            yield rig.passed(1)
            yield rig.contact(rig.hand.press)
        mark("killed")
        robot.kill()
        yield rig.let_go()
        mark("let go")
        yield rig.alone()
        robot.start()
        yield rig.follow()
        mark("back")
        yield rig.passed(1)
        yield rig.follow()
        mark("end")

    assert rig.run(story)
    before = rig.force_before(marks["killed"])
    log = RobotLog(robot.logs[0])
    for milliseconds, stalled in stalls.items():
        begin = log.before(stalled)
        recovered = log.first("recovered", begin)
        if recovered is not None and log.times[recovered] > stalled + 1:
            recovered = None
        end = begin + 300 if recovered is None else recovered
        text = "goes on"
        if recovered is not None:
            text = f"follows after {1e3 * (log.times[end] - stalled):.0f} ms"
        went = np.linalg.norm(log.places[begin:end] - log.places[begin], axis=1)
        pressed = log.forces[begin - 300 : begin].max()
        most = log.forces[begin : end + 300].max()
        print(
            f"robot side stalled for {milliseconds} ms: {text}, "
            f"{1e3 * went.max():.2f} mm; {pressed:.1f} N before, {most:.1f} N at most"
        )
        assert went.max() < TRAVEL + 0.5 * HAND_SPEED  # The hand slides.
        assert most < 1.5 * pressed
        assert milliseconds == 10 or recovered is not None
    kick = rig.most_force(marks["back"] - 10)
    print(
        f"robot side killed: {before:.1f} N on the hand before, none after "
        f"{rig.took(marks['killed'], marks['let go']):.0f} ms; {kick:.2f} N at most in "
        "the second after it follows again"
    )
    assert rig.most_force(marks["killed"], marks["let go"]) < 1.5 * before
    assert rig.most_force(marks["let go"]) < before


def test_keys_of_another_authority(keys, start):
    """Each side says what may be wrong, and the robot does not move."""
    port = free_port()
    haptic = start(
        *("haptic", "--device", "simulated", "--keys", keys / "others" / "haptic"),
        *("--connect", f"127.0.0.1:{port}"),
    )
    robot = start(
        *("robot", "--arm", "simulated", "--yes"),
        *("--listen", f"127.0.0.1:{port}", "--keys", keys / "ours" / "robot"),
    )
    said = "its keys were not made together with these"
    end = time.monotonic() + 20
    while not (robot.says(said) and haptic.says(said)):
        assert time.monotonic() < end, (robot.said, haptic.said)
        time.sleep(0.01)
    for process in (robot, haptic):
        ready = process.says("started")
        print(
            f"keys of another authority: said {1e3 * (process.says(said) - ready):.0f} "
            "ms after its start"
        )
    robot.kill()
    log = RobotLog(robot.logs[0])
    went = np.linalg.norm(log.places - log.places[0], axis=1).max()
    print(f"{1e3 * went:.2f} mm in {log.times[-1] - log.times[0]:.1f} s")
    assert went < TRAVEL
    assert log.first("follow", 0) is None
