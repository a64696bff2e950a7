# SPDX-License-Identifier: BSD-3-Clause
"""What is left out where a scene does not need it: `dual-proxy bench savings`.

Each saving with and without, in turns, and what differs in the results.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dual_proxy import _core
from dual_proxy._core import (
    FilterTrialMetrics,
    FilterTrialParams,
    ForceSpaceParticleFilterParams,
    run_filter_trial,
)
from dual_proxy.bare import BareStation
from dual_proxy.bench.closed_loop import quiet_scenario, take_turns
from dual_proxy.bench.pages import markdown_table, number_text
from dual_proxy.bench.subject import (
    Results,
    Subject,
    by_plan,
    make_axes,
    progress,
    save_axes,
)
from dual_proxy.log import signal
from dual_proxy.run import change_scenario

__all__ = ["FULL", "QUICK", "SUBJECT", "Plan", "measure", "savings_table"]

Row = dict[str, Any]
Array = NDArray[np.float64]

# What a difference is told in -> its unit, and how it is written there.
_DIFFERENCES = {
    "position_m": ("um", 1e6),
    "force_N": ("N", 1.0),
    "joint_rad": ("rad", 1.0),
    "false_contacts": ("samples with a contact", 1.0),
}


class Plan(NamedTuple):
    """How much is run."""

    duration: float
    """s, of runs."""
    pressing: tuple[float, float]
    """s: from when to when the plant alone is driven; the tool presses."""
    filter_turns: int
    """Of the filter, in each of its situations."""


FULL = Plan(duration=12.0, pressing=(6.0, 10.0), filter_turns=50)
QUICK = Plan(duration=6.0, pressing=(5.0, 6.0), filter_turns=10)


def measure(plan: Plan) -> list[Row]:
    """Measure every saving.

    Returns
    -------
    rows
        Each with `saving`, what is `compared`, `unit` of the times, the times
        `without` and `with` the saving (median of pieces that took turns),
        `ratio` (median of the pieces') and `difference`: of results, as root mean
        square over the run, nothing if they are the same bits.
    """
    parts: tuple[Callable[[Plan], Iterable[Row]], ...] = (
        *(_no_plant, _no_rotation, _no_viewer, _no_log),
        *(_no_pictures_or_collisions, _free_space),
    )
    return [row for part in parts for row in part(plan)]


def _row(
    saving: str,
    compared: str,
    costs: Mapping[str, Array],
    difference: Mapping[str, float],
    unit: str = "us per simulated ms",
) -> Row:
    without, with_saving = costs["without"], costs["with"]
    return {
        "saving": saving,
        "compared": compared,
        "unit": unit,
        "without": float(np.median(without)),
        "with": float(np.median(with_saving)),
        "ratio": float(np.median(without / with_saving)),
        "difference": dict(difference),
    }


def _difference(one: pd.DataFrame, other: pd.DataFrame) -> dict[str, float]:
    """Return what differs between the logs of two runs, in what both have."""
    common = one.columns.intersection(other.columns)
    if one[common].equals(other[common]):
        return {}
    result = {}
    for key, name in (("position_m", "robot_position"), ("force_N", "contact_force")):
        error = np.linalg.norm(signal(one, name) - signal(other, name), axis=1)
        result[key] = float(np.sqrt(np.mean(np.square(error))))
    return result


def _compare_runs(
    saving: str, compared: str, plan: Plan, without: Any, with_saving: Any
) -> Row:
    """Run two stations in turns."""
    progress(f"{saving}: {compared}")
    costs = take_turns(
        {"without": without.advance_to, "with": with_saving.advance_to}, plan.duration
    )
    difference = _difference(without.log_frame(), with_saving.log_frame())
    return _row(saving, compared, costs, difference)


def _no_plant(plan: Plan) -> Iterable[Row]:
    from dual_proxy.station import build_station

    point = change_scenario("sim_cylinder")
    arm = point.with_overrides(
        {"robot": "panda", "map.R_cw": np.diag([1.0, -1.0, -1.0]).tolist()}
    )
    saving = "no arm, no MultibodyPlant"
    for engine in ("Drake", "bare engine"):
        yield _compare_runs(
            saving,
            f"sim_cylinder: a Panda ({engine}), the point mass (bare engine)",
            plan,
            build_station(arm)
            if engine == "Drake"
            else BareStation(arm, plan.duration),
            BareStation(point, plan.duration),
        )


def _no_rotation(plan: Plan) -> Iterable[Row]:
    scenario = change_scenario("plane")
    with_angular = scenario.with_overrides({"angular_filter.enabled": True})
    yield _compare_runs(
        "no rotations blocked, no angular filter",
        "plane, bare engine: the angular filter on, off",
        plan,
        BareStation(with_angular, plan.duration),
        BareStation(scenario, plan.duration),
    )


def _no_viewer(plan: Plan) -> Iterable[Row]:
    from dual_proxy.station import build_station

    scenario = change_scenario("plane")
    yield _compare_runs(
        "no viewer, nothing drawn",
        "plane, Drake: Meshcat at 30 pictures per second, none",
        plan,
        build_station(scenario, meshcat=True),
        build_station(scenario),
    )


def _no_log(plan: Plan) -> Iterable[Row]:
    from dual_proxy.station import build_station

    saving, compared = "what nobody logs is not computed", "plane, Drake: log on, off"
    progress(f"{saving}: {compared}")
    scenario = change_scenario("plane")
    stations = {
        "without": build_station(scenario),
        "with": build_station(scenario, logged=False),
    }
    costs = take_turns(
        {name: station.advance_to for name, station in stations.items()}, plan.duration
    )
    states: list[Any] = [
        station.diagram.GetOutputPort("robot_state").Eval(
            station.simulator.get_context()
        )
        for station in stations.values()
    ]
    yield _row(saving, compared, costs, _joint_difference(*states))


def _joint_difference(one: Array, other: Array) -> dict[str, float]:
    if np.array_equal(one, other):
        return {}
    return {"joint_rad": float(np.abs(one[:7] - other[:7]).max())}


def _no_pictures_or_collisions(plan: Plan) -> Iterable[Row]:
    from dual_proxy.bench.recorded_plant import RecordedPlant
    from dual_proxy.station import build_station

    scenario = quiet_scenario({})
    begin, end = plan.pressing
    run = build_station(scenario)
    run.advance_to(end + 0.01)  # The plant takes up torques ahead of the log.
    log = run.log_frame()
    for saving, compared, heavier, lighter in (
        (
            "no viewer, no pictures moved along",
            "plane, Drake's plant alone, pressing: visual geometry, none",
            {"drawn": True},
            {},
        ),
        (
            "links that cannot touch have no collision geometry",
            "plane, Drake's plant alone, pressing: links that collide, that do not",
            {"drawn": True, "colliding": True},
            {"drawn": True},
        ),
    ):
        progress(f"{saving}: {compared}")
        plants = {
            "without": RecordedPlant(scenario, log, **heavier),
            "with": RecordedPlant(scenario, log, **lighter),
        }
        for plant in plants.values():
            plant.start(begin)
        differences: list[dict[str, float]] = []

        def follow(time: float, plants: Any = plants, found: Any = differences) -> None:
            found.append(_joint_difference(*(p.state for p in plants.values())))
            for plant in plants.values():
                plant.follow(time)

        costs = take_turns(
            {name: plant.simulator.AdvanceTo for name, plant in plants.items()},
            end,
            begin,
            follow,
        )
        worst = max(differences, key=lambda found: found.get("joint_rad", 0.0))
        yield _row(saving, compared, costs, worst)


def _free_space(plan: Plan) -> Iterable[Row]:
    saving = "in free space the filter is exact and nearly free"
    compared = "the filter alone, 1000 particles: pressing and sliding, in free space"
    progress(f"{saving}: {compared}")
    rate = 100.0
    params = ForceSpaceParticleFilterParams(num_particles=1000, period=1.0 / rate)
    trials = {
        name: run_filter_trial(FilterTrialParams(scene=scene, force=10.0), params)
        for name, scene in (("without", "still"), ("with", "free"))
    }
    costs: dict[str, list[float]] = {name: [] for name in trials}
    for _ in range(plan.filter_turns):
        for name, trial in trials.items():
            cost = _core._measure_filter_cost(trial, params, 0, 2)
            costs[name].append(cost / rate)
    free = FilterTrialMetrics()
    free.add(trials["with"])
    yield _row(
        saving,
        compared,
        {name: np.array(values) for name, values in costs.items()},
        {"false_contacts": free.false_contact_samples},
        "us per update",
    )


def savings_table(rows: Iterable[Row]) -> str:
    """Return what `measure` found, as Markdown."""
    return markdown_table(
        ["saving", "compared", "unit", "without", "with", "ratio", "difference"],
        (
            [
                *(row["saving"], row["compared"], row["unit"]),
                *(number_text(row[key]) for key in ("without", "with", "ratio")),
                _difference_text(row["difference"]),
            ]
            for row in rows
        ),
    )


def _difference_text(difference: Mapping[str, float]) -> str:
    return (
        ", ".join(
            f"{number_text(_DIFFERENCES[key][1] * value)} {_DIFFERENCES[key][0]}"
            for key, value in difference.items()
        )
        or "none: same bits"
    )


def draw(results: Results, path: Path) -> None:
    """Draw by how much each saving shortens what it saves from."""
    rows = results["rows"]
    axes = make_axes(1, 1, (9, 4.5))
    axis = axes[0, 0]
    axis.barh([row["compared"] for row in rows], [row["ratio"] for row in rows])
    axis.set(xscale="log", xlabel="time without the saving over time with it")
    axis.axvline(1.0, color="black", lw=0.8)
    axis.invert_yaxis()
    axis.tick_params(axis="y", labelsize=7)
    save_axes(axes, path)


_MARK = "dual-proxy bench savings"
SUBJECT = Subject(
    name="savings",
    marks=(_MARK,),
    measure=by_plan(measure, QUICK, FULL),
    tables=lambda results: {_MARK: savings_table(results["rows"])},
    draw=draw,
)
