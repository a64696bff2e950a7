# SPDX-License-Identifier: BSD-3-Clause
"""Sides' logs, played back."""

import math
import time
from dataclasses import replace

import numpy as np
import pytest

import dual_proxy as dp
from dual_proxy.cli import main
from dual_proxy.hardware import replay
from dual_proxy.hardware.arms import ArmFault, SimulatedPanda
from dual_proxy.hardware.devices import SimulatedHand
from dual_proxy.hardware.events import Events
from dual_proxy.hardware.haptic_side import HAPTIC_COLUMNS, HapticSideProcess
from dual_proxy.hardware.robot_side import RobotSideProcess, make_cycle, make_seeds
from dual_proxy.hardware.side_log import read_side_log
from dual_proxy.panda import PandaModel


class RobotBehindLink:
    """A MessageLink whose other side, and its arm, go on by a period a read."""

    flags, reasons = 0, ""

    def __init__(self, scenario):
        self._arm = SimulatedPanda(scenario)
        self._arm.start()
        adapter = dp.ForceTorqueAdapterParams(
            tool_mass=scenario.scene.tool_mass,
            tool_com=scenario.sensor.tool_com,
            tare=True,
        )
        model = PandaModel(scenario.scene.tool_mass)
        self._cycle = make_cycle(scenario, adapter, model)
        self._state = self._cycle.make_state(*make_seeds(scenario))
        self._message = dp.PoseMessage()
        self.follows = lambda now: True

    def receive(self, now):
        reading, wrench = self._arm.look(), self._arm.wrench()
        self._cycle.update(
            now,
            reading.q,
            reading.v,
            self._message,
            self._state,
            sensor_time=now,
            sensor_valid=True,
            measured=wrench.value,
            received_torque=reading.received_torque,
        )
        self._arm.write(self._state.torque)
        return self._state.message

    def send(self, now, message, flags):
        self._message = message

    def trouble(self, now):
        return ""


class Hand(SimulatedHand):
    """Is unplugged for a while, and presses the clutch for a while."""

    def __init__(self, scenario, unplugged, clutch):
        super().__init__(scenario)
        self._unplugged, self._clutch = unplugged, clutch
        self._begin = None

    def open(self):
        if self._within(self._unplugged):
            raise dp.DriverError("nothing is plugged in")
        if self._begin is None:
            self._begin = time.monotonic()
        super().open()

    def read(self):
        reading = super().read()
        return replace(
            reading,
            valid=not self._within(self._unplugged),
            clutch=self._within(self._clutch),
        )

    def _within(self, times):
        begin, end = times
        elapsed = 0 if self._begin is None else time.monotonic() - self._begin
        return begin <= elapsed < end


def quiet(side):
    return Events(side, tell=lambda _: None)


def test_a_haptic_sides_log_gives_the_same_again(tmp_path, capsys, monkeypatch):
    """Contact, a device that is unplugged midway, and the clutch."""
    monkeypatch.setattr(HapticSideProcess, "_REOPEN", 0.1)
    way = [
        {"time": t, "position": [0.45, 0.0, z]}
        for t, z in ((0.0, 0.48), (0.6, 0.48), (1.6, 0.37))
    ]
    scenario = dp.load_scenario("plane").with_overrides({"operator.waypoints": way})
    log = tmp_path / "log.mcap"
    events = quiet("haptic")
    side = HapticSideProcess(
        scenario,
        Hand(scenario, unplugged=(1.8, 2.1), clutch=(2.4, 2.6)),
        RobotBehindLink(scenario),
        events=events,
        log=log,
    )
    forces = []
    side.on_cycle = lambda *_: forces.append(np.linalg.norm(side.state.device_wrench))
    assert side.run(2.8)
    assert [e.text for e in events.all if e.kind == "clutch"] == ["pressed", "let go"]
    assert "nothing is plugged in" in [e.text for e in events.all]
    assert max(forces) > 1
    print(f"{len(forces)} cycles, {max(forces):.1f} N at most;", events.all[-1].text)

    played = replay.replay_side(log)
    assert (played.side, played.cycles, played.different) == ("haptic", len(forces), 0)
    assert main(["run", "--replay", str(log)]) == 0
    printed = capsys.readouterr().out
    assert f"haptic side: {len(forces)} cycles" in printed
    assert "every wrench and message is what was logged, bit for bit" in printed
    # Up to where it was cut.
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(log.read_bytes()[: log.stat().st_size * 3 // 4])
    played = replay.replay_side(cut)
    assert 100 < played.cycles < len(forces)
    assert played.different == 0

    # It is what was logged that counts: here without the clutch.
    handle_of = replay.handle_of

    def without_clutch(values):
        return replace(handle_of(values), clutch=False)

    monkeypatch.setattr(replay, "handle_of", without_clutch)
    assert replay.replay_side(log).different > 100
    assert main(["run", "--replay", str(log)]) == 3
    assert "cycles have another wrench or message" in capsys.readouterr().err


def test_of_a_device_that_fails_no_force_is_logged(tmp_path):
    scenario = dp.load_scenario("plane")
    log = tmp_path / "log.mcap"
    hand = Hand(scenario, unplugged=(0.1, math.inf), clutch=(0, 0))
    side = HapticSideProcess(scenario, hand, None, events=quiet("haptic"), log=log)
    assert side.run(0.3)
    _, cycles = read_side_log(log, {"haptic": HAPTIC_COLUMNS})
    rows = np.array([cycle.values for cycle in cycles])
    good = rows[:, HAPTIC_COLUMNS.index("good")] == 1
    assert 0 < good.sum() < len(rows)
    assert (rows[~good][:, HAPTIC_COLUMNS.index("fx") : -1] == 0).all()
    assert replay.replay_side(log).different == 0
    with pytest.raises(dp.DriverError, match="expected the log of a robot side"):
        read_side_log(log, {"robot": ()})


def test_a_torque_that_the_arm_refuses_is_logged_too(tmp_path, monkeypatch):
    """Else what the side knows of its sensor is not what it was."""
    scenario = dp.load_scenario("plane")
    arm = SimulatedPanda(scenario, patience=0.4)
    write = arm.write
    count = 0

    def refuse(torque, last=False):
        nonlocal count
        count += 1
        if count == 200:  # While it learns the sensor's bias.
            raise ArmFault("refused")
        write(torque, last)

    monkeypatch.setattr(arm, "write", refuse)
    log = tmp_path / "log.mcap"
    events = quiet("robot")
    side = RobotSideProcess(
        scenario, arm, None, confirm=lambda _: True, events=events, log=log
    )
    assert side.run(1.5)
    assert events.count("recovered") == 1
    played = replay.replay_side(log)
    assert played.cycles == side.work.count + 1
    assert played.different == 0
