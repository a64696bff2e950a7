# SPDX-License-Identifier: BSD-3-Clause
"""What a side does whose log, terminal or options are wrong."""

import contextlib
import errno
import os
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from free_port import free_port

import dual_proxy as dp
from dual_proxy.cli import main
from dual_proxy.hardware.arms import ArmFault, FrankaArm, SimulatedPanda
from dual_proxy.hardware.events import Events
from dual_proxy.hardware.robot_side import RobotSideProcess

SILENT = {"tell": lambda _: None}


def robot_side(**options):
    scenario = dp.load_scenario("plane")
    arm = SimulatedPanda(scenario, patience=0.4)
    events = Events("robot", **SILENT)
    return RobotSideProcess(
        scenario, arm, None, confirm=lambda _: True, events=events, **options
    )


def test_a_log_that_cannot_be_written_ends_the_run_at_rest(tmp_path):
    side = robot_side(log=tmp_path / "log.mcap")

    def fill_disk(*_):
        if side.work.count == 200:

            def fail(*_):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

            side._log._writer.add_message = fail

    side.on_cycle = fill_disk
    with pytest.raises(dp.DriverError, match=r"log\.mcap: No space left on device"):
        side.run(20)
    assert side.events.count("fault") == 1
    assert side.events.all[-1].kind == "ended"
    assert np.abs(side.state.torque).max() < 5


def test_nothing_is_left_of_a_run_that_did_not_begin(tmp_path):
    log = tmp_path / "log.mcap"
    side = robot_side(log=log)
    side._confirm = lambda _: False
    assert side.run(1) is False
    assert not log.exists()


def test_gains_that_an_arm_does_not_get_are_told_before_it_starts():
    side = robot_side()
    told = []
    side._confirm = lambda _: told.extend(side.events.all)
    assert not side.run(1)
    assert [event.text.split(",")[0] for event in told if event.kind == "gains"] == [
        "controller.force_gain 0.5 in place of the scenario's 1"
    ]


def test_an_arm_that_stops_while_it_ends_is_not_started_again():
    side = robot_side()

    def stall(*_):
        if side.work.count == 100:
            side.stop()
            time.sleep(0.5)

    side.on_cycle = stall
    assert side.run() is False
    assert [e.text for e in side.events.all][-1] == "the arm has stopped by itself"
    assert side.events.count("started") == 1


def test_a_terminal_that_does_not_take_a_line_holds_up_nothing(monkeypatch):
    """A pipe that nobody reads, or Ctrl-S. What fits when it goes on is told then."""
    end, start = os.pipe()
    os.set_blocking(start, False)
    filled = 0
    with contextlib.suppress(BlockingIOError):
        while True:
            filled += os.write(start, b"x" * 1024)
    os.set_blocking(start, True)
    with os.fdopen(start, "w") as stream, os.fdopen(end, "rb") as reader:
        monkeypatch.setattr(sys, "stderr", stream)
        events = Events("robot")
        for i in range(2000):
            events.add("hold", f"number {i}")
        reader.read(filled)
        events.add("hold", "the last")
        stream.close()
        told = reader.read().decode().splitlines()
    assert "number 1001" in told[0]  # All that are kept, the newest.
    assert "the last" in told[-1]
    assert events.count("hold") == 2001


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("tool_mass: 20", "`tool_mass` expected kg in [0.001, 3], got 20"),
        ("tare: false", "`tool_mass` expected kg in [0.001, 3], got 0"),
        ("", "expected `field: value` in each line"),
        ("[1, 2]", "expected `field: value` in each line"),
        ("{tool_mass: 1, tool_com: [0, 0, 50]}", "`tool_com` expected m in [-1, 1]"),
    ],
)
def test_a_tool_that_cannot_be(tmp_path, capsys, text, wanted):
    tool = tmp_path / "tool.yaml"
    tool.write_text(text)
    command = ["robot-side", "plane", "--arm", "simulated", "--insecure"]
    command += ["--listen", "127.0.0.1:7447", "--tool", str(tool)]
    assert main(command) == 2
    assert capsys.readouterr().err.count("--tool:") == 1
    command[-1] = "/dev/zero"
    assert main(command) == 2
    assert "/dev/zero: expected a file" in capsys.readouterr().err


def test_the_arm_is_told_the_tool_of_the_file(tmp_path, monkeypatch):
    pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")
    tool = tmp_path / "tool.yaml"
    tool.write_text("{tool_mass: 0.7, tool_com: [0.01, -0.02, 0.06]}")
    loads = []

    def note(self):
        loads.append(self.params.load)
        raise dp.DriverError("that is all")

    monkeypatch.setattr(FrankaArm, "open", note)
    command = ["robot-side", "plane", "--arm", "arm.lab", "--insecure", "--yes"]
    command += ["--listen", f"127.0.0.1:{free_port()}", "--tool", str(tool)]
    assert main(command) == 3
    (load,) = loads
    assert load.mass == 0.7
    assert load.com.tolist() == [0.01, -0.02, 0.06]


@pytest.mark.parametrize("side", ["robot", "haptic"])
def test_a_scheme_that_hardware_cannot_have(capsys, side):
    what = "--arm" if side == "robot" else "--device"
    command = [f"{side}-side", "plane", what, "simulated", "--insecure"]
    command += ["--listen", "127.0.0.1:7447", "--set", "scheme=tdpa"]
    assert main(command) == 2
    assert (
        "scheme: expected one of dual_proxy, position_force, model_mediated on "
        "hardware, got tdpa" in capsys.readouterr().err
    )


def test_a_log_that_is_there_and_options_of_another_device(tmp_path, capsys):
    log = tmp_path / "log.mcap"
    log.touch()
    command = ["haptic-side", "plane", "--device", "simulated", "--insecure"]
    command += ["--connect", "127.0.0.1:7447"]
    assert main([*command, "--log", str(log)]) == 2
    assert f"--log: {log}: File exists" in capsys.readouterr().err
    assert main([*command, "--homing"]) == 2
    assert "expected with --device omega only" in capsys.readouterr().err


def test_an_arm_that_is_not_open():
    arm = FrankaArm(dp.FrankaRobotSideParams(host="arm.lab"))
    for call in (arm.look, arm.start, arm.read, lambda: arm.write(np.zeros(7))):
        with pytest.raises(ArmFault, match=r"arm at arm\.lab: it is not open"):
            call()


def test_the_program_of_the_guide(capsys):
    page = Path(__file__).parents[2] / "docs/hardware.md"
    program = page.read_text().partition("```python\n")[2].partition("```")[0]
    exec(program, {})
    assert "cycles: median" in capsys.readouterr().out


@pytest.mark.parametrize("place", [60, 4000])
def test_a_damaged_log(tmp_path, capsys, place):
    log = tmp_path / "log.mcap"
    robot_side(log=log).run(0.2)
    data = bytearray(log.read_bytes())
    data[place] ^= 0xFF
    log.write_bytes(data)
    assert main(["run", "--replay", str(log)]) == 2
    assert "log.mcap: it is damaged" in capsys.readouterr().err
