# SPDX-License-Identifier: BSD-3-Clause
"""What the accuracy of the two engines costs: `dual-proxy bench engine`.

Simulates scene `plane` in closed loop, without delay and noise, with each engine
over the steps of its plant, and compares with the bare engine at a much finer
step. Beyond 1 ms the control period is the step.

The scheme is `position_force`, which draws no random numbers. With `dual_proxy`
the particle filter's draws turn differences of any size into some 20 um and
0.02 N while the tool slides, whatever the step and the engine.

Everything but the times depends on the scenario alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from dual_proxy.bench.closed_loop import (
    CONTROL_PERIOD,
    ERRORS,
    PHASES,
    least_cost,
    phase_errors,
    quiet_scenario,
    simulate,
)
from dual_proxy.bench.pages import markdown_table, number_text
from dual_proxy.bench.subject import (
    Results,
    Subject,
    by_plan,
    make_axes,
    plot_trade,
    progress,
    save_axes,
)
from dual_proxy.scenario import Scenario

__all__ = ["FULL", "QUICK", "SUBJECT", "Plan", "measure"]

# The normal of a plane is exact.
_ERRORS = {key: text for key, text in ERRORS.items() if key != "normal_deg"}

Row = dict[str, Any]


class Plan(NamedTuple):
    """How much is run."""

    steps: tuple[float, ...]
    """s, of both engines."""
    reference_step: float
    """s, of the bare engine."""
    repeats: int
    """Of each run, for its time."""


FULL = Plan((5e-5, 1e-4, 2e-4, 5e-4, 1e-3, 2e-3), reference_step=1e-5, repeats=3)
QUICK = Plan((5e-4, 1e-3, 2e-3), reference_step=2e-5, repeats=1)


def measure(plan: Plan) -> list[Row]:
    """Run both engines with every step.

    Returns
    -------
    rows
        Each with `engine`, `step_ms`, `us_per_ms` (processor time per simulated
        ms, of plant, loop and log; the least of all repeats), and per phase a
        mapping of errors, root mean squares over it: `position_um` and
        `tilt_deg` of the tool, `force_N` of the contact, zero where there is
        none.
    """
    reference, _ = simulate("bare", _scenario(plan.reference_step))
    rows = []
    for engine in ("drake", "bare"):
        for step in plan.steps:
            progress(f"{engine}, {1e3 * step:g} ms")
            runs = [simulate(engine, _scenario(step)) for _ in range(plan.repeats)]
            row: Row = {
                "engine": engine,
                "step_ms": 1e3 * step,
                "us_per_ms": least_cost([cost for _, cost in runs]).us_per_ms,
            }
            rows.append(row | phase_errors(runs[0][0], reference))
    return rows


def _scenario(step: float) -> Scenario:
    return quiet_scenario(
        {"control_period": max(step, CONTROL_PERIOD), "scene.time_step": step}
    )


def _columns() -> Iterator[tuple[str, str]]:
    """Phases and errors that are shown: there is no force in free motion."""
    return (
        (phase, key)
        for phase in PHASES
        for key in _ERRORS
        if (phase, key) != ("free", "force_N")
    )


def engine_table(rows: Sequence[Row]) -> str:
    """Return time and errors of each engine and step, as Markdown."""
    return markdown_table(
        [
            *("engine", "step, ms", "us per simulated ms", "x real time"),
            *(f"{phase}: {_ERRORS[key]}" for phase, key in _columns()),
        ],
        (
            [
                *(row["engine"], f"{row['step_ms']:g}", f"{row['us_per_ms']:.1f}"),
                f"{1e3 / row['us_per_ms']:.1f}",
                *(number_text(row[phase][key]) for phase, key in _columns()),
            ]
            for row in rows
        ),
    )


def draw(results: Results, path: Path) -> None:
    """Draw errors over time, a line per engine along its steps."""
    rows = results["rows"]
    axes = make_axes(len(_ERRORS), len(PHASES), (11, 8))
    axes[list(_ERRORS).index("force_N"), 0].set_visible(False)
    for phase, key in _columns():
        axis = axes[list(_ERRORS).index(key), PHASES.index(phase)]
        for engine in dict.fromkeys(row["engine"] for row in rows):
            of_engine = [row for row in rows if row["engine"] == engine]
            points = [
                (row["us_per_ms"], row[phase][key], f"{row['step_ms']:g}")
                for row in of_engine
            ]
            plot_trade(axis, points, engine)
        axis.set(xscale="log", yscale="log")
        axis.set_title(f"{phase}: {_ERRORS[key]}", fontsize=9)
    axes[0, 0].legend(frameon=False)
    for axis in axes[-1]:
        axis.set_xlabel("us per simulated ms")
    save_axes(axes, path)


_MARK = "dual-proxy bench engine"
SUBJECT = Subject(
    name="engine",
    marks=(_MARK,),
    measure=by_plan(measure, QUICK, FULL),
    tables=lambda results: {_MARK: engine_table(results["rows"])},
    draw=draw,
)
