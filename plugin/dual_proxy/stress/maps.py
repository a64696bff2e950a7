# SPDX-License-Identifier: BSD-3-Clause
"""Maps of stability: of a stiffness or a gain, the range in which all comes to
rest."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from dual_proxy.bench.subject import make_axes, save_axes
from dual_proxy.many_runs import Job, Result, RunsFolder, run_many
from dual_proxy.run import change_scenario
from dual_proxy.scenario import SCHEMES, Scenario, ScenarioError
from dual_proxy.stress.cases import REST, REST_DELAYS
from dual_proxy.stress.verdict import judge, rest_time, swings

__all__ = ["MAPS", "Cell", "Map", "Scan", "cell_text", "draw_maps", "find_ranges"]

Overrides = dict[str, Any]

# Of the bisection of each end of a range, which lies between two values of the
# grid: each step halves what is between them, on a logarithmic scale.
_STEPS = 4
# Tried at equal ratios from a range's end to what is half or twice of that, where edges
# are ragged; and how often, as it may end there.
_CHECKS = 6
_INSIDE = range(1, 1 + _CHECKS)
_ROUNDS = 3
# s: the hand rests longer where a link is late.
_REST_WITH_LINK = 16.0


def _press(rest: float = REST) -> Overrides:
    """Press on the table, 20 mm beyond, and stay there."""
    return {
        "operator.waypoints": [
            {"time": 0.0, "position": [0.45, 0.0, 0.48]},
            {"time": 2.0, "position": [0.45, 0.0, 0.39]},
            {"time": 2.0 + rest, "position": [0.45, 0.0, 0.39]},
        ],
        # It moves what is stable, too.
        "sensor.force_noise_std": 0.0,
    }


class Scan(NamedTuple):
    """What is tried."""

    key: str
    label: str
    grid: tuple[float, ...]
    """Its values; the ends of a range are looked for between them."""


class Map(NamedTuple):
    """For each row and column a range of what is tried."""

    title: str
    rows: Mapping[str, Overrides]
    """By name."""
    label: str
    """Of the columns."""
    unit: str
    factor: float
    """From SI units to that unit."""
    values: tuple[float, ...]
    overrides: Callable[[float], Overrides]
    """Of a column."""
    scan: Scan


# Of tool and surface together.
_STIFFNESS = Scan(
    "scene.contact_stiffness",
    "contact stiffness, N/m",
    tuple(10 ** (i / 2) for i in range(4, 13)),
)
_GAIN = Scan(
    "controller.force_gain",
    "force_gain",
    tuple(10 ** (i / 2) for i in range(-2, 5)),
)
_BY_SCHEME: dict[str, Overrides] = {name: {"scheme": name} for name in SCHEMES}
# What the force sensor says is nothing to the others.
_SENSES = ("dual_proxy", "position_force", "four_channel", "model_mediated")
_BY_STIFFNESS: dict[str, Overrides] = {
    f"{stiffness:.0e} N/m".replace("e+0", "e"): {"scene.contact_stiffness": stiffness}
    for stiffness in (1e3, 3e3, 1e4, 3e4, 1e5, 3e5)
}

#: By name.
MAPS: dict[str, Map] = {
    "delay": Map(
        "stable stiffness, over the link's delay",
        _BY_SCHEME,
        *("delay, one way", "ms", 1e3),
        (0.0, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 3.0),
        lambda value: (
            {"link.delay": value} | _press(_REST_WITH_LINK + REST_DELAYS * value)
        ),
        _STIFFNESS,
    ),
    "control period": Map(
        "stable stiffness, over the control period",
        _BY_SCHEME,
        *("control period", "ms", 1e3),
        (0.00025, 0.0005, 0.001, 0.0015, 0.002, 0.003, 0.004),
        lambda value: {"control_period": value, "scene.time_step": 2.5e-4},
        _STIFFNESS,
    ),
    "sensor delay": Map(
        "stable stiffness, over the sensor's delay",
        {name: _BY_SCHEME[name] for name in _SENSES},
        *("delay of the force sensor", "ms", 1e3),
        (0.0, 0.001, 0.002, 0.004, 0.008, 0.016),
        lambda value: {"sensor.delay": value},
        _STIFFNESS,
    ),
    "force gain, sensor delay": Map(
        "stable force_gain, over the sensor's delay",
        _BY_STIFFNESS,
        *("delay of the force sensor", "ms", 1e3),
        (0.0, 0.001, 0.002, 0.004, 0.008, 0.016),
        lambda value: {"sensor.delay": value},
        _GAIN,
    ),
    "force gain, torque delay": Map(
        "stable force_gain, over the torques' delay",
        _BY_STIFFNESS,
        *("delay of torques", "periods", 1.0),
        (0.0, 1.0, 2.0, 3.0, 4.0),
        lambda value: {"mismatch.torque_delay": int(value)},
        _GAIN,
    ),
}


class Cell(NamedTuple):
    """What was found at a row and column of a map."""

    map: str
    row: str
    value: float
    low: float
    high: float
    """Of the widest range, what is stable and furthest apart; 0 if nothing is."""
    ranges: int
    """How many there are of what was tried."""
    why: str
    """What is wrong where it ends, or begins."""
    not_made: str
    """Why a run of it is not there: then nothing else is known."""


class _Tried(NamedTuple):
    wrong: str
    not_made: str = ""


def find_ranges(
    folder: RunsFolder | None = None,
    maps: Sequence[str] = tuple(MAPS),
    rows: Sequence[str] | None = None,
    steps: int = _STEPS,
    workers: int | None = None,
    progress: Callable[[str], None] | None = None,
    cluster: str | None = None,
    overrides: Overrides | None = None,
) -> list[Cell]:
    """Find the range that is stable, for each row and column of maps.

    The tool of scene `plane` presses and stays; stable is what breaks no limit and
    comes to rest (`judge`, `swings`). What a scenario's checks refuse is not. All
    cells are looked at on the grid first, then both ends of the widest range are
    halved, those of all cells at the same time. Then the inside of each end is tried up
    to half (twice) of it: what is not stable there ends the range, which is looked for
    again.

    Parameters
    ----------
    maps, rows : sequences of str
        Of `MAPS`, and of their rows; by default all.
    steps : int
        How often a range's ends are halved.
    overrides : dict, optional
        Of scene `plane`, as of `Scenario.with_overrides`: a lab's own values.
    folder, workers, progress, cluster
        As for `run_many`.

    Raises
    ------
    ScenarioError
        If a value is wrong, or what a map changes anyway.
    """
    own = overrides or {}
    for name in maps:
        if taken := sorted(own.keys() & _changed_by(name)):
            raise ScenarioError(
                f"{taken[0]}: expected another key, map {name!r} has its own values"
            )
    base = change_scenario("plane", overrides=_press() | own)
    points = [
        (name, row, value)
        for name in maps
        for row in MAPS[name].rows
        if rows is None or row in rows
        for value in MAPS[name].values
    ]

    on_grid = [(point, x) for point in points for x in MAPS[point[0]].scan.grid]
    found: dict[_Point, list[tuple[float, _Tried]]] = {point: [] for point in points}

    def look(asked: Sequence[tuple[_Point, float]]) -> None:
        """Try points at a value of what is tried, and keep what is wrong there."""
        plan: dict[int, Job] = {}
        tried: dict[int, _Tried] = {}
        for place, ((name, row, value), x) in enumerate(asked):
            a_map = MAPS[name]
            changes = a_map.rows[row] | a_map.overrides(value) | {a_map.scan.key: x}
            try:
                scenario = base.with_overrides(changes)
            except ScenarioError as error:
                tried[place] = _Tried(f"refused: {error}")
                continue
            label = f"{name} {row} {value:g} {x:.3g}"
            plan[place] = Job(label, scenario, "bare", rest_time(scenario))
        results = run_many(list(plan.values()), folder, workers, progress, cluster)
        for (place, job), result in zip(plan.items(), results, strict=True):
            tried[place] = _what_is_wrong(result, job.scenario)
        for place, (point, x) in enumerate(asked):
            found[point].append((x, tried[place]))

    look(on_grid)

    def all_ends() -> list[tuple[_Point, _End]]:
        return [(point, end) for point in points for end in _ends(found[point])]

    settled: set[tuple[_Point, int, float]] = set()
    for _ in range(_ROUNDS if steps else 0):
        moved = {
            (point, end.side)
            for point, end in all_ends()
            if (point, end.side, end.value) not in settled
        }
        for _ in range(steps):
            look(
                [
                    (point, math.sqrt(end.value * end.beyond))
                    for point, end in all_ends()
                    if (point, end.side) in moved
                ]
            )
        asked = []
        for point, end in all_ends():
            if (point, end.side) in moved:
                settled.add((point, end.side, end.value))
                inside = (end.value * 2 ** (-end.side * i / _CHECKS) for i in _INSIDE)
                asked += [(point, x) for x in inside if end.side * (x - end.other) > 0]
        look(asked)
    return [_make_cell(point, _in_order(found[point])) for point in points]


_Point = tuple[str, str, float]


def _changed_by(name: str) -> set[str]:
    """The keys that a map has values of."""
    a_map = MAPS[name]
    rows = (key for row in a_map.rows.values() for key in row)
    return {a_map.scan.key, *rows, *a_map.overrides(a_map.values[0]), *_press()}


def _what_is_wrong(result: Result, scenario: Scenario) -> _Tried:
    if result.not_made:
        return _Tried("", result.failure)
    if result.metrics is None:
        return _Tried(result.failure)
    wrong = judge(result.metrics, scenario).safety + swings(result.metrics, scenario)
    return _Tried("; ".join(wrong))


def _stable_spans(values: Sequence[tuple[float, _Tried]]) -> list[tuple[int, int]]:
    """The first and the last of neighbours that are stable."""
    spans: list[tuple[int, int]] = []
    for i, (_, what) in enumerate(values):
        if what.wrong:
            continue
        if spans and spans[-1][1] == i - 1:
            spans[-1] = (spans[-1][0], i)
        else:
            spans.append((i, i))
    return spans


def _in_order(values: Sequence[tuple[float, _Tried]]) -> list[tuple[float, _Tried]]:
    return sorted(values, key=lambda tried: tried[0])


def _widest(values: Sequence[tuple[float, _Tried]]) -> tuple[int, int] | None:
    return max(
        _stable_spans(values),
        key=lambda span: values[span[1]][0] / values[span[0]][0],
        default=None,
    )


class _End(NamedTuple):
    side: int
    """-1: the lower, 1: the upper."""
    value: float
    beyond: float
    """The next one that was tried, which is not stable."""
    other: float
    """The other end."""


def _ends(tried: Sequence[tuple[float, _Tried]]) -> list[_End]:
    """The ends of the widest range, but for those that are the last of the grid."""
    values = _in_order(tried)
    span = _widest(values)
    if span is None:
        return []
    return [
        _End(side, values[here][0], values[here + side][0], values[there][0])
        for side, here, there in ((-1, *span), (1, *reversed(span)))
        if 0 <= here + side < len(values)
    ]


def _make_cell(point: _Point, values: Sequence[tuple[float, _Tried]]) -> Cell:
    not_made = next((what.not_made for _, what in values if what.not_made), "")
    if not_made:
        return Cell(*point, math.nan, math.nan, 0, "", not_made)
    span = _widest(values)
    if span is None:
        return Cell(*point, 0.0, 0.0, 0, values[0][1].wrong, "")
    low, high = (values[index][0] for index in span)
    # Of what is not stable, nearest to the range.
    outside = [
        (abs(math.log(x / end)), what.wrong)
        for x, what in values
        for end in (low, high)
        if what.wrong
    ]
    why = min(outside, default=(0.0, ""))[1]
    return Cell(*point, low, high, len(_stable_spans(values)), why, "")


def cell_text(cell: Cell) -> str:
    """Return a cell as a table has it: its widest range, rounded inwards."""
    if cell.not_made:
        return "not made"
    if cell.ranges == 0:
        return "none"
    grid = MAPS[cell.map].scan.grid
    if (cell.low, cell.high) == (grid[0], grid[-1]):
        return "all"
    text = f"{_number(cell.low, math.ceil)} - {_number(cell.high, math.floor)}"
    return text if cell.ranges == 1 else f"{text} (1 of {cell.ranges})"


def _number(value: float, rounded: Callable[[float], int]) -> str:
    """Two digits of a value; what is off by rounding alone stays."""
    digit = 10.0 ** (math.floor(math.log10(value) + 1e-9) - 1)
    count = value / digit
    whole = round(count) if abs(count - round(count)) < 1e-6 else rounded(count)
    return f"{whole * digit:.2g}".replace("e+0", "e")


def draw_maps(cells: Sequence[Cell], path: Path) -> None:
    """Draw each map: a bar for each range."""
    names = list(dict.fromkeys(cell.map for cell in cells))
    columns = min(3, len(names))
    lines = math.ceil(len(names) / columns)
    axes = make_axes(lines, columns, (5.2 * columns, 4.8 * lines))
    for panel in axes.flat[len(names) :]:
        panel.set_axis_off()
    for name, panel in zip(names, axes.flat, strict=False):
        a_map = MAPS[name]
        rows = list(dict.fromkeys(cell.row for cell in cells if cell.map == name))
        for number, row in enumerate(rows):
            shift = 0.7 * ((number + 0.5) / len(rows) - 0.5)
            of_row = [c for c in cells if (c.map, c.row) == (name, row) and c.ranges]
            panel.vlines(
                [a_map.values.index(cell.value) + shift for cell in of_row],
                [cell.low for cell in of_row],
                [cell.high for cell in of_row],
                color=f"C{number}",
                lw=4 if row == "dual_proxy" else 2.5,
                label=row,
            )
        panel.set_yscale("log")
        panel.set_ylim(a_map.scan.grid[0] / 1.6, 1.6 * a_map.scan.grid[-1])
        panel.set_xlim(-0.5, len(a_map.values) - 0.5)
        ticks = range(len(a_map.values))
        panel.set_xticks(list(ticks), [f"{a_map.factor * v:g}" for v in a_map.values])
        panel.set_xlabel(f"{a_map.label}, {a_map.unit}")
        panel.set_ylabel(a_map.scan.label)
        panel.set_title(a_map.title, fontsize=10)
        place = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.14)}
        panel.legend(fontsize=7, frameon=False, ncols=4, **place)
    save_axes(axes, path)
