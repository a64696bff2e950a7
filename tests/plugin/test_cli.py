# SPDX-License-Identifier: BSD-3-Clause
import contextlib
import json
import os
import pickle
import re
import resource
import signal
import sys
import time
import types
from pathlib import Path

import pandas as pd
import pytest

from dual_proxy import cli
from dual_proxy.log import load_log
from dual_proxy.metrics import METRICS
from dual_proxy.recording import RECORDING_EXAMPLE, RECORDING_FORMAT
from dual_proxy.run import Run, RunError, run
from dual_proxy.run_folder import RunFolder
from dual_proxy.scenario import ScenarioError, load_scenario


class FakeStation:
    """Plays a ready-made log; fails at a given time."""

    log: pd.DataFrame
    fail_at = float("inf")
    error: BaseException = RuntimeError("the arm\nhas left the room")
    built = None

    def __init__(self, scenario, meshcat=False):
        type(self).built = (scenario, meshcat)
        self._time = 0.0

    def store_log(self, duration):
        assert duration > 0.0

    def advance_to(self, now):
        if now > self.fail_at:
            raise self.error
        assert now > self._time
        self._time = now

    def log_frame(self):
        return self.log[self.log.index <= self._time + 1e-9]


@pytest.fixture
def station(monkeypatch, make_log):
    """Replace the simulation and the pages, which have tests of their own."""

    class Station(FakeStation):
        log = make_log(load_scenario("plane"))

    def write_replay(log, path, **_):
        path.write_text(f"{len(log)} rows")

    def write_report(log, metrics, scenario, path, failure="", links=(), *_):
        path.write_text(f"{len(log)} rows {failure} {links}")

    for name, content in (
        ("station", {"build_station": Station, "start_posture": None}),
        ("report", {"write_report": write_report}),
        ("replay", {"write_replay": write_replay}),
    ):
        module = types.ModuleType(f"dual_proxy.{name}")
        module.__dict__.update(content)
        monkeypatch.setitem(sys.modules, module.__name__, module)
    return Station


def run_cli(capsys, *arguments):
    try:
        status = cli.main(list(map(str, arguments)))
    except SystemExit as error:
        status = error.code
    captured = capsys.readouterr()
    return status, captured.out, captured.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "required: COMMAND"),
        (["fly"], "invalid choice: 'fly'"),
        (["run"], "expected a scenario, or --replay"),
        (["run", "plan"], "unknown scenario 'plan', available: flat_tool, "),
        (["run", "none.yaml"], "none.yaml: No such file"),
        (["run", "plane", "--scheme", "magic"], "invalid choice: 'magic'"),
        (["run", "plane", "--delay", "soon"], "invalid float value: 'soon'"),
        (["run", "plane", "--delay", "nan"], "plane.link.delay: expected a finite"),
        (["run", "plane", "--delay", "-1"], "plane.link.delay: expected"),
        (["run", "plane", "--duration", "0"], "plane.duration: expected"),
        (["run", "plane", "--seed", "x"], "invalid int value: 'x'"),
        (["run", "plane", "--seed", "-1"], "plane.seed: expected"),
        (["run", "plane", "--set", "seed"], "--set seed: expected KEY=VALUE"),
        (["run", "plane", "--set", "=1"], "--set =1: expected KEY=VALUE"),
        (["run", "plane", "--set", "sed=1"], "unknown key 'sed', did you mean 'seed'"),
        (["run", "plane", "--set", "seed=[1"], "--set seed=[1"),
        (["run", "plane", "--recording", "no.csv"], "no.csv: No such file"),
        (["run", "plane", "--recording-units", "inch"], "invalid choice: 'inch'"),
        (["run", "plane", "--recording-scale", "0"], r"recording_scale: expected a"),
        (["run", "plane", "--fast"], "unrecognized arguments: --fast"),
        (["run", "plane", "--out", ""], "argument --out: expected a folder, got ''"),
        (
            ["bench", "filter", "--quick", "--out", ""],
            "argument --out: expected a folder",
        ),
        (["run", "plane", "--out", __file__], "test_cli.py: Not a directory"),
        (["run", "plane", "--out", f"{__file__}/a"], "/a: Not a directory"),
    ],
)
def test_bad_input_is_one_clear_line_and_status_2(
    capsys, station, tmp_path, monkeypatch, arguments, message
):
    monkeypatch.chdir(tmp_path)
    status, out, err = run_cli(capsys, *arguments)
    assert status == 2
    assert out == ""
    assert err.count("\n") == 1
    assert "error: " in err
    assert message in err
    assert not list(tmp_path.iterdir())


def test_list_names_each_scenario(capsys):
    status, out, _ = run_cli(capsys, "list")
    assert status == 0
    assert any(line.split()[0] == "plane" for line in out.splitlines())


def test_version_and_help(capsys):
    status, out, _ = run_cli(capsys, "--version")
    assert status == 0
    assert out.startswith("dual-proxy ")
    status, out, _ = run_cli(capsys, "run", "--help")
    assert status == 0
    for option in ("scheme", "delay", "duration", "seed", "set", "recording"):
        assert f"--{option}" in out
    for option in ("--meshcat", "--realtime", "--mcap", "--out"):
        assert option in out
    # What a recording is to look like, in one paragraph and an example.
    assert RECORDING_FORMAT in " ".join(out.split())
    for line in RECORDING_EXAMPLE.splitlines():
        assert f"    {line}\n" in out


def test_run_saves_everything_and_prints_every_metric(capsys, station, tmp_path):
    out_dir = tmp_path / "a" / "b"
    status, out, err = run_cli(
        capsys,
        *("run", "plane", "--scheme", "position_force", "--delay", "0.15"),
        *("--duration", 10, "--seed", 3, "--set", "filter.period=2e-2"),
        *("--set", "controller.feed_forward=true", "--mcap", "--meshcat"),
        *("--out", out_dir),
    )
    assert (status, err) == (0, "")
    for key in METRICS:
        assert key in out
    assert f"report: {out_dir / 'report.html'}" in out
    assert {path.name for path in out_dir.iterdir()} == {
        *("metrics.json", "log.npz", "log.mcap", "scenario.yaml", "claims.json"),
        *("report.html", "replay.html"),
    }
    claims = json.loads((out_dir / "claims.json").read_text())
    assert {claim["metric"] for claim in claims} == {
        *("haptic_force_ac_N", "haptic_force_swing_contact_N")
    }
    scenario, meshcat = station.built
    assert meshcat is True
    assert scenario.scheme == "position_force"
    assert (scenario.link.delay, scenario.duration, scenario.seed) == (0.15, 10.0, 3)
    assert scenario.filter.period == 0.02
    assert scenario.controller.feed_forward is True  # Wins over the scheme's.
    assert load_scenario(out_dir / "scenario.yaml") == scenario
    metrics = json.loads((out_dir / "metrics.json").read_text())
    assert list(metrics) == list(METRICS)
    assert metrics["sim_s"] == pytest.approx(10.0)
    pd.testing.assert_frame_equal(
        load_log(out_dir / "log.npz"), station.log.iloc[:10001], check_exact=True
    )


def test_default_directory_is_a_new_one(capsys, station, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for end in ("", "-2", "-3"):
        status, out, _ = run_cli(capsys, "run", "plane", "--delay", "0.05")
        assert status == 0
        report = Path("out") / f"plane-dual_proxy-50ms{end}" / "report.html"
        assert report.is_file()
        assert f"report: {report}" in out


def test_default_directory_that_cannot_be_made(capsys, station, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "out").touch()
    status, out, err = run_cli(capsys, "run", "plane")
    assert (status, out) == (2, "")
    assert err.startswith("dual-proxy: error: --out out/plane-dual_proxy-0ms")
    assert err.count("\n") == 1


def test_bad_input_leaves_no_directory(capsys, station, tmp_path, monkeypatch):
    def build_station(*_, **__):
        raise ValueError("out of reach")

    monkeypatch.setattr(
        sys.modules["dual_proxy.station"], "build_station", build_station
    )
    status, _, _ = run_cli(capsys, "run", "plane", "--out", tmp_path / "a" / "b")
    assert status == 2
    assert list(tmp_path.iterdir()) == []


def test_directory_in_use_is_refused_before_the_run(capsys, station, tmp_path):
    station.built = None
    with RunFolder(tmp_path / "x"):
        status, _, err = run_cli(capsys, "run", "plane", "--out", tmp_path / "x")
    assert status == 2
    assert err == (
        f"dual-proxy: error: --out {tmp_path / 'x'}: another run is going to save"
        " there\n"
    )
    assert station.built is None


def test_full_disk_leaves_metrics_on_the_screen(capsys, station, tmp_path):
    assert run_cli(capsys, "run", "plane", "--out", tmp_path / "old")[0] == 0
    before = {path: path.read_bytes() for path in (tmp_path / "old").iterdir()}
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, limits[1]))
    try:
        for name in ("old", "new"):
            out_dir = tmp_path / name
            status, out, err = run_cli(capsys, "run", "plane", "--out", out_dir)
            assert status == 3
            assert err == (
                f"dual-proxy: error: nothing was saved in {out_dir}: File too large\n"
            )
            assert "contact_losses" in out
            assert "report:" not in out
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert {path: path.read_bytes() for path in (tmp_path / "old").iterdir()} == before
    assert not (tmp_path / "new").exists()


def test_log_is_saved_if_nothing_can_be_drawn(capsys, station, tmp_path, monkeypatch):
    def write_replay(*_, **__):
        raise RuntimeError("no port\nis free")

    monkeypatch.setattr(sys.modules["dual_proxy.replay"], "write_replay", write_replay)
    status, out, err = run_cli(capsys, "run", "plane", "--out", tmp_path)
    assert status == 3
    assert err == (
        "dual-proxy: error: report.html and replay.html were not saved, only"
        f" metrics.json, scenario.yaml and log.npz in {tmp_path}: no port is free\n"
    )
    assert {path.name for path in tmp_path.iterdir()} == {
        *("metrics.json", "log.npz", "scenario.yaml")
    }
    assert "report:" not in out


def test_claims_that_cannot_be_judged_do_not_lose_the_run(
    capsys, station, tmp_path, monkeypatch
):
    def judge(*_):
        raise TypeError("a list is no number")

    monkeypatch.setattr(sys.modules["dual_proxy.run"], "judge", judge)
    with contextlib.suppress(TypeError):
        run_cli(capsys, "run", "plane", "--out", tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {
        *("metrics.json", "log.npz", "scenario.yaml")
    }


def test_a_claim_on_what_is_no_number_is_refused(capsys, station, tmp_path):
    claims = "claims=[{metric: limits_broken, at_most: 1}]"
    out_dir = tmp_path / "new"
    status, out, err = run_cli(
        capsys, "run", "plane", "--set", claims, "--out", out_dir
    )
    assert (status, out) == (2, "")
    assert err == (
        "dual-proxy: error: plane.claims[0].metric: expected a number among the keys "
        'of metrics.json, got "limits_broken"\n'
    )
    assert station.built is None
    assert not out_dir.exists()


def test_what_was_drawn_goes_if_the_report_fails(
    capsys, station, tmp_path, monkeypatch
):
    def write_report(*_, **__):
        raise RuntimeError("no font is left")

    monkeypatch.setattr(sys.modules["dual_proxy.report"], "write_report", write_report)
    status, _, err = run_cli(capsys, "run", "plane", "--mcap", "--out", tmp_path)
    assert status == 3
    assert err.endswith(f"scenario.yaml and log.npz in {tmp_path}: no font is left\n")
    assert {path.name for path in tmp_path.iterdir()} == {
        *("metrics.json", "log.npz", "scenario.yaml")
    }


def test_no_space_for_the_log_of_a_long_run(capsys, station, tmp_path, monkeypatch):
    def store_log(self, duration):
        raise OSError(28, "No space left on device", "/var/tmp")

    monkeypatch.setattr(station, "store_log", store_log, raising=False)
    status, out, err = run_cli(capsys, "run", "plane", "--out", tmp_path / "x")
    assert (status, out) == (3, "")
    assert err == "dual-proxy: error: /var/tmp: No space left on device\n"
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (signal.SIGINT, "interrupted"),
        (signal.SIGTERM, "terminated"),
        (signal.SIGHUP, "terminated"),
    ],
)
def test_signals_end_the_run_and_save_it(capsys, station, tmp_path, number, text):
    times = 1 if number == signal.SIGINT else 2

    def advance_to(self, now, original=station.advance_to):
        original(self, now)
        if now == 5.0:
            for _ in range(times):
                os.kill(os.getpid(), number)

    station.advance_to = advance_to
    before = signal.getsignal(number)
    status, _, err = run_cli(capsys, "run", "plane", "--out", tmp_path)
    assert status == 3
    assert err == f"dual-proxy: error: the run failed after 5 s: {text}\n"
    assert len(load_log(tmp_path / "log.npz")) == 5001
    assert (tmp_path / "report.html").is_file()
    assert signal.getsignal(number) is before


@pytest.mark.parametrize(
    ("numbers", "status"),
    [
        ([signal.SIGTERM, signal.SIGTERM], 0),
        ([signal.SIGINT], 0),
        ([signal.SIGINT, signal.SIGINT], 3),
    ],
)
def test_signals_while_saving(capsys, station, tmp_path, monkeypatch, numbers, status):
    def write_replay(log, path, **_):
        for number in numbers:
            os.kill(os.getpid(), number)
        path.write_text("replay")

    monkeypatch.setattr(sys.modules["dual_proxy.replay"], "write_replay", write_replay)
    out_dir = tmp_path / "out"
    actual, out, err = run_cli(capsys, "run", "plane", "--out", out_dir)
    assert actual == status
    assert "contact_losses" in out
    assert out_dir.exists() == (status == 0)
    if status:
        assert err == (
            "dual-proxy: error: interrupted while saving; nothing was saved in"
            f" {out_dir}\n"
        )


@pytest.mark.parametrize("place", ["_parser", "list_scenarios"])
@pytest.mark.parametrize(
    ("number", "text"),
    [(signal.SIGINT, "interrupted"), (signal.SIGTERM, "terminated")],
)
def test_interrupt_elsewhere_is_one_line(capsys, monkeypatch, place, number, text):
    def interrupt():
        os.kill(os.getpid(), number)

    monkeypatch.setattr(cli, place, interrupt)
    assert run_cli(capsys, "list") == (3, "", f"dual-proxy: error: {text}\n")


def broken_pipe():
    """Standard output that nobody reads."""
    reading, writing = os.pipe()
    os.close(reading)
    return open(writing, "w", encoding="utf-8")


def test_run_goes_on_when_nobody_reads(station, tmp_path, monkeypatch):
    with broken_pipe() as out, broken_pipe() as err:
        monkeypatch.setattr(sys, "stdout", out)
        monkeypatch.setattr(sys, "stderr", err)
        assert cli.main(["run", "plane", "--out", str(tmp_path)]) == 0
        assert cli.main(["list"]) == 0
    assert (tmp_path / "report.html").is_file()


@pytest.mark.parametrize(("key", "value"), [("units", "mm"), ("scale", "0.3")])
def test_scaling_of_no_recording_is_refused(capsys, tmp_path, key, value):
    option = f"--recording-{key}"
    status, _, err = run_cli(capsys, "run", "plane", option, value, "--out", tmp_path)
    assert status == 2
    assert err == (
        f"dual-proxy: error: {option}: expected with a recording (--recording CSV), "
        f"got {value} without one\n"
    )


def test_closed_or_full_standard_output(capsys, station, tmp_path, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(sys, "stdout", None)
        assert cli.main(["run", "plane", "--out", str(tmp_path)]) == 0
    for command in ("list", "--version"):
        with (
            open("/dev/full", "w", encoding="utf-8") as full,
            monkeypatch.context() as patch,
        ):
            patch.setattr(sys, "stdout", full)
            assert cli.main([command]) == 3
        assert capsys.readouterr().err == (
            "dual-proxy: error: standard output: No space left on device\n"
        )


def test_pydrake_that_cannot_be_loaded_is_one_line(capsys, monkeypatch, tmp_path):
    for name in ("station", "_pydrake"):
        monkeypatch.delitem(sys.modules, f"dual_proxy.{name}", raising=False)
    monkeypatch.setitem(sys.modules, "pydrake", None)
    for name in [name for name in sys.modules if name.startswith("pydrake.")]:
        monkeypatch.delitem(sys.modules, name)
    status, out, err = run_cli(capsys, "run", "plane", "--out", tmp_path / "x")
    assert (status, out) == (2, "")
    assert err.startswith("dual-proxy: error: pydrake cannot be loaded: ")
    assert err.count("\n") == 1
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (RuntimeError("the arm\nhas left the room"), "the arm has left the room"),
        (KeyboardInterrupt(), "interrupted"),
        (ValueError(), "ValueError"),
    ],
)
def test_failed_run_is_saved_and_status_3(capsys, station, tmp_path, error, text):
    station.fail_at, station.error = 5.0, error
    status, out, err = run_cli(capsys, "run", "plane", "--out", tmp_path)
    assert status == 3
    assert err == f"dual-proxy: error: the run failed after 5 s: {text}\n"
    assert len(load_log(tmp_path / "log.npz")) == 5001
    assert text in (tmp_path / "report.html").read_text()
    assert "metrics.json" in {path.name for path in tmp_path.iterdir()}
    assert "report: " in out


def test_failure_before_the_first_step_is_saved_too(capsys, station, tmp_path):
    station.fail_at = -1.0
    station.log = station.log.iloc[:0]
    status, _, _ = run_cli(capsys, "run", "plane", "--out", tmp_path)
    assert status == 3
    assert {path.name for path in tmp_path.iterdir()} == {
        *("metrics.json", "log.npz", "scenario.yaml", "report.html")
    }


def test_values_that_are_not_finite_fail_the_command(capsys, station, tmp_path):
    station.log = station.log.copy()
    station.log.iloc[100, 0] = float("nan")
    status, _, err = run_cli(capsys, "run", "plane", "--out", tmp_path)
    assert status == 3
    assert "not finite" in err
    assert json.loads((tmp_path / "metrics.json").read_text())["finite"] is False


def test_a_run_that_breaks_limits_of_the_arm_has_failed(
    capsys, station, tmp_path, monkeypatch
):
    monkeypatch.delitem(sys.modules, "dual_proxy.report")  # The real one.
    station.log = station.log.copy()
    station.log.iloc[100, station.log.columns.get_loc("joint_velocity_0")] = 3.0
    station.log.iloc[200, station.log.columns.get_loc("robot_velocity_x")] = 2.0
    status, out, err = run_cli(capsys, "run", "plane", "--out", tmp_path)
    assert status == 3
    assert err == (
        "dual-proxy: error: limits of the arm were broken: "
        "joint 1 speed 3 rad/s at 0.1 s (limit 2.175); "
        "tool speed 2 m/s at 0.2 s (limit 1.7)\n"
    )
    assert "joint_speed, tool_speed" in out
    metrics = json.loads((tmp_path / "metrics.json").read_text())
    assert metrics["limits_broken"] == ["joint_speed", "tool_speed"]
    assert "tool speed 2 m/s" in (tmp_path / "report.html").read_text()


def test_run_error_carries_what_was_logged(station):
    station.fail_at = 5.0
    with pytest.raises(RunError, match="failed after 5 s") as caught:
        run("plane")
    assert isinstance(caught.value.run, Run)
    assert len(caught.value.run.log) == 5001
    assert caught.value.run.metrics["sim_s"] == pytest.approx(5.0)
    assert caught.value.__cause__ is station.error
    again = pickle.loads(pickle.dumps(caught.value))
    assert str(again) == str(caught.value)
    pd.testing.assert_frame_equal(again.run.log, caught.value.run.log)
    assert again.run.metrics == caught.value.run.metrics


def test_run_takes_a_scenario_and_leaves_it_alone(station):
    scenario = load_scenario("plane")
    before = scenario.to_yaml()
    seen = []
    result = run(
        scenario, duration=2.0, progress=lambda now, end: seen.append((now, end))
    )
    assert scenario.to_yaml() == before
    assert result.failure == ""
    assert result.scenario.duration == 2.0
    assert len(seen) == 20
    assert seen[-1] == (2.0, 2.0)


@pytest.mark.parametrize("wrong", [3, None, b"plane", ["plane"]])
def test_what_is_no_scenario_is_refused(wrong):
    expected = (
        "scenario: expected a scenario's name, the path of a YAML file or a Scenario, "
        f"got {wrong!r}"
    )
    with pytest.raises(TypeError, match=f"^{re.escape(expected)}$"):
        run(wrong)


def test_arguments_win_over_overrides(station):
    result = run("plane", delay=0.1, overrides={"link.delay": 0.2, "link.rate": 100})
    assert result.scenario.link.delay == 0.1
    assert result.scenario.link.rate == 100.0


def test_realtime_takes_its_time(station):
    began = time.monotonic()
    run("plane", duration=0.3, realtime=True)
    assert time.monotonic() - began >= 0.29


def test_a_scenario_that_cannot_be_built_is_bad_input(station, monkeypatch):
    def build_station(*_, **__):
        raise ValueError("out of\nreach")

    monkeypatch.setattr(
        sys.modules["dual_proxy.station"], "build_station", build_station
    )
    with pytest.raises(ScenarioError, match="plane: cannot be built: out of reach"):
        run("plane")
