# SPDX-License-Identifier: BSD-3-Clause
"""Compares schemes over delays, hands and seeds: a table, and figures as the
paper's Fig. 13 to 15."""

from __future__ import annotations

import contextlib
import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import pandas as pd

from dual_proxy.log import replace_file
from dual_proxy.many_runs import Job, Result, RunsFolder, count_workers, run_many
from dual_proxy.metrics import ANGULAR_METRICS, METRICS
from dual_proxy.run import change_scenario, choose_engine
from dual_proxy.scenario import SCHEMES, Scenario, ScenarioError
from dual_proxy.settings import parse_yaml

__all__ = [
    "COLUMNS",
    "HANDS",
    "LEGEND",
    "Column",
    "compare",
    "is_stable",
    "make_table",
    "summarise",
    "summary_cells",
]

#: What the hands hold the device with, N/m and N s/m.
HANDS: dict[str, dict[str, float]] = {
    "firm": {"device.hand_stiffness": 600.0, "device.hand_damping": 30.0},
    "soft": {"device.hand_stiffness": 300.0, "device.hand_damping": 10.0},
}

# Keys that arguments of `compare` set.
_DECIDED = {"scheme": "schemes", "link.delay": "delays"} | {
    key: "hands" for hand in HANDS.values() for key in hand
}
# Of a stable run: N; times. In the air what the paper calls free motion has.
_MOST_SWING = 0.5
_MOST_SWING_AIR = 1.0
_MOST_LOSSES = 3
_MOST_SEEDS = 1000
T = TypeVar("T")


class Column(NamedTuple):
    """A metric in the printed table."""

    key: str
    label: str
    form: str = "{:.2f}"
    factor: float = 1.0
    at_least: bool = False
    """Whether less is worse."""


#: What is printed of a comparison, after scheme, delay and hand.
COLUMNS = (
    Column("haptic_force_std_contact_N", "hand std, N"),
    Column("haptic_force_swing_contact_N", "swing, N"),
    Column("haptic_force_swing_air_N", "swing in the air, N"),
    Column("haptic_force_rms_free_N", "hand free, N"),
    Column("haptic_force_max_N", "hand max, N", "{:.1f}"),
    Column("contact_force_max_N", "contact max, N", "{:.0f}"),
    Column("position_rms_free_m", "free error, mm", "{:.1f}", 1e3),
    Column("position_rms_free_delay_compensated_m", "delay removed, mm", "{:.1f}", 1e3),
    Column("position_rms_contact_m", "contact error, mm", "{:.1f}", 1e3),
    Column("normal_error_mean_deg", "normal error, deg"),
    Column("dimension_accuracy", "dimension right", "{:.3f}", at_least=True),
    Column("contact_losses", "losses", "{:.0f}"),
)
#: What the printed table means.
LEGEND = (
    "hand: force on the hand, its standard deviation in steady contact, RMS in the "
    "free directions, largest; swing: how much of it goes to and fro while the hand "
    "rests, RMS about the nearest course that only rises or only falls, along the "
    "contact and in the air; contact: of the robot; errors of position: robot "
    "against device, in the free directions as they are and against the device one "
    "delay ago, and along the contact",
    "stable: nothing infinite, no limit of the arm broken, in steady contact the "
    f"force on the hand swings by at most {_MOST_SWING:g} N, quickly "
    "(haptic_force_ac_N, RMS less its average over 0.5 s) or slowly "
    f"(haptic_force_swing_contact_N), in the air by at most {_MOST_SWING_AIR:g} N "
    f"(haptic_force_swing_air_N), contact lost at most {_MOST_LOSSES} times; - if "
    "there was no steady contact",
)


def is_stable(metrics: Mapping[str, Any]) -> bool | None:
    """Tell whether a run was stable by its metrics.

    It is if it is `finite`, broke no limit of the arm (`limits_broken`), lost
    contact no more than three times (`contact_losses`: a tool may bounce where it
    touches, or fall off an edge), and the force on the hand did not swing:

    - in steady contact by no more than 0.5 N, neither quickly (`haptic_force_ac_N`,
      its RMS less its average over 0.5 s, wherever the hand moves) nor slowly
      (`haptic_force_swing_contact_N`, which sees a swing of any period while the
      hand rests along the normal; a loop over a delay swings with some 4 delays);
    - in the air by no more than 1 N while the hand rests
      (`haptic_force_swing_air_N`): what the paper has in free directions. Drag, which
      only fades there, is none.

    A run without such a rest is judged by the others. None: there was no steady
    contact to judge by.
    """
    if not metrics["finite"] or metrics["limits_broken"]:
        return False
    most = {
        "contact_losses": _MOST_LOSSES,
        "haptic_force_ac_N": _MOST_SWING,
        "haptic_force_swing_contact_N": _MOST_SWING,
        "haptic_force_swing_air_N": _MOST_SWING_AIR,
    }
    if any((metrics[key] or 0) > limit for key, limit in most.items()):
        return False
    return None if metrics["haptic_force_ac_N"] is None else True


def compare(
    scenario: Scenario | str | Path,
    schemes: Sequence[str] | str,
    delays: Sequence[float],
    hands: Sequence[str] = ("firm",),
    seeds: int = 1,
    engine: str = "auto",
    overrides: Mapping[str, Any] | None = None,
    jobs: int | None = None,
    out: str | Path | None = None,
    progress: Callable[[str], None] | None = None,
    cluster: str | None = None,
) -> pd.DataFrame:
    """Run schemes over delays, hands and seeds, on all cores.

    Parameters
    ----------
    scenario : Scenario, str or Path
        What is run, as for `run`.
    schemes : sequence of str, or "all"
        Of `Scenario.SCHEMES`; with a parameter of its own as
        "four_channel:variant=three_channel".
    delays : sequence of float
        One way, s, in [0, 10].
    hands : sequence of str
        Of "firm" (600 N/m, 30 N s/m) and "soft" (300 N/m, 10 N s/m).
    seeds : int
        How many, at most 1000: the scenario's, and those that follow.
    engine : str
        As for `run`.
    overrides : Mapping[str, Any], optional
        Further values by dotted key, as for `run`, but for those that the
        arguments above decide.
    jobs : int, optional
        Runs at a time, by default as many as there are processors.
    out : str or Path, optional
        A folder, made if it does not exist, for comparison.json, comparison.csv,
        figures, and in `runs/` each run's metrics and a series every 10 ms. What
        is there already of equal runs is not run again.
    cluster : str, optional
        Address of a dask.distributed scheduler that makes the runs, as for `run_many`.
    progress : callable, optional
        Called with a line for each run that has ended; by default it is printed
        to standard error.

    Returns
    -------
    DataFrame
        A row per run: `scheme`, `delay` (s), `hand`, `seed`, `engine`, `stable`
        (`is_stable`), `exit` (status of `dual-proxy run`: 0 done, 2 it cannot be
        run, 3 it failed), `failure` (why), and all metrics. Those of a run that
        came to no end are missing.

    Raises
    ------
    ScenarioError
        If the scenario or an argument is wrong, before anything is run.
    KeyboardInterrupt
        If it is interrupted; what is in `out` stays.
    OSError
        If something cannot be saved.
    """
    variants = {
        text: _parse_scheme(text)
        for text in _check_choices("schemes", SCHEMES if schemes == "all" else schemes)
    }
    hands = _check_choices("hands", hands, HANDS)
    delays = _check_choices("delays", delays)
    if not isinstance(seeds, int) or not 1 <= seeds <= _MOST_SEEDS:
        raise ScenarioError(
            f"seeds: expected a whole number in [1, {_MOST_SEEDS}], got {seeds!r}"
        )
    for key, argument in _DECIDED.items():
        if key in (overrides or {}):
            raise ScenarioError(f"{key}: is decided by `{argument}`")
    workers = count_workers(jobs)
    base = change_scenario(scenario, overrides=overrides)
    plan: dict[tuple[str, float, str, int], Job] = {}
    for hand in hands:
        for text, (scheme, own) in variants.items():
            for delay in delays:
                for seed in range(base.seed, base.seed + seeds):
                    changed = change_scenario(
                        base,
                        scheme=scheme,
                        delay=delay,
                        seed=seed,
                        overrides=HANDS[hand] | own,
                    )
                    plan[text, delay, hand, seed] = Job(
                        f"{text} {1e3 * delay:g}ms {hand} {seed}",
                        changed,
                        choose_engine(engine, changed),
                    )
    with contextlib.ExitStack() as stack:
        folder = None
        if out is not None:
            folder = stack.enter_context(RunsFolder(out, f"compare {base.name}"))
        results = run_many(list(plan.values()), folder, workers, progress, cluster)
        table = make_table(plan, results)
        if folder is not None:
            _save(table, base, folder.path)
            # Plotting is imported only where something is plotted.
            from dual_proxy.figures import draw_comparison

            draw_comparison(table, results, folder.path, base.name)
    return table


def _parse_scheme(text: str) -> tuple[str, dict[str, Any]]:
    """Return scheme and overrides of "four_channel:variant=three_channel"."""
    scheme, *settings = str(text).split(":")
    if scheme not in SCHEMES:
        raise ScenarioError(
            f"schemes: expected some of {', '.join(SCHEMES)}, got {text!r}"
        )
    overrides = {}
    for setting in settings:
        key, equals, value = setting.partition("=")
        if not (key and equals):
            raise ScenarioError(f"schemes: expected SCHEME:KEY=VALUE, got {text!r}")
        overrides[f"schemes.{scheme}.{key}"] = parse_yaml(value, f"schemes: {text}")
    return scheme, overrides


def _check_choices(name: str, given: Iterable[T], known: Iterable[T] = ()) -> list[T]:
    if isinstance(given, str) or not isinstance(given, Iterable):
        raise ScenarioError(f"{name}: expected a list, got {given!r}")
    given, known = list(given), list(known)
    if not given:
        raise ScenarioError(f"{name}: expected at least one")
    for number, choice in enumerate(given):
        if known and choice not in known:
            raise ScenarioError(
                f"{name}: expected some of {', '.join(map(str, known))}, got {choice!r}"
            )
        if choice in given[:number]:
            raise ScenarioError(f"{name}: {choice!r} is there twice")
    return given


def make_table(
    plan: Mapping[tuple[str, float, str, int], Job], results: Sequence[Result]
) -> pd.DataFrame:
    """Return the table of `compare`.

    Parameters
    ----------
    plan : Mapping
        By scheme, delay, hand and seed: what was run.
    results : sequence of Result
        What came of it.
    """
    keys = list(METRICS)
    keys += [
        key
        for key in ANGULAR_METRICS
        if any(key in (result.metrics or {}) for result in results)
    ]
    rows = []
    for (setting, job), result in zip(plan.items(), results, strict=True):
        metrics = result.metrics
        rows.append(
            dict(zip(("scheme", "delay", "hand", "seed"), setting, strict=True))
            | {
                "engine": job.engine,
                "stable": None if metrics is None else is_stable(metrics),
                "exit": result.status,
                "failure": result.failure,
            }
            | {key: _cell((metrics or {}).get(key)) for key in keys}
        )
    return pd.DataFrame(rows)


def _cell(value: Any) -> Any:
    return ", ".join(value) if isinstance(value, list) else value


def summarise(table: pd.DataFrame) -> pd.DataFrame:
    """Summarise a comparison over its seeds.

    Parameters
    ----------
    table : DataFrame
        As `compare` returns it.

    Returns
    -------
    DataFrame
        A row per scheme, delay and hand: `runs`, how many `failed`, are `stable`
        and not (`unstable`), and for each metric of `COLUMNS` mean and worst,
        KEY and `worst KEY`; of runs without a value nothing goes in.
    """
    rows = []
    for (scheme, delay, hand), group in table.groupby(
        ["scheme", "delay", "hand"], sort=False
    ):
        row = {
            "scheme": scheme,
            "delay": delay,
            "hand": hand,
            "runs": len(group),
            "failed": int((group["exit"] != 0).sum()),
            "stable": int(group["stable"].eq(True).sum()),
            "unstable": int(group["stable"].eq(False).sum()),
        }
        for column in COLUMNS:
            values = pd.to_numeric(group[column.key])
            row[column.key] = values.mean()
            worst = values.min() if column.at_least else values.max()
            row[f"worst {column.key}"] = worst
        rows.append(row)
    return pd.DataFrame(rows)


def summary_cells(table: pd.DataFrame) -> tuple[list[str], list[list[str]]]:
    """Return head and rows of what is printed of a comparison.

    With several seeds a cell is mean and worst, "0.40 (0.52)". What no run of the
    comparison has is left out.
    """
    summary = summarise(table)
    columns = [column for column in COLUMNS if summary[column.key].notna().any()]
    several_hands = summary["hand"].nunique() > 1
    several_seeds = summary["runs"].max() > 1
    head = ["scheme", "delay, ms"]
    head += ["hand"] if several_hands else []
    head += ["stable", *(column.label for column in columns)]
    rows = []
    for row in summary.to_dict("records"):
        cells = [row["scheme"], f"{1e3 * row['delay']:g}"]
        cells += [row["hand"]] if several_hands else []
        cells.append(_stable_cell(row))
        for column in columns:
            mean, worst = (
                "-" if math.isnan(value) else column.form.format(column.factor * value)
                for value in (row[column.key], row[f"worst {column.key}"])
            )
            cells.append(f"{mean} ({worst})" if several_seeds and mean != "-" else mean)
        rows.append(cells)
    return head, rows


def _stable_cell(row: Mapping[Any, Any]) -> str:
    judged = row["stable"] + row["unstable"]
    if not judged:
        return "-"
    if row["runs"] > 1 and row["stable"] < row["runs"]:
        return f"{row['stable']} of {row['runs']}"
    return "no" if row["unstable"] else "yes"


def _save(table: pd.DataFrame, scenario: Scenario, path: Path) -> None:
    """Save comparison.json and comparison.csv."""
    rows = [
        {key: None if _is_missing(value) else value for key, value in row.items()}
        for row in table.astype(object).to_dict("records")
    ]
    content = {
        "scenario": scenario.name,
        "legend": LEGEND,
        "rows": rows,
    }
    text = json.dumps(content, indent=1, allow_nan=False)
    replace_file(path / "comparison.json", f"{text}\n".encode())
    replace_file(path / "comparison.csv", table.to_csv(index=False).encode())


def _is_missing(value: Any) -> bool:
    return isinstance(value, float) and math.isnan(value)
