# SPDX-License-Identifier: BSD-3-Clause
"""A robot side here, a haptic side in a process of its own, and what goes wrong."""

import math
import signal
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
from dual_proxy.hardware.side_process import SideProcess as SideProcessBase

try:
    from rig import BUSY, PATIENCE, TRAVEL, Rig, SideProcess
except ImportError as error:
    pytest.skip(str(error), allow_module_level=True)


@pytest.fixture
def haptic(port, tmp_path):
    process = SideProcess(
        *("haptic", tmp_path, "--device", "simulated"),
        *("--connect", f"127.0.0.1:{port}", "--insecure"),
    )
    process.start()
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
        haptic.signal(signal.SIGSTOP)
        yield rig.passed(2)
        haptic.signal(signal.SIGCONT)
        yield rig.follow()
        yield rig.passed(0.1)
        marks["resumed"] = rig.mark()

    assert rig.run(story)
    for begin, end in (("killed", "again"), ("stopped", "resumed")):
        travelled = rig.travelled(marks[begin], marks[end])
        print(f"{begin} to {end}: {1e3 * travelled:.2f} mm by itself")
        assert travelled < TRAVEL
    print(f"{rig.most_force(0):.1f} N at most;", cycle_text(rig.side.work))


def test_a_haptic_side_of_another_scheme_moves_nothing(port, tmp_path):
    haptic = SideProcess(
        *(
            "haptic",
            tmp_path,
            "--set",
            "scheme=position_force",
            "--device",
            "simulated",
        ),
        *("--connect", f"127.0.0.1:{port}", "--insecure"),
    )
    haptic.start()
    rig = Rig(port)

    def story(rig):
        yield lambda: haptic.says(
            "the robot side has scheme dual_proxy, this one position_force"
        )
        yield rig.passed(0.3)

    try:
        assert rig.run(story)
    finally:
        haptic.kill()
    assert "none" not in rig.holds
    said = "the haptic side has scheme position_force, this one dual_proxy"
    assert any(event.text.startswith(said) for event in rig.side.events.all)


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


def test_trouble_is_told_when_it_begins_changes_and_ends():
    """Who waits is told of the port first, and of keys when something is there."""
    link = SimpleNamespace(send=lambda *_: None)
    events = Events("haptic", tell=lambda _: None)
    side = SideProcessBase("haptic", link, events, None, {}, ())
    for now, trouble in (
        (0.0, ""),
        (2.0, "no robot side for 2 s, connecting to a:1: its port"),
        (3.0, "no robot side for 3 s, connecting to a:1: its port"),
        (3.5, "no robot side for 4 s, connecting to a:1: its keys"),
        (4.5, "no robot side for 4 s, connecting to a:1: its keys"),
        (5.0, ""),
    ):
        link.trouble = lambda _, trouble=trouble: trouble
        link.reasons = trouble.partition(": ")[2]
        side._send(now, None, 0)
    assert [event.text for event in events.all] == [
        "no robot side for 2 s, connecting to a:1: its port",
        "no robot side for 4 s, connecting to a:1: its keys",
        "the robot side is there",
    ]


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
    assert main([*base, "--arm", "simulated", "--tool", str(tmp_path / "no")]) == 2
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
