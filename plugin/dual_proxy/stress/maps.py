# SPDX-License-Identifier: BSD-3-Clause
"""Up to which stiffness a scheme is stable: boundaries by bisection."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from dual_proxy.bench.subject import make_axes, save_axes
from dual_proxy.many_runs import Job, Result, RunsFolder, run_many
from dual_proxy.run import change_scenario
from dual_proxy.scenario import SCHEMES, Scenario, ScenarioError
from dual_proxy.stress.cases import REST, REST_DELAYS
from dual_proxy.stress.verdict import judge

__all__ = ["AXES", "STIFFNESSES", "Axis", "Boundary", "draw_maps", "find_boundaries"]

#: N/m, of tool and surface together: the range that is looked at.
STIFFNESSES = (1e2, 1e6)
# Of the bisection, each of which halves a range on a logarithmic scale.
_STEPS = 8
_REST = 2.0  # s


def _press(delay: float = 0.0) -> dict[str, Any]:
    """Press on the table, 20 mm beyond, and stay there."""
    end = 2.0 + REST + REST_DELAYS * delay
    return {
        "operator.waypoints": [
            {"time": 0.0, "position": [0.45, 0.0, 0.48]},
            {"time": 2.0, "position": [0.45, 0.0, 0.39]},
            {"time": end, "position": [0.45, 0.0, 0.39]},
        ],
    }


class Axis(NamedTuple):
    """What a boundary goes along."""

    label: str
    unit: str
    factor: float
    """From SI units to that unit."""
    values: tuple[float, ...]
    overrides: Callable[[float], dict[str, Any]]


#: By name.
AXES: dict[str, Axis] = {
    "delay": Axis(
        *("delay, one way", "ms", 1e3),
        (0.0, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 3.0),
        lambda value: {"link.delay": value} | _press(value),
    ),
    "control period": Axis(
        *("control period", "ms", 1e3),
        (0.00025, 0.0005, 0.001, 0.0015, 0.002, 0.003, 0.004),
        lambda value: {"control_period": value, "scene.time_step": 2.5e-4},
    ),
    "sensor delay": Axis(
        *("delay of the force sensor", "ms", 1e3),
        (0.0, 0.001, 0.002, 0.004, 0.008, 0.016),
        lambda value: {"sensor.delay": value},
    ),
}


class Boundary(NamedTuple):
    """Of a scheme at a value of an axis."""

    axis: str
    scheme: str
    value: float
    stiffness: float
    """N/m: the largest stable one that was found; 0 if the least is not,
    infinite if the greatest is."""
    why: str
    """What is wrong beyond it."""


def find_boundaries(
    folder: RunsFolder | None = None,
    schemes: Sequence[str] = tuple(SCHEMES),
    axes: Sequence[str] = tuple(AXES),
    steps: int = _STEPS,
    workers: int | None = None,
    progress: Callable[[str], None] | None = None,
    cluster: str | None = None,
) -> list[Boundary]:
    """Find up to which stiffness each scheme is stable, at each value of each axis.

    The tool of scene `plane` presses and stays; stable is what `judge` finds
    nothing wrong with. What a scenario's checks refuse is beyond the boundary. All
    boundaries are halved at the same time.
    """
    low, high = map(math.log, STIFFNESSES)
    bases = {
        scheme: change_scenario("plane", scheme=scheme, overrides=_press())
        for scheme in schemes
    }
    points = [
        (axis, scheme, value)
        for axis in axes
        for scheme in schemes
        for value in AXES[axis].values
    ]

    def try_all(logs: dict[tuple[str, str, float], float]) -> dict[Any, str]:
        """Return what is wrong with each point at a stiffness."""
        plan: dict[Any, Job] = {}
        wrong = {}
        for point, stiffness in logs.items():
            axis, scheme, value = point
            overrides = AXES[axis].overrides(value)
            overrides["scene.contact_stiffness"] = math.exp(stiffness)
            try:
                scenario = bases[scheme].with_overrides(overrides)
            except ScenarioError as error:
                wrong[point] = f"refused: {error}"
                continue
            name = f"{scheme} {axis} {value:g} {math.exp(stiffness):.0f}"
            plan[point] = Job(name, scenario, "bare", _REST)
        results = run_many(list(plan.values()), folder, workers, progress, cluster)
        for (point, job), result in zip(plan.items(), results, strict=True):
            wrong[point] = _what_is_wrong(result, job.scenario)
        return wrong

    least = try_all(dict.fromkeys(points, low))
    most = try_all(dict.fromkeys(points, high))
    ranges = {
        point: (low, high) for point in points if not least[point] and most[point]
    }
    why = dict(most)
    for _ in range(steps):
        middle = {point: sum(ends) / 2 for point, ends in ranges.items()}
        for point, text in try_all(middle).items():
            below, above = ranges[point]
            if text:
                ranges[point], why[point] = (below, middle[point]), text
            else:
                ranges[point] = (middle[point], above)
    found = []
    for point in points:
        if point in ranges:
            stiffness, text = math.exp(ranges[point][0]), why[point]
        elif least[point]:
            stiffness, text = 0.0, least[point]
        else:
            stiffness, text = math.inf, ""
        found.append(Boundary(*point, stiffness, text))
    return found


def _what_is_wrong(result: Result, scenario: Scenario) -> str:
    if result.metrics is None:
        return result.failure
    return judge(result.metrics, scenario).wrong


def stiffness_text(stiffness: float) -> str:
    """Return a boundary as a table has it, in N/m."""
    if stiffness == 0:
        return "none"
    return "all" if math.isinf(stiffness) else f"{stiffness:.2g}".replace("e+0", "e")


def draw_maps(boundaries: Sequence[Boundary], path: Path) -> None:
    """Draw each axis: the boundary of each scheme; above it is not stable."""
    names = list(dict.fromkeys(boundary.axis for boundary in boundaries))
    axes = make_axes(1, len(names), (4.6 * len(names), 4.2))
    for name, panel in zip(names, axes.flat, strict=True):
        axis = AXES[name]
        ticks = range(len(axis.values))
        schemes = dict.fromkeys(b.scheme for b in boundaries if b.axis == name)
        for number, scheme in enumerate(schemes):
            heights = [
                min(max(b.stiffness, STIFFNESSES[0] / 1.6), 1.6 * STIFFNESSES[1])
                for b in boundaries
                if (b.axis, b.scheme) == (name, scheme)
            ]
            # Lines that lie upon each other are moved a little.
            shift = 1 + 0.04 * (number - len(schemes) / 2)
            style = {"lw": 2.5} if scheme == "dual_proxy" else {"lw": 1.2}
            panel.plot(
                ticks, [shift * h for h in heights], "o-", ms=3, label=scheme, **style
            )
        panel.set_yscale("log")
        panel.set_xticks(list(ticks), [f"{axis.factor * v:g}" for v in axis.values])
        panel.set_xlabel(f"{axis.label}, {axis.unit}")
        panel.set_title(f"stable below, over the {name}", fontsize=10)
        for limit in STIFFNESSES:
            panel.axhline(limit, color="0.6", lw=0.8, ls="--")
    axes[0, 0].set_ylabel("contact stiffness, N/m")
    axes[0, 0].legend(fontsize=7, frameon=False)
    save_axes(axes, path)
