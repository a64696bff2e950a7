# SPDX-License-Identifier: BSD-3-Clause
"""Recorded human motion as the operator's path.

A recording is a CSV file with a header and the columns `t` (s), `px`, `py`,
`pz` (m, any frame whose z is up) and, if there, `R11` to `R33` (orientation,
row by row); other columns are ignored. It was made in another place, above
another surface, so `recorded_path` moves it: the height at which the person
worked becomes a pressing depth below the table's top. The operator follows the
positions; the tool keeps its orientation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dual_proxy import _core
from dual_proxy.settings import ScenarioError

__all__ = ["MOVE_TIME", "Recording", "read_recording", "recorded_path"]

#: Time for the move to the recording's first point, and for the one back, s.
MOVE_TIME: float = _core._RECORDING_MOVE_TIME


@dataclass(frozen=True, slots=True)
class Recording:
    """A motion as it was recorded."""

    times: NDArray[np.float64]
    """(n,), s, from 0, strictly increasing."""
    positions: NDArray[np.float64]
    """(n, 3), m, in the recording's frame."""
    rotations: NDArray[np.float64] | None
    """(n, 3, 3), or None if the file has no orientation."""


def read_recording(path: str | Path) -> Recording:
    """Read a recording from a CSV file.

    Raises
    ------
    ScenarioError
        If the file cannot be read, lacks a column, has a value that is not a
        finite number, a time that does not increase, a matrix that is not a
        rotation, or is too short. The message names file, row (1 is the first
        below the header) and column.
    """
    try:
        return Recording(*_core._read_recording(str(path)))
    except ValueError as error:
        raise ScenarioError(str(error)) from None


def recorded_path(
    recording: Recording,
    start: NDArray[np.float64],
    contact_height: float,
    press_depth: float,
    reachable: Callable[[NDArray[np.float64]], NDArray[np.bool_]],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Place a recording above the table and lead into and out of it.

    The recording's contact height (the 1 % quantile of its height: the lowest
    place where the hand stayed) goes to `press_depth` below first touch, and
    nothing goes deeper. Horizontally the middle of its extent goes above
    `start`. If that leaves what is reachable, all its lengths are scaled down by
    the same factor until it fits; time is never scaled. A minimum-jerk move of
    `MOVE_TIME` leads from `start` to its first point, another back from its
    last.

    Parameters
    ----------
    recording : Recording
        The motion, n samples.
    start : (3,), m, in B
        Where the robot's tool is at time 0.
    contact_height : float, m
        Height of the tool point in B when the tool touches the table.
    press_depth : float, m
        Depth below `contact_height` to which the contact height is moved.
    reachable : callable
        Tells which of some points, (n, 3), m, in B, can be reached; the set of
        those that can is convex.

    Returns
    -------
    times : (m,), s, from 0, strictly increasing
    positions : (m, 3), m, in B

    Raises
    ------
    ScenarioError
        If the pressing depth itself is out of reach.
    """
    try:
        return _core._place_recording(
            recording.times,
            recording.positions,
            start,
            contact_height,
            press_depth,
            lambda points: bool(reachable(points).all()),
        )
    except ValueError as error:
        raise ScenarioError(str(error)) from None
