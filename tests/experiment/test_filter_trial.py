# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest

import dual_proxy as dp


@pytest.fixture(scope="module")
def trial():
    params = dp.FilterTrialParams(scene="inner_corner", drive="true_selection", seed=1)
    return dp.run_filter_trial(
        params, filter=dp.ForceSpaceParticleFilterParams(period=0.01), seed=2
    )


def test_arrays_have_one_row_per_update(trial):
    n = len(trial)
    assert n > 500
    assert np.diff(trial.time) == pytest.approx(0.01, abs=1e-9)
    for name in ("time", "dimension", "touched", "true_dimension", "direction_error"):
        assert getattr(trial, name).shape == (n,), name
    for name in (
        *("sensed_force", "velocity", "motion_force", "contact_force"),
        *("true_force", "true_normal", "true_axis"),
    ):
        assert getattr(trial, name).shape == (n, 3), name
    assert trial.singular_vectors.shape == (n, 3, 3)
    assert trial.touched.dtype == bool
    assert trial.contacts.shape[1] == trial.second_walls.shape[1] == 2


def test_the_filter_alone_repeats_its_part_of_the_trial(trial):
    alone = dp.ForceSpaceParticleFilter(
        dp.ForceSpaceParticleFilterParams(period=0.01), seed=2
    )
    for i in range(len(trial)):
        alone.update(
            trial.sensed_force[i],
            trial.velocity[i],
            trial.motion_force[i],
            trial.contact_force[i],
        )
        assert alone.dimension == trial.dimension[i]
        assert (alone.singular_vectors == trial.singular_vectors[i]).all()


def test_metrics_are_those_of_the_arrays(trial):
    metrics = dp.FilterTrialMetrics()
    for count in (1, 2):
        metrics.add(trial)
        contact = np.linalg.norm(trial.true_force, axis=1) >= 0.5
        found = contact & (trial.dimension > 0)
        right = contact & (trial.dimension == trial.true_dimension)
        both = found & (trial.dimension == 2) & (trial.true_dimension == 2)
        assert metrics.samples == count * len(trial)
        assert metrics.contact_samples == count * contact.sum()
        assert metrics.right_dimension_samples == count * right.sum()
        error = np.rad2deg(trial.direction_error)
        np.testing.assert_allclose(
            metrics.direction_error, np.tile(error[found], count)
        )
        np.testing.assert_allclose(metrics.axis_error, np.tile(error[both], count))
        assert metrics.detection_latency.size == count * len(trial.contacts)


def test_wrong_arguments_are_named():
    with pytest.raises(ValueError, match="field `scene` expected one of"):
        dp.FilterTrialParams(scene="moon")
    with pytest.raises(ValueError, match="field `friction`"):
        dp.FilterTrialParams(friction=-1)
    with pytest.raises(ValueError, match=r"field `filter\.period`"):
        dp.run_filter_trial(filter=dp.ForceSpaceParticleFilterParams(period=1e-4))
