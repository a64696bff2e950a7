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

import sys
import time as clock
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dual_proxy.bench.pages import (
    check_page,
    fill_page,
    machine,
    markdown_table,
    number_text,
    write_json,
)
from dual_proxy.log import signal
from dual_proxy.native import native_in_use
from dual_proxy.run import change_scenario
from dual_proxy.scenario import Scenario

__all__ = [
    "FULL",
    "PAGE_TABLE",
    "PHASES",
    "QUICK",
    "Plan",
    "bench_engine",
    "engine_table",
    "measure",
    "write_page",
]

#: What names the table's place in a page.
PAGE_TABLE = "dual-proxy bench engine"

#: Free motion; the impact, in which the tool bounces; pressing and sliding.
PHASES = ("free", "impact", "sliding")

_DURATION = 8.0  # s
_IMPACT_TIME = 0.3  # s: from first touch.
_CONTROL_PERIOD = 1e-3  # s

# Key of a row's errors -> what it is.
_ERRORS = {
    "position_um": "position, um",
    "force_N": "force, N",
    "tilt_deg": "tilt, deg",
}

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
    reference, _ = _simulate("bare", plan.reference_step)
    rows = []
    for engine in ("drake", "bare"):
        for step in plan.steps:
            print(f"{engine}, {1e3 * step:g} ms", file=sys.stderr, flush=True)
            runs = [_simulate(engine, step) for _ in range(plan.repeats)]
            row: Row = {
                "engine": engine,
                "step_ms": 1e3 * step,
                "us_per_ms": 1e3 * min(cost for _, cost in runs) / _DURATION,
            }
            rows.append(row | _errors(runs[0][0], reference))
    return rows


def _scenario(step: float) -> Scenario:
    return change_scenario(
        "plane",
        scheme="position_force",
        delay=0.0,
        duration=_DURATION,
        overrides={
            "control_period": max(step, _CONTROL_PERIOD),
            "scene.time_step": step,
            "sensor.force_noise_std": 0.0,
            "sensor.moment_noise_std": 0.0,
        },
    )


def _simulate(engine: str, step: float) -> tuple[pd.DataFrame, float]:
    """Return the log, and the processor time that it took, s."""
    from dual_proxy.bare import BareStation
    from dual_proxy.station import build_station

    scenario = _scenario(step)
    station: Any
    if engine == "bare":
        station = BareStation(scenario, _DURATION)
    else:
        station = build_station(scenario)
        station.store_log(_DURATION)
    began = clock.process_time()
    station.advance_to(_DURATION)
    log = station.log_frame()
    return log, clock.process_time() - began


def _errors(log: pd.DataFrame, reference: pd.DataFrame) -> dict[str, dict[str, float]]:
    """Return the errors in each phase."""
    reference = reference.iloc[np.searchsorted(reference.index, log.index - 1e-9)]
    time = reference.index.to_numpy()
    touch = time[np.linalg.norm(signal(reference, "contact_force"), axis=1) > 0][0]
    free, late = time < touch, time >= touch + _IMPACT_TIME

    def distance(name: str, sign: float = 1.0) -> NDArray[np.float64]:
        difference = signal(log, name) - sign * signal(reference, name)
        norm: NDArray[np.float64] = np.linalg.norm(difference, axis=1)
        return norm

    # 2 sin(angle / 4): unit quaternions q and -q are the same rotation.
    name = "robot_orientation"
    chord = np.minimum(distance(name), distance(name, -1.0))
    errors = {
        "position_um": 1e6 * distance("robot_position"),
        "force_N": distance("contact_force"),
        "tilt_deg": np.degrees(4 * np.arcsin(chord / 2)),
    }
    return {
        phase: {
            key: float(np.sqrt(np.mean(np.square(values[rows]))))
            for key, values in errors.items()
        }
        for phase, rows in zip(PHASES, (free, ~free & ~late, late), strict=True)
    }


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


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw errors over time, a line per engine along its steps."""
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(
        len(_ERRORS), len(PHASES), figsize=(11, 8), sharex=True, squeeze=False
    )
    axes[list(_ERRORS).index("force_N"), 0].set_visible(False)
    for phase, key in _columns():
        axis = axes[list(_ERRORS).index(key), PHASES.index(phase)]
        for engine in dict.fromkeys(row["engine"] for row in rows):
            of_engine = [row for row in rows if row["engine"] == engine]
            times = [row["us_per_ms"] for row in of_engine]
            errors = [row[phase][key] for row in of_engine]
            axis.loglog(times, errors, "o-", ms=4, lw=1, label=engine)
            for row, time, error in zip(of_engine, times, errors, strict=True):
                axis.annotate(f"{row['step_ms']:g}", (time, error), fontsize=7)
        axis.set_title(f"{phase}: {_ERRORS[key]}", fontsize=9)
        axis.grid(alpha=0.3)
    axes[0, 0].legend(frameon=False)
    for axis in axes[-1]:
        axis.set_xlabel("us per simulated ms")
    figure.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=100, metadata={"Software": None})
    plt.close(figure)


def write_page(page: Path, rows: Sequence[Row]) -> None:
    """Put the table into a page, and the figure into images/ beside it."""
    fill_page(page, PAGE_TABLE, engine_table(rows))
    draw(rows, page.parent / "images" / "bench_engine.png")


def bench_engine(quick: bool, out: Path, page: Path | None) -> None:
    """Run the benchmark; print its table and save it as JSON and figure.

    Raises
    ------
    ScenarioError
        If the page cannot be used; before anything is run.
    """
    if page is not None:
        check_page(page, quick, [PAGE_TABLE])
    plan = QUICK if quick else FULL
    rows = measure(plan)
    where = machine() | {"systems": "C++" if native_in_use() else "Python"}
    write_json(
        out / "engine.json", {"machine": where, "plan": plan._asdict(), "rows": rows}
    )
    draw(rows, out / "engine.png")
    print(
        f"{where['processor']}, {where['processors']} processors, "
        f"Drake's systems in {where['systems']}\n"
    )
    print(engine_table(rows), end="\n\n")
    print(f"saved: {out / 'engine.json'}, {out / 'engine.png'}")
    if page is not None:
        write_page(page, rows)
