# SPDX-License-Identifier: BSD-3-Clause
"""The haptic side as a process: a device, HapticSide, the link.

device.read -> link.receive -> HapticSide -> device.write -> link.send
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dual_proxy._core import DriverError, HapticSide, LinkFrame, Pose
from dual_proxy.hardware.devices import HapticDevice, SimulatedHandle, is_reliable
from dual_proxy.hardware.events import Events, cycle_text
from dual_proxy.hardware.side_log import SideLog, message_digest
from dual_proxy.hardware.side_process import SideProcess
from dual_proxy.scenario import Scenario

if TYPE_CHECKING:
    from dual_proxy.link.message_link import MessageLink

__all__ = [
    "HAPTIC_COLUMNS",
    "HapticSideProcess",
    "handle_of",
    "make_side",
    "update_side",
]

#: Of a cycle in the log.
HAPTIC_COLUMNS = (
    *("time", "handle_time", "handle_valid", "good", "engaged"),
    *("x", "y", "z"),
    *(f"R{i}{j}" for i in range(1, 4) for j in range(1, 4)),
    *("vx", "vy", "vz", "wx", "wy", "wz", "gripper_opening", "clutch"),
    *("fx", "fy", "fz", "mx", "my", "mz", "sent"),
)
_NO_POSITION = np.full(3, math.nan)
_NO_WRENCH = np.zeros(6)
#: m, of a gripper: as wide as any robot's.
_OPEN = 0.1


def handle_of(values: Any) -> SimulatedHandle:
    """Return the handle that a cycle of a log has."""
    return SimulatedHandle(
        float(values[1]),
        bool(values[2]),
        Pose(values[5:8], values[8:17].reshape(3, 3)),
        values[17:23],
        float(values[23]),
        bool(values[24]),
    )


def make_side(scenario: Scenario) -> HapticSide:
    """Return a scenario's haptic side, with the device's buttons."""
    params = scenario.haptic_side_params()
    aids = params.aids
    aids.buttons = True
    params.aids = aids
    return HapticSide(params)


def update_side(
    side: HapticSide,
    now: float,
    message: Any,
    handle: Any,
    state: Any,
    *,
    good: bool,
    engaged: bool,
) -> Any:
    """Advance a side by a period with a Handle, of which nothing counts unless it is
    good; return the wrench for the hand."""
    side.update(
        now,
        message,
        handle.pose.p if good else _NO_POSITION,
        handle.pose.R,
        handle.velocity,
        state,
        clutch=handle.clutch or not engaged,
        gripper_opening=handle.gripper_opening,
    )
    return state.device_wrench if good else _NO_WRENCH


class HapticSideProcess(SideProcess):
    """Runs the haptic side on a device.

    While the device cannot be relied on the hand feels no force, and the robot is
    told, which then holds its place. Then, and while the robot is not there or holds
    its place for another reason, the hand is free as with a pressed clutch, until a
    moment later: it goes where nothing holds it, and the robot goes on from there.

    Parameters
    ----------
    scenario : map, limits and the device's controller; its operator plays no part.
    device : opened by `run`; one that fails midway is opened again.
    link : to the robot side, or None: no force.
    button_grips : whether the button closes the robot's gripper while it is pressed,
        in place of being the clutch; the opening of the device's own plays no part.
    log : MCAP file of all that comes in and goes out.
    """

    #: s between two attempts to open a device that failed.
    _REOPEN = 1.0
    #: s, at most, from when it cannot be relied on until it says why.
    _EXPLAINING = 0.1
    #: s: for which a hand is on its way that lost the force it pressed against.
    _SETTLING = 0.3

    def __init__(
        self,
        scenario: Scenario,
        device: HapticDevice,
        link: MessageLink | None,
        *,
        button_grips: bool = False,
        events: Events | None = None,
        log: Path | None = None,
    ) -> None:
        config = {"scenario": scenario.to_yaml()}
        super().__init__("haptic", link, events, log, config, HAPTIC_COLUMNS)
        self._side = make_side(scenario)
        self.state = self._side.make_state()
        self._period = float(scenario.control_period)
        self._device = device
        self._button_grips = button_grips
        self.on_cycle: Callable[[float, Any], None] | None = None
        """Called after each cycle with its time and the device's reading."""

    def run(self, duration: float = math.inf) -> bool:
        """Run until `stop`, or for so long, s; return whether that is how it ended.

        Raises
        ------
        DriverError
            If the device cannot be opened, or the log not be written.
        """
        device = self._device
        try:
            device.open()
            self._open_log()
            self.events.add("started", "the device is ready")
            self._follow(time.monotonic() + duration)
            self.events.add("ended", cycle_text(self.work))
            if self._log_fault:
                raise DriverError(self._log_fault)
            return True
        finally:
            device.close()
            self._close_log()

    def _follow(self, end: float) -> None:
        device, side, state = self._device, self._side, self.state
        good = True
        bad_since = -math.inf
        untold = False
        clutched = False
        reopen_at = math.inf
        engaged_at = -math.inf
        due = time.monotonic()
        while not self._stop:
            due += self._period
            now = time.monotonic()
            if now < due:
                time.sleep(due - now)
            elif now > due + 0.1:
                due = now  # It was held up; nothing is made up for.
            now = time.monotonic()
            if now >= end:
                break
            handle = self._read()
            is_good = is_reliable(handle, now)
            if is_good != good:
                good = is_good
                bad_since = now
                reopen_at = math.inf if good else now + self._REOPEN
                untold = True
            # What is wrong it says a moment later.
            if untold and (good or device.fault or now > bad_since + self._EXPLAINING):
                untold = False
                if good:
                    self.events.add("device", "it is there again")
                else:
                    silent = f"silent for {now - handle.time:.3f} s"
                    self.events.add("fault", device.fault or silent)
            if now >= reopen_at:
                reopen_at = now + self._REOPEN
                self._reopen()
            if not self._robot_follows(now) or not good:
                engaged_at = now + self._SETTLING
            engaged = now >= engaged_at
            wrench = update_side(
                side,
                now,
                self._message,
                handle,
                state,
                good=good,
                engaged=engaged,
            )
            device.write(wrench)
            flags = 0 if good else LinkFrame.FAULT
            if handle.clutch:
                flags |= LinkFrame.CLUTCH
            self._send(now, state.message, flags)
            if handle.clutch != clutched:
                clutched = handle.clutch
                self.events.add("clutch", "pressed" if clutched else "let go")
            if self._log is not None:
                known = (now, handle.time, handle.valid, good, engaged)
                self._write(self._log, known, handle, wrench)
                self._watch_log()
            if self.on_cycle is not None:
                self.on_cycle(now, handle)
            self.work.add(time.monotonic() - now)

    def _read(self) -> Any:
        """Return the device's handle, with what its button is for."""
        handle = self._device.read()
        if not self._button_grips:
            return handle
        opening = 0.0 if handle.clutch else _OPEN
        return SimulatedHandle(
            handle.time, handle.valid, handle.pose, handle.velocity, opening
        )

    def _robot_follows(self, now: float) -> bool:
        """Take what came; return whether the robot is there, and does not hold."""
        self._receive(now)
        return self._link is not None and self._link.follows(now)

    def _write(
        self, log: SideLog, known: tuple[float, ...], handle: Any, wrench: Any
    ) -> None:
        state, now = self.state, known[0]
        log.cycle(
            now,
            (
                known,
                handle.pose.p,
                np.ravel(handle.pose.R),
                handle.velocity,
                (handle.gripper_opening, handle.clutch),
                wrench,
                (message_digest(state.message),),
            ),
        )
        if log.wants_state(now):
            log.state(
                now,
                {
                    "position": handle.pose.p.tolist(),
                    "force": wrench[:3].tolist(),
                    "clutch": bool(handle.clutch),
                    "link_age": state.link.age,
                },
            )

    def _reopen(self) -> None:
        self._device.close()
        try:
            self._device.open()
        except DriverError as error:
            self.events.add("fault", str(error))
