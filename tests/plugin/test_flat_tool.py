# SPDX-License-Identifier: BSD-3-Clause
"""Runs of scene `flat_tool`: the angular filter beside the linear one."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import dual_proxy as dp
from dual_proxy.log import SIGNALS, column_names, signal, signals
from dual_proxy.metrics import ANGULAR_METRICS, METRICS
from dual_proxy.station import WIRINGS, Station

# When the tool lies on the table and when it is twisted, s.
PRESSED = slice(5.0, 14.0)
TWISTED = slice(11.0, 13.0)


def tilt_deg(log: pd.DataFrame) -> np.ndarray:
    """Between the tool's axis and straight down."""
    _, x, y, _ = signal(log, "robot_orientation").T
    return np.degrees(np.arccos(np.clip(2.0 * (x**2 + y**2) - 1.0, -1.0, 1.0)))


@pytest.fixture(scope="module")
def run() -> dp.Run:
    return dp.run("flat_tool", duration=14.0)


def test_one_direction_of_force_and_two_of_moment(run):
    pressed = run.log.loc[PRESSED]
    assert (pressed["contact_dimension"] == 1).mean() > 0.99
    assert (pressed["contact_moment_dimension"] == 2).mean() > 0.95
    assert (pressed["dimension"] == 1).mean() > 0.99
    assert (pressed["moment_dimension"] == 2).mean() > 0.95
    assert run.metrics["dimension_accuracy"] > 0.95
    assert run.metrics["moment_dimension_accuracy"] > 0.95
    assert run.metrics["normal_error_mean_deg"] < 3.0
    assert run.metrics["contact_losses"] == 0


def test_rotation_is_free_about_the_normal(run):
    axis = signal(run.log.loc[PRESSED], "contact_rotation_axis")
    assert np.abs(axis[np.any(axis != 0.0, axis=1), 2]).min() > 0.9999
    assert run.metrics["rotation_axis_error_mean_deg"] < 3.0
    twisted = run.log.loc[TWISTED]
    assert signal(twisted, "robot_angular_velocity")[:, 2].mean() > 0.2
    omega_tau = signal(twisted, "moment_selection").reshape(-1, 3, 3)
    sine = np.linalg.norm(omega_tau[:, :, 2], axis=1)
    assert np.degrees(np.arcsin(sine.mean())) < 3.0


# Friction pushes a tool that is twisted on its edge, where two directions are one.
@pytest.mark.parametrize(
    ("friction", "seed", "right"),
    [(0.0, 1, 0.95), (0.2, 2, 0.95), (0.3, 3, 0.88), (0.5, 4, 0.88)],
)
def test_rotations_are_right_whatever_the_friction(friction, seed, right):
    metrics = dp.run(
        "flat_tool",
        engine="bare",
        overrides={"scene.friction": friction, "seed": seed},
    ).metrics
    assert metrics["moment_dimension_accuracy"] >= right
    assert metrics["rotation_axis_error_mean_deg"] <= 3.0
    assert metrics["contact_losses"] == 0
    assert metrics["limits_broken"] == []


def test_the_papers_filter_of_moments_is_a_method():
    run = dp.run(
        "flat_tool",
        duration=6.0,
        engine="bare",
        overrides={
            "filter": {"likelihood": "paper", "period": 1 / 15},
            "angular_filter": {"method": "particles", "period": 1 / 15},
        },
    )
    assert (run.log.loc[5.0:, "moment_dimension"] > 0).all()
    printed = dp.load_scenario("flat_tool").with_overrides({"law": "printed"})
    assert printed.angular_filter.method == "particles"
    assert printed.angular_filter.filter.period == pytest.approx(1 / 15)


def test_the_tool_lies_flat_and_moments_stay_bounded(run):
    pressed = run.log.loc[PRESSED]
    assert tilt_deg(pressed).mean() < 0.5
    moment = np.linalg.norm(signal(pressed, "sensed_moment"), axis=1)
    assert 0.1 < moment.mean() < 0.2
    assert moment.max() < 0.4
    # As much as the virtual spring asks for: 3 N m/rad times 0.05 rad.
    reference = np.linalg.norm(signal(pressed, "reference_moment"), axis=1)
    assert reference.max() < 0.2
    assert run.metrics["finite"]


def test_without_the_angular_filter_the_tool_rides_on_its_edge(run):
    without = dp.run(
        "flat_tool", duration=8.0, overrides={"angular_filter.enabled": False}
    )
    assert tilt_deg(without.log.loc[6.0:]).mean() > 1.5
    assert list(without.metrics) == list(METRICS)
    assert list(run.metrics) == [*METRICS, *ANGULAR_METRICS]
    of_a_point_mass = {"commanded_force", "force_limited", "force_rate_limited"}
    switched_on = {
        "planner_selection",
        "handle_force",
        "handle_position",
        "clutched",
        "force_gain",
        "fixture_force",
        "gripper_width_command",
    }
    assert list(run.log.columns) == [
        column
        for name in SIGNALS
        if name not in of_a_point_mass | switched_on
        for column in column_names(name)
    ]
    more = set(signals(run.log.columns)) - set(signals(without.log.columns))
    assert {name for name in more if not name.startswith("angular_filter_")} == {
        "moment_dimension",
        "moment_selection",
        "contact_moment_dimension",
        "contact_rotation_axis",
    }


def test_only_scenarios_that_ask_for_it_have_an_angular_filter():
    scenario = dp.load_scenario("flat_tool")
    for changes, expected in (
        ({}, True),
        ({"angular_filter.enabled": False}, False),
        ({"scheme": "position_force"}, False),
    ):
        for wiring in WIRINGS:
            station = Station(scenario.with_overrides(changes), wiring=wiring)
            outputs = {
                station.diagram.get_output_port(i).get_name()
                for i in range(station.diagram.num_output_ports())
            }
            assert ({"moment_selection", "moment_dimension"} <= outputs) == expected


def test_both_wirings_give_the_same_bits():
    logs = []
    for wiring in WIRINGS:
        station = Station(dp.load_scenario("flat_tool"), wiring=wiring)
        station.advance_to(6.0)
        logs.append(station.log_frame())
    pd.testing.assert_frame_equal(*logs, check_exact=True)


def test_saved_run_has_it_all(run, tmp_path):
    report = run.save(tmp_path, mcap=True)
    pd.testing.assert_frame_equal(
        dp.load_log(tmp_path / "log.npz"), run.log, check_exact=True
    )
    text = report.read_text()
    assert "rotation_axis_error_mean_deg" in text
    assert "<h2>Rotations</h2>" in text
    assert b"/moment_selection" in (tmp_path / "log.mcap").read_bytes()
