# SPDX-License-Identifier: BSD-3-Clause
"""Tables, figure and page of `dual-proxy bench filter`."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl

from dual_proxy.bench.filter import LATE_MS
from dual_proxy.bench.pages import (
    fill_page,
    markdown_table,
    number_text,
    page_image,
    save_figure,
)

__all__ = [
    "PAGE_IMAGE",
    "PAGE_TABLES",
    "SITUATION_COLUMNS",
    "dependence_table",
    "draw",
    "grid_table",
    "situation_table",
    "target_table",
    "write_page",
]

Row = dict[str, Any]
Results = dict[str, list[Row]]

#: Of the targets.
TARGET_PARTICLES = 1000
TARGET_RATES = (15.0, 100.0, 200.0)

#: Of the situations, with as many particles.
SITUATION_RATES = (15.0, 100.0, 1000.0)

#: What names the places of the tables in a page.
PAGE_IMAGE = "bench_filter.png"
PAGE_TABLES = tuple(
    f"dual-proxy bench filter: {name}"
    for name in ("grid", "targets", "situations", "dependence")
)


class Target(NamedTuple):
    """A limit for a quantity of the rows of a table."""

    table: str
    where: dict[str, Any]
    """Which row, beside the filter's setting."""
    name: str
    """Of the row."""
    key: str
    label: str
    limit: float | None
    """None: only shown."""
    at_least: bool = False
    limit_15: float | None = None
    """At 15 Hz, where it is another."""

    def cell(self, results: Results, likelihood: str, rate: float) -> str:
        """Return the value, and whether it is within its limit."""
        row = _find(
            results[self.table],
            likelihood=likelihood,
            num_particles=TARGET_PARTICLES,
            rate=rate,
            **self.where,
        )
        if row is None:
            return "-"
        value = row[self.key]
        limit = self.limit
        if rate == 15.0 and self.limit_15 is not None:
            limit = self.limit_15
        if value is None:
            return "never: not met"
        text = f"{value:.4g}"
        if limit is None:
            return text
        met = value >= limit if self.at_least else value <= limit
        return f"{text}: {'met' if met else 'not met'}"

    @property
    def limits(self) -> str:
        """What the value must be."""
        if self.limit is None:
            return ""
        text = f"{'>=' if self.at_least else '<='} {self.limit:g}"
        if self.limit_15 is not None:
            text += f" ({self.limit_15:g} at 15 Hz)"
        return text


class SituationColumn(NamedTuple):
    """A quantity of the situations, and the limits of its value."""

    key: str
    label: str
    target: str
    low: float
    high: float

    def cell(self, row: Row) -> str:
        """Return the value, bold if it misses the target."""
        value = row[self.key]
        if value is None:
            return "-"
        met = self.low <= value <= self.high
        text = number_text(value)
        if self.key == "direction_error_mean_deg":
            met = met or (row["coverage"] or 0.0) >= _COVERED
            text += f" / {number_text(row['direction_error_p95_deg'])}"
        return text if met else f"**{text}**"


_COVERED = 0.9
SITUATION_COLUMNS = (
    SituationColumn(
        *("direction_error_mean_deg", "error, deg", "<= 3 or covered", 0.0, 3.0)
    ),
    SituationColumn("dimension_right", "dimension right", ">= 0.95", 0.95, 1.0),
    SituationColumn("coverage", "coverage", "0.9 to 0.98", _COVERED, 0.98),
    SituationColumn("confidence", "confidence", ">= 0.9", 0.9, 1.0),
    SituationColumn("false_contact_share", "false contact", "0", 0.0, 0.0),
)


def _scene(scene: str) -> dict[str, Any]:
    return {"scene": scene, "drive": None, "friction": None}


def _targets(results: Results) -> Iterable[Target]:
    def of_scene(scene: str, *arguments: Any, **keywords: Any) -> Target:
        return Target("grid", _scene(scene), scene, *arguments, **keywords)

    def of_latency(scene: str, name: str, label: str) -> Target:
        return of_scene(scene, f"{name}_p95_ms", f"{label}, 95 %, ms", LATE_MS[name])

    error = ("direction_error_mean_deg", "direction error, mean, deg")
    error_p95 = ("direction_error_p95_deg", "direction error, 95 %, deg")
    yield of_scene("plane", *error, 1.0)
    yield of_scene("plane", *error_p95, 2.5)
    yield of_scene("cylinder", *error, 2.0, limit_15=4.0)
    yield of_scene("cylinder", *error_p95, 5.0)
    for scene in ("inner_corner", "step_edge"):
        yield of_scene(scene, "dimension_right", "dimension right", 0.93, at_least=True)
        yield of_scene(
            scene, "axis_error_mean_deg", "motion axis error, mean, deg", 2.0
        )
        yield of_scene(
            scene, "second_p95_ms", "second wall found, 95 %, ms", LATE_MS["second"]
        )
    for scene in ("plane", "cylinder", "inner_corner", "step_edge", "soft", "grazing"):
        yield of_scene(
            scene, "detection_p95_ms", "contact found, 95 %, ms", LATE_MS["detection"]
        )
        yield of_scene(scene, "loss_p95_ms", "contact lost, 95 %, ms", LATE_MS["loss"])
    yield of_scene(
        "free", "false_contact_samples", "updates with a contact that is none", 0.0
    )
    for force in dict.fromkeys(row["force"] for row in results["still"]):
        time = results["still"][0]["time"]
        name = f"still, {force:g} N for {time:g} s"
        yield Target(
            *("still", {"force": force}, name, "dimension_one"),
            *("share of dimension 1", 1.0, True),
        )
    if results["recordings"]:
        yield Target(
            *("recordings", {}, "recordings", "normal_right"),
            *("normal within 10 deg, share", 0.9, True),
        )
        yield Target(
            *("recordings", {}, "recordings", "dimension_changes_per_s"),
            *("changes of dimension per s", None),
        )


def _find(rows: Iterable[Row], **where: Any) -> Row | None:
    return next(
        (row for row in rows if all(row[key] == value for key, value in where.items())),
        None,
    )


_QUANTITIES = (
    "error, deg",
    "dimension right",
    "found, ms",
    "lost, ms",
    "second wall, ms",
)


def _quantities(row: Row) -> list[str]:
    def pair(mean: float | None, p95: float | None) -> str:
        return " / ".join("-" if x is None else number_text(x) for x in (mean, p95))

    cells = [
        pair(row["direction_error_mean_deg"], row["direction_error_p95_deg"]),
        "-" if row["dimension_right"] is None else f"{row['dimension_right']:.3f}",
    ]
    for name in ("detection", "loss", "second"):
        cell = pair(row[f"{name}_mean_ms"], row[f"{name}_p95_ms"])
        if row[f"{name}_missed"]:
            share = row[f"{name}_missed"] / row[f"{name}_events"]
            cell += f" ({100 * share:.0f} % missed)"
        cells.append(cell)
    return cells


def _setting(row: Row) -> Row:
    return {key: row[key] for key in ("likelihood", "num_particles", "rate")}


def _grid_rows(results: Results) -> list[tuple[Row, Row]]:
    """Return each setting's rows: over all trials, and over those in closed loop."""
    pairs = []
    for row in results["grid"]:
        if "cost_us_per_s" in row:
            closed = _find(results["grid"], **_setting(row), drive="closed_loop")
            assert closed is not None
            pairs.append((row, closed))
    return pairs


def grid_table(results: Results) -> str:
    """Return error and cost of each setting, over all trials, as Markdown."""
    return markdown_table(
        [
            *("likelihood", "particles", "Hz", *_QUANTITIES),
            *("closed loop: error", "dimension right", "cost, us/s"),
        ],
        (
            [
                row["likelihood"],
                str(row["num_particles"]),
                f"{row['rate']:g}",
                *_quantities(row),
                *_quantities(closed)[:2],
                number_text(row["cost_us_per_s"]),
            ]
            for row, closed in _grid_rows(results)
        ),
    )


def situation_table(results: Results) -> str:
    """Return what each situation comes to, bold where it misses a target."""
    rows = results["situations"]
    head = ["situation", "Hz"]
    target = ["target", ""]
    keys = dict.fromkeys((row["situation"], row["rate"]) for row in rows)
    cells = [[situation, f"{rate:g}"] for situation, rate in keys]
    for likelihood in dict.fromkeys(row["likelihood"] for row in rows):
        of_likelihood = [row for row in rows if row["likelihood"] == likelihood]
        for column in SITUATION_COLUMNS:
            if all(row[column.key] is None for row in of_likelihood):
                continue
            head.append(f"{likelihood}: {column.label}")
            target.append(column.target)
            for line, row in zip(cells, of_likelihood, strict=True):
                line.append(column.cell(row))
    return markdown_table(head, [target, *cells])


def dependence_table(results: Results) -> str:
    """Return what drive and friction do, at 1000 particles and 100 Hz."""
    return markdown_table(
        ["likelihood", "trials with", *_QUANTITIES],
        (
            [
                row["likelihood"],
                row["drive"] or f"friction {row['friction']:g}",
                *_quantities(row),
            ]
            for row in results["grid"]
            if (row["num_particles"], row["rate"]) == (TARGET_PARTICLES, 100.0)
            and (row["drive"] is not None or row["friction"] is not None)
        ),
    )


def target_table(results: Results) -> str:
    """Return each target beside what was measured, as Markdown."""
    likelihoods = dict.fromkeys(row["likelihood"] for row in results["grid"])
    columns = [
        (likelihood, rate) for likelihood in likelihoods for rate in TARGET_RATES
    ]
    return markdown_table(
        [
            *("scene", "what", "target"),
            *(f"{likelihood}, {rate:g} Hz" for likelihood, rate in columns),
        ],
        (
            [
                *(target.name, target.label, target.limits),
                *(target.cell(results, *column) for column in columns),
            ]
            for target in _targets(results)
        ),
    )


def draw(results: Results, path: Path) -> None:
    """Draw errors over cost: a point per setting, a line along the best."""
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    pairs = _grid_rows(results)
    likelihoods = list(dict.fromkeys(row["likelihood"] for row, _ in pairs))
    rates = list(dict.fromkeys(row["rate"] for row, _ in pairs))
    markers = dict(zip(rates, itertools.cycle("osD^v"), strict=False))
    figure, axes = plt.subplots(2, 3, figsize=(12, 7.5), sharex=True, sharey="col")
    for column, (key, label) in enumerate(
        (
            ("direction_error_mean_deg", "direction error, mean, deg"),
            ("dimension_right", "dimension wrong, share"),
            (
                "second_late",
                f"second wall over {LATE_MS['second']:g} ms or missed, share",
            ),
        )
    ):
        for line, drives in enumerate(("all drives", "closed loop")):
            axis = axes[line, column]
            for number, likelihood in enumerate(likelihoods):
                best: list[tuple[float, float]] = []
                for cost, row in sorted(
                    (
                        (pair[0]["cost_us_per_s"], pair[line])
                        for pair in pairs
                        if pair[line]["likelihood"] == likelihood
                    ),
                    key=lambda point: point[0],
                ):
                    if row[key] is None:
                        continue
                    error = 1 - row[key] if key == "dimension_right" else row[key]
                    size = 3 * math.log10(row["num_particles"]) - 3
                    axis.plot(
                        *(cost, error, markers[row["rate"]]),
                        color=f"C{number}",
                        markersize=size,
                        alpha=0.6,
                    )
                    if not best or error < best[-1][1]:
                        best.append((cost, error))
                axis.plot(
                    [cost for cost, _ in best],
                    [error for _, error in best],
                    color=f"C{number}",
                    lw=1,
                    label=likelihood,
                )
            axis.set_xscale("log")
            axis.set_ylim(bottom=0)
            axis.set_ylabel(label)
            axis.set_title(drives, fontsize=9)
            if line == 1:
                axis.set_xlabel("filter's time per second, us")
    for rate, marker in markers.items():
        axes[0, 1].plot([], [], marker, color="0.4", ms=5, label=f"{rate:g} Hz")
    axes[0, 1].legend(frameon=False, fontsize=8, loc="center")
    figure.tight_layout()
    save_figure(figure, path)
    plt.close(figure)


def write_page(page: Path, results: Results) -> None:
    """Put the tables into a page, and the figure into images/ beside it."""
    tables = (
        grid_table(results),
        target_table(results),
        situation_table(results),
        dependence_table(results),
    )
    for name, table in zip(PAGE_TABLES, tables, strict=True):
        fill_page(page, name, table)
    draw(results, page_image(page, PAGE_IMAGE))
