# SPDX-License-Identifier: BSD-3-Clause
"""The robot side as a process: an arm, its sensor, RobotCycle, the link.

    arm.read -> link.receive -> sensor.read -> RobotCycle -> arm.write -> link.send

Nothing moves before somebody has confirmed it. Whatever goes wrong, the arm holds
its place or has stopped by itself, and follows again from where it is.
"""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dual_proxy._core import (
    DriverError,
    ForceTorqueAdapterParams,
    LinkFrame,
    PushTest,
    RobotCycle,
    make_hardware_defaults,
)
from dual_proxy.hardware.arms import Arm, ArmFault, ArmReading, Cycles, Wrench
from dual_proxy.hardware.events import Events, cycle_text
from dual_proxy.hardware.grippers import Gripper
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
    *("sensor_time", "sensor_valid", "hold", "distrust_sensor"),
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

#: s: that it holds, or follows again, is told no more often.
_RETELL_HOLD = 0.1

_HOLDS = {
    "no_link": "no link: it holds its place",
    "asked": "it is asked to hold its place",
    "bad_inputs": "inputs that cannot be: it brakes",
    "none": "it follows the hand",
}


def wrench_of(values: Any) -> Wrench:
    """Return what the sensor measured, of a cycle of a log."""
    return Wrench(float(values[22]), bool(values[23]), values[26:32])


def make_cycle(
    scenario: Scenario, adapter: ForceTorqueAdapterParams, model: PandaModel
) -> RobotCycle:
    """Return the cycle of a scenario's robot side on a real arm."""
    side = make_hardware_defaults(scenario.robot_side_params())
    follower = side.gripper
    follower.enabled = True  # Whether there are fingers is RobotSideProcess's.
    side.gripper = follower
    return RobotCycle(
        side=side,
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
    push_force : N, with which somebody has to push the tool before the arm follows: so
        it is seen that the sensor's force has the right sign. None: nobody has to.
    push_time : s, within which the push has to come.
    gripper : opened by `run`, that follows the device's; it is told nothing while the
        arm holds its place, and whatever happens to it the arm goes on.
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
        push_force: float | None = None,
        push_time: float = 60.0,
        gripper: Gripper | None = None,
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
        self._max_sensor_age = scenario.robot_side_params().max_sensor_age
        self._lowered = _lowered_gains(scenario)
        self._model = PandaModel(mass, scenario.scene.gravity)
        self._cycle = make_cycle(scenario, adapter, self._model)
        self._seeds = make_seeds(scenario)
        self.state = self._cycle.make_state(*self._seeds)
        self._arm = arm
        self._sensor = sensor
        self._confirm = confirm
        self._gripper = gripper
        self._hold = ""
        self._hold_told = -math.inf
        self._push_force = push_force
        self._push_time = push_time
        self._push: PushTest | None = None
        self._push_until = math.inf
        self._refusal = ""
        self.on_cycle: Callable[[float, ArmReading, Any], None] | None = None
        """Called after each cycle with its time, the arm's and the sensor's reading."""

    def run(self, duration: float = math.inf) -> bool:
        """Run until `stop`, or for so long, s; return whether the arm ended at rest.

        Raises
        ------
        DriverError
            If arm or sensor cannot be opened: nothing has moved. If a push showed that
            the sensor's force is wrong, or none came, or the log cannot be written any
            more: the arm has come to rest.
        """
        sensor = self._sensor
        try:
            # First: its process is not to inherit the priority that an arm asks for.
            if self._gripper is not None:
                self._gripper.open()
            self._arm.open()
            if sensor is not None:
                sensor.open()
            if not self._is_confirmed():
                self.events.add("refused", "nobody confirmed; nothing was moved")
                return False
            self._open_log()
            ended = self._control(time.monotonic() + duration)
            if self._refusal or self._log_fault:
                raise DriverError(self._refusal or self._log_fault)
            return ended
        finally:
            self._arm.close()
            if self._gripper is not None:
                self._gripper.close()
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
        if self._lowered:
            self.events.add("gains", self._lowered)
        p = self._model.calc(reading.q, np.zeros(7)).p_BE
        push = self._push_force
        then = "" if push is None else f"It then waits for a push of {push:g} N. "
        return self._confirm(
            f"The tool point is at {np.round(p, 3).tolist()} m and touches nothing, "
            f"the workspace is clear, a hand is on the stop. {then}Start?"
        )

    def _control(self, end: float) -> bool:
        failures = 0
        self._expect_push()
        while True:
            began = time.monotonic()
            with contextlib.closing(self._follow(end)) as cycles:
                try:
                    return self._arm.run(cycles)
                except ArmFault as fault:
                    self.events.add("fault", str(fault))
            if time.monotonic() - began >= _GOOD_TIME:
                failures = 0
            while True:
                if self._stop or time.monotonic() >= end:
                    self.events.add("ended", "the arm has stopped by itself")
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
            if self._push is not None:
                self._expect_push()
            self.events.add("recovered", "it follows from where it is")

    def _tell_that_it_holds(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while not self._stop and (now := time.monotonic()) < end:
            self._receive(now)
            self._send(now, self.state.message, LinkFrame.HOLDING)
            time.sleep(0.005)

    def _expect_push(self) -> None:
        """Begin the push test, for which the arm holds its place."""
        if self._push_force is not None:
            self._push = PushTest(self._push_force, self._cycle.period)
        self._push_until = math.inf

    def _take_push(self, now: float) -> None:
        """See whether somebody has pushed, and which way the force was."""
        state, push = self.state, self._push
        if push is None or not self._hears_sensor(now) or not state.sensor.ready:
            return
        if self._push_until == math.inf:
            self._push_until = now + self._push_time
            self.events.add(
                "push",
                f"push the tool by hand, any way, with more than {self._push_force:g} N"
                f" for a moment: it yields a little (within {self._push_time:g} s)",
            )
        result = push.update(state.pose.p, state.sensor.wrench[:3])
        if result == "passed":
            self._push = None
            self.events.add("push", "the force is that of the arm on the hand: right")
        elif result == "failed":
            self._refusal = (
                "push test: the sensed force does not oppose the push (cosine "
                f"{push.cosine:.2g}, expected at least 0.5): check the sensor's sign "
                "and how it is mounted"
            )
        elif now > self._push_until:
            self._refusal = (
                f"push test: no push of {self._push_force:g} N was sensed within "
                f"{self._push_time:g} s"
            )
        if self._refusal:
            self.events.add("refused", self._refusal)

    def _follow(self, end: float) -> Cycles:
        cycle, state = self._cycle, self.state
        sensor = self._arm.wrench if self._sensor is None else self._sensor.read
        self.events.add("started", "the arm takes torques")
        resting_until = math.inf
        last = -math.inf
        while True:
            reading = yield None
            now = time.monotonic()
            if now - last > _STALL and last > 0:
                self.events.add("stall", f"{1e3 * (now - last):.0f} ms between cycles")
            last = now
            flags = self._receive(now)
            wrench = sensor()
            if self._stop or now >= end or self._refusal:
                resting_until = min(resting_until, now + _REST_TIME)
            ending = resting_until < math.inf
            pushing = self._push is not None
            holds = ending or pushing or bool(flags & LinkFrame.FAULT)
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
                distrust_sensor=pushing,
            )
            if pushing and not ending:
                self._take_push(now)
            resting = ending and (
                now >= resting_until or float(np.abs(reading.v).max()) < _REST
            )
            try:
                yield state.torque, resting
            except GeneratorExit:
                # Refused; it counts, as what the cycle knows of the sensor goes on.
                if self._log is not None:
                    self._write(self._log, now, reading, wrench, (holds, pushing))
                raise
            if resting:
                self.events.add("ended", cycle_text(self.work))
                return True
            hold = state.side.hold
            self._send(now, state.message, LinkFrame.HOLDING if hold != "none" else 0)
            if hold != self._hold and now >= self._hold_told + _RETELL_HOLD:
                self._hold, self._hold_told = hold, now
                self._tell_hold(now, hold)
            if self._gripper is not None:
                self._serve_gripper(self._gripper)
            if self._log is not None:
                self._write(self._log, now, reading, wrench, (holds, pushing))
                self._watch_log()
            if self.on_cycle is not None:
                self.on_cycle(now, reading, wrench)
            self.work.add(time.monotonic() - now)

    def _hears_sensor(self, now: float) -> bool:
        return bool(now - self.state.sensor_time <= self._max_sensor_age)

    def _tell_hold(self, now: float, hold: str) -> None:
        if hold != "no_sensor":
            self.events.add("follow" if hold == "none" else "hold", _HOLDS[hold])
            return
        text = "no force sensor to rely on"
        if fault := getattr(self._sensor, "fault", ""):
            text = f"{text} ({fault})"
        elif self._hears_sensor(now) and not self.state.sensor.ready:
            text = "the sensor's bias is not known yet"
        self.events.add("hold", f"{text}: it holds its place")

    def _serve_gripper(self, gripper: Gripper) -> None:
        side = self.state.side
        if side.hold == "none" and math.isfinite(self._message.gripper_opening):
            gripper.command(side.gripper_width_command)
        for text in gripper.news():
            self.events.add("gripper", text)

    def _write(
        self,
        log: SideLog,
        now: float,
        reading: ArmReading,
        wrench: Any,
        asked: tuple[bool, bool],
    ) -> None:
        state = self.state
        log.cycle(
            now,
            (
                (now,),
                reading.q,
                reading.v,
                reading.received_torque,
                (wrench.time, wrench.valid, *asked),
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


def _lowered_gains(scenario: Scenario) -> str:
    """Return which gains an arm has that the scenario has not, in one line."""
    asked = scenario.robot_side_params()
    has = make_hardware_defaults(asked)
    return ", ".join(
        f"controller.{name} {here:g} in place of the scenario's {there:g}"
        for name in ("force_gain", "moment_gain")
        if (here := getattr(has.controller, name))
        != (there := getattr(asked.controller, name))
    )


def _plain(params: Any) -> dict[str, Any]:
    return {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in params.__getstate__().items()
    }
