#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What an update of the force-space particle filter takes, beside a textbook's.

python benchmarks/filter_speed.py [--program PATH] [--out PATH] [--min-time SEC]
                                  [--cases REGEX] [--page docs/benchmarks.md]

Runs filter_benchmark (build it with the C++ tests, where Google Benchmark is
installed), writes what it reports as JSON and prints a Markdown table: per
situation, number of particles and instruction set the mean, median, 99 % and
maximum of the updates, in us. A machine's speed drifts, so the ratio to the
textbook, the paper's algorithms as one would write them down (textbook_filter.h),
compares medians as multiples of a fixed loop's, which takes turns with the
updates. The maximum is that of the machine more than of the filter, which does
the same work each time: it waits for other programs.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from dual_proxy.bench.pages import fill_page, markdown_table

ROOT = Path(__file__).resolve().parents[1]


def run(program: Path, out: Path, min_time: float, cases: str) -> dict[str, Any]:
    """Runs the program and returns its report, which is also left in `out`."""
    out.parent.mkdir(parents=True, exist_ok=True)
    unfinished = out.with_suffix(".unfinished")
    subprocess.run(
        [
            program,
            f"--benchmark_out={unfinished}",
            "--benchmark_out_format=json",
            f"--benchmark_min_time={min_time}",
            f"--benchmark_filter={cases}",
        ],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    unfinished.rename(out)
    report: dict[str, Any] = json.loads(out.read_text())
    return report


HEAD = (
    "situation",
    "particles",
    "filter",
    "mean us",
    "median",
    "99 %",
    "max",
    "textbook takes",
)


def table(report: dict[str, Any]) -> str:
    """The report as Markdown."""
    rows = []
    for case in report["benchmarks"]:
        kind, situation, particles = case["name"].split("/")[:3]
        times = [
            f"{case[f'{name}_us']:.4g}" for name in ("mean", "median", "p99", "max")
        ]
        ratio = f"{case['textbook']:.1f} x" if "textbook" in case else ""
        rows.append([situation, particles, kind, *times, ratio])
    return markdown_table(HEAD, rows)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measures, writes the JSON and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--program", type=Path, default=ROOT / "build/benchmarks/filter_benchmark"
    )
    parser.add_argument("--out", type=Path, default=ROOT / "out/filter_speed.json")
    parser.add_argument("--min-time", type=float, default=0.5, help="s per case")
    parser.add_argument("--page", type=Path)
    parser.add_argument("--cases", default=".", help="FILTER/SITUATION/PARTICLES/")
    options = parser.parse_args(arguments)
    if not options.program.exists():
        sys.exit(
            f"filter_speed.py: no {options.program}: build it with the C++ tests, "
            "where Google Benchmark is installed (Debian: libbenchmark-dev)"
        )
    report = run(options.program, options.out, options.min_time, options.cases)
    context = report["context"]
    print(f"{context['num_cpus']} x {context['mhz_per_cpu']} MHz, {options.out}\n")
    print(table(report))
    if options.page:
        fill_page(options.page, "filter_speed.py", table(report))


if __name__ == "__main__":
    main()
