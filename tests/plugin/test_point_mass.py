# SPDX-License-Identifier: BSD-3-Clause
"""A scenario whose robot is a point mass: no arm, no rotations, no Drake."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import dual_proxy as dp
from dual_proxy.log import SIGNALS, signal, signals

SCENE = Path(__file__).parents[1] / "data" / "point_mass.yaml"


@pytest.fixture(scope="module")
def run():
    return dp.run(SCENE)


def test_it_presses_and_slides_as_the_paper_says(run):
    assert run.engine == "bare"
    metrics = run.metrics
    assert metrics["finite"]
    assert metrics["contact_losses"] == 0
    assert metrics["dimension_accuracy"] > 0.98
    assert metrics["normal_error_mean_deg"] < 5.0
    assert metrics["haptic_force_rms_free_N"] < 0.3
    assert metrics["position_rms_free_delay_compensated_m"] < 0.005
    # Hand and haptic proxy are springs in series, the map's scale is 2.5:
    # 600 * 1250 / (600 + 1250) * 0.030 / 2.5 = 4.9 N.
    force = signal(run.log, "contact_force")[:, 2]
    pressing = run.log.index.to_series().between(4.0, 6.5).to_numpy()
    assert force[pressing].mean() == pytest.approx(-4.9, abs=0.3)
    assert force[pressing].std() < 0.3
    assert force.min() > -13.0


def test_a_log_without_rotations_and_joints(run):
    names = signals(run.log.columns)
    for name in names:
        assert SIGNALS[name].unit not in ("rad", "rad/s", "N m", "N m/s"), name
    assert "robot_orientation" not in names
    assert {"robot_position", "commanded_force", "force_limited", "dimension"} <= set(
        names
    )
    # Metrics of what is not there are null.
    for key in ("joint_speed_share_max", "joint_margin_min_rad", "torque_share_max"):
        assert run.metrics[key] is None


@pytest.mark.parametrize("scheme", dp.Scenario.SCHEMES)
def test_every_scheme_runs(scheme):
    run = dp.run(SCENE, scheme=scheme, delay=0.05, duration=4.0)
    assert run.metrics["finite"]
    assert np.abs(signal(run.log, "contact_force")).max() > 2.0


def test_equal_seeds_give_equal_logs(run):
    assert dp.run(SCENE, engine="bare").log.equals(run.log)
    other = dp.run(SCENE, seed=1, duration=0.1)
    assert not other.log.equals(run.log.iloc[: len(other.log)])


def test_it_is_saved_with_report_and_replay(run, tmp_path):
    run.save(tmp_path)
    assert json.loads((tmp_path / "metrics.json").read_text())["finite"] is True
    report = (tmp_path / "report.html").read_text()
    assert "Contact direction" in report
    assert "Torques" not in report
    assert len((tmp_path / "replay.html").read_bytes()) > 100_000
    again = dp.load_scenario(tmp_path / "scenario.yaml")
    assert again.robot == "point_mass"
    assert again.to_mapping() == run.scenario.to_mapping()


def test_it_needs_no_drake():
    code = (
        "import sys; sys.modules['pydrake'] = None\n"
        "import dual_proxy as dp\n"
        f"print(dp.run({str(SCENE)!r}, duration=0.2).metrics['sim_s'])"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stderr
    assert float(result.stdout) == pytest.approx(0.2)


def test_drake_has_none():
    with pytest.raises(
        dp.ScenarioError, match=r"engine: expected .* no MultibodyPlant"
    ):
        dp.run(SCENE, engine="drake")


@pytest.mark.parametrize(
    ("key", "value", "problem"),
    [
        ("angular_filter.enabled", True, "expected false with robot point_mass"),
        ("scene.tool", "flat", 'expected "sphere" with robot point_mass'),
        ("map.R_cw", [[1, 0, 0], [0, -1, 0], [0, 0, -1]], "expected no rotation"),
        ("scene.contact_stiffness", 1e7, "expected at most 0.000316"),
        ("point_mass.mass", 0, "expected a finite value > 0"),
        ("point_mass.substeps", 3, "scene.time_step"),
        ("point_controller.force.period", 0.001, "control_period"),
    ],
)
def test_what_it_has_not_is_refused(key, value, problem):
    scenario = dp.load_scenario(SCENE)
    with pytest.raises(dp.ScenarioError) as error:
        scenario.with_overrides({key: value})
    text = str(error.value)
    assert problem in text
    assert "point_mass." in text


def test_the_printed_law_is_the_papers():
    printed = dp.load_scenario(SCENE).with_overrides({"law": "printed"})
    controller = printed.point_controller
    assert (controller.position_stiffness, controller.position_damping) == (100, 20)
    assert not controller.feed_forward
    assert controller.selection_blend_time == 0
    assert not controller.force.passivity.enabled


def test_controller_in_python():
    controller = dp.PointController()
    state = controller.make_state()
    zero = np.zeros(3)
    output = controller.update(
        2.0, zero, [0.01, 0, 0], zero, zero, zero, np.zeros((3, 3)), zero, state
    )
    np.testing.assert_allclose(output.force, [-2.0, 0, 0], atol=1e-14)
    np.testing.assert_allclose(output.motion_force, [-1.0, 0, 0], atol=1e-14)
