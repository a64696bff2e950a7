# SPDX-License-Identifier: BSD-3-Clause
"""What a run is judged by, from its log and scenario alone.

All truth comes from the simulator's contacts, never from the filter; the C++
library computes it (plugin/experiment/metrics.h defines the terms), so that a
run without Python is judged by the same.

A metric that cannot be given is None (null in JSON): there was no contact, or a
value that it needs is not finite. `finite` says whether the latter happened.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dual_proxy import _core
from dual_proxy.log import ANGULAR_SIGNALS, SIGNALS, column_names

if TYPE_CHECKING:
    from dual_proxy.scenario import Scenario

__all__ = [
    "ANGULAR_METRICS",
    "METRICS",
    "Metric",
    "compute_metrics",
    "device_in_robot_frame",
    "format_metric",
    "normal_error_deg",
]

Array = NDArray[np.float64]


class Metric(NamedTuple):
    """What a metric means."""

    unit: str
    description: str


#: The keys of metrics.json, in order.
METRICS: dict[str, Metric] = {
    key: Metric(unit, description)
    for key, unit, description in _core._metric_descriptions()
}
#: Those that follow where the angular filter ran.
ANGULAR_METRICS: dict[str, Metric] = {
    key: Metric(unit, description)
    for key, unit, description in _core._angular_metric_descriptions()
}


def compute_metrics(
    log: pd.DataFrame,
    scenario: Scenario,
    wall_s: float | None = None,
    recording_scale: float | None = None,
) -> dict[str, Any]:
    """Compute every metric of `METRICS`, and with the angular filter of
    `ANGULAR_METRICS`.

    Parameters
    ----------
    log : DataFrame
        As `dual_proxy.log.make_frame` makes it; may be cut short or empty.
    scenario : Scenario
        What was run: its `map`, `link.delay` and `scheme` are used.
    wall_s : float, optional
        How long the run took, s.
    recording_scale : float, optional
        `OperatorMotion.scale`, if the operator followed a recording.

    Returns
    -------
    dict
        By key; numbers, booleans or None, all valid JSON.
    """
    return dict(
        _core._compute_metrics(
            *_run_log(log),
            map=scenario.map,
            delay=scenario.link.delay,
            has_filter=scenario.scheme == "dual_proxy",
            recording_scale=recording_scale,
            wall_s=wall_s,
        )
    )


def device_in_robot_frame(scenario: Scenario, x_D: Array) -> Array:
    """Map device positions, (n, 3), m, in D, to the robot, in B, eq. (1)."""
    return _core._map_device_positions(scenario.map, x_D)


def format_metric(value: Any) -> str:
    """Return a metric as people read it: four digits, "-" for None."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:d}" if isinstance(value, int) else f"{value:.4g}"


def normal_error_deg(log: pd.DataFrame) -> Array:
    """Return the angle between estimated and true normal at each row.

    Returns
    -------
    (n,), deg, in [0, 90]
        NaN where there is no true contact or no estimate; see `METRICS`.
    """
    return _core._normal_error_deg(*_run_log(log))


def _run_log(log: pd.DataFrame) -> tuple[Array, Array, list[tuple[str, int]]]:
    """Return times, values, and the signals that the log has, with their sizes."""
    names = [
        name
        for name in SIGNALS | ANGULAR_SIGNALS
        if set(column_names(name)) <= set(log.columns)
    ]
    values = log[[column for name in names for column in column_names(name)]]
    return (
        log.index.to_numpy(np.float64),
        values.to_numpy(np.float64),
        [(name, len(column_names(name))) for name in names],
    )
