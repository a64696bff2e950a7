# SPDX-License-Identifier: BSD-3-Clause
"""Runs in closed loop, timed, and their errors against a reference.

Times are the processor's. As a machine's speed drifts, and others' differ, a
time is told as a ratio to a yardstick, too, which takes turns with what is
timed, in short pieces of simulated time: the bare engine with scene `plane` and
scheme `position_force` at 1 ms, its log included.
"""

from __future__ import annotations

import os
import time as clock
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dual_proxy.bare import BareStation
from dual_proxy.compare import is_stable
from dual_proxy.log import signal
from dual_proxy.many_runs import Result
from dual_proxy.native import FACES_VARIABLE
from dual_proxy.run import change_scenario
from dual_proxy.scenario import Scenario

__all__ = [
    "CONTROL_PERIOD",
    "DURATION",
    "ERRORS",
    "PHASES",
    "Cost",
    "least_cost",
    "make_yardstick",
    "phase_errors",
    "quiet_scenario",
    "simulate",
    "station_with_faces",
    "summarise_runs",
    "take_turns",
]

#: Free motion; the impact, in which the tool bounces; pressing and sliding.
PHASES = ("free", "impact", "sliding")
#: Key of an error -> what it is.
ERRORS = {
    "position_um": "position, um",
    "force_N": "force, N",
    "tilt_deg": "tilt, deg",
    "normal_deg": "normal, deg",
}
#: Of scene `plane`, s: in it the tool presses and slides.
DURATION = 8.0
#: The usual one, s.
CONTROL_PERIOD = 1e-3

_IMPACT_TIME = 0.3  # s: from first touch.
_PIECE = 0.25  # s

Array = NDArray[np.float64]


class Cost(NamedTuple):
    """What a run took."""

    us_per_ms: float
    """Microseconds of processor time per simulated millisecond."""
    yardsticks: float
    """The same in yardsticks, median of the pieces."""


def quiet_scenario(overrides: Mapping[str, Any], scene: str = "plane") -> Scenario:
    """Return a scene without anything random: with scheme `position_force`,
    without delay and sensor noise.

    With `dual_proxy` the particle filter's draws turn differences of any size
    into some 20 um and 0.02 N while the tool slides.
    """
    return change_scenario(
        scene,
        scheme="position_force",
        delay=0.0,
        duration=DURATION,
        overrides={
            "sensor.force_noise_std": 0.0,
            "sensor.moment_noise_std": 0.0,
            **overrides,
        },
    )


def make_yardstick(duration: float) -> BareStation:
    """Return what times are told in."""
    return BareStation(quiet_scenario({}), duration)


def station_with_faces(faces: str, scenario: Scenario, **options: Any) -> Any:
    """Return a Drake station with LeafSystems of one kind, `python` or `native`;
    options are those of `build_station`."""
    from dual_proxy.station import build_station

    before = os.environ.get(FACES_VARIABLE)
    os.environ[FACES_VARIABLE] = faces
    try:
        return build_station(scenario, **options)
    finally:
        del os.environ[FACES_VARIABLE]
        if before is not None:
            os.environ[FACES_VARIABLE] = before


def take_turns(
    advances: Mapping[str, Callable[[float], Any]],
    end: float,
    begin: float = 0.0,
    before: Callable[[float], Any] = lambda _: None,
) -> dict[str, Array]:
    """Advance several simulations in turns, a piece at a time, and time them.

    Parameters
    ----------
    advances
        By name what advances a simulation to a time, s.
    end, begin : s
        Of simulated time.
    before
        Called untimed with the time at which a piece begins, s.

    Returns
    -------
    dict of (n,)
        By name the processor time of each piece, us per simulated ms.
    """
    times = np.linspace(begin, end, max(1, round((end - begin) / _PIECE)) + 1)
    costs: dict[str, list[float]] = {name: [] for name in advances}
    for start, stop in zip(times[:-1].tolist(), times[1:].tolist(), strict=True):
        before(start)
        for name, advance in advances.items():
            began = clock.process_time()
            advance(stop)
            cost = clock.process_time() - began
            costs[name].append(1e3 * cost / (stop - start))
    return {name: np.array(values) for name, values in costs.items()}


def simulate(
    engine: str, scenario: Scenario, duration: float = DURATION
) -> tuple[pd.DataFrame, Cost]:
    """Run a scenario beside the yardstick; return its log and what it took, with
    plant, loop and log."""
    from dual_proxy.station import build_station

    station: Any
    if engine == "bare":
        station = BareStation(scenario, duration)
    else:
        station = build_station(scenario)
        station.store_log(duration)
    logs = []

    def advance(time: float) -> None:
        station.advance_to(time)
        if time >= duration:
            logs.append(station.log_frame())

    yardstick = make_yardstick(duration)
    costs = take_turns({"run": advance, "yardstick": yardstick.advance_to}, duration)
    ratios = costs["run"] / costs["yardstick"]
    return logs[0], Cost(float(costs["run"].mean()), float(np.median(ratios)))


def least_cost(costs: list[Cost]) -> Cost:
    """Return the least time of several equal runs, and the median in yardsticks."""
    return Cost(
        min(cost.us_per_ms for cost in costs),
        float(np.median([cost.yardsticks for cost in costs])),
    )


def phase_errors(
    log: pd.DataFrame, reference: pd.DataFrame
) -> dict[str, dict[str, float]]:
    """Return a run's errors in each of `PHASES`.

    The reference has every instant of the run. The phases are those of the
    reference.

    Returns
    -------
    dict
        By phase a mapping of `ERRORS`, root mean squares over it: `position_um`
        and `tilt_deg` of the tool, `force_N` of the contact, zero where there is
        none, `normal_deg` of the true contact where both have one, missing if
        there is no such instant.
    """
    reference = reference.iloc[np.searchsorted(reference.index, log.index - 1e-9)]
    time = reference.index.to_numpy()
    touch = time[np.linalg.norm(signal(reference, "contact_force"), axis=1) > 0][0]
    free, late = time < touch, time >= touch + _IMPACT_TIME

    def distance(name: str, sign: float = 1.0) -> Array:
        difference = signal(log, name) - sign * signal(reference, name)
        norm: Array = np.linalg.norm(difference, axis=1)
        return norm

    # 2 sin(angle / 4): unit quaternions q and -q are the same rotation.
    name = "robot_orientation"
    chord = np.minimum(distance(name), distance(name, -1.0))
    errors = {
        "position_um": 1e6 * distance("robot_position"),
        "force_N": distance("contact_force"),
        "tilt_deg": np.degrees(4 * np.arcsin(chord / 2)),
        "normal_deg": np.degrees(2 * np.arcsin(distance("contact_normal") / 2)),
    }
    touching = (signal(log, "contact_dimension") > 0) & (
        signal(reference, "contact_dimension") > 0
    )
    result: dict[str, dict[str, float]] = {}
    for phase, rows in zip(PHASES, (free, ~free & ~late, late), strict=True):
        result[phase] = {}
        for key, values in errors.items():
            of_phase = values[rows & touching] if key == "normal_deg" else values[rows]
            if of_phase.size:
                result[phase][key] = float(np.sqrt(np.mean(np.square(of_phase))))
    return result


def summarise_runs(
    results: Sequence[Result], keys: Mapping[str, str]
) -> dict[str, Any]:
    """Summarise runs that differ in their seed.

    Parameters
    ----------
    results
        What came of them.
    keys
        Metric -> its key in the summary.

    Returns
    -------
    dict
        How many `runs`, how many of them `stable` (`is_stable`), in how many the
        arm's `limits` broke, and by key the mean of the metric over those that
        have it, None if none has.
    """
    runs = [result.metrics for result in results if result.metrics is not None]
    summary: dict[str, Any] = {
        "runs": len(results),
        "stable": sum(is_stable(metrics) is True for metrics in runs),
        "limits": sum(bool(metrics["limits_broken"]) for metrics in runs),
    }
    for metric, key in keys.items():
        values = [metrics[metric] for metrics in runs if metrics[metric] is not None]
        summary[key] = float(np.mean(values)) if values else None
    return summary
