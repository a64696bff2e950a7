# SPDX-License-Identifier: BSD-3-Clause
"""Whatever stands on the command line: an exit status, and one line if it is
wrong."""

import contextlib
import io
import os
import tempfile
from pathlib import Path
from unittest import mock

from hypothesis import given
from hypothesis import strategies as st
from strategies import FLOATS, INTEGERS, TEXTS

from dual_proxy import cli
from dual_proxy.scenario import SCHEMES, ScenarioError

FOLDER = Path(tempfile.mkdtemp(prefix="dual-proxy-fuzz-"))
ACCEPTED = "accepted"
ARGUMENTS = st.one_of(
    TEXTS.filter(lambda text: "\0" not in text),
    FLOATS.map(str),
    INTEGERS.map(lambda number: str(number)[:300]),
    st.lists(FLOATS.map(str), max_size=3).map(",".join),
    st.lists(st.sampled_from([*SCHEMES, "firm", "soft", "all"]), max_size=3).map(
        ",".join
    ),
    st.sampled_from(
        ["plane", "soft", "-", "--", "-1", "1e-3", "nan", "0,,0.1", "tdpa:x=1"]
    ),
)
OPTIONS = {
    "run": "scheme delay duration seed recording recording-units recording-scale set "
    "engine",
    "compare": "schemes delays hands seeds set engine jobs cluster",
    "stress": "cases first case jobs only engine",
    "reproduce": "engine jobs",
}


@st.composite
def command_lines(draw: st.DrawFn) -> list[str]:
    command = draw(st.sampled_from([*OPTIONS, "list", "fly"]))
    line = [command]
    if command in ("run", "compare"):
        line.append(draw(st.sampled_from(["plane", "plane", "point_mass"]) | ARGUMENTS))
    if command == "compare":
        line += ["--schemes", draw(st.just("tdpa") | ARGUMENTS)]
        line += ["--delays", draw(st.just("0,0.1") | ARGUMENTS)]
    for option in draw(
        st.lists(st.sampled_from(OPTIONS.get(command, "x").split()), max_size=3)
    ):
        value = draw(ARGUMENTS)
        if option == "set":
            key = draw(
                st.sampled_from(["seed", "link.delay", "law", "operator.waypoints"])
            )
            value = f"{key}={value}"
        line += [f"--{option}={value}"]
    return line + draw(st.lists(ARGUMENTS, max_size=1))


def run_command(arguments: list[str]) -> tuple[int, str]:
    """Run all but what takes long, in an empty folder; return status and errors."""

    def accept(*_: object, **__: object) -> None:
        raise ScenarioError(ACCEPTED)

    names = (
        "dual_proxy.cli._simulate",
        "dual_proxy.compare.run_many",
        "dual_proxy.stress.command.stress",
        "dual_proxy.stress.command.explain",
        "dual_proxy.reproduce.reproduce",
    )
    here = Path.cwd()
    out, err = io.StringIO(), io.StringIO()
    with contextlib.ExitStack() as stack:
        for name in names:
            stack.enter_context(mock.patch(name, accept))
        stack.enter_context(contextlib.redirect_stdout(out))
        stack.enter_context(contextlib.redirect_stderr(err))
        os.chdir(FOLDER)
        try:
            return cli.main(arguments), err.getvalue()
        finally:
            os.chdir(here)


@given(command_lines())
def test_any_command_line(arguments):
    status, errors = run_command(arguments)
    assert status in (0, 2, 3)
    if status != 0:
        assert errors.count("\n") == 1, errors
        assert "error: " in errors
        assert len(errors) < 3000


@given(st.lists(ARGUMENTS, max_size=4))
def test_any_arguments(arguments):
    status, errors = run_command(arguments)
    assert (status == 0) == (errors == "")


def test_a_right_command_line_is_accepted():
    for line in (
        ["run", "plane", "--delay", "0.1"],
        ["compare", "plane", "--schemes", "tdpa", "--delays", "0,0.1"],
        ["stress", "--quick"],
        ["reproduce", "--quick"],
    ):
        assert run_command(line) == (2, f"dual-proxy: error: {ACCEPTED}\n")
