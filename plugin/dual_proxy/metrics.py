# SPDX-License-Identifier: BSD-3-Clause
"""What a run is judged by, from its log and scenario alone.

All truth comes from the simulator's contacts, never from the filter; the C++
library computes it (plugin/experiment/metrics.h defines the terms), so that a
run without Python is judged by the same.

A metric that cannot be given is None (null in JSON): there was no contact, or a
value that it needs is not finite. `finite` says whether the latter happened.
`limits_broken` lists the limits of the real arm that the run broke.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dual_proxy import _core
from dual_proxy.log import (
    SIGNALS,
    column_names,
    log_store,
    signal,
)

if TYPE_CHECKING:
    from dual_proxy.scenario import Scenario

__all__ = [
    "ANGULAR_METRICS",
    "METRICS",
    "Limit",
    "Metric",
    "compute_metrics",
    "describe_broken_limits",
    "device_in_robot_frame",
    "format_metric",
    "metrics_out_of_limits",
    "normal_error_deg",
]

Array = NDArray[np.float64]


class Limit(NamedTuple):
    """The range in which a metric is as it should be."""

    least: float
    most: float
    of_arm: bool
    """True: a limit of the real arm; a run that breaks it has failed. False:
    what a good run of a sound scheme keeps to."""


class Metric(NamedTuple):
    """What a metric means."""

    unit: str
    description: str
    limit: Limit | None = None


_LIMITS = {
    key: Limit(least, most, of_arm)
    for key, least, most, of_arm in _core._metric_limits()
}

#: The keys of metrics.json, in order.
METRICS: dict[str, Metric] = {
    key: Metric(unit, description, _LIMITS.get(key))
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
        What was run: its `map`, `link.delay` and control period are used.
    wall_s : float, optional
        How long the run took, s.
    recording_scale : float, optional
        `OperatorMotion.scale`, if the operator followed a recording.

    Returns
    -------
    dict
        By key; numbers, booleans, None or a list of names, all valid JSON.
    """
    return dict(
        _core._compute_metrics(
            *_run_log(log),
            map=scenario.map,
            delay=scenario.link.delay,
            control_period=scenario.controller.period,
            recording_scale=recording_scale,
            wall_s=wall_s,
        )
    )


def describe_broken_limits(log: pd.DataFrame, scenario: Scenario) -> list[str]:
    """Say where each limit of the real arm that a run broke was broken most.

    Parameters
    ----------
    log, scenario
        As for `compute_metrics`.

    Returns
    -------
    list of str
        Such as "joint 4 speed 2.31 rad/s at 3.214 s (limit 2.175)".
    """
    names = [name for name, entry in SIGNALS.items() if not entry.integer]
    return _core._describe_broken_limits(
        *_run_log(log, names), control_period=scenario.controller.period
    )


def watch_log(
    log: pd.DataFrame, scenario: Scenario, duration: float, rest: float
) -> list[tuple[Any, ...]]:
    """Watch a run that was logged; see `dual_proxy.watch`."""
    return _core._watch_log(*_run_log(log), scenario, duration, rest)


def metrics_out_of_limits(metrics: Mapping[str, Any]) -> list[str]:
    """Return the keys of the metrics that are not as they should be: out of the
    limits in `METRICS`, not `finite`, or with `limits_broken`."""
    return _core._metrics_out(list(metrics.items()))


def device_in_robot_frame(scenario: Scenario, x_D: Array) -> Array:
    """Map device positions, (n, 3), m, in D, to the robot, in B, eq. (1)."""
    return _core._map_device_positions(scenario.map, x_D)


def format_metric(value: Any) -> str:
    """Return a metric as people read it: four digits, "-" for None, names side by
    side or "none"."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list):
        return ", ".join(value) or "none"
    return f"{value:d}" if isinstance(value, int) else f"{value:.4g}"


def normal_error_deg(log: pd.DataFrame) -> Array:
    """Return the angle between estimated and true normal at each row.

    Returns
    -------
    (n,), deg, in [0, 90]
        NaN where there is no true contact or no estimate; see `METRICS`.
    """
    names = (
        *("contact_force", "contact_normal", "contact_dimension"),
        *("dimension", "force_direction", "force_selection"),
    )
    return _core._normal_error_deg(*_run_log(log, names))


def _run_log(
    log: pd.DataFrame, names: Iterable[str] = SIGNALS
) -> tuple[Array, list[tuple[str, NDArray[Any]]], _core._RunLogStore | None]:
    """Return times, values of those signals that the log has, and where they are.

    Integers are copied, as C++ takes doubles.
    """
    columns = set(log.columns)
    signals = [
        (name, signal(log, name))
        for name in names
        if columns.issuperset(column_names(name))
    ]
    return log.index.to_numpy(np.float64), signals, log_store(log)
