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
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from dual_proxy.bench.pages import check_page, fill_page, markdown_table
from dual_proxy.log import replace_file
from dual_proxy.many_runs import Job, Result, RunsFolder, count_workers, run_many
from dual_proxy.scenario import SCHEMES, Scenario, ScenarioError
from dual_proxy.stress.cases import (
    FACTORS,
    SCENES,
    Case,
    base_scenario,
    case_scenario,
    draw_case,
    long_case,
)
from dual_proxy.stress.maps import MAPS, Cell, cell_text, draw_maps, find_ranges
from dual_proxy.stress.verdict import Verdict, judge, rest_time
from dual_proxy.watch import Watched

__all__ = [
    "FULL",
    "PAGE_MARKS",
    "QUICK",
    "Plan",
    "Report",
    "explain",
    "map_own",
    "stress",
]

#: What names the tables' places in a page.
PAGE_MARKS = tuple(
    f"dual-proxy stress: {name}"
    for name in ("regions", "failures", "unstable", "day", *MAPS)
)

_OWN = "dual_proxy"
#: Each is drawn before the first is run.
_MOST_CASES = 100_000
#: In place of the names of factors, if there are none.
NOTHING = "nothing"


class Plan(NamedTuple):
    """How much is run."""

    cases: int
    drake_every: int
    """Of so many cases the first that Drake can simulate is run in it, too; 0:
    none."""
    map_steps: int
    """Of the bisection of a range's ends; 0: no maps."""
    hours: float
    """h, of one long run."""


FULL = Plan(cases=3000, drake_every=100, map_steps=4, hours=24.0)
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
    not_made: str = ""
    """Why nothing is known of it."""

    @property
    def ran(self) -> bool:
        """Whether it is a run that can be judged."""
        return not self.refused and not self.not_made

    @property
    def factors(self) -> str:
        """The names of its factors."""
        return " + ".join(sorted(self.case.factors)) or NOTHING

    @property
    def command(self) -> str:
        """What repeats it."""
        only = ",".join(self.case.factors) or NOTHING
        words = ["dual-proxy", "stress", "--case", str(self.case.number)]
        words += ["--only", only]
        if self.engine != "bare":
            words += ["--engine", self.engine]
        return shlex.join(words)

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


class Report(NamedTuple):
    """What came of `stress`."""

    tables: dict[str, str]
    """Markdown, by the names of `PAGE_MARKS`."""
    failures: list[Outcome]
    """Each with the fewest factors that still fail; the day, if it did, as it is."""
    not_made: list[str]
    """Why runs are not there, one by one."""


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
        self.not_made: list[str] = []
        """Why runs are not there, so far."""
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

    def has_drake(self, case: Case) -> bool:
        """Tell whether Drake can simulate a case, and its log tells what happened:
        not what a wrong input says."""
        if set(case.factors) & {"model", "bad input"}:
            return False
        try:
            return self.scenario(case).robot != "point_mass"
        except ScenarioError:
            return False

    def scenario(self, case: Case) -> Scenario:
        """Return what is run of a case; raises ScenarioError if it is refused."""
        return case_scenario(case, self._bases[case.scene])

    def run(self, cases: Sequence[tuple[Case, str]]) -> list[Outcome]:
        """Run cases, each in an engine; each has its outcome."""
        outcomes: dict[int, Outcome] = {}
        plan: dict[int, Job] = {}
        for place, (case, engine) in enumerate(cases):
            try:
                scenario = self.scenario(case)
            except ScenarioError as error:
                outcomes[place] = _no_run(case, engine, refused=str(error))
                continue
            name = f"{case.number} {'-'.join(case.factors)} {engine}"
            plan[place] = Job(name, scenario, engine, rest_time(scenario))
        results = self._run(list(plan.values()))
        for (place, job), result in zip(plan.items(), results, strict=True):
            outcomes[place] = _outcome(cases[place][0], job, result)
            if result.not_made:
                self.not_made.append(f"{job.name}: {result.failure}")
        return [outcomes[place] for place in range(len(cases))]

    def shrink(
        self,
        outcomes: Sequence[Outcome],
        kinds: Sequence[str] | None = None,
    ) -> list[Outcome]:
        """Take factors away from failed cases as long as they still fail: each
        time all that are left are tried without each of their factors, in the
        engine in which they failed.

        Parameters
        ----------
        outcomes : sequence of Outcome
            Failed ones.
        kinds : sequence of str, optional
            Of each, what is to stay wrong (`Verdict.kinds`); by default each limit
            that was broken, or, of what was safe, each kind.
        """
        shrunk = list(outcomes)
        open_ones = [place for place, o in enumerate(shrunk) if o.case.factors]
        while open_ones:
            tries = [
                (place, shrunk[place].case.without(factor))
                for place in open_ones
                for factor in shrunk[place].case.factors
            ]
            tried = self.run([(case, shrunk[place].engine) for place, case in tries])
            open_ones = []
            for (place, _), outcome in zip(tries, tried, strict=True):
                before = shrunk[place]
                if place in open_ones or not outcome.ran:
                    continue
                if (
                    _is_as_bad(outcome, before)
                    if kinds is None
                    else kinds[place] in outcome.verdict.kinds
                ):
                    shrunk[place] = outcome
                    open_ones.append(place)
            open_ones = [place for place in open_ones if shrunk[place].case.factors]
        return shrunk


def _is_as_bad(outcome: Outcome, before: Outcome) -> bool:
    if before.failure:
        return bool(outcome.failure)
    if before.safe:
        return set(before.verdict.kinds) <= set(outcome.verdict.kinds)
    return set(before.verdict.limits) <= set(outcome.verdict.limits)


def _outcome(case: Case, job: Job, result: Result) -> Outcome:
    if result.not_made:
        return _no_run(case, job.engine, not_made=result.failure)
    if result.metrics is None:
        if result.status == 2:
            return _no_run(case, job.engine, refused=result.failure)
        return _no_run(case, job.engine, failure=result.failure)
    verdict = judge(result.metrics, job.scenario)
    return Outcome(case, job.engine, "", "", verdict, result.metrics)


def _no_run(
    case: Case,
    engine: str,
    refused: str = "",
    failure: str = "",
    not_made: str = "",
) -> Outcome:
    return Outcome(case, engine, refused, failure, Verdict([], []), {}, not_made)


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
) -> Report:
    """Run cases and a day, shrink those of the dual proxy that failed and those of
    any scheme that broke a limit, and one of each kind of the others' that are not
    stable, and map what is stable.

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
        A page to be filled, with its figure in images/ beside it; not if a run
        could not be made.
    cluster : str, optional
        Address of a dask.distributed scheduler that makes the runs, as for `run_many`.
    progress : callable, optional
        Called with a line for each run; by default one a second is printed.

    Returns
    -------
    Report

    Raises
    ------
    ScenarioError
        If an argument is wrong, before anything is run.
    KeyboardInterrupt, OSError
        As for `run_many`.
    """
    if not 1 <= plan.cases <= _MOST_CASES:
        raise ScenarioError(
            f"cases: expected 1 to {_MOST_CASES}, got {plan.cases} (--first N: others)"
        )
    if first < 0:
        raise ScenarioError(f"first: expected at least 0, got {first}")
    alone = cluster is None and count_workers(jobs) == 1
    if page is not None:
        check_page(page, plan.map_steps == 0, PAGE_MARKS)
    say = progress or _Ticker()
    done = {"first": first, **plan._asdict()}
    with RunsFolder(out, "stress") as folder:
        _check_earlier(folder.path / _RESULTS, done)
        bench = Bench(folder, jobs, say, cluster)
        cases = [bench.draw(number) for number in range(first, first + plan.cases)]
        runs = [(case, "bare") for case in cases]
        runs += [(case, "drake") for case in _sample(bench, cases, plan.drake_every)]
        # The day takes as long as most of the others: beside them, or after them.
        day_run = (bench.long_case(plan.hours), "bare")
        if alone:
            *outcomes, day = bench.run([*runs, day_run])
        else:
            day, *outcomes = bench.run([day_run, *runs])
        failures = bench.shrink([o for o in outcomes if _is_failure(o)])
        groups = _group_unstable(outcomes)
        examples = bench.shrink(
            [min(group, key=_size) for group in groups.values()],
            [kind for _, kind in groups],
        )
        cells = (
            find_ranges(
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
            "failures": _failures(failures),
            "unstable": _unstable(groups, examples),
            "day": _day(day, plan),
        } | {name: _map_table(name, cells) for name in MAPS if cells}
        _save(folder.path, done, day, outcomes, failures, examples, cells)
        if cells:
            draw_maps(cells, folder.path / "stability.png")
    not_made = [*bench.not_made, *(cell.not_made for cell in cells if cell.not_made)]
    if page is not None and not not_made:
        for name, mark in zip(tables, PAGE_MARKS, strict=True):
            fill_page(page, mark, tables[name])
        draw_maps(cells, page.parent / "images" / "stability.png")
    return Report(tables, [*failures, *([day] if _is_failure(day) else [])], not_made)


# Of a folder: what the runs came to.
_RESULTS = "stress.json"


def _check_earlier(file: Path, done: dict[str, Any]) -> None:
    """Leave results alone that hold more than these would."""
    try:
        before = json.loads(file.read_text())["done"]
        begin, end = before["first"], before["first"] + before["cases"]
        covered = (
            done["first"] <= begin
            and end <= done["first"] + done["cases"]
            and (done["map_steps"] > 0 or before["map_steps"] == 0)
        )
    except (OSError, ValueError, KeyError, TypeError):
        return  # There are none, or such as can be made no use of.
    if not covered:
        maps = " and maps" if before["map_steps"] else ""
        raise ScenarioError(
            f"{file}: holds cases {begin} to {end - 1}{maps}, which less would take "
            "the place of; expected all of them, or another folder (--out)"
        )


def _sample(bench: Bench, cases: Sequence[Case], every: int) -> list[Case]:
    """Of each so many cases the first that Drake can simulate; of 0 none."""
    if every == 0:
        return []
    blocks = (cases[i : i + every] for i in range(0, len(cases), every))
    firsts = (next(filter(bench.has_drake, block), None) for block in blocks)
    return [case for case in firsts if case is not None]


def map_own(
    name: str,
    overrides: dict[str, Any],
    out: str | Path = "out/stress",
    jobs: int | None = None,
    cluster: str | None = None,
) -> tuple[str, list[str]]:
    """Make one map of stability, of a lab's own values.

    Parameters
    ----------
    name : str
        Of `MAPS`.
    overrides : dict
        Of scene `plane`, as of `Scenario.with_overrides`.
    out, jobs, cluster
        As for `stress`; the folder gets map.png, and keeps the runs.

    Returns
    -------
    table : str
        Markdown.
    not_made : list of str
        Why runs are not there.

    Raises
    ------
    ScenarioError
        If a value is wrong, or what the map changes anyway.
    """
    with RunsFolder(out, "stress") as folder:
        cells = find_ranges(
            folder,
            [name],
            workers=jobs,
            progress=_Ticker(),
            cluster=cluster,
            overrides=overrides,
        )
        draw_maps(cells, folder.path / "map.png")
    return _map_table(name, cells), [cell.not_made for cell in cells if cell.not_made]


def explain(
    number: int,
    jobs: int | None = None,
    only: Sequence[str] | None = None,
    engine: str = "bare",
    out: Path | None = None,
) -> tuple[str, str]:
    """Run a case alone; tell what is wrong, what it needs for that, and how to
    repeat it.

    Parameters
    ----------
    number : int
        Of the case.
    jobs : int, optional
        As for `stress`.
    only : sequence of str, optional
        The names of those of its factors that it keeps, or `NOTHING`; then it is
        run as it is. By default all, and those that it does not need are taken
        away.
    engine : str
        "bare" or "drake".
    out : Path, optional
        A folder for the scenario of what was run last.

    Returns
    -------
    text : str
        All of it, with what was watched.
    failure : str
        What is wrong with it; empty if nothing.

    Raises
    ------
    ScenarioError
        If there is no case of this number or no such factor, or its scenario is
        refused.
    """
    if number < 0:
        raise ScenarioError(f"case: expected at least 0, got {number}")
    bench = Bench(None, jobs, lambda _: None)
    case = bench.draw(number)
    if only is not None:
        case = _keep_only(case, only)
    scenario = bench.scenario(case)
    (outcome,) = bench.run([(case, engine)])
    if outcome.refused:
        raise ScenarioError(f"case {number}: {outcome.refused}")
    wrong = outcome.not_made or outcome.wrong
    lines = [
        f"case {number}: {case.scene}, {case.scheme}, engine {engine}, "
        f"{outcome.factors}",
        f"wrong: {wrong or NOTHING}",
    ]
    if only is None and wrong and outcome.ran:
        (outcome,) = bench.shrink([outcome])
        scenario = bench.scenario(outcome.case)
        lines += [f"it needs: {outcome.factors}", f"wrong then: {outcome.wrong}"]
    lines += [f"to repeat it: {outcome.command}"]
    if out is not None:
        file = out / f"case-{number}.yaml"
        out.mkdir(parents=True, exist_ok=True)
        replace_file(file, scenario.to_yaml().encode())
        lines += [f"its log: dual-proxy run {file} --engine {engine}"]
    for name, watch in outcome.watched.items():
        value = "-" if watch["value"] is None else f"{watch['value']:.4g}"
        text = f"{name:24}{value:>10} {watch['unit']}"
        lines.append(f"{text}  {watch['detail']}".rstrip())
    return "\n".join(lines), wrong


def _keep_only(case: Case, names: Sequence[str]) -> Case:
    kept = [] if list(names) == [NOTHING] else list(names)
    for name in kept:
        if name not in case.factors:
            raise ScenarioError(
                f"only: expected some of the factors of case {case.number} "
                f"({', '.join(case.factors) or 'it has none'}) or {NOTHING}, got "
                f"{name!r}"
            )
    for name in set(case.factors) - set(kept):
        case = case.without(name)
    return case


def _is_failure(outcome: Outcome) -> bool:
    """Whether there is something to mend: a limit broken by any scheme, or the
    dual proxy not stable."""
    if not outcome.ran:
        return False
    return not outcome.safe or (outcome.case.scheme == _OWN and not outcome.stable)


def _group_unstable(
    outcomes: Iterable[Outcome],
) -> dict[tuple[str, str], list[Outcome]]:
    """Those of the other schemes that are safe and not stable, by scheme and by
    what is wrong."""
    groups: dict[tuple[str, str], list[Outcome]] = {}
    for outcome in outcomes:
        scheme = outcome.case.scheme
        if scheme == _OWN or not outcome.ran or not outcome.safe:
            continue
        for kind in outcome.verdict.kinds:
            groups.setdefault((scheme, kind), []).append(outcome)
    return groups


def _size(outcome: Outcome) -> tuple[int, int]:
    return len(outcome.case.factors), outcome.case.number


def _regions(outcomes: Sequence[Outcome]) -> str:
    """How many passed, by factor, scene and scheme; in Drake beside that."""
    bare = [outcome for outcome in outcomes if outcome.engine == "bare"]
    groups = {
        "all": bare,
        NOTHING: [outcome for outcome in bare if not outcome.case.factors],
        **{name: [o for o in bare if name in o.case.factors] for name in FACTORS},
        **{
            f"scene {name}": [o for o in bare if o.case.scene == name]
            for name in SCENES
        },
        **{
            f"scheme {name}": [o for o in bare if o.case.scheme == name]
            for name in SCHEMES
        },
        "some of all, again in Drake": [o for o in outcomes if o.engine == "drake"],
    }
    head = ["of", "cases", "refused", "dual proxy: safe", "and stable"]
    head += ["other schemes: safe", "and stable"]
    has_gaps = any(outcome.not_made for outcome in outcomes)
    rows = []
    for name, inside in groups.items():
        ran = [outcome for outcome in inside if outcome.ran]
        own = [outcome for outcome in ran if outcome.case.scheme == _OWN]
        others = [outcome for outcome in ran if outcome.case.scheme != _OWN]
        row = [name, str(len(inside)), str(sum(bool(o.refused) for o in inside))]
        for group in (own, others):
            row += [_share(o.safe for o in group), _share(o.stable for o in group)]
        if has_gaps:
            row += [str(sum(bool(o.not_made) for o in inside))]
        rows.append(row)
    return markdown_table([*head, *(["not made"] if has_gaps else [])], rows)


def _share(passed: Any) -> str:
    values = list(passed)
    if not values:
        return "-"
    # Never rounded up to all of them.
    return f"{math.floor(1000 * sum(values) / len(values)) / 10:g} % of {len(values)}"


def _failures(failures: Sequence[Outcome]) -> str:
    """Each kind of failure once, with how often it came."""
    kinds: dict[tuple[str, ...], list[Outcome]] = {}
    for outcome in failures:
        what = "stability" if outcome.safe else "safety"
        case = outcome.case
        key = (case.scheme, case.scene, outcome.engine, what, outcome.factors)
        kinds.setdefault(key, []).append(outcome)
    rows = [
        [*kind, str(len(group)), *_example_cells(group[0])]
        for kind, group in sorted(kinds.items(), key=lambda item: -len(item[1]))
    ]
    head = ["scheme", "scene", "engine", "what", "fewest factors", "cases"]
    head += ["the first"]
    head += ["to repeat it"]
    return markdown_table(head, rows or [["-"] * len(head)])


def _unstable(
    groups: dict[tuple[str, str], list[Outcome]], examples: Sequence[Outcome]
) -> str:
    """How often each other scheme was not stable, with an example of each kind."""
    rows = [
        [*key, str(len(group)), example.factors, *_example_cells(example)]
        for (key, group), example in zip(groups.items(), examples, strict=True)
    ]
    head = ["scheme", "what", "cases", "fewest factors", "an example", "to repeat it"]
    return markdown_table(head, sorted(rows) or [["-"] * len(head)])


def _example_cells(outcome: Outcome) -> list[str]:
    return [outcome.wrong.replace("|", "/")[:160], f"`{outcome.command}`"]


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
                day.refused or day.not_made or day.wrong or "nothing",
                *("-" if value is None else f"{value:.3g}" for value in values),
            ]
        ],
    )


def _map_table(name: str, cells: Sequence[Cell]) -> str:
    of_map = [cell for cell in cells if cell.map == name]
    values = list(dict.fromkeys(cell.value for cell in of_map))
    by_key = {(cell.row, cell.value): cell_text(cell) for cell in of_map}
    unit, factor = MAPS[name].unit, MAPS[name].factor
    return markdown_table(
        ["", *(f"{factor * value:g} {unit}" for value in values)],
        (
            [row, *(by_key[row, value] for value in values)]
            for row in dict.fromkeys(cell.row for cell in of_map)
        ),
    )


def _save(
    path: Path,
    done: dict[str, Any],
    day: Outcome,
    outcomes: Sequence[Outcome],
    failures: Sequence[Outcome],
    examples: Sequence[Outcome],
    cells: Sequence[Cell],
) -> None:
    """Save stress.json."""
    content = {
        "done": done,
        "day": _record(day) | {"watched": day.watched},
        "cases": [_record(outcome) for outcome in outcomes],
        "failures": [_record(o) | {"command": o.command} for o in failures],
        "unstable": [_record(o) | {"command": o.command} for o in examples],
        "maps": [
            cell._asdict() | ({"low": None, "high": None} if cell.not_made else {})
            for cell in cells
        ],
    }
    text = json.dumps(content, indent=1, allow_nan=False)
    replace_file(path / _RESULTS, f"{text}\n".encode())


def _record(outcome: Outcome) -> dict[str, Any]:
    return {
        "number": outcome.case.number,
        "engine": outcome.engine,
        "scene": outcome.case.scene,
        "scheme": outcome.case.scheme,
        "factors": list(outcome.case.factors),
        "refused": outcome.refused,
        "failure": outcome.failure,
        "not_made": outcome.not_made,
        **outcome.verdict._asdict(),
    }
