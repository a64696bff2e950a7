# SPDX-License-Identifier: BSD-3-Clause
"""The filter on recordings of a guided arm that presses a horizontal board.

There is no truth but that: the normal of what is pressed from above is vertical.
Nor is there a command, as a person guides the arm; the sensed force stands in
for it, its part in motion space for F_m and that in force space for F_f.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dual_proxy._core import ForceSpaceParticleFilter, ForceSpaceParticleFilterParams
from dual_proxy.bench.filter import Config
from dual_proxy.recording import read_recording
from dual_proxy.settings import ScenarioError

__all__ = ["GuidedRecording", "measure_recordings", "read_recordings"]

Array = NDArray[np.float64]

_FORCE = ["sensed_fx", "sensed_fy", "sensed_fz"]
_VELOCITY = ["vx", "vy", "vz"]
_PRESSED_FORCE = 3.0  # N
_BOARD_DEPTH = 0.003  # m: below the board's top is a hole.
_MAX_ANGLE_DEG = 10.0


@dataclass(frozen=True)
class GuidedRecording:
    """What the filter sees of a recording; rows of three are in B."""

    times: Array
    """(n,), s."""
    positions: Array
    """(n, 3), m."""
    forces: Array
    """(n, 3), N."""
    velocities: Array
    """(n, 3), m/s."""

    def means(self, period: float) -> GuidedRecording:
        """Return the means over periods (s); what has no sample is left out."""
        number = np.floor(self.times / period + 1e-6)
        starts = np.flatnonzero(np.diff(number, prepend=-1.0))
        counts = np.diff(np.append(starts, self.times.size))

        def mean(values: Array) -> Array:
            sums: Array = np.add.reduceat(values, starts, axis=0)
            return sums / counts[:, None]

        return GuidedRecording(
            self.times[starts],
            mean(self.positions),
            mean(self.forces),
            mean(self.velocities),
        )


def read_recordings(directory: Path) -> list[GuidedRecording]:
    """Read every CSV file of a directory.

    Raises
    ------
    ScenarioError
        If there is none, or one is no recording with forces and velocities.
    """
    paths = sorted(directory.glob("*.csv"))
    if not paths:
        raise ScenarioError(f"--recordings {directory}: expected CSV files, found none")
    return [_read(path) for path in paths]


def _read(path: Path) -> GuidedRecording:
    recording = read_recording(path)
    if recording.rotations is None:
        raise ScenarioError(f"{path}: expected columns R11 to R33")
    try:
        table = pd.read_csv(path, usecols=[*_FORCE, *_VELOCITY], dtype=np.float64)
    except ValueError as error:
        raise ScenarioError(f"{path}: {error}") from None
    forces = np.einsum("nij,nj->ni", recording.rotations, table[_FORCE].to_numpy())
    return GuidedRecording(
        recording.times, recording.positions, forces, table[_VELOCITY].to_numpy()
    )


def measure_recordings(
    recordings: Sequence[GuidedRecording], configs: Sequence[Config]
) -> list[dict[str, Any]]:
    """Return per setting how vertical the normal is, over all recordings.

    `normal_right` is the share of the updates pressing the board from above (at
    least 3 N down and more down than sideways, within 3 mm of the board's top)
    at which the filter has a contact whose U1 is within 10 deg of the vertical.
    """
    rows = []
    for config in configs:
        results = [_run(recording, config.params) for recording in recordings]
        changes = sum(result[0] for result in results)
        duration = sum(float(recording.times[-1]) for recording in recordings)
        right = np.concatenate([result[1] for result in results])
        rows.append(
            config._asdict()
            | {
                "updates_pressing": right.size,
                "normal_right": float(right.mean()) if right.size else None,
                "dimension_changes_per_s": changes / duration,
            }
        )
    return rows


def _run(
    recording: GuidedRecording, params: ForceSpaceParticleFilterParams
) -> tuple[int, NDArray[np.bool_]]:
    """Return the changes of dimension, and at which presses the normal is right."""
    means = recording.means(params.period)
    pressed = _presses_down(recording.forces)
    top = np.quantile(recording.positions[pressed, 2], 0.95) if pressed.any() else 0.0
    counts = _presses_down(means.forces)
    counts &= means.positions[:, 2] >= top - _BOARD_DEPTH
    filter_ = ForceSpaceParticleFilter(params)
    dimensions = np.zeros(counts.size, dtype=int)
    right = np.zeros(counts.size, dtype=bool)
    for i, force in enumerate(means.forces):
        filter_.update(
            force,
            means.velocities[i],
            filter_.motion_selection @ force,
            filter_.force_selection @ force,
        )
        dimensions[i] = filter_.dimension
        down = -filter_.singular_vectors[2, 0]
        right[i] = filter_.dimension > 0 and down >= np.cos(np.deg2rad(_MAX_ANGLE_DEG))
    return int(np.count_nonzero(np.diff(dimensions, prepend=0))), right[counts]


def _presses_down(forces: Array) -> NDArray[np.bool_]:
    down = -forces[:, 2]
    sideways = np.linalg.norm(forces[:, :2], axis=1)
    pressed: NDArray[np.bool_] = (down >= _PRESSED_FORCE) & (sideways <= down)
    return pressed
