# SPDX-License-Identifier: BSD-3-Clause
"""Recorded human motion as the operator's path.

A recording is a CSV file: `RECORDING_FORMAT` says what it looks like,
`RECORDING_EXAMPLE` is the start of one. `t` increases from any value; `px`,
`py`, `pz` are in any frame whose z is up. `qw`, `qx`, `qy`, `qz`, a unit
quaternion in the same frame, are followed; `R11` to `R33`, a rotation matrix row
by row, are read only. The order of the columns is free, others are ignored.
Blank lines and lines that begin with # are skipped.

It was made in another place, above another surface, so it is moved: the height
at which the person worked becomes a pressing depth below the table's top, and
the first orientation becomes the tool's at home. `Scenario.operator_motion`
gives what comes of it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dual_proxy import _core
from dual_proxy.settings import ScenarioError

__all__ = [
    "MOVE_TIME",
    "RECORDING_EXAMPLE",
    "RECORDING_FORMAT",
    "Recording",
    "read_recording",
    "recorded_path",
]

#: What a recording looks like, in the words of errors, `--help` and README.
RECORDING_FORMAT: str = _core._RECORDING_FORMAT
#: The first lines of one.
RECORDING_EXAMPLE: str = _core._RECORDING_EXAMPLE

#: Time for the move to the recording's first point, and for the one back, s.
MOVE_TIME: float = _core._RECORDING_MOVE_TIME


@dataclass(frozen=True, slots=True)
class Recording:
    """A motion as it was recorded."""

    times: NDArray[np.float64]
    """(n,), s, from 0, strictly increasing."""
    positions: NDArray[np.float64]
    """(n, 3), m, in the recording's frame, scaled."""
    rotations: NDArray[np.float64] | None
    """(n, 3, 3), or None if the file has no orientation."""


def read_recording(path: str | Path, units: str = "m", scale: float = 1.0) -> Recording:
    """Read a recording from a CSV file.

    Parameters
    ----------
    path : str or Path
        The file.
    units : str
        Of its positions: "m", "cm" or "mm".
    scale : float, > 0
        By which its lengths are multiplied.

    Raises
    ------
    ScenarioError
        If the file cannot be read or is no recording, has a value that is not a
        finite number, a matrix or quaternion that is no rotation, fewer than 10
        rows, a length beyond 1 to 3600 s; or if, once scaled, no hand moves so:
        a time that does not increase, fewer than 5 or more than 10 000 samples
        per second, a gap of more than 0.5 s, a speed over 3 m/s or 20 rad/s, a
        jump. The message names file, row (1 is the first below the header),
        column and remedy.
    """
    try:
        return Recording(*_core._read_recording(str(path), units, scale))
    except ValueError as error:
        raise ScenarioError(str(error)) from None


def recorded_path(
    recording: Recording,
    start: NDArray[np.float64],
    contact_height: float,
    press_depth: float,
    reachable: Callable[[NDArray[np.float64]], NDArray[np.bool_]],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Place a recording's positions above the table, lead into and out of them.

    The recording's contact height (the 1 % quantile of its height: the lowest
    place where the hand stayed) goes to `press_depth` below first touch, and
    nothing goes deeper. Horizontally the middle of its extent goes above
    `start`. If that leaves what is reachable, all its lengths are scaled down by
    the same factor, at least 0.5, until it fits; time is never scaled. A
    minimum-jerk move of `MOVE_TIME` leads from `start` to its first point,
    another back from its last.

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
        If the motion is more than twice as large as what can be reached, or the
        pressing depth itself is out of reach.
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
