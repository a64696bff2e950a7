# SPDX-License-Identifier: BSD-3-Clause
"""What the rate of control gives and costs: `dual-proxy bench control`.

Scene `plane` with the bare engine over rates of control and what else stands
between controller and plant: the force sensor's low-pass and delay, steps between
the torques that joints can give. The plant's step is always that of the reference.
Errors against the reference are of scheme `position_force`, which draws no random
numbers; of `dual_proxy`, with the sensor's noise, it is how far the tool is from the
hand's way, the filter's normal from the true one, the ripple, and whether it is stable.
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
_OF_DUAL_PROXY = {
    "position_rms_free_delay_compensated_m": "tracking_m",
    "normal_error_mean_deg": "normal_deg",
    "haptic_force_ac_N": "hand_ac_N",
    "contact_force_ac_N": "contact_ac_N",
}


class Between(NamedTuple):
    """Something between controller and plant."""

    name: str
    overrides: dict[str, Any]


_NOTHING = Between("nothing", {"sensor.cutoff": 0.0})


def _low_pass(cutoff: float) -> Between:
    return Between(f"low-pass {cutoff:g} Hz", {"sensor.cutoff": cutoff})


def _sensor_delay(milliseconds: float) -> Between:
    delay = 1e-3 * milliseconds
    overrides = _NOTHING.overrides | {"sensor.delay": delay}
    return Between(f"sensor {milliseconds:g} ms late", overrides)


def _torque_steps(step: float) -> Between:
    overrides = _NOTHING.overrides | {"mismatch.torque_step": step}
    return Between(f"torques in steps of {step:g} N m", overrides)


class Plan(NamedTuple):
    """How much is run."""

    rates: tuple[float, ...]
    """Hz, of control."""
    between: tuple[Between, ...]
    """What stands between controller and plant, one at a time."""
    reference_rate: float
    """Hz, of control with nothing in between; the plant's step is its period."""
    seeds: int
    """Of each run of `dual_proxy`."""
    repeats: int
    """Of each other run, for its time."""


FULL = Plan(
    rates=(250.0, 500.0, 1000.0, 2000.0, 4000.0),
    between=(
        _NOTHING,
        *(_low_pass(cutoff) for cutoff in (100.0, 50.0, 20.0, 10.0)),
        # In whole periods of all rates.
        *(_sensor_delay(delay) for delay in (4.0, 8.0, 16.0)),
        *(_torque_steps(step) for step in (0.003, 0.01, 0.03, 0.1)),
    ),
    reference_rate=8000.0,
    seeds=5,
    repeats=3,
)
QUICK = Plan(
    rates=(500.0, 1000.0, 2000.0),
    between=(_NOTHING, _low_pass(20.0), _sensor_delay(8.0), _torque_steps(0.03)),
    reference_rate=4000.0,
    seeds=1,
    repeats=1,
)


def measure(plan: Plan, jobs: int | None = None) -> list[Row]:
    """Run every rate with each of what is between, `jobs` runs at a time
    (all cores if None).

    Returns
    -------
    rows
        Each with `rate_Hz`, `between`; of `position_force` `us_per_ms` and
        `yardsticks` (see `Cost`), `position_um` and `force_N` (root mean squares
        while sliding, against the reference); of `dual_proxy` over 20 s, as means over
        its seeds, `tracking_m` (root mean square in the free directions), `normal_deg`
        (of the filter's normal), `hand_ac_N` and `contact_ac_N` (what swings about the
        average over 0.5 s in steady contact; None without such), of `runs` the
        `stable`.
    """
    step = 1.0 / plan.reference_rate

    def overrides(rate: float, between: Between) -> dict[str, Any]:
        rates = {"control_period": 1.0 / rate, "scene.time_step": step}
        return rates | between.overrides

    settings = list(itertools.product(plan.between, plan.rates))
    planned = [
        Job(
            f"{rate:g} Hz {between.name} seed {seed}",
            change_scenario("plane", seed=seed, overrides=overrides(rate, between)),
            "bare",
        )
        for between, rate in settings
        for seed in range(plan.seeds)
    ]
    results = iter(run_many(planned, workers=jobs))
    reference, _ = simulate(
        "bare", quiet_scenario(overrides(plan.reference_rate, _NOTHING))
    )
    rows = []
    for between, rate in settings:
        progress(f"position_force, {rate:g} Hz, {between.name}")
        scenario = quiet_scenario(overrides(rate, between))
        runs = [simulate("bare", scenario) for _ in range(plan.repeats)]
        errors = phase_errors(runs[0][0], reference)["sliding"]
        rows.append(
            {"rate_Hz": rate, "between": between.name}
            | least_cost([cost for _, cost in runs])._asdict()
            | {key: errors[key] for key in ("position_um", "force_N")}
            | summarise_runs([next(results) for _ in range(plan.seeds)], _OF_DUAL_PROXY)
        )
    return rows


def control_table(rows: Iterable[Row]) -> str:
    """Return what `measure` found, as Markdown."""
    return markdown_table(
        [
            *("in between", "control, Hz", "us per simulated ms", "yardsticks"),
            *("position, um", "force, N", "tracking, mm", "normal, deg"),
            *("hand AC, N", "contact AC, N", "stable"),
        ],
        (
            [
                row["between"],
                f"{row['rate_Hz']:g}",
                *(
                    number_text(row[key])
                    for key in ("us_per_ms", "yardsticks", "position_um", "force_N")
                ),
                _millimetres(row["tracking_m"]),
                *(
                    optional_text(row[key])
                    for key in ("normal_deg", "hand_ac_N", "contact_ac_N")
                ),
                f"{row['stable']} of {row['runs']}",
            ]
            for row in rows
        ),
    )


def _millimetres(metres: float | None) -> str:
    return optional_text(None if metres is None else 1e3 * metres)


def draw(results: Results, path: Path) -> None:
    """Draw errors and ripple over time, a line for each of what is between along
    the rates."""
    rows = results["rows"]
    axes = make_axes(1, 4, (15, 4))
    shown = {
        "position_um": "position, um",
        "force_N": "force, N",
        "hand_ac_N": "hand AC, N",
        "contact_ac_N": "contact AC, N",
    }
    for axis, (key, title) in zip(axes.flat, shown.items(), strict=True):
        for between in dict.fromkeys(row["between"] for row in rows):
            points = [
                (row["yardsticks"], row[key], f"{row['rate_Hz']:g}")
                for row in rows
                if row["between"] == between and row[key] is not None
            ]
            plot_trade(axis, points, between)
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
