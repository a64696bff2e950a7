# SPDX-License-Identifier: BSD-3-Clause
"""Haptic devices as the haptic side's process has them, beside OmegaDevice."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from dual_proxy._core import OperatorPath, Pose, SimulatedHapticDevice
from dual_proxy.scenario import Scenario

__all__ = ["HapticDevice", "SimulatedHand", "SimulatedHandle", "is_reliable"]

Vector = NDArray[np.float64]


class Handle(Protocol):
    """What a device says of its handle, as HandleReading."""

    time: float
    valid: bool
    pose: Pose
    velocity: Vector
    gripper_opening: float
    clutch: bool


#: s: a reading that is older is none.
_STALE = 0.02


def is_reliable(handle: Any, now: float) -> bool:
    """Return whether what a device said of its handle can be relied on at `now`, s."""
    return bool(handle.valid) and now - handle.time <= _STALE


class HapticDevice(Protocol):
    """What the haptic side's loop needs of a device: OmegaDevice has it."""

    def open(self) -> None:
        """Make it ready, with no force on the hand. Raises DriverError."""

    def read(self) -> Any:
        """Return the newest Handle, at once."""

    def write(self, wrench: Any, gripper_force: float = 0.0) -> None:
        """Set [force; moment] on the hand, (6,), N, N m, in D, until the next call."""

    def close(self) -> None:
        """Take the force off the hand; may be called at any time."""

    @property
    def fault(self) -> str:
        """What is wrong with it, in one line; "": nothing."""


@dataclass(frozen=True)
class SimulatedHandle:
    """A reading of a device that is simulated or replayed; see HandleReading."""

    time: float
    valid: bool
    pose: Pose
    velocity: Vector
    gripper_opening: float = math.nan
    clutch: bool = False


class SimulatedHand:
    """The scenario's device in its operator's hand, in real time.

    The operator goes on along the scenario's path only while `may_move` says so.
    """

    #: Periods that are made up for at most, once it was not read for a while.
    _MOST = 100

    def __init__(
        self, scenario: Scenario, may_move: Callable[[], bool] = lambda: True
    ) -> None:
        self._device = SimulatedHapticDevice(scenario.device)
        self._state = self._device.make_state()
        self._path: OperatorPath = scenario.handle_path()
        self._period = float(scenario.control_period)
        self._may_move = may_move
        self._moved = 0.0
        self._wrench = np.zeros(6)
        self._now = -math.inf

    def open(self) -> None:
        """See HapticDevice."""
        self._now = time.monotonic()

    def read(self) -> SimulatedHandle:
        """See HapticDevice."""
        now = time.monotonic()
        if self._now < now - self._MOST * self._period:
            self._now = now - self._period
        while self._now + self._period <= now:
            self._now += self._period
            if self._may_move():
                self._moved += self._period
            position, velocity = self._path.calc(self._moved)
            self._device.update(
                position,
                self._path.calc_rotation(self._moved),
                velocity,
                self._wrench,
                self._state,
            )
        return SimulatedHandle(
            self._now,
            True,
            self._state.read_pose,
            np.array(self._state.read_velocity),
            self._opening(),
        )

    def write(self, wrench: Any, gripper_force: float = 0.0) -> None:
        """See HapticDevice."""
        self._wrench = np.array(wrench, dtype=np.float64)

    def close(self) -> None:
        """See HapticDevice."""
        self._wrench = np.zeros(6)

    @property
    def fault(self) -> str:
        """See HapticDevice."""
        return ""

    def _opening(self) -> float:
        opening = math.nan
        for at, value in self._path.params.gripper:
            if at <= self._moved:
                opening = value
        return opening

    @property
    def moved(self) -> float:
        """s: how far along its path the operator is."""
        return self._moved
