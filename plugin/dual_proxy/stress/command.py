# SPDX-License-Identifier: BSD-3-Clause
"""`dual-proxy stress`: many hard runs, what was wrong with them, and where each
scheme stops being stable."""

from __future__ import annotations

import functools
import json
import math
import shlex
import sys
import time as clock
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from dual_proxy.bench.pages import check_page, fill_page, markdown_table
from dual_proxy.log import replace_file
from dual_proxy.many_runs import Job, Result, RunsFolder, run_many
from dual_proxy.scenario import Scenario, ScenarioError
from dual_proxy.stress.cases import (
    FACTORS,
    SCENES,
    Case,
    base_scenario,
    case_scenario,
    draw_case,
    long_case,
)
from dual_proxy.stress.maps import (
    AXES,
    Boundary,
    draw_maps,
    find_boundaries,
    stiffness_text,
)
from dual_proxy.stress.verdict import Verdict, judge
from dual_proxy.watch import Watched

__all__ = ["FULL", "PAGE_MARKS", "QUICK", "Plan", "repeat_command", "stress"]

#: What names the tables' places in a page.
PAGE_MARKS = tuple(
    f"dual-proxy stress: {name}" for name in ("regions", "failures", "day", *AXES)
)

_REST = 2.0  # s, at the end of a run
_OWN = "dual_proxy"


class Plan(NamedTuple):
    """How much is run."""

    cases: int
    drake_every: int
    """Of so many cases one is run in Drake, too; 0: none."""
    map_steps: int
    """Of each boundary's bisection; 0: no maps."""
    hours: float
    """h, of one long run."""


FULL = Plan(cases=3000, drake_every=300, map_steps=8, hours=24.0)
QUICK = Plan(cases=150, drake_every=0, map_steps=0, hours=0.1)


class Outcome(NamedTuple):
    """What came of a case."""

    case: Case
    engine: str
    refused: str
    """Why a scenario's checks refused it; empty if they did not."""
    failure: str
    """Why it came to no end."""
    verdict: Verdict
    watched: Watched

    @property
    def safe(self) -> bool:
        """Whether it ended and no limit was broken."""
        return not self.failure and not self.verdict.safety

    @property
    def stable(self) -> bool:
        """Whether it is safe and nothing else was wrong."""
        return self.safe and not self.verdict.stability

    @property
    def wrong(self) -> str:
        """What was wrong, in one line."""
        return self.failure or self.verdict.wrong


class Bench:
    """Runs cases."""

    def __init__(
        self,
        folder: RunsFolder | None,
        workers: int | None,
        progress: Callable[[str], None] | None,
        cluster: str | None = None,
    ) -> None:
        self._bases = {name: base_scenario(name) for name in SCENES}
        self._run = functools.partial(
            run_many,
            folder=folder,
            workers=workers,
            progress=progress,
            cluster=cluster,
        )

    def draw(self, number: int) -> Case:
        """Draw a case by its number."""
        return draw_case(number, self._bases)

    def long_case(self, hours: float) -> Case:
        """Return the case of many hours."""
        return long_case(hours, self._bases["plane"])

    def scenario(self, case: Case) -> Scenario:
        """Return what is run of a case; raises ScenarioError if it is refused."""
        return case_scenario(case, self._bases[case.scene])

    def run(self, cases: Sequence[Case], engine: str = "bare") -> list[Outcome]:
        """Run cases; each has its outcome."""
        outcomes: dict[int, Outcome] = {}
        plan: dict[int, Job] = {}
        for place, case in enumerate(cases):
            try:
                scenario = self.scenario(case)
            except ScenarioError as error:
                outcomes[place] = _no_run(case, engine, refused=str(error))
                continue
            name = f"{case.number} {'-'.join(case.factors)} {engine}"
            plan[place] = Job(name, scenario, engine, _REST)
        results = self._run(list(plan.values()))
        for (place, job), result in zip(plan.items(), results, strict=True):
            outcomes[place] = _outcome(cases[place], job, result)
        return [outcomes[place] for place in range(len(cases))]

    def shrink(self, outcomes: Sequence[Outcome]) -> list[Outcome]:
        """Take factors away from failed cases as long as they still fail: each
        time all that are left are tried without each of their factors."""
        shrunk = list(outcomes)
        open_ones = [place for place, o in enumerate(shrunk) if o.case.factors]
        while open_ones:
            tries = [
                (place, shrunk[place].case.without(factor))
                for place in open_ones
                for factor in shrunk[place].case.factors
            ]
            tried = self.run([case for _, case in tries])
            open_ones = []
            for (place, _), outcome in zip(tries, tried, strict=True):
                before = shrunk[place]
                if place in open_ones or outcome.refused:
                    continue
                if _is_as_bad(outcome, before):
                    shrunk[place] = outcome
                    open_ones.append(place)
            open_ones = [place for place in open_ones if shrunk[place].case.factors]
        return shrunk


def _is_as_bad(outcome: Outcome, before: Outcome) -> bool:
    return not outcome.stable if before.safe else not outcome.safe


def _outcome(case: Case, job: Job, result: Result) -> Outcome:
    if result.metrics is None:
        if result.status == 2:
            return _no_run(case, job.engine, refused=result.failure)
        return _no_run(case, job.engine, failure=result.failure)
    verdict = judge(result.metrics, job.scenario)
    return Outcome(case, job.engine, "", "", verdict, result.metrics)


def _no_run(case: Case, engine: str, refused: str = "", failure: str = "") -> Outcome:
    return Outcome(case, engine, refused, failure, Verdict([], []), {})


class _Ticker:
    """Shows the last line of progress, once a second."""

    def __init__(self) -> None:
        self._next = 0.0

    def __call__(self, text: str) -> None:
        if (now := clock.monotonic()) >= self._next:
            self._next = now + 1
            print(text, file=sys.stderr, flush=True)


def stress(
    plan: Plan = FULL,
    first: int = 0,
    out: str | Path = "out/stress",
    jobs: int | None = None,
    page: Path | None = None,
    progress: Callable[[str], None] | None = None,
    cluster: str | None = None,
) -> tuple[dict[str, str], list[Outcome]]:
    """Run cases and a day, shrink those of the dual proxy that failed and those of
    any scheme that broke a limit, and find the boundaries of stability.

    Parameters
    ----------
    plan : Plan
        How much.
    first : int
        Number of the first case; those that follow have the next ones.
    out : str or Path
        A folder for stress.json, the maps, and the runs; what is there already is
        not run again.
    jobs : int, optional
        Runs at a time, by default as many as there are processors.
    page : Path, optional
        A page to be filled, with its figure in images/ beside it.
    cluster : str, optional
        Address of a dask.distributed scheduler that makes the runs, as for `run_many`.
    progress : callable, optional
        Called with a line for each run; by default one a second is printed.

    Returns
    -------
    tables : dict
        Markdown, by the names of `PAGE_MARKS`.
    failures : list of Outcome
        Each with the fewest factors that still fail; the day, if it did, as it is.

    Raises
    ------
    ScenarioError
        If an argument is wrong, before anything is run.
    KeyboardInterrupt, OSError
        As for `run_many`.
    """
    if plan.cases < 1:
        raise ScenarioError(f"cases: expected at least 1, got {plan.cases}")
    if first < 0:
        raise ScenarioError(f"first: expected at least 0, got {first}")
    if page is not None:
        check_page(page, plan.map_steps == 0, PAGE_MARKS)
    say = progress or _Ticker()
    with RunsFolder(out, "stress") as folder:
        bench = Bench(folder, jobs, say, cluster)
        cases = [bench.draw(number) for number in range(first, first + plan.cases)]
        # The day first: it takes as long as most of the others.
        day, *outcomes = bench.run([bench.long_case(plan.hours), *cases])
        if plan.drake_every:
            outcomes += bench.run(
                [
                    case
                    for case in cases[:: plan.drake_every]
                    if _has_drake(bench, case)
                ],
                "drake",
            )
        failures = bench.shrink([o for o in outcomes if _is_failure(o)])
        boundaries = (
            find_boundaries(
                folder,
                steps=plan.map_steps,
                workers=jobs,
                progress=say,
                cluster=cluster,
            )
            if plan.map_steps
            else []
        )
        tables = {
            "regions": _regions(outcomes),
            "failures": _failures(failures, bench),
            "day": _day(day, plan),
        } | {axis: _map_table(axis, boundaries) for axis in AXES if boundaries}
        _save(folder.path, day, outcomes, failures, boundaries, bench)
        if boundaries:
            draw_maps(boundaries, folder.path / "stability.png")
    if page is not None:
        for name, mark in zip(tables, PAGE_MARKS, strict=True):
            fill_page(page, mark, tables[name])
        draw_maps(boundaries, page.parent / "images" / "stability.png")
    return tables, [*failures, *([day] if _is_failure(day) else [])]


def explain(number: int, jobs: int | None = None) -> str:
    """Run a case alone; tell what is wrong, what it needs for that, and how to
    repeat it.

    Raises
    ------
    ScenarioError
        If there is no case of this number, or its scenario is refused.
    """
    if number < 0:
        raise ScenarioError(f"case: expected at least 0, got {number}")
    bench = Bench(None, jobs, lambda _: None)
    case = bench.draw(number)
    scenario = bench.scenario(case)
    (outcome,) = bench.run([case])
    least = outcome if outcome.stable else bench.shrink([outcome])[0]
    lines = [
        f"case {number}: {case.scene}, {case.scheme}, {', '.join(case.factors) or '-'}",
        f"wrong: {outcome.wrong or 'nothing'}",
    ]
    if least is not outcome:
        lines += [f"it needs: {', '.join(least.case.factors) or 'nothing'}"]
        lines += [f"wrong then: {least.wrong}"]
        scenario = bench.scenario(least.case)
    return "\n".join([*lines, repeat_command(least.case, scenario)])


def _has_drake(bench: Bench, case: Case) -> bool:
    """Tell whether Drake can simulate a case."""
    try:
        scenario = bench.scenario(case)
    except ScenarioError:
        return False
    return scenario.robot != "point_mass" and "model" not in case.factors


def _is_failure(outcome: Outcome) -> bool:
    """Whether there is something to mend: a limit broken by any scheme, or the
    dual proxy not stable."""
    if outcome.refused:
        return False
    return not outcome.safe or (outcome.case.scheme == _OWN and not outcome.stable)


def _regions(outcomes: Sequence[Outcome]) -> str:
    """How many passed, by factor."""
    rows = []
    for name in ("all", "nothing", *FACTORS):
        inside = [
            outcome
            for outcome in outcomes
            if name == "all"
            or name in outcome.case.factors
            or (name == "nothing" and not outcome.case.factors)
        ]
        ran = [outcome for outcome in inside if not outcome.refused]
        own = [outcome for outcome in ran if outcome.case.scheme == _OWN]
        others = [outcome for outcome in ran if outcome.case.scheme != _OWN]
        rows.append(
            [
                name,
                *(str(len(inside)), str(len(inside) - len(ran))),
                *(_share(o.safe for o in own), _share(o.stable for o in own)),
                *(_share(o.safe for o in others), _share(o.stable for o in others)),
            ]
        )
    head = ["factor", "cases", "refused", "dual proxy: safe", "and stable"]
    return markdown_table([*head, "other schemes: safe", "and stable"], rows)


def _share(passed: Any) -> str:
    values = list(passed)
    if not values:
        return "-"
    # Never rounded up to all of them.
    return f"{math.floor(1000 * sum(values) / len(values)) / 10:g} % of {len(values)}"


def _failures(failures: Sequence[Outcome], bench: Bench) -> str:
    """Each kind of failure once, with how often it came."""
    kinds: dict[tuple[str, ...], list[Outcome]] = {}
    for outcome in failures:
        what = "safety" if not outcome.safe else "stability"
        key = (outcome.case.scheme, what, " + ".join(sorted(outcome.case.factors)))
        kinds.setdefault(key, []).append(outcome)
    rows = []
    for (scheme, what, factors), group in sorted(
        kinds.items(), key=lambda item: -len(item[1])
    ):
        worst = group[0]
        rows.append(
            [
                *(scheme, what, factors or "nothing", str(len(group))),
                worst.wrong.replace("|", "/")[:160],
                f"`dual-proxy stress --case {worst.case.number}`",
            ]
        )
    head = ["scheme", "what", "fewest factors", "cases", "the first", "to repeat it"]
    return markdown_table(head, rows or [["-"] * len(head)])


# What of a long run is told, and in which unit.
_OF_DAY = {
    "device_force": "most force on the hand, N",
    "device_energy": "most energy given to the hand, J",
    "motion_error": "tool off at the end, m",
    "rest_contact_force": "contact swings at rest, N",
}


def _day(day: Outcome, plan: Plan) -> str:
    values = [day.watched.get(name, {}).get("value") for name in _OF_DAY]
    return markdown_table(
        ["simulated, h", "what was wrong", *_OF_DAY.values()],
        [
            [
                f"{plan.hours:g}",
                day.refused or day.wrong or "nothing",
                *("-" if value is None else f"{value:.3g}" for value in values),
            ]
        ],
    )


def _map_table(axis: str, boundaries: Sequence[Boundary]) -> str:
    of_axis = [b for b in boundaries if b.axis == axis]
    values = list(dict.fromkeys(b.value for b in of_axis))
    by_key = {(b.scheme, b.value): b for b in of_axis}
    unit, factor = AXES[axis].unit, AXES[axis].factor
    return markdown_table(
        ["scheme", *(f"{factor * value:g} {unit}" for value in values)],
        (
            [scheme, *(stiffness_text(by_key[scheme, v].stiffness) for v in values)]
            for scheme in dict.fromkeys(b.scheme for b in of_axis)
        ),
    )


def repeat_command(case: Case, scenario: Scenario) -> str:
    """Return the command of `dual-proxy run` that repeats a case."""
    words = ["dual-proxy", "run", "plane" if case.scene == "reach" else case.scene]
    words += ["--engine", "bare"]
    base = base_scenario(words[2]).to_mapping()
    for key, value in _differences(base, scenario.to_mapping()):
        text = value if isinstance(value, str) else json.dumps(value)
        words += ["--set", f"{key}={text}"]
    return shlex.join(words)


def _differences(
    before: Mapping[str, Any], after: Mapping[str, Any], path: str = ""
) -> list[tuple[str, Any]]:
    found: list[tuple[str, Any]] = []
    for key, value in after.items():
        old = before.get(key)
        if isinstance(value, Mapping) and isinstance(old, Mapping):
            found += _differences(old, value, f"{path}{key}.")
        elif value != old:
            found.append((f"{path}{key}", value))
    return found


def _save(
    path: Path,
    day: Outcome,
    outcomes: Sequence[Outcome],
    failures: Sequence[Outcome],
    boundaries: Sequence[Boundary],
    bench: Bench,
) -> None:
    """Save stress.json."""
    content = {
        "day": _record(day) | {"watched": day.watched},
        "cases": [_record(outcome) for outcome in outcomes],
        "failures": [
            _record(outcome)
            | {"command": repeat_command(outcome.case, bench.scenario(outcome.case))}
            for outcome in failures
        ],
        "boundaries": [
            b._asdict()
            | {"stiffness": None if math.isinf(b.stiffness) else b.stiffness}
            for b in boundaries
        ],
    }
    text = json.dumps(content, indent=1, allow_nan=False)
    replace_file(path / "stress.json", f"{text}\n".encode())


def _record(outcome: Outcome) -> dict[str, Any]:
    return {
        "number": outcome.case.number,
        "engine": outcome.engine,
        "scene": outcome.case.scene,
        "scheme": outcome.case.scheme,
        "factors": list(outcome.case.factors),
        "refused": outcome.refused,
        "failure": outcome.failure,
        **outcome.verdict._asdict(),
    }
