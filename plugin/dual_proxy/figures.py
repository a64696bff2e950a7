# SPDX-License-Identifier: BSD-3-Clause
"""Figures of many runs: of a comparison as the paper's Fig. 13 to 15, of a scene
as its others."""

from __future__ import annotations

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

from dual_proxy.many_runs import Result, Series

__all__ = ["draw_comparison", "draw_errors", "draw_scene"]

# Colour-blind safe (Okabe and Ito).
_COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#444b55")
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
# A force that no axis goes beyond, N: what swings would make the rest flat.
_MOST_FORCE = 20.0
# Of a normal, deg.
_MOST_ERROR = 20.0
# The measures of Fig. 15 -> title, factor to the unit shown.
_MEASURES = {
    "position_rms_free_m": ("position error in free directions, mm", 1e3),
    "position_rms_contact_m": ("position error along the contact, mm", 1e3),
    "haptic_force_rms_free_N": ("force on the hand in free directions, N", 1.0),
    "haptic_force_std_contact_N": ("std of the force on the hand in contact, N", 1.0),
}
_COMPENSATED = "position_rms_free_delay_compensated_m"


def draw_comparison(table: pd.DataFrame, results: Sequence[Result], path: Path) -> None:
    """Draw for each hand forces and positions over time and errors over the delay:
    forces_HAND.png, positions_HAND.png, errors_HAND.png.

    Parameters
    ----------
    table : DataFrame
        As `compare` returns it.
    results : sequence of Result
        Of its rows.
    path : Path
        The folder.
    """
    firsts: dict[str, dict[tuple[str, float], Series]] = {}
    for row, result in zip(table.to_dict("records"), results, strict=True):
        of_hand = firsts.setdefault(row["hand"], {})
        setting = row["scheme"], row["delay"]
        if setting not in of_hand:
            of_hand[setting] = result.series()
    for hand, series in firsts.items():
        _save(_over_time(series, _FORCES, "N"), path / f"forces_{hand}.png")
        _save(_over_time(series, _POSITIONS, "m"), path / f"positions_{hand}.png")
        draw_errors(table[table["hand"] == hand], path / f"errors_{hand}.png")


def _over_time(
    series: dict[tuple[str, float], Series],
    curves: dict[str, tuple[str, str, float]],
    unit: str,
) -> Figure:
    """A column per delay, three axes per scheme."""
    schemes = list(dict.fromkeys(scheme for scheme, _ in series))
    delays = list(dict.fromkeys(delay for _, delay in series))
    count = 3 * len(schemes)
    figure, axes = _grid(count, len(delays), (2.9 * len(delays) + 1.2, 1.05 * count))
    for column, delay in enumerate(delays):
        title = f"{1e3 * delay:g} ms delay"
        axes[0, column].set_title(title, loc="right", fontsize=9)
        axes[-1, column].set_xlabel("time, s")
        for line, scheme in enumerate(schemes):
            panel = axes[3 * line : 3 * line + 3, column]
            _plot(panel, series[scheme, delay], curves)
    for component in range(3):
        _share_limits(axes[component::3].flat, _MOST_FORCE if unit == "N" else math.inf)
    for line, scheme in enumerate(schemes):
        axes[3 * line, 0].set_title(scheme, loc="left", fontsize=9, fontweight="bold")
        for component, axis in enumerate("xyz"):
            axes[3 * line + component, 0].set_ylabel(f"{axis}, {unit}", fontsize=8)
    figure.legend(
        handles=[
            Patch(color=color, label=label) for label, color, _ in curves.values()
        ],
        loc="outside upper center",
        ncols=len(curves),
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
        if not series:
            axis.text(0.5, 0.5, "failed", transform=axis.transAxes, ha="center")


def _share_limits(axes: Iterable[Axes], most: float) -> None:
    """Give equal components equal scales, within +-most."""
    panels = list(axes)
    low = min(panel.get_ylim()[0] for panel in panels)
    high = max(panel.get_ylim()[1] for panel in panels)
    for panel in panels:
        panel.set_ylim(max(low, -most), min(high, most))


def draw_scene(series: Mapping[float, Series], path: Path) -> None:
    """Draw positions, forces, error of the normal and dimension over time, a column
    per delay.

    Parameters
    ----------
    series : Mapping[float, Series]
        Of a run with each delay, s.
    path : Path
        The file.
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
        for name, color in (("true_dimension", _GREY), ("dimension", _COLORS[2])):
            values = of_run[name]
            dimension.plot(
                *(of_run["time"], values), color=color, lw=1, drawstyle="steps-post"
            )
        dimension.set_ylim(-0.2, 3.2)
        dimension.set_yticks(range(4))
    labels = [f"{axis}, {unit}" for unit in ("m", "N") for axis in "xyz"]
    for axis, label in zip(
        axes[:, 0], [*labels, "normal, deg", "dimension"], strict=True
    ):
        axis.set_ylabel(label, fontsize=8)
    for row in range(6):
        _share_limits(axes[row], _MOST_FORCE if row >= 3 else math.inf)
    handles = [
        Patch(color=color, label=label)
        for color, label in (
            (_COLORS[1], "device, mapped; what the hand exerts"),
            (_COLORS[0], "robot; its reference"),
            (_COLORS[2], "filter"),
            (_GREY, "sensed; true"),
        )
    ]
    figure.legend(
        handles=handles,
        loc="outside upper center",
        ncols=min(len(handles), 5),
        frameon=False,
        fontsize=8,
    )
    _save(figure, path)


def draw_errors(table: pd.DataFrame, path: Path) -> None:
    """Draw a panel per measure of Fig. 15, a group per delay, a bar per scheme."""
    schemes = list(dict.fromkeys(table["scheme"]))
    delays = list(dict.fromkeys(table["delay"]))
    figure, axes = _grid(2, 2, (10.5, 6.5))
    width = 0.8 / len(schemes)
    for axis, (key, (title, factor)) in zip(axes.flat, _MEASURES.items(), strict=True):
        axis.set_title(title, fontsize=9)
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
    figure.savefig(path, dpi=100, metadata={"Software": None})
