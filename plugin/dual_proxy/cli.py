# SPDX-License-Identifier: BSD-3-Clause
"""The command `dual-proxy`.

Exit status: 0 done, 2 bad usage or scenario (one clear line), 3 the run failed
(what was logged until then is saved), broke a limit of the real arm, learned no
bias of its force sensor or could not be saved. Ctrl-C, SIGTERM and SIGHUP end a
run early: it has failed, and is saved. Of `stress`: 3 some case failed, 4 some could
not be run. A reader of what is printed may go away
(`| head -1`); the run goes on.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import importlib.metadata
import math
import os
import re
import signal
import sys
import textwrap
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NoReturn

from dual_proxy.bench.pages import markdown_table
from dual_proxy.claims import limit_text, statement, verdict_text
from dual_proxy.hardware.options import (
    add_haptic_side,
    add_record_poses,
    add_robot_side,
)
from dual_proxy.link import SIDES, LinkError
from dual_proxy.many_runs import count_workers
from dual_proxy.metrics import ANGULAR_METRICS, METRICS, format_metric
from dual_proxy.recording import RECORDING_EXAMPLE, RECORDING_FORMAT
from dual_proxy.run import (
    ENGINES,
    Run,
    RunError,
    change_scenario,
    find_fault,
    run,
)
from dual_proxy.run_folder import RunFolder, folder_for
from dual_proxy.scenario import (
    SCHEMES,
    Scenario,
    ScenarioError,
    list_scenarios,
    load_scenario,
)
from dual_proxy.settings import parse_yaml
from dual_proxy.text import one_line

__all__ = ["main"]

_BAD_INPUT = 2
_RUN_FAILED = 3
#: Some runs of many are not there.
_NOT_MADE = 4

_EXAMPLES = """\
examples:
  dual-proxy list
  dual-proxy run plane
  dual-proxy run plane --delay 0.15 --scheme position_force --out out/baseline
  dual-proxy run plane --set filter.period=0.02 --set law=printed --seed 3
  dual-proxy compare plane --schemes all --delays 0,0.05,0.15 --out out/schemes
  dual-proxy reproduce --quick
  dual-proxy bench filter --quick
  dual-proxy bench engine --quick
  dual-proxy keys out/keys --robot-host 192.168.1.10 --haptic-host 192.168.1.20
  dual-proxy record-poses --arm simulated --sensor own --poses 6 --out poses.csv
  dual-proxy calibrate-tool poses.csv --out tool.yaml
  dual-proxy robot-side plane --arm simulated --listen 127.0.0.1:7447 --insecure
  dual-proxy haptic-side plane --device simulated --connect 127.0.0.1:7447 --insecure
"""


# Of `bench`: what it measures. A module of the package `bench` has the name.
_SUBJECTS = {
    "filter": "the force-space particle filter, over particles, rates, likelihoods",
    "engine": "the two engines, over the plant's steps",
    "control": "control, over its rate and the force sensor's low-pass",
    "link": "the link, over rates, delays and schemes",
    "plant": "Drake's plant, over steps, contact approximations and stiffnesses",
    "cycle": "a control period's worst case",
    "savings": "what is left out where a scene does not need it, with and without",
    "peer": "this package beside MuJoCo with a controller in NumPy",
}
# Of these, what makes several runs at a time.
_MANY_RUNS = ("filter", "control", "link")


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        """One line, without the usage that argparse prints before it."""
        self.exit(_BAD_INPUT, f"{self.prog}: error: {one_line(message, 1500)}\n")


class _Version(argparse.Action):
    """Looks the version up only when asked, so a source tree needs none."""

    def __init__(self, **arguments: Any) -> None:
        super().__init__(nargs=0, default=argparse.SUPPRESS, **arguments)

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        print("dual-proxy", importlib.metadata.version("drake-dual-proxy"))
        parser.exit()


def _folder(text: str) -> Path:
    if not text:
        raise argparse.ArgumentTypeError("expected a folder, got ''")
    return Path(text)


class _Stream:
    """Standard output or error, which may be closed or end before we do."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream
        self._ended = stream is None
        self.error: OSError | None = None
        """Why it ended, unless its reader just went away."""

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def isatty(self) -> bool:
        return not self._ended and bool(self._stream.isatty())

    def write(self, text: str) -> int:
        if not self._ended:
            try:
                self._stream.write(text)
            except OSError as error:
                self._end(error)
        return len(text)

    def flush(self) -> None:
        if not self._ended:
            try:
                self._stream.flush()
            except OSError as error:
                self._end(error)

    def _end(self, error: OSError) -> None:
        self._ended = True
        if not isinstance(error, BrokenPipeError):
            self.error = error
        # What is left in its buffer is written at exit, to where it can be.
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self._stream.fileno())
        os.close(nowhere)


class _Interrupts:
    """Notes Ctrl-C, SIGTERM and SIGHUP while a run goes on or is saved.

    The run ends between two steps, where nothing is half done. The second Ctrl-C
    ends the saving, too; SIGTERM may come twice (`timeout` sends it so).
    """

    def __init__(self) -> None:
        self._reason = ""

    def note(self, number: int, _: Any) -> None:
        if number == signal.SIGINT and self._reason:
            raise KeyboardInterrupt
        self._reason = "interrupted" if number == signal.SIGINT else "terminated"

    def check(self) -> None:
        if self._reason:
            raise KeyboardInterrupt(self._reason)


def _terminate(*_: Any) -> NoReturn:
    raise KeyboardInterrupt("terminated")


@contextlib.contextmanager
def _handling(handlers: dict[signal.Signals, Any]) -> Iterator[None]:
    """Handle signals, unless the caller wants them to be ignored (`nohup`)."""
    before = {}
    if threading.current_thread() is threading.main_thread():
        for number, handler in handlers.items():
            if signal.getsignal(number) != signal.SIG_IGN:
                before[number] = signal.signal(number, handler)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; return its exit status."""
    out, err = _Stream(sys.stdout), _Stream(sys.stderr)
    with (
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        _handling({signal.SIGTERM: _terminate, signal.SIGHUP: _terminate}),
    ):
        try:
            status = _main(arguments)
        finally:
            out.flush()
            err.flush()
        if out.error is not None and status == 0:
            status = _fail(f"standard output: {out.error.strerror}", _RUN_FAILED)
        return status


def _main(arguments: Sequence[str] | None) -> int:
    try:
        options = _parser().parse_args(arguments)
        if options.command == "list":
            return _list()
        if options.command == "bench":
            return _bench(options)
        if options.command == "calibrate-tool":
            return _calibrate_tool(options)
        if options.command == "compare":
            return _compare(options)
        if options.command == "keys":
            return _keys(options)
        if options.command == "record-poses":
            return _record_poses(options)
        if options.command == "reproduce":
            return _reproduce(options)
        if options.command == "stress":
            return _stress(options)
        if options.command in ("robot-side", "haptic-side"):
            return _run_side(options)
        return _run(options)
    except SystemExit as end:  # Of the parser, whose output may not be out yet.
        return end.code if isinstance(end.code, int) else 0
    except (ScenarioError, LinkError, ImportError) as error:
        return _fail(_describe(error), _BAD_INPUT)
    except (OSError, MemoryError, KeyboardInterrupt) as error:
        return _fail(_describe(error), _RUN_FAILED)


def _fail(message: str, status: int) -> int:
    sys.stdout.flush()  # What was said before comes before.
    print(f"dual-proxy: error: {message}", file=sys.stderr)
    return status


def _describe(error: BaseException) -> str:
    """What an error says, in one line."""
    text = one_line(error)
    if isinstance(error, OSError) and error.strerror:
        where = f"{error.filename}: " if error.filename else ""
        return f"{where}{error.strerror}"
    if isinstance(error, ImportError) and (error.name or "") not in text:
        return f"cannot import {error.name}: {text}"
    if isinstance(error, KeyboardInterrupt):
        return text or "interrupted"
    if isinstance(error, MemoryError):
        return "out of memory"
    return text or type(error).__name__


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="dual-proxy",
        description="Haptic teleoperation experiments with the dual-proxy model.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action=_Version, help="print the version")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    commands.add_parser("list", help="list the scenarios that come with the package")
    command = commands.add_parser(
        "run",
        help="run a scenario; save metrics, log, report and replay",
        epilog=_recording_help(),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = command.add_argument
    _add_scenario(command, needed=False)
    add("--scheme", choices=SCHEMES, help="teleoperation scheme")
    add("--delay", type=float, metavar="SEC", help="one-way delay of the link")
    add(
        "--duration",
        type=float,
        metavar="SEC",
        help="simulated time (default: the scenario's, lengthened for the delay)",
    )
    add("--seed", type=int, metavar="N", help="of everything random")
    add("--recording", metavar="CSV", help="human motion that the operator follows")
    add(
        "--recording-units",
        choices=("m", "cm", "mm"),
        help="of the positions in it (default: m)",
    )
    add(
        "--recording-scale",
        type=float,
        metavar="S",
        help="by which its lengths are multiplied (default: 1)",
    )
    add("--meshcat", action="store_true", help="show the run in the browser")
    add("--realtime", action="store_true", help="not faster than real time")
    add("--mcap", action="store_true", help="save log.mcap for Foxglove, too")
    add(
        "--replay",
        type=Path,
        metavar="MCAP",
        help="in place of a scenario: play the log of a robot-side or haptic-side back "
        "through the same cycle",
    )
    add(
        "--out",
        type=_folder,
        metavar="DIR",
        help="where to save, in place of an earlier run's files (default: a new"
        " folder out/SCENARIO-SCHEME-DELAYms, with -2, -3... if there is one)",
    )
    _add_compare(commands)
    _add_reproduce(commands)
    _add_bench(commands)
    _add_stress(commands)
    _add_keys(commands)
    _add_calibrate_tool(commands)
    _add_record_poses(commands)
    _add_sides(commands)
    return parser


def _add_scenario(command: argparse.ArgumentParser, needed: bool = True) -> None:
    """Add what every command that runs a scenario has."""
    add = command.add_argument
    add(
        "scenario",
        nargs=None if needed else "?",
        metavar="SCENARIO",
        help="its name, or the path of a YAML file",
    )
    _add_settings(command)
    add(
        "--engine",
        choices=ENGINES,
        default="auto",
        help="what simulates the robot: drake, or bare, the project's own arm, which "
        "is faster; auto takes drake for a Panda",
    )


def _add_settings(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--set",
        dest="settings",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="any value of the scenario by dotted key, e.g. controller.force_gain=1;"
        " may be given many times",
    )


def _recording_help() -> str:
    text = textwrap.fill(
        RECORDING_FORMAT, 79, initial_indent="  ", subsequent_indent="  "
    )
    example = textwrap.indent(RECORDING_EXAMPLE, "    ")
    return f"a recording has\n{text}\n{example}"


def _add_compare(commands: Any) -> None:
    command = commands.add_parser(
        "compare",
        help="run schemes over delays; print a table, draw forces and errors",
        epilog="The same command goes on with a comparison that was interrupted.",
    )
    _add_scenario(command)
    add = command.add_argument
    add(
        "--schemes",
        type=_names,
        required=True,
        metavar="A,B,...",
        help=f"of {', '.join(SCHEMES)}; or all; with a parameter of its own as "
        "four_channel:variant=three_channel",
    )
    add(
        "--delays",
        type=_numbers,
        required=True,
        metavar="SEC,...",
        help="one-way delays of the link",
    )
    add(
        "--hands",
        type=_names,
        default=["firm"],
        metavar="A,...",
        help="firm (600 N/m, 30 N s/m; the default), soft (300 N/m, 10 N s/m)",
    )
    add("--seeds", type=int, default=1, metavar="N", help="how many of each run")
    _add_many(command, "out/compare-SCENARIO")


def _add_jobs(add: Callable[..., Any]) -> None:
    add("--jobs", type=int, metavar="N", help="runs at a time (default: all cores)")


def _add_many(command: argparse.ArgumentParser, where: str) -> None:
    """Add what every command that makes many runs has."""
    add = command.add_argument
    _add_jobs(add)
    add(
        "--cluster",
        metavar="ADDRESS",
        help="of a dask.distributed scheduler that makes the runs, tcp://HOST:PORT",
    )
    add(
        "--out",
        type=_folder,
        metavar="DIR",
        help=f"where to save, and to go on (default: {where})",
    )


def _add_reproduce(commands: Any) -> None:
    command = commands.add_parser(
        "reproduce",
        help="run every scene of the paper; print its claims beside what is measured",
        epilog="The same command goes on where it was interrupted.",
    )
    add = command.add_argument
    add("--quick", action="store_true", help="one seed, engine bare: half a minute")
    add("--page", type=Path, metavar="MD", help="page to be filled")
    add(
        "--engine",
        choices=ENGINES,
        default="auto",
        help="as of run; the page's is bare, which takes minutes in place of an hour",
    )
    _add_many(command, "out/reproduce")


def _names(text: str) -> list[str]:
    return [name.strip() for name in text.split(",")]


def _numbers(text: str) -> list[float]:
    try:
        return [float(number) for number in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"expected numbers with commas between, got {text!r}"
        ) from None


def _compare(options: argparse.Namespace) -> int:
    # Here, as it draws: other commands need not wait for that.
    from dual_proxy.compare import LEGEND, compare, summary_cells

    scenario = load_scenario(options.scenario)
    out = options.out or Path("out") / f"compare-{_file_name(scenario.name)}"
    table = compare(
        scenario,
        "all" if options.schemes == ["all"] else options.schemes,
        options.delays,
        hands=options.hands,
        seeds=options.seeds,
        engine=options.engine,
        overrides=dict(map(_setting, options.settings)),
        jobs=options.jobs,
        out=out,
        cluster=options.cluster,
    )
    print(markdown_table(*summary_cells(table)), end="\n\n")
    seeds = [f"mean (worst) of {options.seeds} seeds"] if options.seeds > 1 else []
    for text in (*seeds, *LEGEND):
        print(textwrap.fill(text, 88))
    print(f"\nsaved: {out / 'comparison.json'}, .csv, figures")
    failed = table[table["exit"] != 0]
    if len(failed):
        first = failed.iloc[0]
        return _fail(
            f"{len(failed)} of {len(table)} runs failed, the first {first['scheme']}, "
            f"{1e3 * first['delay']:g} ms, {first['hand']}, seed {first['seed']}: "
            f"{first['failure']}",
            _RUN_FAILED,
        )
    return 0


def _reproduce(options: argparse.Namespace) -> int:
    # Here, as it draws: other commands need not wait for that.
    from dual_proxy.reproduce import reproduce

    out = options.out or Path("out/reproduce")
    tables, failures = reproduce(
        options.quick,
        out,
        options.jobs,
        options.page,
        options.engine,
        cluster=options.cluster,
    )
    for name, table in tables.items():
        print(f"{name}\n\n{table}\n")
    print(f"saved: {out / 'reproduction.json'}, figures")
    if failures:
        return _fail(
            f"{len(failures)} runs failed, the first {failures[0]}", _RUN_FAILED
        )
    return 0


def _add_bench(commands: Any) -> None:
    bench = commands.add_parser("bench", help="measure run time against error")
    subjects = bench.add_subparsers(dest="subject", required=True, metavar="SUBJECT")
    for subject, text in _SUBJECTS.items():
        add = subjects.add_parser(subject, help=text).add_argument
        add("--quick", action="store_true", help="a part of it, in seconds")
        add(
            "--out",
            type=_folder,
            metavar="DIR",
            default=Path("out/bench"),
            help=f"where to save {subject}.json and {subject}.png"
            " (default: %(default)s)",
        )
        add("--page", type=Path, metavar="MD", help="page to be filled")
        if subject in _MANY_RUNS:
            _add_jobs(add)
        if subject == "filter":
            add(
                "--recordings",
                type=Path,
                metavar="DIR",
                help="CSV files of a guided arm that presses a horizontal board",
            )


def _bench(options: argparse.Namespace) -> int:
    # Here, as they draw: other commands need not wait for that.
    from dual_proxy.bench.filter_command import bench_filter
    from dual_proxy.bench.subject import bench_subject

    subject, out = options.subject, options.out
    jobs = options.jobs if subject in _MANY_RUNS else None
    count_workers(jobs)
    with _bench_folder(out, [f"{subject}.{kind}" for kind in ("json", "png")]):
        if subject == "filter":
            bench_filter(options.quick, out, options.page, options.recordings, jobs)
        else:
            module = importlib.import_module(f"dual_proxy.bench.{subject}")
            bench_subject(module.SUBJECT, options.quick, out, options.page, jobs)
    return 0


@contextlib.contextmanager
def _bench_folder(out: Path, names: Sequence[str]) -> Iterator[None]:
    """The folder to save in, before the benchmark, not after it."""
    with contextlib.ExitStack() as stack:
        try:
            stack.enter_context(folder_for(out, names))
        except OSError as error:
            raise ScenarioError(f"--out {_describe(error)}") from None
        yield


def _add_stress(commands: Any) -> None:
    command = commands.add_parser(
        "stress",
        help="look for what breaks a scheme: many hard runs, maps of stability",
        epilog="The same command goes on where it was interrupted.",
    )
    add = command.add_argument
    add("--quick", action="store_true", help="a slice, in a minute or two, no maps")
    add("--cases", type=int, metavar="N", help="how many")
    add("--first", type=int, metavar="N", help="number of the first one (default: 0)")
    add(
        "--case",
        type=int,
        metavar="N",
        help="that one alone, and what it needs to fail; with --out DIR its scenario "
        "is saved there",
    )
    add(
        "--only",
        type=_names,
        metavar="A,...",
        help="of the case's factors; or nothing: none of them",
    )
    add(
        "--engine",
        choices=("bare", "drake"),
        help="in which the case is run (default: bare)",
    )
    add("--page", type=Path, metavar="MD", help="page to be filled")
    add(
        "--map",
        metavar="NAME",
        help="one map of stability alone, with the values of --set (docs/stability.md)",
    )
    _add_settings(command)
    _add_many(command, "out/stress")


def _stress(options: argparse.Namespace) -> int:
    # Here, as it draws: other commands need not wait for that.
    from dual_proxy.stress.command import FULL, QUICK, explain, stress

    if options.map is not None:
        return _map(options)
    if options.settings:
        raise ScenarioError("--set: expected with --map")
    of_many = ("quick", "cases", "first", "page", "cluster")
    of_one = ("only", "engine")
    for name in of_one if options.case is None else of_many:
        if getattr(options, name) not in (None, False):
            with_or_without = "with" if options.case is None else "without"
            raise ScenarioError(f"--{name}: expected {with_or_without} --case")
    if options.case is not None:
        text, wrong = explain(
            options.case,
            options.jobs,
            options.only,
            options.engine or "bare",
            options.out,
        )
        print(text)
        return _fail(f"case {options.case}: {wrong}", _RUN_FAILED) if wrong else 0
    plan = QUICK if options.quick else FULL
    if options.cases is not None:
        plan = plan._replace(cases=options.cases)
    out = options.out or Path("out/stress")
    report = stress(
        plan,
        options.first or 0,
        out,
        options.jobs,
        options.page,
        cluster=options.cluster,
    )
    for name, table in report.tables.items():
        print(f"{name}\n\n{table}\n")
    print(f"saved: {out / 'stress.json'}")
    problems = []
    if failures := report.failures:
        problems.append(
            f"{len(failures)} cases failed, the first number "
            f"{failures[0].case.number}: {failures[0].wrong}"
        )
    if report.not_made:
        page = f", and {options.page} is as it was" if options.page else ""
        problems.append(
            f"{len(report.not_made)} runs could not be made, the first "
            f"{report.not_made[0]} (the same command makes them{page})"
        )
    status = _NOT_MADE if report.not_made else _RUN_FAILED
    return _fail("; ".join(problems), status) if problems else 0


def _map(options: argparse.Namespace) -> int:
    # Here, as it draws: other commands need not wait for that.
    from dual_proxy.stress.command import map_own
    from dual_proxy.stress.maps import MAPS

    if options.map not in MAPS:
        raise ScenarioError(
            f"--map: expected one of {'; '.join(MAPS)}, got {options.map!r}"
        )
    for name in ("quick", "cases", "first", "page", "case", "only", "engine"):
        if getattr(options, name) not in (None, False):
            raise ScenarioError(f"--{name}: expected without --map")
    out = options.out or Path("out/stress")
    overrides = dict(map(_setting, options.settings))
    table, not_made = map_own(
        options.map, overrides, out, options.jobs, options.cluster
    )
    print(f"{MAPS[options.map].title}\n\n{table}\n\nsaved: {out / 'map.png'}")
    if not_made:
        return _fail(f"runs could not be made, the first {not_made[0]}", _NOT_MADE)
    return 0


def _add_keys(commands: Any) -> None:
    command = commands.add_parser(
        "keys",
        help="make the keys with which both sides of a link know each other",
        epilog="New keys are for both sides: what signed them is not kept.",
    )
    add = command.add_argument
    add(
        "directory", type=_folder, metavar="DIR", help="new folder for both sides' keys"
    )
    for side in SIDES:
        add(
            f"--{side}-host",
            type=_names,
            metavar="HOST,...",
            help=f"names or IPv4 addresses of the {side} side's machine (default: this "
            "machine only, localhost and 127.0.0.1)",
        )
    add("--days", type=int, metavar="N", help="how long they are valid (default: 365)")


def _keys(options: argparse.Namespace) -> int:
    # Here, as it needs the extra `hardware`.
    from dual_proxy.link.keys import DAYS, LOCAL_HOSTS, make_keys

    hosts = {side: getattr(options, f"{side}_host") or LOCAL_HOSTS for side in SIDES}
    last = make_keys(
        options.directory,
        robot_hosts=hosts["robot"],
        haptic_hosts=hosts["haptic"],
        days=DAYS if options.days is None else options.days,
    )
    print(f"valid until {last:%Y-%m-%d %H:%M} UTC")
    for side in SIDES:
        print(
            f"{options.directory / side}: copy it to the {side} side's machine "
            f"({', '.join(hosts[side])}), and to no other"
        )
    print("Whoever has a key.pem can pass for that side. Keep none here.")
    return 0


def _add_calibrate_tool(commands: Any) -> None:
    command = commands.add_parser(
        "calibrate-tool",
        help="mass, centre of mass and bias of a tool, from poses at rest",
        epilog="dual-proxy record-poses records them; docs/force_sensor.md says how.",
    )
    add = command.add_argument
    add(
        "samples",
        type=Path,
        metavar="CSV",
        help="t; qw, qx, qy, qz of R_BS, or q1 to q7 of a Panda; fx, fy, fz, mx, my,"
        " mz in S, of the arm on the tool",
    )
    add(
        "--out",
        type=Path,
        metavar="YAML",
        default=Path("out/tool.yaml"),
        help="where to save the fields of ForceTorqueAdapterParams"
        " (default: %(default)s)",
    )
    for name, unit, most in (("force", "N", 0.5), ("moment", "N m", 0.05)):
        add(
            f"--max-{name}-residual",
            type=float,
            metavar=unit.replace(" ", ""),
            default=most,
            help=f"{unit}, of all poses, rms; more is refused (default: %(default)s)",
        )


def _calibrate_tool(options: argparse.Namespace) -> int:
    # Here, as no other command needs it.
    from dual_proxy.tool_calibration import (
        CalibrationError,
        calibrate_tool,
        find_resting_poses,
        read_samples,
    )

    try:
        calibration = calibrate_tool(
            find_resting_poses(read_samples(options.samples)),
            max_force_residual=options.max_force_residual,
            max_moment_residual=options.max_moment_residual,
        )
    except CalibrationError as error:
        return _fail(str(error), _BAD_INPUT)
    print(calibration.table())
    _make_directory(options.out.parent)
    options.out.write_text(calibration.yaml(options.samples.name), encoding="utf-8")
    print(f"\nsaved: {options.out}")
    return 0


def _add_record_poses(commands: Any) -> None:
    add_record_poses(
        commands.add_parser(
            "record-poses",
            help="record poses of a tool for calibrate-tool, of an arm guided by hand",
            epilog="docs/force_sensor.md says which.",
        )
    )


def _record_poses(options: argparse.Namespace) -> int:
    # Here, as no other command needs it.
    from dual_proxy._core import DriverError
    from dual_proxy.hardware.arms import ArmFault
    from dual_proxy.hardware.pose_recorder import make_pose_recorder
    from dual_proxy.tool_calibration import FEWEST_POSES

    try:
        recorder = make_pose_recorder(options)
        with _handling(_ends(recorder)):
            count = recorder.run()
    except (DriverError, ArmFault) as error:
        return _fail(one_line(error, 500), _RUN_FAILED)
    print(f"saved: {options.out}, {count} poses")
    if count < FEWEST_POSES:
        return _fail(f"expected at least {FEWEST_POSES} poses", _RUN_FAILED)
    return 0


def _ends(runs: Any) -> dict[signal.Signals, Any]:
    """Return handlers with which Ctrl-C, SIGTERM and SIGHUP stop something."""
    return dict.fromkeys(
        (signal.SIGINT, signal.SIGTERM, signal.SIGHUP), lambda *_: runs.stop()
    )


def _add_sides(commands: Any) -> None:
    for side, text, add_options in (
        (
            "robot",
            "run the robot side alone: an arm, its sensor, the link",
            add_robot_side,
        ),
        ("haptic", "run the haptic side alone: a device, the link", add_haptic_side),
    ):
        command = commands.add_parser(
            f"{side}-side",
            help=text,
            epilog="docs/hardware.md says what to look at before, and in what order.",
        )
        command.add_argument(
            "scenario",
            metavar="SCENARIO",
            help="of map, gains and limits: its name, or the path of a YAML file",
        )
        _add_settings(command)
        add_options(command)


def _run_side(options: argparse.Namespace) -> int:
    # Here, as it needs the extra `hardware`.
    from dual_proxy._core import DriverError
    from dual_proxy.hardware.arms import ArmFault
    from dual_proxy.hardware.commands import make_haptic_side, make_robot_side

    scenario = change_scenario(
        options.scenario, overrides=dict(map(_setting, options.settings))
    )
    make = make_robot_side if options.command == "robot-side" else make_haptic_side
    try:
        side = make(options, scenario)
        with contextlib.closing(side), _handling(_ends(side)):
            done = side.run(math.inf if options.duration is None else options.duration)
    except (DriverError, ArmFault) as error:
        return _fail(one_line(error, 500), _RUN_FAILED)
    return 0 if done else _RUN_FAILED


def _list() -> int:
    names = list_scenarios()
    width = max(map(len, names), default=0)
    for name in names:
        print(f"{name:{width}}  {load_scenario(name).description}")
    return 0


def _replay(path: Path) -> int:
    # Here, as no other run needs it.
    from dual_proxy._core import DriverError
    from dual_proxy.hardware.replay import replay_side

    try:
        replayed = replay_side(path)
    except DriverError as error:
        return _fail(str(error), _BAD_INPUT)
    side, command, unit = replayed.side, "torque", "N m"
    if side == "haptic":
        command, unit = "wrench", "N or N m"
    print(f"{side} side: {replayed.cycles} cycles, {replayed.seconds:.3f} s")
    if replayed.different:
        return _fail(
            f"{replayed.different} cycles have another {command} or message than was "
            f"logged, {command} by up to {replayed.largest:.3g} {unit}",
            _RUN_FAILED,
        )
    print(f"every {command} and message is what was logged, bit for bit")
    return 0


def _run(options: argparse.Namespace) -> int:
    if options.replay is not None:
        if options.scenario is not None:
            raise ScenarioError("--replay: expected in place of a scenario, got both")
        return _replay(options.replay)
    if options.scenario is None:
        raise ScenarioError("expected a scenario, or --replay MCAP")
    overrides = dict(map(_setting, options.settings))
    for key in ("recording_units", "recording_scale"):
        if (value := getattr(options, key)) is not None:
            overrides[f"operator.{key}"] = value
    scenario = change_scenario(
        options.scenario,
        scheme=options.scheme,
        delay=options.delay,
        duration=options.duration,
        seed=options.seed,
        recording=options.recording,
        overrides=overrides,
    )
    for key in ("units", "scale"):
        given = getattr(options, f"recording_{key}")
        if given is not None and not scenario.operator.recording:
            raise ScenarioError(
                f"--recording-{key}: expected with a recording (--recording CSV), "
                f"got {given} without one"
            )
    interrupts = _Interrupts()
    noted = dict.fromkeys(
        (signal.SIGINT, signal.SIGTERM, signal.SIGHUP), interrupts.note
    )
    with _handling(noted), _open_folder(options.out, scenario) as folder:
        result, failure = _simulate(scenario, options, interrupts)
        failure = failure or find_fault(result)
        if result.recording:
            print(f"recording: {result.recording}")
        _print_metrics(result)
        report, not_saved = _save(result, folder, options.mcap)
        # Now that it is saved.
        _print_claims(result)
        if report:
            print(f"\nreport: {report}")
    if failure or not_saved:
        return _fail("; ".join(filter(None, (failure, not_saved))), _RUN_FAILED)
    return 0


def _open_folder(chosen: Path | None, scenario: Scenario) -> RunFolder:
    """Open the folder to save in, before the run, not after it."""
    try:
        if chosen is not None:
            return RunFolder(chosen)
        name = f"{scenario.name}-{scenario.scheme}-{scenario.link.delay * 1e3:g}ms"
        return RunFolder.numbered(Path("out") / _file_name(name))
    except OSError as error:
        raise ScenarioError(f"--out {_describe(error)}") from None


def _file_name(text: str) -> str:
    return re.sub(r"[^\w.+-]", "_", text)


def _simulate(
    scenario: Scenario, options: argparse.Namespace, interrupts: _Interrupts
) -> tuple[Run, str]:
    """Return the run, and why it ended early."""
    show = sys.stderr.isatty()
    report = _print_progress if show else _TenthsPrinter()

    def progress(now: float, end: float) -> None:
        report(now, end)
        if now < end:
            interrupts.check()

    failure = ""
    try:
        result = run(
            scenario,
            meshcat=options.meshcat,
            realtime=options.realtime,
            engine=options.engine,
            progress=progress,
        )
    except RunError as error:
        result, failure = error.run, str(error)
    finally:
        if show:
            print(file=sys.stderr)
    return result, failure


def _save(result: Run, folder: RunFolder, mcap: bool) -> tuple[Path | None, str]:
    """Save what can be saved; return the report, or what could not be and why."""
    try:
        return result.save(folder, mcap), ""
    except KeyboardInterrupt:
        return None, f"interrupted while saving; nothing was saved in {folder.path}"
    except OSError as error:
        # The file's name in the draft, which is gone, is of no use.
        reason = error.strerror or _describe(error)
    except Exception as error:
        reason = _describe(error)
    try:
        saved = folder.keep_data()
    except (OSError, KeyboardInterrupt):
        saved = False
    if not saved:
        return None, f"nothing was saved in {folder.path}: {reason}"
    return None, (
        f"report.html and replay.html were not saved, only metrics.json, "
        f"scenario.yaml and log.npz in {folder.path}: {reason}"
    )


def _setting(text: str) -> tuple[str, Any]:
    key, equals, value = text.partition("=")
    if not (equals and key.strip()):
        raise ScenarioError(f"--set {text}: expected KEY=VALUE")
    return key.strip(), parse_yaml(value, f"--set {text}")


def _make_directory(directory: Path) -> None:
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ScenarioError(f"--out {_describe(error)}") from None


def _print_progress(now: float, end: float) -> None:
    width = 30
    done = round(width * now / end)
    bar = "#" * done + "." * (width - done)
    print(f"\r{bar} {now:6.1f} / {end:.1f} s", end="", file=sys.stderr, flush=True)


class _TenthsPrinter:
    """Progress for a file or a pipe: a line for each tenth of the run."""

    def __init__(self) -> None:
        self._tenths = 0

    def __call__(self, now: float, end: float) -> None:
        tenths = int(10.0 * now / end + 1e-9)
        if tenths > self._tenths:
            self._tenths = tenths
            print(f"simulated {now:.1f} of {end:.1f} s", flush=True)


def _print_metrics(result: Run) -> None:
    width = max(map(len, result.metrics))
    metrics = METRICS | ANGULAR_METRICS
    for key, value in result.metrics.items():
        print(f"{key:{width}}  {format_metric(value):>9} {metrics[key].unit}")


def _print_claims(result: Run) -> None:
    """What is claimed of the scene beside what was measured."""
    verdicts = result.judge_claims()
    if not verdicts:
        return
    limits = [limit_text(claim) for claim, _, _ in verdicts]
    width = max(map(len, limits))
    print("\nclaims")
    for limit, (claim, value, met) in zip(limits, verdicts, strict=True):
        print(
            f"{limit:{width}}  {format_metric(value):>9} {verdict_text(met):8}"
            f" {statement(claim)}"
        )


if __name__ == "__main__":
    sys.exit(main())
