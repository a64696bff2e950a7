# SPDX-License-Identifier: BSD-3-Clause
"""The robot side as a process: an arm, its sensor, RobotCycle, the link.

    arm.read -> link.receive -> sensor.read -> RobotCycle -> arm.write -> link.send

Nothing moves before somebody has confirmed it. Whatever goes wrong, the arm holds
its place or has stopped by itself, and follows again from where it is.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dual_proxy._core import (
    DriverError,
    ForceTorqueAdapterParams,
    LinkFrame,
    PoseMessage,
    RobotCycle,
    make_hardware_defaults,
)
from dual_proxy.hardware.arms import Arm, ArmFault, ArmReading
from dual_proxy.hardware.events import CycleTimes, Events
from dual_proxy.hardware.side_log import SideLog, read_side_log
from dual_proxy.link.message_link import MessageLink
from dual_proxy.panda import PandaModel, p_SE_S
from dual_proxy.scenario import Scenario
from dual_proxy.settings import dump_yaml, parse_yaml

__all__ = [
    "Replayed",
    "RobotSideProcess",
    "replay_robot_side",
]

#: Of a cycle in the log.
ROBOT_COLUMNS = (
    "time",
    *(f"{name}{i}" for name in ("q", "v", "received_torque") for i in range(1, 8)),
    *("sensor_time", "sensor_valid", "hold"),
    *("fx", "fy", "fz", "mx", "my", "mz"),
    *(f"torque{i}" for i in range(1, 8)),
)

#: s: between two attempts to make an arm ready again, and how many in a row.
_RECOVERY_PAUSE = 0.5
_RECOVERIES = 5
#: rad/s: slower than this an arm that is asked to end is at rest; s: at the latest.
_REST = 0.005
_REST_TIME = 2.0
#: s: a cycle that comes later than this is told.
_STALL = 0.02

_HOLDS = {
    "no_link": "no link: it holds its place",
    "no_sensor": "no force sensor to rely on: it holds its place",
    "asked": "it is asked to hold its place",
    "bad_inputs": "inputs that cannot be: it brakes",
    "none": "it follows the hand",
}


def make_cycle(
    scenario: Scenario, adapter: ForceTorqueAdapterParams, tool_mass: float
) -> RobotCycle:
    """Return the cycle of a scenario's robot side on a real Panda."""
    return RobotCycle(
        side=make_hardware_defaults(scenario.robot_side_params()),
        model=PandaModel(tool_mass, scenario.scene.gravity).arm_params,
        sensor=adapter,
        p_SE=p_SE_S,
    )


def make_seeds(scenario: Scenario) -> tuple[int, int]:
    """Return the seeds of the filters of forces and of moments."""
    return scenario.calc_seed("filter"), scenario.calc_seed("angular_filter")


class RobotSideProcess:
    """Runs the robot side on an arm.

    Parameters
    ----------
    scenario : gains, limits and map; its surfaces and operator play no part.
    arm : opened by `run`.
    link : to the haptic side, or None: the arm holds its place.
    sensor : at its wrist, with open, read and close, as RdtSensor; None: the arm's own.
    adapter : of that sensor; its `period` is the scenario's, and it learns the bias.
    tool_mass : kg, beyond the flange: of the model, and by default of the adapter.
    confirm : asked once before the arm is started; False: it is not.
    log : MCAP file of all that comes in and goes out, for `replay_robot_side`.
    """

    def __init__(
        self,
        scenario: Scenario,
        arm: Arm,
        link: MessageLink | None,
        *,
        sensor: Any = None,
        adapter: ForceTorqueAdapterParams | None = None,
        tool_mass: float | None = None,
        confirm: Callable[[str], bool] = lambda _: False,
        events: Events | None = None,
        log: Path | None = None,
    ) -> None:
        mass = scenario.scene.tool_mass if tool_mass is None else tool_mass
        if adapter is None:
            adapter = ForceTorqueAdapterParams(
                tool_mass=mass, tool_com=scenario.sensor.tool_com, tare=True
            )
        adapter.period = scenario.control_period
        self._model = PandaModel(mass, scenario.scene.gravity)
        self.params = make_hardware_defaults(scenario.robot_side_params())
        self._cycle = make_cycle(scenario, adapter, mass)
        self._seeds = make_seeds(scenario)
        self.state = self._cycle.make_state(*self._seeds)
        self._arm = arm
        self._link = link
        self._sensor = sensor
        self._confirm = confirm
        self.events = events or Events("robot")
        self.work = CycleTimes()
        self._message: Any = PoseMessage()
        self._stop = False
        self._hold = ""
        self._trouble = ""
        self._fault = ""
        self.on_cycle: Callable[[float, ArmReading, Any], None] | None = None
        """Called after each cycle with its time, the arm's and the sensor's reading."""
        self._log: SideLog | None = None
        if log is not None:
            config = {
                "scenario": scenario.to_yaml(),
                "adapter": dump_yaml(_plain(adapter)),
                "tool_mass": repr(float(mass)),
            }
            self._log = SideLog(log, "robot", config, ROBOT_COLUMNS)
            self.events.also(self._log.event)

    def stop(self) -> None:
        """Have `run` come to rest and end; for signal handlers and other threads."""
        self._stop = True

    def run(self, duration: float = math.inf) -> bool:
        """Run until `stop`, or for so long, s; return whether the arm ended at rest.

        Raises
        ------
        DriverError
            If arm or sensor cannot be opened: nothing has moved.
        """
        sensor = self._sensor
        try:
            self._arm.open()
            if sensor is not None:
                sensor.open()
            if not self._is_confirmed():
                self.events.add("refused", "nobody confirmed; nothing was moved")
                return False
            return self._control(time.monotonic() + duration)
        finally:
            self._arm.close()
            if sensor is not None:
                sensor.close()
            if self._log is not None:
                self._log.close()

    def _is_confirmed(self) -> bool:
        reading = self._arm.look()
        limits = self.params.controller.joint_limits
        outside = [
            i + 1
            for i, q in enumerate(reading.q)
            if not limits.lower[i] <= q <= limits.upper[i]
        ]
        if outside:
            self.events.add(
                "refused", f"joint {outside[0]} is beyond its limits; guide it back"
            )
            return False
        p = self._model.calc(reading.q, np.zeros(7)).p_BE
        return self._confirm(
            f"The tool point is at {np.round(p, 3).tolist()} m and touches nothing, "
            "the workspace is clear, a hand is on the stop: start?"
        )

    def _control(self, end: float) -> bool:
        failures = 0
        while True:
            try:
                self._arm.start()
                self.events.add("started", "the arm takes torques")
                return self._follow(end)
            except ArmFault as fault:
                self.events.add("fault", str(fault))
            if self._stop:
                return False
            while True:
                failures = failures + 1 if self._since_start() < 1 else 1
                if failures > _RECOVERIES:
                    self.events.add("ended", "the arm cannot be made ready again")
                    return False
                time.sleep(_RECOVERY_PAUSE)
                try:
                    self._arm.recover()
                    break
                except ArmFault as fault:
                    self.events.add("fault", str(fault))
            # From where it is now, with what it knows of the sensor.
            self._cycle.restart(self.state, *self._seeds)
            self.events.add("recovered", "it follows from where it is")

    def _since_start(self) -> float:
        started = [event for event in self.events.all if event.kind == "started"]
        now = self.events.all[-1].time
        return now - started[-1].time if started else 0.0

    def _follow(self, end: float) -> bool:
        arm, link, cycle, state = self._arm, self._link, self._cycle, self.state
        sensor = arm.wrench if self._sensor is None else self._sensor.read
        resting_until = math.inf
        last = -math.inf
        while True:
            reading = arm.read()
            now = time.monotonic()
            if now - last > _STALL and last > 0:
                self.events.add("stall", f"{1e3 * (now - last):.0f} ms between cycles")
            last = now
            flags = 0
            newest = None
            if link is not None:
                newest = link.receive(now)
                if newest is not None:
                    self._message = newest
                flags = link.flags
            wrench = sensor()
            if self._stop or now >= end:
                resting_until = min(resting_until, now + _REST_TIME)
            ending = resting_until < math.inf
            holds = ending or bool(flags & LinkFrame.FAULT)
            cycle.update(
                now,
                reading.q,
                reading.v,
                self._message,
                state,
                sensor_time=wrench.time,
                sensor_valid=wrench.valid,
                measured=wrench.value,
                received_torque=reading.received_torque,
                hold=holds,
            )
            resting = ending and (
                now >= resting_until or float(np.abs(reading.v).max()) < _REST
            )
            arm.write(state.torque, resting)
            if resting:
                self.events.add("ended", self.work.text())
                return True
            hold = state.side.hold
            if link is not None:
                holding = LinkFrame.HOLDING if hold != "none" else 0
                link.send(now, state.message, holding)
                self._tell_trouble(link.trouble(now))
            if hold != self._hold:
                self._hold = hold
                self.events.add("hold" if hold != "none" else "follow", _HOLDS[hold])
            if self._log is not None:
                self._write(now, reading, newest, wrench, holds)
            if self.on_cycle is not None:
                self.on_cycle(now, reading, wrench)
            self.work.add(time.monotonic() - now)

    def _write(
        self, now: float, reading: ArmReading, newest: Any, wrench: Any, holds: bool
    ) -> None:
        log, state = self._log, self.state
        assert log is not None
        if newest is not None:
            log.message(now, newest)
        log.cycle(
            now,
            (
                (now,),
                reading.q,
                reading.v,
                reading.received_torque,
                (wrench.time, wrench.valid, holds),
                wrench.value,
                state.torque,
            ),
        )
        if log.wants_state(now):
            side = state.side
            log.state(
                now,
                {
                    "position": state.pose.p.tolist(),
                    "proxy_position": side.proxy_position.tolist(),
                    "force": state.sensor.wrench[:3].tolist(),
                    "reference_force": side.reference_force.tolist(),
                    "torque": state.torque.tolist(),
                    "dimension": side.filter.dimension,
                    "hold": side.hold,
                    "link_age": side.link.age,
                },
            )

    def _tell_trouble(self, trouble: str) -> None:
        # The text counts seconds: what is told is that it began.
        if bool(trouble) != bool(self._trouble):
            self.events.add("link", trouble or "the haptic side is there")
        self._trouble = trouble


def _plain(params: Any) -> dict[str, Any]:
    return {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in params.__getstate__().items()
    }


@dataclass(frozen=True)
class Replayed:
    """What became of a log that was played back.

    Attributes
    ----------
    cycles : played.
    different : of them, those whose torque is not what was logged, bit for bit.
    largest : N m, the largest difference.
    seconds : from the first to the last.
    """

    cycles: int
    different: int
    largest: float
    seconds: float


def replay_robot_side(path: Path) -> Replayed:
    """Play a robot side's log back through the same cycle.

    Raises
    ------
    DriverError
        If the file cannot be read, or is another log.
    """
    config, cycles = read_side_log(path)
    if config["side"] != "robot":
        raise DriverError(f"{path}: expected the log of a robot side")
    text = parse_yaml(config["scenario"], str(path))
    (name,) = text
    scenario = Scenario.from_mapping(name, text[name])
    adapter = ForceTorqueAdapterParams(**parse_yaml(config["adapter"], str(path)))
    cycle = make_cycle(scenario, adapter, float(config["tool_mass"]))
    seeds = make_seeds(scenario)
    state = cycle.make_state(*seeds)
    message: Any = PoseMessage()
    count = different = 0
    largest = 0.0
    first = last = None
    for logged in cycles:
        values = list(logged.values.values())
        now = values[0]
        first, last = now if first is None else first, now
        if "recovered" in logged.kinds:
            cycle.restart(state, *seeds)
        if logged.message is not None:
            message = logged.message
        cycle.update(
            now,
            values[1:8],
            values[8:15],
            message,
            state,
            sensor_time=values[22],
            sensor_valid=bool(values[23]),
            measured=values[25:31],
            received_torque=values[15:22],
            hold=bool(values[24]),
        )
        count += 1
        difference = float(np.abs(state.torque - values[31:38]).max())
        different += difference != 0
        largest = max(largest, difference)
    return Replayed(count, different, largest, (last or 0.0) - (first or 0.0))
