# SPDX-License-Identifier: BSD-3-Clause
"""What the accuracy of Drake's contacts costs: `dual-proxy bench plant`.

Closed loop in Drake's plant over its step, its contact approximations and the
stiffness of contact, control always at 1 kHz, against the bare engine with a much
finer step; `dual-proxy bench engine` has both engines over steps down to 0.05 ms,
with one stiffness. Scene `plane`; and the cylinder of `sim_cylinder` with a Panda
and friction, where the normal turns as the tool slides.

Of the sensed force half as much as in these scenes goes to the hand: with all of
it `position_force` swings with contacts of 1e4 N/m, and swings make any small
difference large.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from dual_proxy.bench.closed_loop import (
    ERRORS,
    Cost,
    phase_errors,
    quiet_scenario,
    simulate,
)
from dual_proxy.bench.pages import markdown_table, number_text, optional_text
from dual_proxy.bench.subject import (
    Results,
    Subject,
    by_plan,
    make_axes,
    plot_trade,
    progress,
    save_axes,
)

__all__ = ["APPROXIMATIONS", "BARE", "FULL", "QUICK", "SUBJECT", "Plan", "measure"]

#: Drake's, of discrete contacts; sap with the scenarios' relaxation time of 10 ms,
#: and with 1 ms.
APPROXIMATIONS: dict[str, dict[str, Any]] = {
    "lagged": {"scene.contact_approximation": "lagged"},
    "similar": {"scene.contact_approximation": "similar"},
    "sap": {"scene.contact_approximation": "sap"},
    "sap, 1 ms": {
        "scene.contact_approximation": "sap",
        "scene.relaxation_time": 1e-3,
    },
}
#: In their place: the bare engine at twice the reference's step, which says how
#: far the reference can be relied on.
BARE = "bare"

Row = dict[str, Any]

_FORCE_SCALE = 0.3

# What a scene is changed by.
_SCENES: dict[str, dict[str, Any]] = {
    "plane": {},
    "sim_cylinder": {
        "robot": "panda",
        "map.R_cw": np.diag([1.0, -1.0, -1.0]).tolist(),  # The tool points down.
        "scene.friction": 0.3,
        "scene.contact_dissipation": 10.0,
    },
}

# Phase and error of each column.
_COLUMNS = (
    ("impact", "force_N"),
    ("sliding", "position_um"),
    ("sliding", "force_N"),
    ("sliding", "normal_deg"),
)


class Plan(NamedTuple):
    """How much is run."""

    scenes: dict[str, tuple[float, tuple[float, ...]]]
    """Scene -> how long, s, and with what stiffnesses, N/m."""
    steps: tuple[float, ...]
    """s, of Drake's plant."""
    reference_step: float
    """s, of the bare engine."""


FULL = Plan(
    scenes={"plane": (8.0, (1e3, 1e4, 1e5, 1e6)), "sim_cylinder": (10.0, (1e4,))},
    steps=(2.5e-4, 5e-4, 1e-3, 2e-3, 4e-3),
    reference_step=1e-5,
)
QUICK = Plan(
    scenes={"plane": (6.0, (1e5,)), "sim_cylinder": (8.0, (1e4,))},
    steps=(1e-3, 4e-3),
    reference_step=1e-4,
)


def measure(plan: Plan) -> list[Row]:
    """Run every scene, stiffness, approximation and step.

    Returns
    -------
    rows
        Each with `scene`, `approximation` (or `BARE`), `stiffness_N_m`, `step_ms`,
        `us_per_ms` and `yardsticks` (see `Cost`), and per phase a mapping of
        errors, as of `phase_errors`.
    """
    return [
        row
        for scene, (duration, stiffnesses) in plan.scenes.items()
        for stiffness in stiffnesses
        for row in _measure_case(plan, scene, duration, stiffness)
    ]


def _measure_case(
    plan: Plan, scene: str, duration: float, stiffness: float
) -> Iterator[Row]:
    """Yield the rows of a scene with a stiffness."""

    def run(
        engine: str, step: float, approximation: str = "lagged"
    ) -> tuple[pd.DataFrame, Cost]:
        progress(
            f"{scene}, {stiffness:g} N/m, {engine}, {approximation}, {1e3 * step:g} ms"
        )
        changes = (
            _SCENES[scene]
            | APPROXIMATIONS[approximation]
            | {
                "duration": duration,
                "schemes.position_force.force_scale": _FORCE_SCALE,
                "scene.contact_stiffness": stiffness,
                "scene.time_step": step,
            }
        )
        return simulate(engine, quiet_scenario(changes, scene), duration)

    reference, _ = run("bare", plan.reference_step)
    coarser = 2 * plan.reference_step
    runs = [(BARE, coarser, run("bare", coarser))]
    runs += [
        (approximation, step, run("drake", step, approximation))
        for approximation, step in itertools.product(APPROXIMATIONS, plan.steps)
    ]
    for approximation, step, (log, cost) in runs:
        yield (
            {
                "scene": scene,
                "approximation": approximation,
                "stiffness_N_m": stiffness,
                "step_ms": 1e3 * step,
            }
            | cost._asdict()
            | phase_errors(log, reference)
        )


def plant_table(rows: Iterable[Row]) -> str:
    """Return what `measure` found, as Markdown."""
    return markdown_table(
        [
            *("scene", "stiffness, N/m", "approximation", "step, ms"),
            *("x real time", "yardsticks"),
            *(f"{phase}: {ERRORS[key]}" for phase, key in _COLUMNS),
        ],
        (
            [
                *(row["scene"], f"{row['stiffness_N_m']:.0e}".replace("e+0", "e")),
                *(row["approximation"], f"{row['step_ms']:g}"),
                *(f"{1e3 / row['us_per_ms']:.1f}", number_text(row["yardsticks"])),
                *(optional_text(row[phase].get(key)) for phase, key in _COLUMNS),
            ]
            for row in rows
        ),
    )


def draw(results: Results, path: Path) -> None:
    """Draw errors while sliding over run time: a row of axes per error, a column
    per scene and stiffness, a line per approximation along the steps."""
    rows = results["rows"]
    keys = [key for phase, key in _COLUMNS if phase == "sliding"]
    cases = list(dict.fromkeys((row["scene"], row["stiffness_N_m"]) for row in rows))
    axes = make_axes(len(keys), len(cases), (3.2 * len(cases), 8))
    for (i, key), (j, case) in itertools.product(enumerate(keys), enumerate(cases)):
        axis = axes[i, j]
        for approximation in APPROXIMATIONS:
            points = [
                row
                for row in rows
                if (row["scene"], row["stiffness_N_m"]) == case
                and row["approximation"] == approximation
            ]
            line = [
                (row["yardsticks"], row["sliding"][key], f"{row['step_ms']:g}")
                for row in points
            ]
            plot_trade(axis, line, approximation)
        if any(row["sliding"][key] > 0 for row in points):
            axis.set(xscale="log", yscale="log")
        else:  # The normal of a plane is exact.
            axis.set_visible(False)
        scene, stiffness = case
        axis.set_title(f"{scene}, {stiffness:.0e} N/m: {ERRORS[key]}", fontsize=8)
    axes[0, 0].legend(frameon=False, fontsize=7)
    for axis in axes[-1]:
        axis.set_xlabel("run time, yardsticks", fontsize=8)
    save_axes(axes, path)


_MARK = "dual-proxy bench plant"
SUBJECT = Subject(
    name="plant",
    marks=(_MARK,),
    measure=by_plan(measure, QUICK, FULL),
    tables=lambda results: {_MARK: plant_table(results["rows"])},
    draw=draw,
)
