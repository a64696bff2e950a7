# SPDX-License-Identifier: BSD-3-Clause
"""The situations of `dual-proxy bench filter`: what is in them is what they say."""

import numpy as np
import pytest

import dual_proxy as dp
from dual_proxy.bench.filter_situations import SITUATIONS, Situation

TWO_WALLS = ("corner", "wall", "groove", "slot", "chamfer")


def test_trials_go_through_their_values():
    situation = Situation({"friction": (0.1, 0.2), "speed": (0.01, 0.02, 0.03)})
    trials = situation.trials(6)
    assert [trial.seed for trial in trials] == list(range(6))
    assert len({(trial.friction, trial.speed) for trial in trials}) == 6
    assert {trial.sensor_noise for trial in trials} == {0.1, 0.2}
    assert {trial.force_noise for trial in trials} == {0.0}


@pytest.mark.parametrize("name", SITUATIONS)
def test_truth_is_what_the_name_says(name):
    dp.FrictionConeParams(**SITUATIONS[name].cone)
    two = 0.0
    for params in SITUATIONS[name].trials(2):
        trial = dp.run_filter_trial(
            params,
            dp.ForceSpaceParticleFilterParams(num_particles=100, period=0.01),
            params.seed,
        )
        if "free" in name:
            assert not trial.touched.any()
            continue
        contact = np.linalg.norm(trial.true_force, axis=1) >= 0.5
        assert contact.sum() > 200
        assert contact.mean() > 0.5
        assert trial.true_dimension.max() <= 2
        two += (trial.true_dimension[contact] == 2).mean() / 2
    if any(word in name for word in TWO_WALLS):
        assert two > 0.25
    else:
        assert two == 0.0


def test_biased_situations_are_biased():
    for name, situation in SITUATIONS.items():
        biased = any(trial.sensor_bias > 0 for trial in situation.trials(6))
        assert biased == ("bias" in name), name
        spiked = any(trial.spike > 0 for trial in situation.trials(6))
        assert spiked == ("spikes" in name), name
