# SPDX-License-Identifier: BSD-3-Clause
"""What the link's bandwidth buys: `dual-proxy bench link`.

Scene `plane` with the bare engine over message rates, delays and schemes; with
messages that are means or samples (`link.average`), and poses that are joined to
a motion or not (`robot_proxy.interpolate`).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from dual_proxy.bench.closed_loop import summarise_runs
from dual_proxy.bench.pages import markdown_table, optional_text
from dual_proxy.bench.subject import Results, Subject, by_plan, make_axes, save_axes
from dual_proxy.many_runs import Job, run_many
from dual_proxy.run import change_scenario

__all__ = [
    "FULL",
    "HEADER_BYTES",
    "QUICK",
    "SUBJECT",
    "Plan",
    "measure",
    "message_numbers",
    "options_table",
    "schemes_table",
]

Row = dict[str, Any]

#: Of a message: tag and size, 4 bytes each, sequence number and send time, 8 each
#: (`systems/link/message.h`). A number of its body takes 8, and so does a gripper's
#: opening, where there is one.
HEADER_BYTES = 24

# Those that are compared; the first one's options are, too.
_SCHEMES = ("dual_proxy", "position_force", "position_position")
# Metric of a run -> its key in a row.
_METRICS = {
    "position_rms_free_delay_compensated_m": "tracking_m",
    "haptic_force_std_contact_N": "hand_std_N",
    "haptic_force_ac_N": "hand_ac_N",
    "contact_force_max_N": "contact_max_N",
}


class Plan(NamedTuple):
    """How much is run."""

    rates: tuple[float, ...]
    """Hz, of messages."""
    delays: tuple[float, ...]
    """s, one way."""
    option_delay: float
    """s, of the runs with other options, one of `delays`."""
    seeds: int
    """Of each run."""


FULL = Plan(
    rates=(5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0),
    delays=(0.0, 0.05, 0.15),
    option_delay=0.05,
    seeds=3,
)
QUICK = Plan(rates=(5.0, 50.0, 500.0), delays=(0.05,), option_delay=0.05, seeds=1)


def message_numbers(scheme: str) -> tuple[int, int]:
    """Return how many numbers a scheme's messages to robot and to device hold."""
    # Drake is imported only where there is a diagram.
    from dual_proxy.station import build_station
    from dual_proxy.systems import get_value

    station = build_station(
        change_scenario("plane", scheme=scheme), logged=False, wiring="systems"
    )
    station.advance_to(0.1)  # Both have sent by then.
    context = station.simulator.get_context()
    numbers = []
    for name in ("haptic_side", "robot_side"):
        system = station.diagram.GetSubsystemByName(name)
        port: Any = system.GetOutputPort("message")
        message = get_value(port.EvalAbstract(system.GetMyContextFromRoot(context)))
        numbers.append(_count_numbers(message))
    return numbers[0], numbers[1]


def _count_numbers(message: Any) -> int:
    """Count what a message holds beside its header."""
    if hasattr(message, "body"):
        return len(message.body)
    if hasattr(message, "pose"):
        pose = message.pose
        parts = [pose.p, pose.R, message.force_selection, message.moment_selection]
        return sum(map(np.size, [*parts, message.contact_normals]))
    return int(np.size(message.force))


def measure(plan: Plan, jobs: int | None = None) -> list[Row]:
    """Run every scheme, rate and delay, and the options of the first scheme, `jobs`
    runs at a time (all cores if None).

    Returns
    -------
    rows
        Each with `scheme`, `rate_Hz`, `delay_s`, `average`, `interpolate`;
        `bytes_per_s`, both ways together; of `runs` the `stable`, those in which
        a limit of the arm broke (`limits`), and the means over all of them of
        `tracking_m` (RMS of robot against device one delay ago in the free
        directions), `hand_std_N` and `hand_ac_N` of the force on the hand in
        steady contact, `contact_max_N`; None where no run has it.
    """
    settings = list(
        itertools.product(_SCHEMES, plan.delays, plan.rates, [True], [True])
    )
    settings += [
        (_SCHEMES[0], plan.option_delay, rate, average, interpolate)
        for rate in plan.rates
        for average, interpolate in ((True, False), (False, True), (False, False))
    ]
    planned = [
        Job(
            f"{scheme} {rate:g} Hz {1e3 * delay:g} ms"
            f"{'' if average else ' samples'}{'' if interpolate else ' held'} {seed}",
            change_scenario(
                "plane",
                scheme=scheme,
                delay=delay,
                seed=seed,
                overrides={
                    "link.rate": rate,
                    "link.average": average,
                    "robot_proxy.interpolate": interpolate,
                },
            ),
            "bare",
        )
        for scheme, delay, rate, average, interpolate in settings
        for seed in range(plan.seeds)
    ]
    results = iter(run_many(planned, workers=jobs))
    bytes_per_message = {
        scheme: sum(HEADER_BYTES + 8 * number for number in message_numbers(scheme))
        for scheme in _SCHEMES
    }
    keys = ("scheme", "delay_s", "rate_Hz", "average", "interpolate")
    return [
        dict(zip(keys, setting, strict=True))
        | {"bytes_per_s": bytes_per_message[setting[0]] * setting[2]}
        | summarise_runs([next(results) for _ in range(plan.seeds)], _METRICS)
        for setting in settings
    ]


def _result_cells(row: Row) -> list[str]:
    tracking = row["tracking_m"]
    return [
        optional_text(None if tracking is None else 1e3 * tracking),
        *(optional_text(row[key]) for key in list(_METRICS.values())[1:]),
        f"{row['stable']} of {row['runs']}",
    ]


_RESULT_HEAD = ("tracking, mm", "hand std, N", "hand AC, N", "contact max, N", "stable")


def _usual(rows: Iterable[Row]) -> list[Row]:
    return [row for row in rows if row["average"] and row["interpolate"]]


def schemes_table(rows: Iterable[Row]) -> str:
    """Return schemes over rates and delays, as Markdown."""
    return markdown_table(
        ["scheme", "delay, ms", "rate, Hz", "kB/s", *_RESULT_HEAD],
        (
            [
                *(row["scheme"], f"{1e3 * row['delay_s']:g}", f"{row['rate_Hz']:g}"),
                *(f"{1e-3 * row['bytes_per_s']:.3g}", *_result_cells(row)),
            ]
            for row in _usual(rows)
        ),
    )


def options_table(rows: Sequence[Row]) -> str:
    """Return what the options do, over rates, as Markdown."""
    changed = [row for row in rows if not (row["average"] and row["interpolate"])]
    (delay,) = {row["delay_s"] for row in changed}
    compared = [
        row for row in rows if row["scheme"] == _SCHEMES[0] and row["delay_s"] == delay
    ]
    compared.sort(
        key=lambda row: (row["rate_Hz"], -row["average"], -row["interpolate"])
    )
    return markdown_table(
        ["rate, Hz", "message", "poses", *_RESULT_HEAD, "limits broken"],
        (
            [
                f"{row['rate_Hz']:g}",
                "mean" if row["average"] else "newest sample",
                "joined" if row["interpolate"] else "held",
                *_result_cells(row),
                f"{row['limits']} of {row['runs']}",
            ]
            for row in compared
        ),
    )


def draw(results: Results, path: Path) -> None:
    """Draw tracking and the hand's force over bandwidth, a line per scheme and
    delay."""
    rows = _usual(results["rows"])
    shown = {
        "tracking_m": "tracking, m",
        "hand_std_N": "hand std, N",
        "hand_ac_N": "hand AC, N",
    }
    styles = dict(zip(_SCHEMES, ("o-", "s--", "^:"), strict=True))
    delays = list(dict.fromkeys(row["delay_s"] for row in rows))
    axes = make_axes(1, len(shown), (14, 4.5))
    for axis, (key, title) in zip(axes.flat, shown.items(), strict=True):
        for scheme, (number, delay) in itertools.product(_SCHEMES, enumerate(delays)):
            points = [
                (row["bytes_per_s"], row[key])
                for row in rows
                if (row["scheme"], row["delay_s"]) == (scheme, delay)
                and row[key] is not None
            ]
            axis.loglog(
                [x for x, _ in points],
                [y for _, y in points],
                styles[scheme],
                color=f"C{number}",
                ms=4,
                lw=1,
                label=f"{scheme}, {1e3 * delay:g} ms",
            )
        axis.set_title(title, fontsize=9)
        axis.set_xlabel("bytes per second, both ways")
    axes[0, 0].legend(frameon=False, fontsize=7)
    save_axes(axes, path)


_MARKS = tuple(f"dual-proxy bench link: {name}" for name in ("schemes", "options"))
SUBJECT = Subject(
    name="link",
    marks=_MARKS,
    measure=by_plan(measure, QUICK, FULL),
    tables=lambda results: dict(
        zip(
            _MARKS,
            (schemes_table(results["rows"]), options_table(results["rows"])),
            strict=True,
        )
    ),
    draw=draw,
)
