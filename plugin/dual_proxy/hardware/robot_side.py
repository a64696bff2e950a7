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
from typing import Any

import numpy as np

from dual_proxy._core import (
    ForceTorqueAdapterParams,
    LinkFrame,
    PoseMessage,
    RobotCycle,
    RobotSideParams,
)
from dual_proxy.hardware.arms import Arm, ArmFault, ArmReading
from dual_proxy.hardware.events import CycleTimes, Events
from dual_proxy.link.message_link import MessageLink
from dual_proxy.panda import PandaModel, p_SE_S
from dual_proxy.scenario import Scenario

__all__ = ["RobotSideProcess", "hardware_side_params"]

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


def hardware_side_params(scenario: Scenario) -> RobotSideParams:
    """Return the robot side's parameters of a scenario, made fit for a real arm.

    A real arm's torques act two or three periods late, so the force loop's gain is at
    most 0.5 and its passivity controllers know; the arm holds its own weight; its
    torques' rate is not spent on accelerations fed forward; and it never travels to
    where the hand is.
    """
    params = scenario.robot_side_params()
    controller = params.controller
    controller.force_gain = min(controller.force_gain, 0.5)
    controller.moment_gain = min(controller.moment_gain, 0.5)
    controller.acceleration_feed_forward = False
    controller.gravity_compensation = False
    for passivity in (controller.force_passivity, controller.moment_passivity):
        passivity.actuation_delay = 3
    params.controller = controller
    proxy = params.proxy
    proxy.reclutch = True
    params.proxy = proxy
    return params


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
    ) -> None:
        mass = scenario.scene.tool_mass if tool_mass is None else tool_mass
        if adapter is None:
            adapter = ForceTorqueAdapterParams(
                tool_mass=mass, tool_com=scenario.sensor.tool_com, tare=True
            )
        adapter.period = scenario.control_period
        self._model = PandaModel(mass, scenario.scene.gravity)
        self.params = hardware_side_params(scenario)
        self._cycle = RobotCycle(
            side=self.params,
            model=self._model.arm_params,
            sensor=adapter,
            p_SE=p_SE_S,
        )
        self._seeds = (
            scenario.calc_seed("filter"),
            scenario.calc_seed("angular_filter"),
        )
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
            if link is not None:
                newest = link.receive(now)
                if newest is not None:
                    self._message = newest
                flags = link.flags
            wrench = sensor()
            if self._stop or now >= end:
                resting_until = min(resting_until, now + _REST_TIME)
            ending = resting_until < math.inf
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
                hold=ending or bool(flags & LinkFrame.FAULT),
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
            if self.on_cycle is not None:
                self.on_cycle(now, reading, wrench)
            self.work.add(time.monotonic() - now)

    def _tell_trouble(self, trouble: str) -> None:
        # The text counts seconds: what is told is that it began.
        if bool(trouble) != bool(self._trouble):
            self.events.add("link", trouble or "the haptic side is there")
        self._trouble = trouble
