# SPDX-License-Identifier: BSD-3-Clause
"""What the subjects of `dual-proxy bench` have in common: they measure, print
tables, and save them as JSON and figure."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl

from dual_proxy.bench.pages import (
    check_page,
    fill_page,
    machine,
    page_image,
    save_figure,
    write_json,
)
from dual_proxy.native import native_in_use

__all__ = [
    "Results",
    "Subject",
    "bench_subject",
    "by_plan",
    "make_axes",
    "plot_trade",
    "progress",
    "save_axes",
]

Results = dict[str, Any]


class Subject(NamedTuple):
    """A benchmark."""

    name: str
    """Of the subcommand, and of what it saves."""
    marks: tuple[str, ...]
    """What names the tables' places in a page."""
    measure: Callable[..., Results]
    """Whether a part of it is enough, and, if it makes many runs, by name `jobs`,
    how many at a time -> what was measured, as JSON takes it."""
    tables: Callable[[Results], Mapping[str, str]]
    """Of what was measured, Markdown by mark, in order."""
    draw: Callable[[Results, Path], None]
    """Of what was measured, a figure."""

    def write_page(self, page: Path, results: Results) -> None:
        """Put the tables into a page, and the figure into images/ beside it."""
        for mark, table in self.tables(results).items():
            fill_page(page, mark, table)
        self.draw(results, page_image(page, self.image))

    @property
    def image(self) -> str:
        """The name of a page's figure."""
        return f"bench_{self.name}.png"


def by_plan(
    measure: Callable[..., list[dict[str, Any]]], quick: Any, full: Any
) -> Callable[..., Results]:
    """Return what `Subject.measure` is where `measure` makes rows of a plan, a named
    tuple: one of two."""

    def measured(is_quick: bool, **jobs: int) -> Results:
        plan = quick if is_quick else full
        return {"plan": plan._asdict(), "rows": measure(plan, **jobs)}

    return measured


def bench_subject(
    subject: Subject,
    quick: bool,
    out: Path,
    page: Path | None,
    jobs: int | None = None,
) -> None:
    """Run a benchmark; print its tables and save them as JSON and figure.

    Raises
    ------
    ScenarioError
        If the page cannot be used; before anything is run.
    OSError
        If something cannot be saved; the tables are printed nevertheless.
    """
    if page is not None:
        check_page(page, quick, subject.marks, [subject.image])
    results = subject.measure(quick, **({} if jobs is None else {"jobs": jobs}))
    where = machine() | {"systems": "C++" if native_in_use() else "Python"}
    print(
        f"{where['processor']}, {where['processors']} processors, "
        f"Drake's systems in {where['systems']}\n"
    )
    for table in subject.tables(results).values():
        print(table, end="\n\n")
    data, figure = (out / f"{subject.name}.{kind}" for kind in ("json", "png"))
    write_json(data, {"machine": where} | results)
    subject.draw(results, figure)
    print(f"saved: {data}, {figure}")
    if page is not None:
        subject.write_page(page, results)


def progress(text: str) -> None:
    """Say what is measured."""
    print(text, file=sys.stderr, flush=True)


def make_axes(rows: int, columns: int, size: tuple[float, float]) -> Any:
    """Return the axes, (rows, columns), of a new figure of a size in inches."""
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    _, axes = plt.subplots(rows, columns, figsize=size, squeeze=False)
    for axis in axes.flat:
        axis.grid(alpha=0.3)
    return axes


def plot_trade(
    axis: Any, points: Iterable[tuple[float, float, str]], label: str
) -> None:
    """Draw a line of errors over run times, with a note at each point."""
    points = list(points)
    axis.plot(
        [time for time, _, _ in points],
        [error for _, error, _ in points],
        "o-",
        ms=4,
        lw=1,
        label=label,
    )
    for time, error, note in points:
        axis.annotate(note, (time, error), fontsize=7)


def save_axes(axes: Any, path: Path) -> None:
    """Write the figure of axes, whose folder may not exist, and close it."""
    from matplotlib import pyplot as plt

    figure = axes[0, 0].figure
    figure.tight_layout()
    save_figure(figure, path)
    plt.close(figure)
