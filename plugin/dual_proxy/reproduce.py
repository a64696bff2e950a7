# SPDX-License-Identifier: BSD-3-Clause
"""`dual-proxy reproduce`: every scene that the paper says something about, what it
says beside what is measured.

A scene is one of the package that has `claims`. Each claim is about every run of
its scheme; what is shown is the worst over the seeds.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from dual_proxy._core import Claim
from dual_proxy.bench.pages import check_page, fill_page, markdown_table
from dual_proxy.claims import is_about, judge_value, limit_text, statement
from dual_proxy.compare import make_table
from dual_proxy.log import replace_file
from dual_proxy.many_runs import Job, Result, RunsFolder, count_workers, run_many
from dual_proxy.run import change_scenario, choose_engine
from dual_proxy.scenario import Scenario, list_scenarios, load_scenario

__all__ = ["LAWS", "page_marks", "reproduce"]

#: What each scene is run with: this project's law, its law with the paper's
#: filter, the paper's law.
LAWS: dict[str, dict[str, Any]] = {
    "default": {},
    "printed filter": {"filter.likelihood": "paper", "filter.period": 1 / 15},
    "printed law": {"law": "printed"},
}

# One way, s; of other scenes that of the scenario.
_DELAYS = {
    "plane": (0.0, 0.05, 0.15, 0.35, 0.65, 1.5),
    "inner_corner": (0.0, 0.15, 0.35),
    "outer_corner": (0.0, 0.15, 0.35),
}
# Scene -> name in a table -> what else it is run with.
_SETTINGS: dict[str, dict[str, dict[str, Any]]] = {
    "inner_corner": {"": {}, "without friction": {"scene.friction": 0.0}}
}
_SEEDS = 5
_DRAWN_SEED = 0


class Key(NamedTuple):
    """Which run."""

    scene: str
    setting: str
    law: str
    scheme: str
    delay: float
    seed: int


def page_marks() -> list[str]:
    """Return what names the tables' places in a page."""
    return [f"dual-proxy reproduce: {name}" for name in ("summary", *_scenes())]


def reproduce(
    quick: bool = False,
    out: str | Path = "out/reproduce",
    jobs: int | None = None,
    page: Path | None = None,
    engine: str = "auto",
    progress: Callable[[str], None] | None = None,
    cluster: str | None = None,
) -> tuple[dict[str, str], list[str]]:
    """Run every scene and compare with what is claimed of it.

    Parameters
    ----------
    quick : bool
        With one seed and the bare engine, in place of five and what
        `dual_proxy.run` takes.
    out : str or Path
        A folder for reproduction.json, a figure of each scene, and the runs; what
        is there already is not run again.
    jobs : int, optional
        Runs at a time, by default as many as there are processors.
    page : Path, optional
        A page to be filled, with figures in images/ beside it.
    engine : str
        As for `run`; with `quick` "auto" is the bare engine.
    cluster : str, optional
        Address of a dask.distributed scheduler that makes the runs, as for `run_many`.
    progress : callable, optional
        As for `compare`.

    Returns
    -------
    tables : dict
        Of each scene, and over all of them, `summary`: Markdown.
    failures : list of str
        A line for each run that came to no end.

    Raises
    ------
    ScenarioError
        If an argument is wrong, before anything is run.
    KeyboardInterrupt, OSError
        As for `compare`.
    """
    workers = count_workers(jobs)
    if page is not None:
        check_page(page, quick, page_marks())
    scenes = _scenes()
    plan = _make_plan(scenes, quick, "bare" if quick and engine == "auto" else engine)
    with RunsFolder(out, "reproduce") as folder:
        results = run_many(list(plan.values()), folder, workers, progress, cluster)
        by_key = dict(zip(plan, results, strict=True))
        rows = _judge(scenes, plan, by_key)
        tables = {name: _table(name, rows) for name in scenes}
        tables = {"summary": _summary(rows)} | tables
        text = json.dumps(rows, indent=1, allow_nan=False)
        replace_file(folder.path / "reproduction.json", f"{text}\n".encode())
        _draw(scenes, plan, by_key, folder.path)
    if page is not None:
        for name, mark in zip(tables, page_marks(), strict=True):
            fill_page(page, mark, tables[name])
        _draw(scenes, plan, by_key, page.parent / "images")
    failures = [
        f"{plan[key].name}: {result.failure}"
        for key, result in by_key.items()
        if result.metrics is None
    ]
    return tables, failures


def _scenes() -> dict[str, Scenario]:
    scenarios = {name: load_scenario(name) for name in list_scenarios()}
    return {name: scene for name, scene in scenarios.items() if scene.claims}


def _make_plan(
    scenes: Mapping[str, Scenario], quick: bool, engine: str
) -> dict[Key, Job]:
    plan = {}
    for name, scene in scenes.items():
        delays = _DELAYS.get(name, (scene.link.delay,))
        for setting, overrides in _SETTINGS.get(name, {"": {}}).items():
            for scheme in dict.fromkeys(claim.scheme for claim in scene.claims):
                # Laws are the dual proxy's.
                laws = LAWS if scheme == "dual_proxy" else {"default": {}}
                for law, changes in laws.items():
                    for delay in delays:
                        for seed in range(1 if quick else _SEEDS):
                            key = Key(name, setting, law, scheme, delay, seed)
                            plan[key] = _make_job(
                                key, scene, overrides | changes, engine
                            )
    return plan


def _make_job(
    key: Key, scene: Scenario, overrides: Mapping[str, Any], engine: str
) -> Job:
    scenario = change_scenario(
        scene, scheme=key.scheme, delay=key.delay, seed=key.seed, overrides=overrides
    )
    parts = (
        *(key.scene, key.setting, key.scheme, key.law),
        *(f"{1e3 * key.delay:g}ms", str(key.seed)),
    )
    return Job(" ".join(filter(None, parts)), scenario, choose_engine(engine, scenario))


def _judge(
    scenes: Mapping[str, Scenario],
    plan: Mapping[Key, Job],
    results: Mapping[Key, Result],
) -> list[dict[str, Any]]:
    """Return a row per claim, setting and law."""
    rows = []
    for name, scene in scenes.items():
        for claim in scene.claims:
            groups: dict[tuple[str, str], list[Key]] = {}
            for key, job in plan.items():
                if key.scene == name and is_about(claim, job.scenario):
                    groups.setdefault((key.setting, key.law), []).append(key)
            for (setting, law), keys in groups.items():
                values = _worst(claim, keys, results)
                met = [judge_value(claim, value) for value in values.values()]
                rows.append(
                    {
                        "scene": name,
                        "paper": claim.paper,
                        "source": claim.source,
                        "claim": statement(claim),
                        "limit": limit_text(claim),
                        "setting": setting,
                        "scheme": claim.scheme,
                        "law": law,
                        "engine": plan[keys[0]].engine,
                        "delays": list(values),
                        "values": list(values.values()),
                        "met": all(met),
                    }
                )
    return rows


def _worst(
    claim: Claim, keys: Sequence[Key], results: Mapping[Key, Result]
) -> dict[float, float | None]:
    """Return the value at each delay that is furthest from the claim; None if a run
    has none."""

    def excess(value: float) -> float:
        return max(
            -math.inf if claim.at_least is None else claim.at_least - value,
            -math.inf if claim.at_most is None else value - claim.at_most,
        )

    worst: dict[float, float | None] = {}
    for delay in dict.fromkeys(key.delay for key in keys):
        values = [
            (results[key].metrics or {}).get(claim.metric)
            for key in keys
            if key.delay == delay
        ]
        found = [value for value in values if value is not None]
        worst[delay] = max(found, key=excess) if len(found) == len(values) else None
    return worst


def _table(scene: str, rows: Sequence[Mapping[str, Any]]) -> str:
    """Return a scene's claims beside what was measured with each law."""
    of_scene = [row for row in rows if row["scene"] == scene]
    lines: dict[tuple[str, ...], dict[str, str]] = {}
    for row in of_scene:
        delays = " / ".join(f"{1e3 * delay:g}" for delay in row["delays"])
        setting = ", ".join(filter(None, (row["setting"], _scheme_text(row))))
        claim = f"{row['claim']}; {setting}" if setting else row["claim"]
        line = (claim, f"`{row['limit']}`", delays, row["engine"])
        values = " / ".join(_value_text(row, value) for value in row["values"])
        verdict = "met" if row["met"] else "**not met**"
        lines.setdefault(line, {})[row["law"]] = f"{values}: {verdict}"
    return markdown_table(
        ["claim", "as a limit", "delays, ms", "engine", *LAWS],
        (
            [*line, *(cells.get(law, "-") for law in LAWS)]
            for line, cells in lines.items()
        ),
    )


def _scheme_text(row: Mapping[str, Any]) -> str:
    scheme: str = row["scheme"]
    return "" if scheme == "dual_proxy" else f"`{scheme}`"


def _value_text(row: Mapping[str, Any], value: float | None) -> str:
    if value is None:
        return "-"
    # Shares are told apart by what they lack of 1.
    return f"{value:.4f}" if "accuracy" in row["limit"] else f"{value:.3g}"


def _summary(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return how many claims of each scene are met with each law."""
    cells = []
    for scene in dict.fromkeys(row["scene"] for row in rows):
        of_scene = [row for row in rows if row["scene"] == scene]
        line = [scene]
        for law in LAWS:
            for papers in (True, False):
                met = [
                    row["met"]
                    for row in of_scene
                    if row["law"] == law and bool(row["paper"]) is papers
                ]
                line.append(f"{sum(met)} of {len(met)}" if met else "-")
        cells.append(line)
    head = [f"{law}: {whose}" for law in LAWS for whose in ("the paper's", "aims")]
    return markdown_table(["scene", *head], cells)


def _draw(
    scenes: Mapping[str, Scenario],
    plan: Mapping[Key, Job],
    results: Mapping[Key, Result],
    folder: Path,
) -> None:
    """Draw each scene with the default law and the first seed, and the errors of
    several schemes."""
    # Plotting is imported only where something is plotted.
    from dual_proxy.figures import draw_errors, draw_scene

    folder.mkdir(parents=True, exist_ok=True)
    for name in scenes:
        usual = [key for key in plan if key[:3] == (name, "", "default")]
        series = {
            key.delay: results[key].series()
            for key in usual
            if key.scheme == "dual_proxy" and key.seed == _DRAWN_SEED
        }
        title = f"scene {name}, dual_proxy, seed {_DRAWN_SEED}"
        draw_scene(series, folder / f"reproduce_{name}.png", title)
        if len({key.scheme for key in usual}) > 1:
            settings = {(key.scheme, key.delay, "", key.seed): key for key in usual}
            table = make_table(
                {setting: plan[key] for setting, key in settings.items()},
                [results[key] for key in settings.values()],
            )
            seeds = table["seed"].nunique()
            title = f"scene {name}, {seeds} seed{'s' if seeds > 1 else ''}"
            draw_errors(table, folder / f"reproduce_{name}_errors.png", title)
