# SPDX-License-Identifier: BSD-3-Clause
"""`dual-proxy compare`, and the many runs under it."""

import contextlib
import errno
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import dual_proxy as dp
from dual_proxy import cli, figures, many_runs
from dual_proxy.compare import COLUMNS, is_stable, summarise, summary_cells
from dual_proxy.log import replace_file
from dual_proxy.many_runs import Job, RunsFolder, run_many
from dual_proxy.metrics import METRICS
from dual_proxy.run import change_scenario

# Long enough to touch.
SHORT = {"duration": 3.0}
CLOCK = ["wall_s", "real_time_factor"]


def ignore(_):
    pass


def compare(out=None, progress=ignore, **changes):
    arguments = {
        "schemes": ["dual_proxy", "position_force"],
        "delays": [0.0, 0.05],
        "engine": "bare",
        "overrides": SHORT,
        "jobs": 1,
    }
    return dp.compare(
        "sim_cylinder", out=out, progress=progress, **(arguments | changes)
    )


def make_job(name="job", engine="bare", **overrides):
    scenario = change_scenario("sim_cylinder", overrides=SHORT | overrides)
    return Job(name, scenario, engine)


def run_cli(capsys, *arguments):
    status = cli.main(list(map(str, arguments)))
    captured = capsys.readouterr()
    return status, captured.out, captured.err


@pytest.fixture
def no_figures(monkeypatch):
    """Drawing takes longest."""
    monkeypatch.setattr(figures, "draw_comparison", lambda *_: None)


@pytest.fixture(scope="module")
def compared(tmp_path_factory):
    """A comparison, and where it was saved."""
    out = tmp_path_factory.mktemp("compare")
    table = compare(out, seeds=2, hands=["firm", "soft"], jobs=2)
    return SimpleNamespace(table=table, out=out)


def test_table_has_a_row_per_run(compared):
    table = compared.table
    assert len(table) == 2 * 2 * 2 * 2
    assert list(table.columns[:8]) == [
        *("scheme", "delay", "hand", "seed", "engine", "stable", "exit", "failure")
    ]
    assert set(METRICS) <= set(table.columns)
    assert not table.duplicated(["scheme", "delay", "hand", "seed"]).any()
    assert (table["exit"] == 0).all()
    assert (table["failure"] == "").all()
    assert (table["sim_s"] == 3.0).all()
    assert (table["contact_time_s"] > 0.3).all()
    of_filter = table["scheme"] == "dual_proxy"
    assert table["dimension_accuracy"].notna().eq(of_filter).all()


def test_rows_are_the_runs_they_say(compared):
    """Hand, delay, seed and scheme are what a run of its own has."""
    for row in (3, 12):
        is_of = compared.table.iloc[row]
        hand = {"firm": (600.0, 30.0), "soft": (300.0, 10.0)}[is_of["hand"]]
        alone = dp.run(
            "sim_cylinder",
            scheme=is_of["scheme"],
            delay=is_of["delay"],
            seed=int(is_of["seed"]),
            engine="bare",
            overrides=SHORT
            | {"device.hand_stiffness": hand[0], "device.hand_damping": hand[1]},
        )
        for column in COLUMNS:
            expected = alone.metrics[column.key]
            assert is_of[column.key] == pytest.approx(expected, nan_ok=True) or (
                expected is None and np.isnan(is_of[column.key])
            )


def test_files_hold_the_table_and_a_series_of_each_run(compared):
    names = {path.name for path in compared.out.iterdir()}
    assert names == {"comparison.json", "comparison.csv", "runs"} | {
        f"{what}_{hand}.png"
        for what in ("forces", "positions", "errors")
        for hand in ("firm", "soft")
    }
    saved = json.loads((compared.out / "comparison.json").read_text())
    assert saved["scenario"] == "sim_cylinder"
    assert len(saved["rows"]) == len(compared.table)
    first = compared.table.iloc[0]
    assert saved["rows"][0]["haptic_force_max_N"] == first["haptic_force_max_N"]
    frame = pd.read_csv(compared.out / "comparison.csv")
    assert list(frame.columns) == list(compared.table.columns)
    series = sorted((compared.out / "runs").glob("*.npz"))
    assert len(series) == len(compared.table)
    with np.load(series[0]) as arrays:
        assert arrays["time"].shape == (300,)
        assert arrays["hand"].shape == arrays["robot"].shape == (300, 3)
    # A small part of a log, which has 1.6 MB per second.
    assert sum(path.stat().st_size for path in series) < 50e3 * len(series)


def test_series_is_what_the_log_has(tmp_path):
    job = make_job()
    with RunsFolder(tmp_path, "test") as folder:
        (result,) = run_many([job], folder, progress=ignore)
    series = result.series()
    log = dp.run(job.scenario, engine="bare").log
    rows = log.iloc[::10]
    assert series["time"] == pytest.approx(rows.index.to_numpy())
    for name, column, sign in (
        ("sensed", "sensed_force_z", 1.0),
        ("hand", "device_force_z", -1.0),  # R_DB is the identity there.
        ("robot", "robot_position_z", 1.0),
        ("contact", "contact_force_z", 1.0),
    ):
        expected = sign * rows[column].to_numpy(np.float32)
        np.testing.assert_array_equal(series[name][:, 2], expected)
    np.testing.assert_array_equal(series["dimension"], rows["dimension"])


def test_workers_make_no_difference(compared):
    alone = compare(seeds=2, hands=["firm", "soft"], jobs=1)
    pd.testing.assert_frame_equal(
        alone.drop(columns=CLOCK), compared.table.drop(columns=CLOCK), check_exact=True
    )


def test_what_is_there_is_not_run_again_unless_it_changed(no_figures, tmp_path):
    lines = []
    first = compare(tmp_path, lines.append)
    assert len(lines) == 4
    lines.clear()
    again = compare(tmp_path, lines.append)
    assert lines == ["4 of 4 runs are there already"]
    # The times are those of then.
    pd.testing.assert_frame_equal(first, again, check_exact=True)
    lines.clear()
    compare(tmp_path, lines.append, delays=[0.05, 0.1])
    assert lines[0] == "2 of 4 runs are there already"
    assert len(lines) == 3
    for change in (
        {"overrides": SHORT | {"scene.contact_stiffness": 9000.0}},
        {"hands": ["soft"]},
    ):
        lines.clear()
        compare(tmp_path, lines.append, **change)
        assert len(lines) == 4


def test_a_damaged_file_is_made_again(tmp_path):
    job = make_job()
    with RunsFolder(tmp_path, "test") as folder:
        run_many([job], folder, progress=ignore)
        (file,) = folder.runs.glob("*.json")
        whole = json.loads(file.read_text())["metrics"]
        file.write_text(file.read_text()[:100])
        lines = []
        (result,) = run_many([job], folder, progress=lines.append)
        assert len(lines) == 1
        for key in set(METRICS) - set(CLOCK):
            assert json.loads(file.read_text())["metrics"][key] == whole[key]
            assert result.metrics[key] == whole[key]


def test_what_decides_nothing_does_not_run_it_again(tmp_path):
    job = make_job()
    described = make_job(description="the same in other words")
    with RunsFolder(tmp_path, "test") as folder:
        run_many([job], folder, progress=ignore)
        lines = []
        run_many([described, job], folder, progress=lines.append)
    assert lines == ["1 of 1 runs are there already"]


def test_a_recording_that_changes_is_run_again(tmp_path):
    path = tmp_path / "motion.csv"

    def write(depth):
        lines = [
            f"{0.01 * i},0,0,{0.1 - depth * min(i, 250) / 250}" for i in range(301)
        ]
        path.write_text("t,px,py,pz\n" + "\n".join(lines) + "\n")

    def run():
        scenario = change_scenario(
            "plane", recording=path, overrides={"duration": 0.1, "seed": 1}
        )
        lines = []
        with RunsFolder(tmp_path / "out", "test") as folder:
            run_many([Job("recorded", scenario, "bare")], folder, 1, lines.append)
        return lines

    write(0.05)
    assert "already" not in run()[0]
    assert "already" in run()[0]
    write(0.06)
    assert "already" not in run()[0]


class Deadly:
    """A scenario that ends the process that reads it."""

    operator = SimpleNamespace(recording="")
    scene = SimpleNamespace(model_directives="")

    def to_mapping(self):
        return {"description": "deadly"}

    def __reduce__(self):
        return os._exit, (7,)


def test_failed_runs_do_not_lose_the_others(tmp_path):
    jobs = [
        make_job("crashes")._replace(scenario=Deadly()),
        make_job("good"),
        make_job("cannot be built", **{"scene.contact_approximation": "sap"}),
        make_job("also good", seed=1),
    ]
    lines = []
    with RunsFolder(tmp_path, "test") as folder:
        results = run_many(jobs, folder, 1, lines.append)
        assert [result.status for result in results] == [3, 0, 2, 0]
        why = "the process of the run ended with exit code 7, 2 times"
        assert results[0].failure == f"not made: {why}"
        assert "contact_approximation: expected" in results[2].failure
        assert results[0].metrics is results[2].metrics is None
        assert results[1].metrics["finite"]
        assert results[0].series() == {}
        assert len(results[1].series()["time"]) == 300
        assert any("cannot be built: sim_cylinder.scene" in line for line in lines)
        # Those that failed are tried again.
        lines.clear()
        run_many(jobs, folder, 2, lines.append)
        assert lines[0] == "2 of 4 runs are there already"


@pytest.mark.parametrize(
    ("error", "status", "text"),
    [
        (dp.ScenarioError("wrong"), 2, "wrong"),
        (ImportError("no\npydrake"), 2, "no pydrake"),
        (dp.RunError("the run failed after 1 s: x", None), 3, "failed after 1 s"),
        (MemoryError(), 3, "MemoryError: "),
    ],
)
def test_what_goes_wrong_in_a_run_is_its_result(monkeypatch, error, status, text):
    def run(*_, **__):
        raise error

    monkeypatch.setattr(many_runs, "run", run)
    result, series = many_runs._work(make_job())
    assert (result.metrics, result.status, series) == (None, status, {})
    assert text in result.failure
    assert "\n" not in result.failure


def test_a_run_that_breaks_limits_has_failed_and_has_metrics(monkeypatch):
    def fault(result):
        return "limits of the arm were broken: all"

    monkeypatch.setattr(many_runs, "find_fault", fault)
    result, series = many_runs._work(make_job())
    assert (result.status, result.failure) == (3, fault(None))
    assert result.metrics["sim_s"] == 3.0
    assert len(series["time"]) == 300


def test_an_interrupted_comparison_goes_on(no_figures, tmp_path):
    def interrupt(line):
        if line.startswith("2/4"):
            raise KeyboardInterrupt

    message = rf"^interrupted after 2 of 4 runs \(in {tmp_path}/runs\); the same"
    with pytest.raises(KeyboardInterrupt, match=message):
        compare(tmp_path, interrupt, jobs=1)
    assert not (tmp_path / "comparison.json").exists()
    lines = []
    table = compare(tmp_path, lines.append)
    assert lines[0] == "2 of 4 runs are there already"
    assert len(lines) == 3
    pd.testing.assert_frame_equal(
        table.drop(columns=CLOCK), compare().drop(columns=CLOCK), check_exact=True
    )


def children(pid):
    found = []
    for task in Path(f"/proc/{pid}/task").iterdir():
        found += map(int, (task / "children").read_text().split())
    return found


def runs(pid):
    """Whether it does, and is not just to be waited for."""
    with contextlib.suppress(OSError):
        return (
            Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
        )
    return False


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (signal.SIGINT, "interrupted"),
        (signal.SIGTERM, "terminated"),
        (signal.SIGKILL, None),
    ],
)
def test_signals_end_the_workers(tmp_path, number, text):
    command = [
        *(sys.executable, "-m", "dual_proxy.cli", "compare", "sim_cylinder"),
        *("--schemes", "all", "--delays", "0", "--seeds", "40", "--jobs", "2"),
        *("--set", "duration=100", "--out", str(tmp_path)),
    ]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stderr.readline().startswith(
                f"1/{40 * len(dp.Scenario.SCHEMES)}"
            )
            workers = children(process.pid)
            assert len(workers) >= 2
            process.send_signal(number)
            rest = process.stderr.read()
            status = process.wait(timeout=30)
        finally:
            process.kill()
    if text is not None:
        assert status == 3
        last = rest.splitlines()[-1]
        assert last.startswith(f"dual-proxy: error: {text} after ")
        assert "the same command makes the others" in last
        assert "Traceback" not in rest
    end = time.monotonic() + 10.0
    while any(map(runs, workers)) and time.monotonic() < end:
        time.sleep(0.05)
    assert not any(map(runs, workers))
    done = list((tmp_path / "runs").glob("*.json"))
    assert 1 <= len(done) < 120
    for file in done:
        assert json.loads(file.read_text())["metrics"]["finite"]


def test_a_script_needs_no_guard():
    """Unlike with multiprocessing; not even a file."""
    script = (
        "import dual_proxy as dp\n"
        "table = dp.compare('sim_cylinder', ['dual_proxy'], [0, 0.1], engine='bare',"
        " overrides={'duration': 1.0}, jobs=2)\n"
        "print(table['exit'].tolist())\n"
    )
    done = subprocess.run(
        [sys.executable, "-"], input=script, capture_output=True, text=True, timeout=60
    )
    assert done.stdout == "[0, 0]\n"
    assert len(done.stderr.splitlines()) == 2


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"schemes": ["magic"]}, "schemes: expected some of dual_proxy, "),
        ({"schemes": "dual_proxy"}, "schemes: expected a list, got 'dual_proxy'"),
        ({"schemes": []}, "schemes: expected at least one"),
        ({"schemes": ["dual_proxy"] * 2}, "schemes: 'dual_proxy' is there twice"),
        ({"delays": [0.1, 0.1]}, "delays: 0.1 is there twice"),
        ({"delays": [-1.0]}, "sim_cylinder.link.delay: expected"),
        ({"delays": [float("nan")]}, "sim_cylinder.link.delay: expected"),
        ({"hands": ["limp"]}, "hands: expected some of firm, soft, got 'limp'"),
        ({"delays": 0.0}, "delays: expected a list, got 0.0"),
        ({"delays": []}, "delays: expected at least one"),
        ({"seeds": 0}, "seeds: expected a whole number in [1, 1000], got 0"),
        ({"seeds": 1.5}, "seeds: expected a whole number in [1, 1000], got 1.5"),
        ({"seeds": 99999999}, "seeds: expected a whole number in [1, 1000], got 9"),
        ({"schemes": ["tdpa:x"]}, "schemes: expected SCHEME:KEY=VALUE, got 'tdpa:x'"),
        ({"schemes": ["tdpa:x=1"]}, "sim_cylinder.schemes.tdpa: unknown key 'x'"),
        ({"jobs": 0}, "jobs: expected at least 1, got 0"),
        ({"engine": "drake"}, 'engine: expected "auto" or "bare" with robot'),
        ({"overrides": {"foo": 1}}, "sim_cylinder: unknown key 'foo'"),
        ({"overrides": {"link.delay": 1}}, "link.delay: is decided by `delays`"),
        ({"out": __file__}, "test_compare.py: Not a directory"),
    ],
)
def test_bad_arguments_are_refused_before_anything_is_run(changes, message):
    with pytest.raises(dp.ScenarioError) as caught:
        compare(**changes)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_folder_of_another_comparison_is_refused(no_figures, tmp_path):
    compare(tmp_path, delays=[0.0], schemes=["position_force"])
    with pytest.raises(
        dp.ScenarioError, match="a new folder or one of `compare plane`"
    ):
        dp.compare("plane", ["position_force"], [0.0], engine="bare", out=tmp_path)
    with (
        RunsFolder(tmp_path, "compare sim_cylinder"),
        pytest.raises(dp.ScenarioError, match="another run is going to save there"),
    ):
        compare(tmp_path)


def test_folder_with_other_files_is_left_alone(no_figures, tmp_path):
    """Such as those of a run; an empty folder will do."""
    (tmp_path / "metrics.json").write_text("{}")
    with pytest.raises(dp.ScenarioError, match=r"an empty folder .* with metrics.json"):
        compare(tmp_path, delays=[0.0], schemes=["position_force"])
    assert [path.name for path in tmp_path.iterdir()] == ["metrics.json"]
    (tmp_path / "metrics.json").unlink()
    compare(tmp_path, delays=[0.0], schemes=["position_force"])
    assert (tmp_path / "comparison.json").exists()


def test_a_full_disk_says_where_and_how_far_it_came(monkeypatch, tmp_path):
    save, saved = RunsFolder.save, []

    def fill(*arguments):
        if saved:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "there")
        saved.append(save(*arguments))
        return saved[0]

    monkeypatch.setattr(RunsFolder, "save", fill)
    with pytest.raises(OSError, match="No space left") as caught:
        compare(tmp_path)
    assert caught.value.filename == "there"
    assert caught.value.strerror == (
        f"No space left on device after 1 of 4 runs (in {tmp_path / 'runs'}); the same "
        "command makes the others"
    )


def test_a_file_that_cannot_be_written_is_named(monkeypatch, tmp_path):
    def fail(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(OSError, match="No space left") as caught:
        replace_file(tmp_path / "x", b"x")
    assert caught.value.filename == str(tmp_path / "x")


def test_a_variant_of_a_scheme_beside_it(no_figures):
    variant = "four_channel:variant=three_channel"
    table = compare(schemes=["four_channel", variant], delays=[0.0])
    assert table["scheme"].tolist() == ["four_channel", variant]
    alone = dp.run(
        "sim_cylinder",
        scheme="four_channel",
        delay=0.0,
        engine="bare",
        overrides=SHORT | {"schemes.four_channel.variant": "three_channel"},
    )
    force = table["haptic_force_max_N"]
    assert force[1] == alone.metrics["haptic_force_max_N"] != force[0]


def test_command(capsys, no_figures, tmp_path):
    arguments = [
        *("compare", "sim_cylinder", "--schemes", "dual_proxy,position_force"),
        *("--delays", "0,0.05", "--seeds", 2, "--set", "duration=3", "--jobs", 2),
        *("--out", tmp_path),
    ]
    status, out, err = run_cli(capsys, *arguments)
    assert status == 0
    assert len(err.splitlines()) == 8
    rows = [line for line in out.splitlines() if line.startswith("| ")]
    assert len(rows) == 2 + 4
    assert rows[2].startswith("| dual_proxy | 0 | ")
    assert rows[5].startswith("| position_force | 50 | ")
    assert "mean (worst) of 2 seeds" in out
    assert "stable: nothing infinite" in out
    assert f"saved: {tmp_path / 'comparison.json'}" in out
    status, _, err = run_cli(capsys, *arguments)
    assert (status, err) == (0, "8 of 8 runs are there already\n")


def test_command_that_has_failed_runs_says_so(capsys, no_figures, tmp_path):
    status, out, err = run_cli(
        capsys,
        *("compare", "sim_cylinder", "--schemes", "dual_proxy", "--delays", "0,0.05"),
        *("--set", "scene.contact_approximation=sap", "--out", tmp_path),
    )
    assert status == 3
    last = err.splitlines()[-1]
    assert last.startswith(
        "dual-proxy: error: 2 of 2 runs failed, the first dual_proxy, 0 ms, firm, seed "
        "0: sim_cylinder.scene.contact_approximation: expected"
    )
    assert "| dual_proxy | 50 | - |" in out
    row = json.loads((tmp_path / "comparison.json").read_text())["rows"][1]
    assert row["exit"] == 2
    assert "contact_approximation" in row["failure"]
    assert row["haptic_force_max_N"] is None


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--delays", "0"], "required: --schemes"),
        (["--schemes", "all"], "required: --delays"),
        (["--schemes", "all", "--delays", "soon"], "expected numbers with commas"),
        (["--schemes", "all", "--delays", "0,"], "expected numbers with commas"),
        (["--schemes", "magic", "--delays", "0"], "got 'magic'"),
        (["--schemes", "all", "--delays", "0", "--out", ""], "expected a folder"),
        (["--schemes", "all", "--delays", "0", "--seeds", "x"], "invalid int value"),
    ],
)
def test_bad_usage_is_one_line_and_status_2(
    capsys, tmp_path, monkeypatch, arguments, message
):
    monkeypatch.chdir(tmp_path)
    status, out, err = run_cli(capsys, "compare", "sim_cylinder", *arguments)
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
    assert message in err
    assert not list(tmp_path.iterdir())


def metrics(**changes):
    sound = {
        "finite": True,
        "limits_broken": [],
        "haptic_force_ac_N": 0.1,
        "haptic_force_swing_contact_N": 0.1,
        "haptic_force_swing_air_N": 0.1,
        "contact_losses": 0,
    }
    return sound | changes


@pytest.mark.parametrize(
    ("changes", "stable"),
    [
        ({}, True),
        ({"haptic_force_ac_N": 0.5, "contact_losses": 3}, True),
        ({"finite": False}, False),
        ({"limits_broken": ["torque"]}, False),
        ({"haptic_force_ac_N": 0.51}, False),
        ({"haptic_force_swing_contact_N": 0.51}, False),
        ({"haptic_force_swing_contact_N": None}, True),
        ({"haptic_force_swing_air_N": 1.0}, True),
        ({"haptic_force_swing_air_N": 1.1}, False),
        ({"haptic_force_swing_air_N": None}, True),
        ({"haptic_force_ac_N": None, "haptic_force_swing_air_N": 1.1}, False),
        ({"contact_losses": 4}, False),
        ({"haptic_force_ac_N": None}, None),
        ({"haptic_force_ac_N": None, "contact_losses": 4}, False),
        ({"haptic_force_ac_N": None, "contact_losses": None}, None),
    ],
)
def test_rule_of_stability(changes, stable):
    assert is_stable(metrics(**changes)) is stable


def test_unstable_is_called_unstable():
    """The two-channel scheme with a soft hand swings, the dual proxy does not."""
    table = dp.compare(
        *("plane", ["dual_proxy", "position_force"], [0.05], ["soft"]),
        engine="bare",
        overrides={"duration": 8.0},
        progress=ignore,
    )
    assert table["stable"].tolist() == [True, False]
    _, rows = summary_cells(table)
    assert [row[2] for row in rows] == ["yes", "no"]


@pytest.mark.parametrize(
    ("scheme", "delay", "stable"),
    [
        ("tdpa", 1.5, False),  # With a period of 6 s, on the table and off it.
        ("tdpa", 0.35, False),
        ("position_position", 1.5, True),  # It drags.
        ("dual_proxy", 1.5, True),
    ],
)
def test_a_slow_swing_is_unstable_and_drag_is_not(scheme, delay, stable):
    metrics = dp.run("plane", scheme=scheme, delay=delay, engine="bare").metrics
    assert metrics["haptic_force_ac_N"] < 0.5
    assert is_stable(metrics) is stable
    swing = metrics["haptic_force_swing_contact_N"]
    assert swing < 0.1 if stable else swing > 0.7
    assert (metrics["haptic_force_max_air_N"] > 7.0) is (scheme != "dual_proxy")
    assert metrics["haptic_force_swing_air_N"] < 0.1 or not stable


def test_summary_has_mean_and_worst_over_seeds(compared):
    summary = summarise(compared.table)
    assert len(summary) == 8
    group = compared.table[
        (compared.table["scheme"] == "dual_proxy")
        & (compared.table["delay"] == 0.05)
        & (compared.table["hand"] == "soft")
    ]
    row = summary[
        (summary["scheme"] == "dual_proxy")
        & (summary["delay"] == 0.05)
        & (summary["hand"] == "soft")
    ].iloc[0]
    assert row["runs"] == 2
    for key, worst in (("haptic_force_max_N", max), ("dimension_accuracy", min)):
        assert row[key] == pytest.approx(group[key].mean())
        assert row[f"worst {key}"] == worst(group[key])
    head, rows = summary_cells(compared.table)
    assert head[:4] == ["scheme", "delay, ms", "hand", "stable"]
    assert all(len(cells) == len(head) for cells in rows)
    assert rows[0][head.index("dimension right")].count("(") == 1
