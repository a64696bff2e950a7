# SPDX-License-Identifier: BSD-3-Clause
"""The command `dual-proxy`.

Exit status: 0 done, 2 bad usage or scenario (one clear line), 3 the run failed
(what was logged until then is saved).
"""

from __future__ import annotations

import argparse
import importlib.metadata
import sys
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from dual_proxy.metrics import ANGULAR_METRICS, METRICS, format_metric
from dual_proxy.recording import RECORDING_EXAMPLE, RECORDING_FORMAT
from dual_proxy.run import Run, RunError, run
from dual_proxy.scenario import SCHEMES, ScenarioError, list_scenarios, load_scenario
from dual_proxy.settings import parse_yaml

__all__ = ["main"]

_BAD_INPUT = 2
_RUN_FAILED = 3

_EXAMPLES = """\
examples:
  dual-proxy list
  dual-proxy run plane
  dual-proxy run plane --delay 0.15 --scheme position_force --out out/baseline
  dual-proxy run plane --set filter.period=0.02 --set law=printed --seed 3
  dual-proxy bench filter --quick
"""


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        """One line, without the usage that argparse prints before it."""
        self.exit(_BAD_INPUT, f"{self.prog}: error: {message}\n")


class _Version(argparse.Action):
    """Looks the version up only when asked, so a source tree needs none."""

    def __init__(self, **arguments: Any) -> None:
        super().__init__(nargs=0, default=argparse.SUPPRESS, **arguments)

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        print("dual-proxy", importlib.metadata.version("drake-dual-proxy"))
        parser.exit()


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; return its exit status."""
    options = _parser().parse_args(arguments)
    try:
        if options.command == "list":
            return _list()
        if options.command == "bench":
            return _bench_filter(options)
        return _run(options)
    except ScenarioError as error:
        print(f"dual-proxy: error: {error}", file=sys.stderr)
        return _BAD_INPUT


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
    add("scenario", metavar="SCENARIO", help="its name, or the path of a YAML file")
    add("--scheme", choices=SCHEMES, help="teleoperation scheme")
    add("--delay", type=float, metavar="SEC", help="one-way delay of the link")
    add(
        "--duration",
        type=float,
        metavar="SEC",
        help="simulated time (default: the scenario's, lengthened for the delay)",
    )
    add("--seed", type=int, metavar="N", help="of everything random")
    add(
        "--set",
        dest="settings",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="any value of the scenario by dotted key, e.g. controller.force_gain=1;"
        " may be given many times",
    )
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
        "--out",
        type=Path,
        metavar="DIR",
        help="where to save (default: out/SCENARIO-SCHEME-DELAYms)",
    )
    _add_bench(commands)
    return parser


def _recording_help() -> str:
    text = textwrap.fill(RECORDING_FORMAT, 79, initial_indent="  ", subsequent_indent="  ")
    example = textwrap.indent(RECORDING_EXAMPLE, "    ")
    return f"a recording has\n{text}\n{example}"


def _add_bench(commands: Any) -> None:
    bench = commands.add_parser("bench", help="measure run time against error")
    subjects = bench.add_subparsers(dest="subject", required=True, metavar="SUBJECT")
    command = subjects.add_parser(
        "filter",
        help="the force-space particle filter, over particles, rates, likelihoods",
    )
    add = command.add_argument
    add("--quick", action="store_true", help="a part of it, in seconds")
    add(
        "--out",
        type=Path,
        metavar="DIR",
        default=Path("out/bench"),
        help="where to save filter.json and filter.png (default: %(default)s)",
    )
    add("--page", type=Path, metavar="MD", help="page whose tables are to be filled")
    add(
        "--recordings",
        type=Path,
        metavar="DIR",
        help="CSV files of a guided arm that presses a horizontal board",
    )


def _bench_filter(options: argparse.Namespace) -> int:
    # Here, as it draws: other commands need not wait for that.
    from dual_proxy.bench.filter_command import bench_filter

    _make_directory(options.out)
    bench_filter(options.quick, options.out, options.page, options.recordings)
    return 0


def _list() -> int:
    names = list_scenarios()
    width = max(map(len, names), default=0)
    for name in names:
        print(f"{name:{width}}  {load_scenario(name).description}")
    return 0


def _run(options: argparse.Namespace) -> int:
    scenario = load_scenario(options.scenario)
    overrides = dict(map(_setting, options.settings))
    for key in ("recording_units", "recording_scale"):
        if (value := getattr(options, key)) is not None:
            overrides[f"operator.{key}"] = value
    if options.out is not None:
        _make_directory(options.out)  # Before the run, not after it.
    show = sys.stderr.isatty()
    failure = ""
    try:
        result = run(
            scenario,
            scheme=options.scheme,
            delay=options.delay,
            duration=options.duration,
            seed=options.seed,
            recording=options.recording,
            overrides=overrides,
            meshcat=options.meshcat,
            realtime=options.realtime,
            progress=_print_progress if show else _TenthsPrinter(),
        )
    except RunError as error:
        result, failure = error.run, str(error)
    if show:
        print(file=sys.stderr)
    if not failure and not result.metrics["finite"]:
        failure = "the log holds values that are not finite"
    directory = options.out or Path("out") / _directory_name(result)
    report = result.save(directory, mcap=options.mcap)
    if result.recording:
        print(f"recording: {result.recording}")
    _print_metrics(result)
    print(f"\nreport: {report}")
    if failure:
        print(f"dual-proxy: error: {failure}", file=sys.stderr)
        return _RUN_FAILED
    return 0


def _setting(text: str) -> tuple[str, Any]:
    key, equals, value = text.partition("=")
    if not (equals and key.strip()):
        raise ScenarioError(f"--set {text}: expected KEY=VALUE")
    return key.strip(), parse_yaml(value, f"--set {text}")


def _make_directory(directory: Path) -> None:
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ScenarioError(f"--out {directory}: {error.strerror}") from None


def _directory_name(result: Run) -> str:
    scenario = result.scenario
    return f"{scenario.name}-{scenario.scheme}-{scenario.link.delay * 1e3:g}ms"


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


if __name__ == "__main__":
    sys.exit(main())
