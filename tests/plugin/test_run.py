# SPDX-License-Identifier: BSD-3-Clause
"""Whole runs of scene `plane`: what the README says of them."""

from __future__ import annotations

import importlib
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import dual_proxy as dp
from dual_proxy import systems
from dual_proxy.log import column_names, signal
from dual_proxy.panda import TORQUE_LIMIT
from dual_proxy.station import Station

DATA = Path(__file__).resolve().parents[2].parent / "shared" / "data"


def check_limits(run: dp.Run) -> None:
    """What holds for every run of every scheme and law."""
    assert run.metrics["finite"]
    assert run.metrics["sensor_ready"]
    assert run.metrics["limits_broken"] == []
    assert run.metrics["haptic_force_max_N"] <= 12.0 + 1e-9
    torque = signal(run.log, "torque")[1:]
    assert np.all(np.abs(torque) <= TORQUE_LIMIT + 1e-9)
    # 1000 N m/s.
    period = np.diff(run.log.index[:2])[0]
    assert np.abs(np.diff(torque, axis=0)).max() <= 1000.0 * period + 1e-9


@pytest.mark.parametrize(
    ("scene", "force", "moment"),
    [
        ("plane", [0.0, 0.0, 20.0], [0.0, 0.0, 0.0]),
        ("plane", [-40.0, 0.0, 30.0], [0.0, 0.0, 0.0]),
        ("flat_tool", [0.0, 0.0, 0.0], [0.0, 4.0, 0.0]),
    ],
)
def test_a_phantom_contact_is_no_runaway(scene, force, moment):
    run = dp.run(
        scene,
        overrides={
            "sensor.tare": False,
            "sensor.force_bias": force,
            "sensor.moment_bias": moment,
            "duration": 8.0,
        },
    )
    check_limits(run)
    assert run.metrics["tool_speed_max_m_s"] < 0.6


# Neither a multiple of the other: poses come to the sensor in uneven steps.
@pytest.mark.parametrize(("period", "step"), [(0.001, 0.0015), (0.0015, 0.001)])
def test_steps_of_plant_and_control_need_nothing_in_common(period, step):
    run = dp.run(
        "plane",
        overrides={"control_period": period, "scene.time_step": step, "duration": 6.0},
    )
    check_limits(run)
    assert run.metrics["false_contact_share"] < 0.02


@pytest.fixture(scope="module")
def dual_proxy_150ms() -> dp.Run:
    return dp.run("plane", delay=0.15)


@pytest.mark.parametrize("delay", [0.05, 1.5])
def test_dual_proxy_does_not_notice_the_delay(delay, dual_proxy_150ms):
    for run in (dp.run("plane", delay=delay), dual_proxy_150ms):
        check_limits(run)
        metrics = run.metrics
        assert metrics["normal_error_mean_deg"] < 3.0
        assert metrics["normal_error_p95_deg"] < 6.0
        assert metrics["dimension_accuracy"] > 0.95
        assert metrics["haptic_force_std_contact_N"] < 0.5
        assert metrics["position_rms_free_delay_compensated_m"] < 0.006
        assert metrics["contact_losses"] <= 3
        assert metrics["contact_force_max_N"] < 90.0
        assert metrics["link_messages_dropped"] == 0


def test_two_channel_baseline_swings_with_delay(dual_proxy_150ms):
    still = dp.run("plane", scheme="position_force", delay=0.0)
    swinging = dp.run("plane", scheme="position_force", delay=0.15)
    for run in (still, swinging):
        check_limits(run)
        assert run.metrics["dimension_accuracy"] is None
    std = swinging.metrics["haptic_force_std_contact_N"]
    assert std > 1.5
    assert std > 5.0 * dual_proxy_150ms.metrics["haptic_force_std_contact_N"]
    assert std > 1.5 * still.metrics["haptic_force_std_contact_N"]


def test_printed_law_loses_contact_and_tilts_the_normal():
    run = dp.run("plane", delay=0.0, duration=9.0, overrides={"law": "printed"})
    check_limits(run)
    assert run.metrics["contact_losses"] > 0
    assert run.metrics["normal_error_mean_deg"] > 3.0


def test_same_seed_same_bytes_other_seed_others(tmp_path):
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        run = dp.run(
            "plane",
            delay=0.05,
            duration=3.6,
            seed=seed,
            overrides={"link.jitter": 0.003, "link.loss": 0.1},
        )
        dp.save_log(run.log, tmp_path / name)
    same, again, other = ((tmp_path / name).read_bytes() for name in "abc")
    assert same == again
    assert same != other


def test_station_can_be_reset():
    """Again from the start: the same bits (clones: test_determinism.py)."""
    station = Station(dp.load_scenario("plane").with_overrides({"link.delay": 0.05}))
    station.advance_to(3.3)
    assert station.log_frame()["dimension"].iloc[-1] == 1
    station.advance_to(3.6)
    log = station.log_frame()

    station.simulator.reset_context(station.diagram.CreateDefaultContext())
    station.simulator.Initialize()
    station.advance_to(3.6)
    pd.testing.assert_frame_equal(station.log_frame(), log, check_exact=True)


def test_a_lost_link_lets_go():
    """From 6 s on, in contact, nothing gets through any more."""
    station = Station(
        dp.load_scenario("plane").with_overrides({"link.delay": 0.05}),
        wiring="systems",
    )
    station.advance_to(6.0)
    # Nothing new arrives: the messages stay what they are.
    root = station.simulator.get_mutable_context()
    for name, port in (
        ("robot_side", "haptic_message"),
        ("haptic_side", "robot_message"),
    ):
        system = station.diagram.GetSubsystemByName(name)
        context = system.GetMyMutableContextFromRoot(root)
        newest = systems.get_value(system.GetInputPort(port).EvalAbstract(context))
        system.GetInputPort(port).FixValue(context, systems.make_value(newest))
    station.advance_to(9.0)
    log = station.log_frame()
    assert log["robot_link_status"].iloc[-1] == dp.LinkStatus.LOST
    assert log["haptic_link_status"].iloc[-1] == dp.LinkStatus.LOST
    pressing = log.loc[5.5:6.0]
    assert (pressing["contact_force_z"] < -5.0).all()
    end = log.loc[8.0:]
    # No spring force on the hand; the robot presses no more than it needs to
    # stay where it is.
    assert np.abs(signal(end, "haptic_reference_force")).max() < 1e-9
    assert np.abs(signal(end, "reference_force")).max() < 1e-9
    assert end["contact_force_z"].min() > -2.0
    # Nor is what damps it in contact there.
    assert np.abs(signal(end, "device_force")).max() == 0
    # Neither reference stepped on the way: 50 N/s, and without a link 120.
    for name, rate in (("reference_force", 50.0), ("haptic_reference_force", 120.0)):
        steps = np.diff(signal(log.loc[6.0:], name), axis=0)
        assert np.linalg.norm(steps, axis=1).max() <= rate * 1e-3 + 1e-9


@pytest.mark.skipif(not DATA.is_dir(), reason="recordings are not in ../shared/data")
def test_recorded_hand_goes_in_and_out_of_contact():
    run = dp.run("plane", delay=0.05, recording=DATA / "panda_guided_02.csv")
    check_limits(run)
    touching = np.linalg.norm(signal(run.log, "contact_force"), axis=1) > 0.5
    assert 0.1 < touching.mean() < 0.95
    assert run.metrics["sim_s"] > 30.0


def test_save_writes_what_it_says(tmp_path):
    run = dp.run("plane", duration=0.5)
    report = run.save(tmp_path / "out", mcap=True)
    assert report == tmp_path / "out" / "report.html"
    names = {path.name for path in report.parent.iterdir()}
    assert names == {
        "claims.json",
        "log.mcap",
        "log.npz",
        "metrics.json",
        "replay.html",
        "report.html",
        "scenario.yaml",
    }
    metrics = json.loads((report.parent / "metrics.json").read_text())
    assert metrics["sim_s"] == pytest.approx(0.5)
    log = dp.load_log(report.parent / "log.npz")
    np.testing.assert_array_equal(log.to_numpy(), run.log.to_numpy())
    again = dp.run(dp.load_scenario(report.parent / "scenario.yaml"))
    columns = column_names("robot_position")
    np.testing.assert_array_equal(
        again.log.loc[:0.5, columns].to_numpy(), run.log[columns].to_numpy()
    )


def test_run_that_is_interrupted_keeps_all_its_rows():
    def progress(now, end):
        if now > 0.35:
            raise KeyboardInterrupt

    with pytest.raises(dp.RunError, match=r"after 0\.4 s: interrupted") as caught:
        dp.run("plane", duration=2.0, progress=progress)
    log = caught.value.run.log
    np.testing.assert_allclose(log.index, 1e-3 * np.arange(1, 401))
    assert np.isfinite(log.to_numpy()).all()


def test_no_space_for_the_log_is_said_before_the_run(monkeypatch):
    monkeypatch.setenv("TMPDIR", "/no/such/folder")
    assert len(dp.run("plane", duration=0.1).log) == 100  # It fits into memory.
    calls = []
    with pytest.raises(FileNotFoundError, match="MB in /no/such/folder"):
        dp.run("plane", duration=200.0, progress=lambda *_: calls.append(1))
    assert not calls


def test_log_that_is_moved_on_the_way_is_the_same():
    scenario = dp.load_scenario("plane")
    kept, moved = Station(scenario), Station(scenario)
    moved.store_log(2.5)
    for time in (0.7, 1.2, 1.3, 2.5):
        kept.advance_to(time)
        moved.advance_to(time)
    pd.testing.assert_frame_equal(moved.log_frame(), kept.log_frame(), check_exact=True)
    pd.testing.assert_frame_equal(moved.log_frame(), kept.log_frame(), check_exact=True)


def test_saving_that_fails_leaves_nothing(tmp_path, monkeypatch):
    run = dp.run("plane", duration=0.2)
    (tmp_path / "file").touch()
    with pytest.raises(NotADirectoryError):
        run.save(tmp_path / "file")
    report = importlib.import_module("dual_proxy.report")
    monkeypatch.setattr(report, "write_report", None)
    with pytest.raises(TypeError):
        run.save(tmp_path / "out")
    assert list(tmp_path.iterdir()) == [tmp_path / "file"]


def test_saved_scenario_runs_from_anywhere(tmp_path, monkeypatch):
    (tmp_path / "motion.csv").write_text(
        "t,px,py,pz\n"
        + "\n".join(f"{0.1 * i},0.45,{0.001 * i},0.48" for i in range(21))
    )
    monkeypatch.chdir(tmp_path)
    run = dp.run("plane", recording="motion.csv", duration=0.3)
    run.save("out", pages=False)
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    again = dp.run(tmp_path / "out" / "scenario.yaml")
    pd.testing.assert_frame_equal(again.log, run.log, check_exact=True)


def test_a_station_without_a_log_goes_the_same_way():
    scenario = dp.load_scenario("plane")
    with_log, without = (Station(scenario, logged=logged) for logged in (True, False))
    states = []
    for station in (with_log, without):
        station.advance_to(0.5)
        context = station.simulator.get_context()
        states.append(station.diagram.GetOutputPort("robot_state").Eval(context))
    np.testing.assert_array_equal(*states)
    assert not without.diagram.HasSubsystemNamed("contact_truth")
    with pytest.raises(RuntimeError, match="logged=False"):
        without.log_frame()
