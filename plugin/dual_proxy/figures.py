# SPDX-License-Identifier: BSD-3-Clause
"""Figures of many runs: of a comparison as the paper's Fig. 13 to 15, of a scene
as its others."""

from __future__ import annotations

import io
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from dual_proxy.log import replace_file
from dual_proxy.many_runs import Result, Series

__all__ = ["draw_comparison", "draw_errors", "draw_scene", "mark_cut"]

# Colour-blind safe (Okabe and Ito).
_COLORS = (
    "#0072b2",
    "#d55e00",
    "#009e73",
    "#cc79a7",
    "#e69f00",
    "#56b4e9",
    "#444b55",
    "#c9b800",
)
_GREY = "#9aa3af"
# Curve -> what it is, its colour and line width.
_FORCES = {
    "sensed": ("sensed", _GREY, 0.5),
    "reference": ("robot's reference", _COLORS[0], 1.0),
    "hand": ("hand exerts", _COLORS[1], 1.0),
}
_POSITIONS = {
    "device": ("device, mapped", _COLORS[1], 1.0),
    "robot": ("robot", _COLORS[0], 1.0),
}
# A force that no axis goes beyond, N: what swings would make the rest flat. What
# is cut is marked.
_MOST_FORCE = 20.0
# Of a normal, deg.
_MOST_ERROR = 20.0
_UNITS = {"position": "m", "force": "N"}
_MOST = {"position": math.inf, "force": _MOST_FORCE}
# Behind the curves, where a link is lost.
_LOST = "#f3d9d2"
# The measures of Fig. 15 -> title, factor to the unit shown.
_MEASURES = {
    "position_rms_free_m": ("position error in free directions, mm", 1e3),
    "position_rms_contact_m": ("position error along the contact, mm", 1e3),
    "haptic_force_rms_free_N": ("force on the hand in free directions, N", 1.0),
    "haptic_force_std_contact_N": ("std of the force on the hand in contact, N", 1.0),
}
_COMPENSATED = "position_rms_free_delay_compensated_m"


def draw_comparison(
    table: pd.DataFrame, results: Sequence[Result], path: Path, scene: str
) -> None:
    """Draw for each hand forces and positions over time, of the first seed, and
    errors over the delay: forces_HAND.png, positions_HAND.png, errors_HAND.png.

    Parameters
    ----------
    table : DataFrame
        As `compare` returns it.
    results : sequence of Result
        Of its rows.
    path : Path
        The folder.
    scene : str
        Its name, for the titles.
    """
    firsts: dict[str, dict[tuple[str, float], Series]] = {}
    for row, result in zip(table.to_dict("records"), results, strict=True):
        of_hand = firsts.setdefault(row["hand"], {})
        setting = row["scheme"], row["delay"]
        if setting not in of_hand:
            of_hand[setting] = result.series()
    for hand, series in firsts.items():
        rows = table[table["hand"] == hand]
        title = f"scene {scene}, {hand} hand"
        of_seed = f"{title}, seed {rows['seed'].min()}"
        for name, curves in (("force", _FORCES), ("position", _POSITIONS)):
            figure = _over_time(series, curves, name, of_seed)
            _save(figure, path / f"{name}s_{hand}.png")
        draw_errors(rows, path / f"errors_{hand}.png", title)


def _over_time(
    series: dict[tuple[str, float], Series],
    curves: dict[str, tuple[str, str, float]],
    quantity: str,
    title: str,
) -> Figure:
    """A column per delay, three axes per scheme."""
    schemes = list(dict.fromkeys(scheme for scheme, _ in series))
    delays = list(dict.fromkeys(delay for _, delay in series))
    count = 3 * len(schemes)
    figure, axes = _grid(count, len(delays), (2.9 * len(delays) + 1.2, 1.05 * count))
    for column, delay in enumerate(delays):
        axes[0, column].set_title(f"{1e3 * delay:g} ms delay", loc="right", fontsize=9)
        axes[-1, column].set_xlabel("time, s")
        for line, scheme in enumerate(schemes):
            panel = axes[3 * line : 3 * line + 3, column]
            _plot(panel, series[scheme, delay], curves)
    for component in range(3):
        _share_limits(axes[component::3].flat, _MOST[quantity])
    for line, scheme in enumerate(schemes):
        axes[3 * line, 0].set_title(scheme, loc="left", fontsize=9, fontweight="bold")
        for component, axis in enumerate("xyz"):
            label = f"{quantity}\n{axis}, {_UNITS[quantity]}"
            axes[3 * line + component, 0].set_ylabel(label, fontsize=7)
    handles = [Patch(color=color, label=label) for label, color, _ in curves.values()]
    handles += _lost_handle(series.values())
    figure.legend(
        handles=handles,
        title=title,
        loc="outside upper center",
        ncols=len(handles),
        frameon=False,
        fontsize=9,
    )
    return figure


def _plot(
    panel: Iterable[Axes], series: Series, curves: dict[str, tuple[str, str, float]]
) -> None:
    for component, axis in enumerate(panel):
        for name, (_, color, width) in curves.items():
            # A scheme without such a force has zeros.
            if name in series and series[name].any():
                values = series[name][:, component]
                axis.plot(series["time"], values, color=color, linewidth=width)
        _shade_lost(axis, series)
        if not series:
            axis.text(0.5, 0.5, "failed", transform=axis.transAxes, ha="center")


def _shade_lost(axis: Axes, series: Series) -> None:
    if "link_lost" in series:
        axis.fill_between(
            series["time"], 0, 1, where=(series["link_lost"] > 0).tolist(),
            color=_LOST, linewidth=0, transform=axis.get_xaxis_transform(), zorder=0,
        )  # fmt: skip


def _lost_handle(series: Iterable[Series]) -> list[Patch]:
    """What explains the shade in a legend, if a link was lost."""
    lost = any(np.any(of_run.get("link_lost", 0)) for of_run in series)
    return [Patch(color=_LOST, label="link lost")] if lost else []


def _share_limits(axes: Iterable[Axes], most: float) -> None:
    """Give equal components equal scales, within +-most."""
    panels = list(axes)
    low = min(panel.get_ylim()[0] for panel in panels)
    high = max(panel.get_ylim()[1] for panel in panels)
    for panel in panels:
        panel.set_ylim(max(low, -most), min(high, most))
        mark_cut(panel)


def mark_cut(axis: Axes) -> None:
    """Say at an axis' edge how far the curves go that it cuts: "\u25b2 42"."""
    low, high = axis.get_ylim()
    curves = [np.asarray(line.get_ydata(), np.float64) for line in axis.get_lines()]
    values = np.concatenate([[np.nan], *curves])
    if np.isnan(values).all():
        return
    for place, sign, edge in ((1.0, 1.0, high), (0.0, -1.0, -low)):
        most = np.nanmax(sign * values)
        # A line's width beyond is none.
        if most > edge + 1e-3 * (high - low):
            arrow = "\u25b2" if sign > 0 else "\u25bc"
            axis.text(
                0.995, place, f"{arrow} {sign * most:.0f}", transform=axis.transAxes,
                ha="right", va="top" if sign > 0 else "bottom", fontsize=7,
                color=_COLORS[3], fontweight="bold",
            )  # fmt: skip


def draw_scene(series: Mapping[float, Series], path: Path, title: str) -> None:
    """Draw positions, forces, error of the normal and dimension over time, a column
    per delay.

    Parameters
    ----------
    series : Mapping[float, Series]
        Of a run with each delay, s.
    path : Path
        The file.
    title : str
        Of which runs.
    """
    size = (max(2.9 * len(series) + 1.2, 6.5), 8 * 0.95)
    figure, axes = _grid(8, len(series), size)
    for column, (delay, of_run) in enumerate(series.items()):
        axes[0, column].set_title(f"{1e3 * delay:g} ms delay", fontsize=9)
        axes[-1, column].set_xlabel("time, s")
        _plot(axes[0:3, column], of_run, _POSITIONS)
        _plot(axes[3:6, column], of_run, _FORCES)
        if not of_run:
            continue
        error, dimension = axes[6:, column]
        error.plot(of_run["time"], of_run["normal_error_deg"], color=_COLORS[2], lw=1)
        error.set_ylim(0.0, _MOST_ERROR)
        mark_cut(error)
        for axis in (error, dimension):
            _shade_lost(axis, of_run)
        for name, color in (("true_dimension", _GREY), ("dimension", _COLORS[2])):
            values = of_run[name]
            dimension.plot(
                *(of_run["time"], values), color=color, lw=1, drawstyle="steps-post"
            )
        dimension.set_ylim(-0.2, 3.2)
        dimension.set_yticks(range(4))
    rows = [(quantity, axis) for quantity in _UNITS for axis in "xyz"]
    labels = [f"{quantity}\n{axis}, {_UNITS[quantity]}" for quantity, axis in rows]
    labels += ["error of the\nnormal, deg", "dimension"]
    for axis, label in zip(axes[:, 0], labels, strict=True):
        axis.set_ylabel(label, fontsize=8)
    for row, (quantity, _) in enumerate(rows):
        _share_limits(axes[row], _MOST[quantity])
    handles = [
        Patch(color=color, label=label)
        for color, label in (
            (_COLORS[1], "position: device, mapped; force: the hand exerts"),
            (_COLORS[0], "position: robot; force: its reference"),
            (_COLORS[2], "error, dimension: the filter's"),
            (_GREY, "force: sensed; dimension: true"),
        )
    ]
    handles += _lost_handle(series.values())
    figure.legend(
        handles=handles,
        title=title,
        loc="outside upper center",
        ncols=2,
        frameon=False,
        fontsize=8,
    )
    _save(figure, path)


def draw_errors(table: pd.DataFrame, path: Path, title: str) -> None:
    """Draw a panel per measure of Fig. 15, a group per delay, a bar per scheme."""
    schemes = list(dict.fromkeys(table["scheme"]))
    delays = list(dict.fromkeys(table["delay"]))
    figure, axes = _grid(2, 2, (10.5, 6.5))
    width = 0.8 / len(schemes)
    for axis, (key, (measure, factor)) in zip(
        axes.flat, _MEASURES.items(), strict=True
    ):
        axis.set_title(measure, fontsize=9)
        axis.set_xticks(range(len(delays)), [f"{1e3 * delay:g}" for delay in delays])
        for number, scheme in enumerate(schemes):
            color = _COLORS[number % len(_COLORS)]
            for group, delay in enumerate(delays):
                runs = table[(table["scheme"] == scheme) & (table["delay"] == delay)]
                values = factor * pd.to_numeric(runs[key]).dropna()
                if values.empty:
                    continue
                at = group + (number - (len(schemes) - 1) / 2) * width
                swings = runs["stable"].eq(False).any()
                axis.bar(
                    *(at, values.mean(), width),
                    color="white" if swings else color,
                    edgecolor=color,
                    hatch="////" if swings else None,
                )
                if len(values) > 1:
                    axis.plot([at, at], [values.mean(), values.max()], color="black")
                if key == "position_rms_free_m":
                    rest = factor * pd.to_numeric(runs[_COMPENSATED]).mean()
                    axis.plot(at, rest, "_", color="black", markersize=7)
        axis.set_ylim(bottom=0.0)
    for axis in axes[-1]:
        axis.set_xlabel("delay each way, ms")
    handles: list[Artist] = [
        Patch(color=_COLORS[number % len(_COLORS)], label=scheme)
        for number, scheme in enumerate(schemes)
    ]
    handles += [
        Patch(fill=False, hatch="////", label="not stable"),
        Line2D([], [], color="black", marker="_", lw=0, label="delay removed"),
    ]
    if table["seed"].nunique() > 1:
        handles.append(Line2D([], [], color="black", label="up to the worst seed"))
    figure.legend(
        handles=handles,
        title=title,
        loc="outside upper center",
        ncols=min(len(handles), 5),
        frameon=False,
        fontsize=9,
    )
    _save(figure, path)


def _grid(
    rows: int, columns: int, size: tuple[float, float]
) -> tuple[Figure, np.ndarray[Any, Any]]:
    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, columns, sharex="col", squeeze=False)
    for axis in axes.flat:
        axis.grid(color="#e3e7ec", linewidth=0.7)
        axis.set_axisbelow(True)
        axis.spines[["top", "right"]].set_visible(False)
        axis.tick_params(labelsize=8)
    return figure, axes


def _save(figure: Figure, path: Path) -> None:
    # Without the date and version that matplotlib would add, equal runs give
    # equal figures.
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=100, metadata={"Software": None})
    replace_file(path, buffer.getbuffer())
