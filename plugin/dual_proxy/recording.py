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

import csv
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dual_proxy.settings import ScenarioError

__all__ = ["Recording", "read_recording", "recorded_path"]

_POSITION = ("px", "py", "pz")
_ROTATION = tuple(f"R{i}{j}" for i in "123" for j in "123")
_MIN_ROWS = 10
_MIN_LENGTH = 1.0  # s
_MAX_LENGTH = 3600.0  # s

#: Time for the move to the recording's first point, and for the one back, s.
MOVE_TIME = 2.0


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
        with open(path, newline="", encoding="utf-8-sig") as file:
            rows = list(csv.reader(file))
    except OSError as error:
        raise ScenarioError(f"{path}: {error.strerror}") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise ScenarioError(f"{path}: expected a CSV file: {error}") from None
    header = [name.strip() for name in rows[0]] if rows else []
    columns = ["t", *_POSITION]
    if any(name in header for name in _ROTATION):
        columns += _ROTATION
    for name in columns:
        if header.count(name) != 1:
            found = "missing" if name not in header else "found more than once"
            raise ScenarioError(f"{path}: column {name!r} is {found}")
    body = [row for row in rows[1:] if row]
    table = np.array(
        [
            _numbers(row, header, columns, f"{path}, row {i}")
            for i, row in enumerate(body, 1)
        ]
    ).reshape(len(body), len(columns))
    times = table[:, 0]
    if len(times) < _MIN_ROWS or times[-1] - times[0] < _MIN_LENGTH:
        length = times[-1] - times[0] if len(times) else 0.0
        raise ScenarioError(
            f"{path}: too short, expected at least {_MIN_ROWS} rows and "
            f"{_MIN_LENGTH:g} s, got {len(times)} rows and {length:g} s"
        )
    if times[-1] - times[0] > _MAX_LENGTH:
        raise ScenarioError(
            f"{path}: too long, expected at most {_MAX_LENGTH:g} s, "
            f"got {times[-1] - times[0]:g} s"
        )
    bad = np.flatnonzero(np.diff(times) <= 0.0)
    if bad.size:
        row = int(bad[0])
        raise ScenarioError(
            f"{path}, row {row + 2}, column 't': expected a time after "
            f"{times[row]:g} s, got {times[row + 1]:g} s"
        )
    rotations = None
    if len(columns) > 4:
        rotations = table[:, 4:].reshape(-1, 3, 3)
        deviation = np.abs(rotations @ rotations.transpose(0, 2, 1) - np.eye(3))
        wrong = np.flatnonzero(
            (deviation.max(axis=(1, 2)) > 1e-3) | (np.linalg.det(rotations) < 0.0)
        )
        if wrong.size:
            raise ScenarioError(
                f"{path}, row {wrong[0] + 1}, columns 'R11' to 'R33': "
                "expected a rotation matrix"
            )
    return Recording(times - times[0], table[:, 1:4].copy(), rotations)


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
    low, high = recording.positions.min(axis=0), recording.positions.max(axis=0)
    level = float(np.quantile(recording.positions[:, 2], 0.01))
    offsets = recording.positions - np.array([*(low + high)[:2] / 2.0, level])
    offsets[:, 2] = np.maximum(offsets[:, 2], 0.0)
    middle = np.array([start[0], start[1], contact_height - press_depth])
    if not reachable(middle[None]).all():
        raise ScenarioError(
            f"operator.press_depth: expected a depth that the device reaches below "
            f"scene.start_position, got {press_depth!r}"
        )
    scale = 1.0
    if not reachable(middle + offsets).all():
        # The set is convex and holds `middle`, so bisection finds its border.
        scale, too_large = 0.0, 1.0
        for _ in range(20):
            trial = (scale + too_large) / 2.0
            if reachable(middle + trial * offsets).all():
                scale = trial
            else:
                too_large = trial
    points = middle + scale * offsets

    steps = np.linspace(0.0, 1.0, round(MOVE_TIME * 100) + 1)
    share = (steps**3 * (10.0 - 15.0 * steps + 6.0 * steps**2))[:, None]
    into = start + share * (points[0] - start)
    out = points[-1] + share * (start - points[-1])
    times = MOVE_TIME + recording.times
    return (
        np.concatenate(
            [steps[:-1] * MOVE_TIME, times, times[-1] + steps[1:] * MOVE_TIME]
        ),
        np.concatenate([into[:-1], points, out[1:]]),
    )


def _numbers(
    row: Sequence[str], header: Sequence[str], columns: Sequence[str], where: str
) -> list[float]:
    if len(row) != len(header):
        raise ScenarioError(f"{where}: expected {len(header)} values, got {len(row)}")
    values = []
    for name in columns:
        text = row[header.index(name)]
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if not np.isfinite(value):
            raise ScenarioError(
                f"{where}, column {name!r}: expected a finite number, got {text!r}"
            )
        values.append(value)
    return values
