# SPDX-License-Identifier: BSD-3-Clause
"""A robot side here, a haptic side in a process of its own, and what goes wrong.

The arm is simulated in real time, and its hand moves on only while the robot follows.
Machines that run tests are busy: times are printed, and what is asserted has room.
"""

import math
import signal
import socket
import subprocess
import sys
import time
from types import SimpleNamespace

import numpy as np
import pytest

import dual_proxy as dp
from dual_proxy.cli import main
from dual_proxy.hardware import robot_side
from dual_proxy.hardware.arms import ArmFault, SimulatedPanda
from dual_proxy.hardware.events import Events, cycle_text
from dual_proxy.hardware.replay import replay_side
from dual_proxy.hardware.robot_side import ROBOT_COLUMNS, RobotSideProcess
from dual_proxy.hardware.side_log import SideLog, read_side_log

zenoh = pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")
MessageLink = pytest.importorskip("dual_proxy.link.message_link").MessageLink

# m: what counts as travelling by itself.
TRAVEL = 0.002
# s: for which a busy machine may hold a process up.
BUSY = 0.4
# s: how long a test waits for what is to come, at most.
PATIENCE = 40.0


class HapticProcess:
    def __init__(self, port):
        code = "import sys; from dual_proxy.cli import main; sys.exit(main())"
        options = ["--device", "simulated", "--connect", f"127.0.0.1:{port}"]
        self._command = [
            *(sys.executable, "-c", code, "haptic-side", "plane"),
            *(*options, "--insecure"),
        ]
        self.start()

    def start(self):
        self.process = subprocess.Popen(self._command, stderr=subprocess.DEVNULL)

    def kill(self):
        self.process.kill()
        self.process.wait()


class Rig:
    """Runs a robot side, calls `story` each cycle, and keeps what the arm did."""

    def __init__(self, port, sensor=None, log=None):
        self.scenario = dp.load_scenario("plane")
        self.arm = SimulatedPanda(self.scenario, patience=BUSY)
        self.sensor = sensor
        if sensor is not None:
            sensor.arm = self.arm
        link = MessageLink("robot", listen=f"127.0.0.1:{port}", insecure=True)
        self.link = link
        self.side = RobotSideProcess(
            self.scenario,
            self.arm,
            link,
            sensor=sensor,
            confirm=lambda _: True,
            events=Events("robot", tell=lambda _: None),
            log=log,
        )
        self.times, self.places, self.forces, self.holds = [], [], [], []

    def run(self, story):
        steps = story(self)
        wait = next(steps)
        begin = time.monotonic()

        def on_cycle(now, *_):
            nonlocal wait
            self.times.append(now)
            self.places.append(self.arm.state.pose.p)
            self.forces.append(np.linalg.norm(self.arm.state.contact_truth[:3]))
            self.holds.append(self.side.state.side.hold)
            if now - begin > PATIENCE:
                self.side.stop()
            elif wait():
                try:
                    wait = next(steps)
                except StopIteration:
                    self.side.stop()

        self.side.on_cycle = on_cycle
        with self.link:
            ended = self.side.run()
        # The story came to its end, in time.
        assert next(steps, None) is None, [e.text for e in self.side.events.all]
        return ended

    # What a story waits for.

    def contact(self):
        return lambda: len(self.forces) > 500 and min(self.forces[-500:]) > 2

    def hold(self, *why):
        return lambda: self.holds[-1] in why

    def follow(self):
        return lambda: self.holds[-1] == "none"

    def passed(self, seconds):
        end = time.monotonic() + seconds
        return lambda: time.monotonic() >= end

    def mark(self):
        return len(self.times)

    def travelled(self, begin, end):
        places = np.array(self.places[begin:end])
        return float(np.linalg.norm(places - places[0], axis=1).max())

    def most_force(self, begin, end=None):
        return max(self.forces[begin:end])


@pytest.fixture
def port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


@pytest.fixture
def haptic(port):
    process = HapticProcess(port)
    yield process
    process.kill()


def test_the_robot_never_travels_by_itself(port, haptic):
    """The haptic process is killed in contact and starts again; another time it is
    stopped, and sends on later."""
    rig = Rig(port)
    marks = {}

    def story(rig):
        yield rig.contact()
        marks["killed"] = rig.mark()
        haptic.kill()
        yield rig.hold("no_link")
        yield rig.passed(0.5)
        haptic.start()
        yield rig.follow()
        yield rig.passed(0.1)
        marks["again"] = rig.mark()
        yield rig.contact()
        marks["stopped"] = rig.mark()
        haptic.process.send_signal(signal.SIGSTOP)
        yield rig.passed(2)
        haptic.process.send_signal(signal.SIGCONT)
        yield rig.follow()
        yield rig.passed(0.1)
        marks["resumed"] = rig.mark()

    assert rig.run(story)
    for begin, end in (("killed", "again"), ("stopped", "resumed")):
        travelled = rig.travelled(marks[begin], marks[end])
        print(f"{begin} to {end}: {1e3 * travelled:.2f} mm by itself")
        assert travelled < TRAVEL
    print(f"{rig.most_force(0):.1f} N at most;", cycle_text(rig.side.work))


class Sensor:
    """The arm's own, until it is told otherwise."""

    def __init__(self):
        self.change = None
        self.last = None

    def open(self):
        pass

    def close(self):
        pass

    def read(self):
        wrench = self.arm.wrench()
        if self.change is None:
            self.last = wrench
            return wrench
        return self.change(wrench)


@pytest.mark.parametrize("fault", ["silent", "invalid", "nan"])
def test_without_a_sensor_the_arm_neither_falls_nor_hits(port, haptic, fault):
    sensor = Sensor()
    rig = Rig(port, sensor)
    changes = {
        "silent": lambda wrench: sensor.last,
        "invalid": lambda wrench: SimpleNamespace(
            time=wrench.time, valid=False, value=wrench.value
        ),
        "nan": lambda wrench: SimpleNamespace(
            time=wrench.time, valid=True, value=np.full(6, math.nan)
        ),
    }
    marks = {}

    def story(rig):
        yield rig.contact()
        marks["lost"] = rig.mark()
        sensor.change = changes[fault]
        yield rig.hold("no_sensor")
        marks["held"] = rig.mark()
        yield rig.passed(1)
        marks["back"] = rig.mark()
        sensor.change = None
        yield rig.follow()
        yield rig.passed(1)
        marks["end"] = rig.mark()

    assert rig.run(story)
    took = rig.times[marks["held"]] - rig.times[marks["lost"]]
    before = rig.most_force(marks["lost"] - 500, marks["lost"])
    after = rig.most_force(marks["back"])
    travelled = rig.travelled(marks["lost"], marks["back"])
    print(
        f"{fault}: holds after {1e3 * took:.0f} ms, {1e3 * travelled:.2f} mm, "
        f"{before:.1f} N before, {after:.1f} N after"
    )
    assert travelled < TRAVEL
    assert after < 1.5 * before


def test_an_arm_that_stops_goes_on_from_where_it_is(port, haptic, tmp_path, capsys):
    """A cycle that comes too late is what a real arm stops for. All of it is logged,
    and played back."""
    log = tmp_path / "log.mcap"
    rig = Rig(port, log=log)
    marks = {}

    def story(rig):
        yield rig.contact()
        marks["stalled"] = rig.mark()
        time.sleep(BUSY + 0.05)
        yield rig.passed(0.01)
        yield rig.follow()
        yield rig.passed(0.1)
        marks["again"] = rig.mark()

    assert rig.run(story)
    events = rig.side.events
    assert events.count("fault") >= 1
    assert events.count("recovered") >= 1
    travelled = rig.travelled(marks["stalled"], marks["again"])
    print(f"{1e3 * travelled:.2f} mm by itself", [e.text for e in events.all])
    assert travelled < TRAVEL
    print(f"{rig.most_force(marks['stalled']):.1f} N at most after it")
    with capsys.disabled():
        replayed = replay_side(log)
    assert replayed.cycles == len(rig.times)
    assert replayed.different == 0
    assert main(["run", "--replay", str(log)]) == 0
    assert "bit for bit" in capsys.readouterr().out
    # What a process that is killed leaves behind.
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(log.read_bytes()[: log.stat().st_size // 2])
    replayed = replay_side(cut)
    assert replayed.cycles > 500
    assert replayed.different == 0
    # Wherever it is cut.
    head = log.read_bytes()[:21000]
    whole = []
    for size in range(20000, len(head)):
        cut.write_bytes(head[:size])
        _, cycles = read_side_log(cut, {"robot": ROBOT_COLUMNS})
        whole.append(sum(len(cycle.values) == len(ROBOT_COLUMNS) for cycle in cycles))
    assert whole == sorted(whole)
    assert whole[0] > 5
    assert whole[-1] > whole[0]


def test_nothing_moves_unless_somebody_confirms():
    scenario = dp.load_scenario("plane")
    arm = SimulatedPanda(scenario)
    asked = []
    events = Events("robot", tell=lambda _: None)
    side = RobotSideProcess(
        scenario,
        arm,
        None,
        confirm=lambda text: bool(asked.append(text)),
        events=events,
    )
    q = np.array(arm.state.q)
    assert side.run(1) is False
    assert len(asked) == 1
    assert "0.45, 0.0, 0.48" in asked[0]
    assert events.count("refused") == 1
    assert events.count("started") == 0
    assert (arm.state.q == q).all()


def test_an_arm_that_cannot_be_made_ready_is_given_up(monkeypatch):
    """Also where it ran well before, and where it is made ready but does not start."""
    monkeypatch.setattr(robot_side, "_RECOVERY_PAUSE", 0.001)
    monkeypatch.setattr(robot_side, "_GOOD_TIME", 0.05)
    scenario = dp.load_scenario("plane")
    for broken in ("recover", "start"):
        arm = SimulatedPanda(scenario, patience=BUSY)
        events = Events("robot", tell=lambda _: None)
        side = RobotSideProcess(
            scenario, arm, None, confirm=lambda _: True, events=events
        )

        def fail():
            raise ArmFault("it does not answer")

        def run_well(*_, arm=arm, side=side, broken=broken):
            if side.work.count == 100:
                monkeypatch.setattr(arm, broken, fail)
                arm.close()

        side.on_cycle = run_well
        assert side.run(PATIENCE) is False
        assert events.all[-1].text == "the arm cannot be made ready again"
        assert events.count("fault") == 6  # The first, and five attempts.


def test_a_simulated_arm_stops_as_a_real_one():
    arm = SimulatedPanda(dp.load_scenario("plane"))
    with pytest.raises(ArmFault, match="not started"):
        arm.write(np.zeros(7))
    arm.start()
    arm.read()
    with pytest.raises(ArmFault, match="changed by 2 N m"):
        arm.write(np.full(7, 2.0))
    arm.recover()
    arm.start()
    arm.read()
    with pytest.raises(ArmFault, match="not finite"):
        arm.write(np.full(7, math.nan))


def test_command_line_says_what_is_wrong(port, tmp_path, capsys):
    base = ["robot-side", "plane", "--listen", f"127.0.0.1:{port}", "--insecure"]
    assert main([*base, "--arm", "simulated", "--sensor", "x"]) == 2
    assert capsys.readouterr().err.endswith(
        "--sensor: expected own, rdt:HOST[:PORT] or replay:LOG, got 'x'\n"
    )
    assert main([*base, "--arm", "simulated", "--tool", str(tmp_path / "no")]) == 3
    assert "no: No such file" in capsys.readouterr().err
    assert main([*base, "--arm", "simulated", "--duration", "nan"]) == 2
    assert "--duration: expected seconds > 0, got 'nan'" in capsys.readouterr().err
    assert main(base) == 2
    assert "--arm" in capsys.readouterr().err


def test_a_log_is_never_overwritten_and_no_other_file_is_one(tmp_path, capsys):
    path = tmp_path / "log.mcap"
    path.write_bytes(b"something")
    with pytest.raises(dp.DriverError, match="File exists"):
        SideLog(path, "robot", {}, ["time"])
    assert main(["run", "--replay", str(path)]) == 2
    assert "expected the log of a robot or haptic side" in capsys.readouterr().err
    assert main(["run", "--replay", str(tmp_path / "none")]) == 2
    assert "No such file" in capsys.readouterr().err
    assert main(["run", "plane", "--replay", str(path)]) == 2
    assert main(["run"]) == 2
    assert "expected a scenario" in capsys.readouterr().err
