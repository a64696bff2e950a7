# SPDX-License-Identifier: BSD-3-Clause
"""Scene `plane` in closed loop, with the filter at several rates.

python benchmarks/filter_rates.py [--page docs/benchmarks.md]

For each likelihood and rate: friction 0 to 0.6, and the contact at several
phases of the filter's period (the link's delay moves it by parts of a period);
`friction_cone` also with the table at 0.10 m, where the arm's inertia turns the
push on the table into a drag along it.
Prints Markdown: mean and 95th percentile of the normal's error, share of
contact time with the right dimension, time from the first force to the contact
being found, largest force until then, and lost contacts; of all runs of a rate
the worst.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from law import lowered

import dual_proxy as dp
from dual_proxy.bench.pages import fill_page, markdown_table
from dual_proxy.log import signal

RATES = (15, 60, 100, 200, 500)
FRICTIONS = (0.0, 0.3, 0.6)
# Of the filter's period, by which the first force comes later.
PHASES = (0.0, 0.3, 0.7)

# Likelihood, height of the table in m.
VARIANTS = (("paper", 0.40), ("friction_cone", 0.40), ("friction_cone", 0.10))

HEAD = (
    "likelihood",
    "table, m",
    "rate, Hz",
    "normal error mean / 95 %, deg",
    "dimension right",
    "found after, ms",
    "largest force until found, N",
    "lost contacts",
)


def force_until_found(run: dp.Run) -> float:
    """Returns the largest contact force, N, before the filter first sees it."""
    forces = np.linalg.norm(signal(run.log, "contact_force"), axis=1)
    found = np.flatnonzero(signal(run.log, "dimension") > 0)
    return float(forces[: found[0] + 1].max()) if found.size else float(forces.max())


def worst(likelihood: str, height: float, rate: float) -> list[str]:
    """Returns the cells of a line: the worst over frictions and phases."""
    errors, accuracies, latencies, forces, losses = [], [], [], [], []
    for friction in FRICTIONS:
        for phase in PHASES:
            scenario = lowered(dp.load_scenario("plane"), height).with_overrides(
                {
                    "filter.likelihood": likelihood,
                    "filter.period": 1 / rate,
                    "scene.friction": friction,
                }
            )
            run = dp.run(scenario, delay=round(phase / rate, 3))
            metrics = run.metrics
            errors.append(
                (metrics["normal_error_mean_deg"], metrics["normal_error_p95_deg"])
            )
            accuracies.append(metrics["dimension_accuracy"])
            latencies.append(metrics["detection_latency_ms"])
            losses.append(metrics["contact_losses"])
            forces.append(force_until_found(run))
    mean, p95 = np.max(errors, axis=0)
    return [
        f"`{likelihood}`",
        f"{height:.2f}",
        f"{rate:g}",
        f"{mean:.2f} / {p95:.2f}",
        f"{min(accuracies):.3f}",
        f"{max(latencies):.0f}",
        f"{max(forces):.1f}",
        f"{max(losses):.0f}",
    ]


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs everything and prints the table as Markdown."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--page", type=Path)
    options = parser.parse_args(arguments)
    table = markdown_table(
        HEAD,
        [
            worst(likelihood, height, rate)
            for likelihood, height in VARIANTS
            for rate in RATES
        ],
    )
    print(table)
    if options.page:
        fill_page(options.page, "filter_rates.py", table)


if __name__ == "__main__":
    main()
