# SPDX-License-Identifier: BSD-3-Clause
"""The scenes that come with the package do what they were made for."""

import numpy as np
import pytest

import dual_proxy as dp
from dual_proxy.log import signal


def changes(log):
    """The true dimensions one after the other, none shorter than 0.3 s."""
    truth = signal(log, "contact_dimension")
    ends = np.append(np.flatnonzero(np.diff(truth)), len(truth) - 1)
    steady = truth[ends[np.diff(ends, prepend=-1) > 300]]
    return steady[np.diff(steady, prepend=-1) != 0].astype(int).tolist()


@pytest.mark.parametrize(
    ("scene", "dimensions", "right", "normal_deg", "force_n"),
    [
        ("sim_cylinder", [0, 1, 0], 0.99, 2.0, 12.0),
        ("sim_cylinder_wall", [0, 1, 2, 1, 0], 0.98, 5.0, 18.0),
        ("sim_surfaces", [0, 1, 2, 1, 0], 0.99, 2.0, 12.0),
        ("inner_corner", [0, 1, 2, 1, 0], 0.985, 3.0, 15.0),
        ("outer_corner", [0, 1, 0], 0.995, 2.0, 12.0),
    ],
)
def test_scene(scene, dimensions, right, normal_deg, force_n):
    run = dp.run(scene, engine="bare")
    metrics = run.metrics
    assert metrics["finite"]
    assert metrics["limits_broken"] == []
    assert metrics["contact_losses"] == 0
    assert metrics["dimension_accuracy"] > right
    assert metrics["normal_error_mean_deg"] < normal_deg
    assert metrics["contact_force_max_N"] < force_n
    assert changes(run.log) == dimensions


def test_force_turns_over_the_outer_edge():
    log = dp.run("outer_corner", engine="bare").log
    force = signal(log, "contact_force")
    on_face = log.index.to_series().between(4.2, 5.0).to_numpy()
    on_top = log.index.to_series().between(11.0, 11.6).to_numpy()
    y, z = force[on_face, 1].mean(), force[on_top, 2].mean()
    assert y > 3.0
    assert z < -3.0
    assert abs(force[on_face, 2].mean()) < 0.35 * y
    assert abs(force[on_top, 1].mean()) < 0.35 * -z


def test_remote_ultrasound_over_a_bad_link():
    run = dp.run("remote_ultrasound", engine="bare")
    metrics, log = run.metrics, run.log
    assert metrics["finite"]
    assert metrics["limits_broken"] == []
    assert metrics["dimension_accuracy"] > 0.97
    assert metrics["contact_losses"] <= 1  # That of the outage.
    assert metrics["contact_force_max_N"] < 12.0
    lost = log["haptic_link_status"] == int(dp.LinkStatus.LOST)
    assert 0.5 < lost.sum() * 1e-3 < 2.5
    free = lost & (lost.rolling(101).sum() > 100)
    assert np.abs(signal(log[free], "device_force")).max() == 0.0
    # It comes back without a hit.
    recovered = log.index[lost][-1]
    assert signal(log.loc[recovered:], "contact_force").max() < 12.0


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("scene", ["sim_cylinder_wall", "sim_surfaces", "inner_corner"])
def test_what_the_hand_feels_does_not_step(scene, seed):
    """Where surfaces come and go, too, into which nothing is to pull it."""
    log = dp.run(scene, engine="bare", seed=seed).log
    steps = np.diff(signal(log, "device_force"), axis=0)
    assert np.linalg.norm(steps, axis=1).max() < 0.1


@pytest.mark.parametrize("delay", [0.0, 0.35, 1.5])
def test_the_hand_is_never_pulled_into_the_table(delay):
    log = dp.run("plane", delay=delay, engine="bare").log
    assert log["device_force_z"].max() > 5.0
    assert log["device_force_z"].min() > -0.01
    # Nor does what it feels step, at touch or anywhere: 1.2 N as printed.
    steps = np.diff(signal(log, "device_force"), axis=0)
    assert np.linalg.norm(steps, axis=1).max() < 0.1
