# SPDX-License-Identifier: BSD-3-Clause
"""The command `dual-proxy bench filter`."""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path

from dual_proxy.bench.filter import (
    FULL,
    LIKELIHOODS,
    QUICK,
    Config,
    measure_grid,
    measure_situations,
    measure_still,
    worker_pool,
)
from dual_proxy.bench.filter_recordings import measure_recordings, read_recordings
from dual_proxy.bench.filter_report import (
    PAGE_IMAGE,
    PAGE_TABLES,
    SITUATION_RATES,
    TARGET_PARTICLES,
    TARGET_RATES,
    dependence_table,
    draw,
    grid_table,
    situation_table,
    target_table,
    write_page,
)
from dual_proxy.bench.pages import check_page, machine, write_json

__all__ = ["bench_filter"]


def bench_filter(
    quick: bool,
    out: Path,
    page: Path | None,
    recordings: Path | None,
    jobs: int | None = None,
) -> None:
    """Run the benchmark; print its tables and save them as JSON and figure.

    Raises
    ------
    ScenarioError
        If the page or the recordings cannot be used; before anything is run.
    OSError
        If something cannot be saved; the tables are printed nevertheless.
    """
    if page is not None:
        check_page(page, quick, PAGE_TABLES, [PAGE_IMAGE])
    recorded = read_recordings(recordings) if recordings is not None else []
    plan = QUICK if quick else FULL
    targeted, in_situations = (
        [
            Config(likelihood, TARGET_PARTICLES, rate)
            for likelihood in LIKELIHOODS
            for rate in rates
        ]
        for rates in (TARGET_RATES, SITUATION_RATES)
    )
    with worker_pool(jobs) as pool:
        results = {
            "grid": measure_grid(plan, pool, _progress),
            "still": measure_still(plan, targeted, pool),
            "situations": measure_situations(plan, in_situations, pool, _progress),
            # They are of 100 Hz.
            "recordings": measure_recordings(
                recorded, [config for config in targeted if config.rate <= 100.0]
            )
            if recorded
            else [],
        }
    where = machine()
    print(f"{where['processor']}, {where['processors']} processors\n")
    print(grid_table(results), end="\n\n")
    print(target_table(results), end="\n\n")
    print(situation_table(results), end="\n\n")
    if plan.full_square:
        print(dependence_table(results), end="\n\n")
    write_json(out / "filter.json", {"machine": where, "plan": asdict(plan)} | results)
    draw(results, out / "filter.png")
    print(f"saved: {out / 'filter.json'}, {out / 'filter.png'}")
    if page is not None:
        write_page(page, results)


def _progress(text: str) -> None:
    print(text, file=sys.stderr, flush=True)
