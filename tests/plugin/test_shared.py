# SPDX-License-Identifier: BSD-3-Clause
"""A planner takes directions over and hands them back, without a jump."""

import numpy as np
import pytest

import dual_proxy as dp
from dual_proxy.log import signal

SCENE = dp.load_scenario("shared")
(TAKEN, BACK), *_ = SCENE.planner.active


def between(log, start, end):
    return log.index.to_series().between(start, end).to_numpy()


@pytest.fixture(scope="module", params=[0.0, 0.15, 0.35])
def run(request):
    return dp.run("shared", engine="bare", delay=request.param)


def test_it_keeps_contact(run):
    metrics = run.metrics
    assert metrics["finite"]
    assert metrics["limits_broken"] == []
    assert metrics["contact_losses"] == 0
    assert metrics["dimension_accuracy"] >= 0.97


def test_nothing_steps(run):
    """From when the contact is there until the hand begins to lift."""
    log = run.log
    limits = SCENE.robot_proxy.limiter
    period = SCENE.control_period
    shared = between(log, TAKEN - 0.1, 16.0)
    force = np.diff(signal(log, "reference_force")[shared], axis=0)
    velocity = signal(log, "robot_proxy_velocity")[shared]
    position = np.diff(signal(log, "robot_proxy_position")[shared], axis=0)
    rate = SCENE.robot_proxy.force_rate
    assert np.linalg.norm(force, axis=1).max() <= rate * period * 1.0001
    assert np.abs(velocity).max() <= limits.max_velocity
    assert np.abs(position).max() <= limits.max_velocity * period * 1.0001
    change = np.abs(np.diff(velocity, axis=0)).max()
    assert change <= limits.max_acceleration * period * 1.0001


def test_the_planner_keeps_the_force_and_scans(run):
    log = run.log
    owned = signal(log, "planner_selection").any(axis=1)
    np.testing.assert_array_equal(owned, between(log, TAKEN + 5e-4, BACK + 5e-4))
    steady = between(log, TAKEN + 0.5, BACK)
    error = signal(log, "contact_force")[steady, 2] - SCENE.planner.force[2]
    assert np.sqrt(np.mean(error**2)) < 0.5
    amplitude = SCENE.planner.scan_amplitude[1]
    across = signal(log, "robot_position")[steady, 1]
    assert np.ptp(across) == pytest.approx(2 * amplitude, rel=0.15)


def test_the_hand_steers_along_and_feels_nothing_of_the_rest(run):
    log, delay = run.log, run.scenario.link.delay
    owned = between(log, TAKEN + delay + 0.7, BACK)
    felt = np.linalg.norm(signal(log, "haptic_reference_force")[owned], axis=1)
    assert felt.max() < 0.01
    # Along x it is where the hand has been, a delay and 1.5 messages earlier.
    late = round((delay + 1.5 / run.scenario.link.rate) / run.scenario.control_period)
    asked = signal(log, "device_position")[:, 0] * run.scenario.map.scale
    asked = np.roll(asked + run.scenario.map.p_cw[0], late)
    error = signal(log, "robot_position")[:, 0] - asked
    assert np.abs(error[owned]).max() < 0.005


def test_the_hand_has_it_back(run):
    """It presses as before it was taken: two springs in series; see `plane`."""
    log, delay = run.log, run.scenario.link.delay
    force = -signal(log, "contact_force")[:, 2]
    before = force[between(log, TAKEN - 0.5, TAKEN)].mean()
    after = force[between(log, 15.5, 16.0)].mean()
    assert before == pytest.approx(6.5, abs=0.5)
    assert after == pytest.approx(before, abs=0.3 + delay)


@pytest.mark.parametrize("seed", range(5))
def test_the_press_does_not_double(seed):
    """As the hand has sunk while it felt nothing."""
    log = dp.run("shared", engine="bare", seed=seed, duration=14.0).log
    force = signal(log, "contact_force")[:, 2]
    before = force[between(log, BACK - 0.5, BACK)].mean()
    after = force[between(log, BACK, BACK + 1.0)]
    assert np.abs(after - before).max() < 1.5


def test_a_scheme_without_selections_has_no_use_for_it():
    with pytest.raises(dp.ScenarioError, match=r"planner\.active: .* position_force"):
        dp.run("shared", engine="bare", scheme="position_force")
