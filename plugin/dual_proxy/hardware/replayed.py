# SPDX-License-Identifier: BSD-3-Clause
"""A device and a force sensor that give, in real time, what a side's log has of them.

What was logged is shifted in time: the first cycle of the log is when it is first
read. Ages and validity are those that were logged, pauses too. At the end of the log
the last reading goes stale. Neither answers to what is done now: the hand to no
force, the sensor to no motion.

A log is kept in memory: 0.3 kB a cycle, 18 MB a minute.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dual_proxy._core import DriverError, Pose
from dual_proxy.hardware.arms import Wrench
from dual_proxy.hardware.devices import SimulatedHandle
from dual_proxy.hardware.haptic_side import HAPTIC_COLUMNS, handle_of
from dual_proxy.hardware.robot_side import ROBOT_COLUMNS, wrench_of
from dual_proxy.hardware.side_log import read_side_log

__all__ = ["ReplayedHand", "ReplayedSensor"]


class _Replayed:
    """A log's cycles, by the time since it was first looked at."""

    def __init__(self, path: Path, side: str, columns: Sequence[str]) -> None:
        _, cycles = read_side_log(path, {side: columns})
        self._rows = np.array([cycle.values for cycle in cycles])
        if not len(self._rows):
            raise DriverError(f"{path}: expected a log with cycles, got none")
        self._path = path
        self._times = self._rows[:, 0].copy()
        self._shift = math.nan
        self._is_open = False

    def open(self) -> None:
        """Go on, as what was closed meanwhile did, too. Raises DriverError once the
        log has ended."""
        if fault := self.fault:
            raise DriverError(fault)
        self._is_open = True

    def close(self) -> None:
        """Give nothing any more."""
        self._is_open = False

    @property
    def fault(self) -> str:
        """That the log has ended; "": it has not."""
        ended = time.monotonic() - self._shift > self._times[-1]
        return f"{self._path}: the log has ended" if ended else ""

    def _look(self) -> tuple[NDArray[np.float64], float] | None:
        """Return the newest cycle, and what its times are to be shifted by, s."""
        if not self._is_open:
            return None
        now = time.monotonic()
        if math.isnan(self._shift):
            self._shift = now - self._times[0]
        past = int(np.searchsorted(self._times, now - self._shift, "right"))
        return self._rows[max(past - 1, 0)], self._shift


class ReplayedHand(_Replayed):
    """The device, and the hand that held it, of a haptic side's log: a HapticDevice.

    Parameters
    ----------
    path : of the log.

    Raises
    ------
    DriverError
        If it is no such log.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path, "haptic", HAPTIC_COLUMNS)

    def read(self) -> SimulatedHandle:
        """See HapticDevice."""
        found = self._look()
        if found is None:
            return SimulatedHandle(-math.inf, False, Pose(), np.zeros(6))
        row, shift = found
        handle = handle_of(row)
        return replace(handle, time=handle.time + shift)

    def write(self, wrench: Any, gripper_force: float = 0.0) -> None:
        """See HapticDevice; there is no hand to feel it."""


class ReplayedSensor(_Replayed):
    """The force sensor of a robot side's log, also one that was the arm's own.

    Not for a real arm: it would feel what it does not touch, and not what it does.

    Parameters
    ----------
    path : of the log.

    Raises
    ------
    DriverError
        If it is no such log.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path, "robot", ROBOT_COLUMNS)

    def read(self) -> Wrench:
        """Return the newest reading, at once."""
        found = self._look()
        if found is None:
            return Wrench()
        row, shift = found
        wrench = wrench_of(row)
        return replace(wrench, time=wrench.time + shift)
