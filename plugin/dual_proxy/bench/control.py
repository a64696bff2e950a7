# SPDX-License-Identifier: BSD-3-Clause
"""What the rate of control gives and costs: `dual-proxy bench control`.

Scene `plane` with the bare engine over rates of control and low-passes of the
force sensor, the plant's step always that of the reference: what differs is
control alone. Errors are of scheme `position_force`, which draws no random
numbers; force ripple and stability are of `dual_proxy`, with the sensor's noise.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

from dual_proxy.bench.closed_loop import (
    least_cost,
    phase_errors,
    quiet_scenario,
    simulate,
    summarise_runs,
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
from dual_proxy.many_runs import Job, run_many
from dual_proxy.run import change_scenario

__all__ = ["FULL", "QUICK", "SUBJECT", "Plan", "control_table", "measure"]

Row = dict[str, Any]

# Metric of a run -> its key in a row.
_RIPPLE = {"haptic_force_ac_N": "hand_ac_N", "contact_force_ac_N": "contact_ac_N"}


class Plan(NamedTuple):
    """How much is run."""

    rates: tuple[float, ...]
    """Hz, of control."""
    cutoffs: tuple[float, ...]
    """Hz, of the sensor's low-pass; 0: none."""
    reference_rate: float
    """Hz, of control without a low-pass; the plant's step is its period."""
    seeds: int
    """Of each run of `dual_proxy`."""
    repeats: int
    """Of each other run, for its time."""


FULL = Plan(
    rates=(250.0, 500.0, 1000.0, 2000.0, 4000.0),
    cutoffs=(0.0, 100.0, 50.0, 20.0, 10.0),
    reference_rate=8000.0,
    seeds=5,
    repeats=3,
)
QUICK = Plan(
    rates=(500.0, 1000.0, 2000.0),
    cutoffs=(0.0, 20.0),
    reference_rate=4000.0,
    seeds=1,
    repeats=1,
)


def measure(plan: Plan) -> list[Row]:
    """Run every rate and low-pass.

    Returns
    -------
    rows
        Each with `rate_Hz`, `cutoff_Hz`; of `position_force` `us_per_ms` and
        `yardsticks` (see `Cost`), `position_um` and `force_N` (root mean squares
        while sliding, against the reference); of `dual_proxy` over 20 s
        `hand_ac_N` and `contact_ac_N` (mean over its seeds of what swings about
        the average over 0.5 s in steady contact; None without such), of `runs`
        the `stable`.
    """
    step = 1.0 / plan.reference_rate

    def overrides(rate: float, cutoff: float) -> dict[str, Any]:
        return {
            "control_period": 1.0 / rate,
            "scene.time_step": step,
            "sensor.cutoff": cutoff,
        }

    settings = list(itertools.product(plan.cutoffs, plan.rates))
    jobs = [
        Job(
            f"{rate:g} Hz low-pass {cutoff:g} Hz seed {seed}",
            change_scenario("plane", seed=seed, overrides=overrides(rate, cutoff)),
            "bare",
        )
        for cutoff, rate in settings
        for seed in range(plan.seeds)
    ]
    results = iter(run_many(jobs))
    reference, _ = simulate("bare", quiet_scenario(overrides(plan.reference_rate, 0.0)))
    rows = []
    for cutoff, rate in settings:
        progress(f"position_force, {rate:g} Hz, low-pass {cutoff:g} Hz")
        scenario = quiet_scenario(overrides(rate, cutoff))
        runs = [simulate("bare", scenario) for _ in range(plan.repeats)]
        errors = phase_errors(runs[0][0], reference)["sliding"]
        rows.append(
            {"rate_Hz": rate, "cutoff_Hz": cutoff}
            | least_cost([cost for _, cost in runs])._asdict()
            | {key: errors[key] for key in ("position_um", "force_N")}
            | summarise_runs([next(results) for _ in range(plan.seeds)], _RIPPLE)
        )
    return rows


def control_table(rows: Iterable[Row]) -> str:
    """Return what `measure` found, as Markdown."""
    return markdown_table(
        [
            *("low-pass, Hz", "control, Hz", "us per simulated ms", "yardsticks"),
            *("position, um", "force, N", "hand AC, N", "contact AC, N", "stable"),
        ],
        (
            [
                f"{row['cutoff_Hz']:g}" if row["cutoff_Hz"] else "none",
                f"{row['rate_Hz']:g}",
                *(
                    number_text(row[key])
                    for key in ("us_per_ms", "yardsticks", "position_um", "force_N")
                ),
                *(optional_text(row[key]) for key in _RIPPLE.values()),
                f"{row['stable']} of {row['runs']}",
            ]
            for row in rows
        ),
    )


def draw(results: Results, path: Path) -> None:
    """Draw errors and ripple over time, a line per low-pass along the rates."""
    rows = results["rows"]
    axes = make_axes(1, 4, (15, 4))
    shown = {
        "position_um": "position, um",
        "force_N": "force, N",
        "hand_ac_N": "hand AC, N",
        "contact_ac_N": "contact AC, N",
    }
    for axis, (key, title) in zip(axes.flat, shown.items(), strict=True):
        for cutoff in dict.fromkeys(row["cutoff_Hz"] for row in rows):
            points = [
                (row["yardsticks"], row[key], f"{row['rate_Hz']:g}")
                for row in rows
                if row["cutoff_Hz"] == cutoff and row[key] is not None
            ]
            label = f"low-pass {cutoff:g} Hz" if cutoff else "no low-pass"
            plot_trade(axis, points, label)
        axis.set(xscale="log", yscale="log")
        axis.set_title(title, fontsize=9)
        axis.set_xlabel("run time, yardsticks")
    axes[0, 0].legend(frameon=False, fontsize=7)
    save_axes(axes, path)


_MARK = "dual-proxy bench control"
SUBJECT = Subject(
    name="control",
    marks=(_MARK,),
    measure=by_plan(measure, QUICK, FULL),
    tables=lambda results: {_MARK: control_table(results["rows"])},
    draw=draw,
)
