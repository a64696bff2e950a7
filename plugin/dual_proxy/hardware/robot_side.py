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
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dual_proxy._core import (
    ForceTorqueAdapterParams,
    LinkFrame,
    RobotCycle,
    make_hardware_defaults,
)
from dual_proxy.hardware.arms import Arm, ArmFault, ArmReading, Wrench
from dual_proxy.hardware.events import Events, cycle_text
from dual_proxy.hardware.side_log import SideLog, message_digest
from dual_proxy.hardware.side_process import SideProcess
from dual_proxy.panda import PandaModel, p_SE_S
from dual_proxy.scenario import Scenario
from dual_proxy.settings import dump_yaml

if TYPE_CHECKING:
    from dual_proxy.link.message_link import MessageLink

__all__ = ["ROBOT_COLUMNS", "RobotSideProcess", "make_cycle", "make_seeds", "wrench_of"]

#: Of a cycle in the log.
ROBOT_COLUMNS = (
    "time",
    *(f"{name}{i}" for name in ("q", "v", "received_torque") for i in range(1, 8)),
    *("sensor_time", "sensor_valid", "hold"),
    *("fx", "fy", "fz", "mx", "my", "mz"),
    *(f"torque{i}" for i in range(1, 8)),
    "sent",
)

#: s: between two attempts to make an arm ready again, how many in a row, and s for
#: which it has to take torques to begin a new row.
_RECOVERY_PAUSE = 0.5
_RECOVERIES = 5
_GOOD_TIME = 1.0
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


def wrench_of(values: Any) -> Wrench:
    """Return what the sensor measured, of a cycle of a log."""
    return Wrench(float(values[22]), bool(values[23]), values[25:31])


def make_cycle(
    scenario: Scenario, adapter: ForceTorqueAdapterParams, model: PandaModel
) -> RobotCycle:
    """Return the cycle of a scenario's robot side on a real arm."""
    return RobotCycle(
        side=make_hardware_defaults(scenario.robot_side_params()),
        model=model.arm_params,
        sensor=adapter,
        p_SE=p_SE_S,
    )


def make_seeds(scenario: Scenario) -> tuple[int, int]:
    """Return the seeds of the filters of forces and of moments."""
    return scenario.calc_seed("filter"), scenario.calc_seed("angular_filter")


class RobotSideProcess(SideProcess):
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
    log : MCAP file of all that comes in and goes out, for `replay_side`.
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
        adapter = ForceTorqueAdapterParams(
            **{**adapter.__getstate__(), "period": scenario.control_period}
        )
        config = {
            "scenario": scenario.to_yaml(),
            "adapter": dump_yaml(_plain(adapter)),
            "tool_mass": repr(float(mass)),
        }
        super().__init__("robot", link, events, log, config, ROBOT_COLUMNS)
        self._limits = scenario.controller.joint_limits
        self._model = PandaModel(mass, scenario.scene.gravity)
        self._cycle = make_cycle(scenario, adapter, self._model)
        self._seeds = make_seeds(scenario)
        self.state = self._cycle.make_state(*self._seeds)
        self._arm = arm
        self._sensor = sensor
        self._confirm = confirm
        self._hold = ""
        self.on_cycle: Callable[[float, ArmReading, Any], None] | None = None
        """Called after each cycle with its time, the arm's and the sensor's reading."""

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
            self._close_log()

    def _is_confirmed(self) -> bool:
        reading = self._arm.look()
        limits = self._limits
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
            began = time.monotonic()
            try:
                self._arm.start()
                self.events.add("started", "the arm takes torques")
                return self._follow(end)
            except ArmFault as fault:
                self.events.add("fault", str(fault))
            if time.monotonic() - began >= _GOOD_TIME:
                failures = 0
            while True:
                if self._stop:
                    return False
                failures += 1
                if failures > _RECOVERIES:
                    self.events.add("ended", "the arm cannot be made ready again")
                    return False
                self._tell_that_it_holds(_RECOVERY_PAUSE)
                try:
                    self._arm.recover()
                    break
                except ArmFault as fault:
                    self.events.add("fault", str(fault))
            # From where it is now, with what it knows of the sensor.
            self._cycle.restart(self.state, *self._seeds)
            self.events.add("recovered", "it follows from where it is")

    def _tell_that_it_holds(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while not self._stop and (now := time.monotonic()) < end:
            self._receive(now)
            self._send(now, self.state.message, LinkFrame.HOLDING)
            time.sleep(0.005)

    def _follow(self, end: float) -> bool:
        arm, cycle, state = self._arm, self._cycle, self.state
        sensor = arm.wrench if self._sensor is None else self._sensor.read
        resting_until = math.inf
        last = -math.inf
        while True:
            reading = arm.read()
            now = time.monotonic()
            if now - last > _STALL and last > 0:
                self.events.add("stall", f"{1e3 * (now - last):.0f} ms between cycles")
            last = now
            flags = self._receive(now)
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
            try:
                arm.write(state.torque, resting)
            except ArmFault:
                # The cycle counts, as what it knows of the sensor goes on.
                if self._log is not None:
                    self._write(self._log, now, reading, wrench, holds)
                raise
            if resting:
                self.events.add("ended", cycle_text(self.work))
                return True
            hold = state.side.hold
            self._send(now, state.message, LinkFrame.HOLDING if hold != "none" else 0)
            if hold != self._hold:
                self._hold = hold
                self.events.add("hold" if hold != "none" else "follow", _HOLDS[hold])
            if self._log is not None:
                self._write(self._log, now, reading, wrench, holds)
            if self.on_cycle is not None:
                self.on_cycle(now, reading, wrench)
            self.work.add(time.monotonic() - now)

    def _write(
        self, log: SideLog, now: float, reading: ArmReading, wrench: Any, holds: bool
    ) -> None:
        state = self.state
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
                (message_digest(state.message),),
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
                    "force_selection": side.filter.force_selection.tolist(),
                    "hold": side.hold,
                    "link_age": side.link.age,
                },
            )


def _plain(params: Any) -> dict[str, Any]:
    return {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in params.__getstate__().items()
    }
