# SPDX-License-Identifier: BSD-3-Clause
"""What each part of likelihood `friction_cone` gives: the trials of
`dual-proxy bench filter` at 100 Hz with one parameter at a time taken away or
changed.

python benchmarks/filter_choices.py [--page docs/filter.md]

Prints Markdown: over all trials, mean and 95th percentile of the direction
error, share of contact time with the right dimension, and how many contacts,
losses and second walls were not found in time (50, 50 and 100 ms).
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import dual_proxy as dp
from dual_proxy.bench.filter import FULL, LATE_MS, worker_pool
from dual_proxy.bench.pages import fill_page, markdown_table

RATE = 100.0

# What is changed -> parameters of FrictionConeParams, or of the filter itself.
CHOICES: dict[str, dict[str, Any]] = {
    "as it is": {},
    "the paper's likelihood": {"likelihood": "paper"},
    "velocity says nothing (`velocity_noise` 10 m/s)": {"velocity_noise": 10.0},
    "velocity is exact (`velocity_noise` 0.3 mm/s)": {"velocity_noise": 0.0003},
    "surfaces are rigid (`compliance` 0)": {"compliance": 0.0},
    "normals do not turn (`curvature` 0, `torsion` 0)": {
        "curvature": 0.0,
        "torsion": 0.0,
    },
    "normals turn either way alike (`torsion` 2)": {"torsion": 2.0},
    "no friction (`max_friction` 0.01)": {"max_friction": 0.01},
    "any friction (`max_friction` 2)": {"max_friction": 2.0},
    "decides on little (`evidence` 3)": {"evidence": 3.0},
    "decides on much (`evidence` 50)": {"evidence": 50.0},
    "100 particles": {"num_particles": 100},
    "10000 particles": {"num_particles": 10000},
}

HEAD = (
    "",
    "direction error mean / 95 %, deg",
    "dimension right",
    "late: found",
    "lost",
    "second wall",
)


def make_params(changes: dict[str, Any]) -> dp.ForceSpaceParticleFilterParams:
    """Returns the filter's parameters with some changed."""
    params = dp.ForceSpaceParticleFilterParams(period=1 / RATE)
    cone = dp.FrictionConeParams()
    for name, value in changes.items():
        setattr(params if hasattr(params, name) else cone, name, value)
    params.friction_cone = cone
    return params


def measure(changes: dict[str, Any]) -> list[str]:
    """Returns the cells of a line."""
    params = make_params(changes)

    def run(trial: dp.FilterTrialParams) -> dp.FilterTrialMetrics:
        metrics = dp.FilterTrialMetrics()
        metrics.add(dp.run_filter_trial(trial, params, trial.seed))
        return metrics

    with worker_pool() as pool:
        results = list(pool.map(run, FULL.trials()))
    errors = np.concatenate([result.direction_error for result in results])
    right = sum(result.right_dimension_samples for result in results)
    contact = sum(result.contact_samples for result in results)
    late = []
    for name, limit in LATE_MS.items():
        times = 1e3 * np.concatenate(
            [getattr(result, f"{name}_latency") for result in results]
        )
        late.append(f"{np.mean(times > limit):.3f}")
    return [
        f"{errors.mean():.2f} / {np.quantile(errors, 0.95):.2f}",
        f"{right / contact:.3f}",
        *late,
    ]


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs everything and prints the table as Markdown."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--page", type=Path)
    options = parser.parse_args(arguments)
    rows = [[name, *measure(changes)] for name, changes in CHOICES.items()]
    table = markdown_table(HEAD, rows)
    print(table)
    if options.page:
        fill_page(options.page, "filter_choices.py", table)


if __name__ == "__main__":
    main()
