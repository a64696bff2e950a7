# SPDX-License-Identifier: BSD-3-Clause
"""A heavy haptic device in a whole run, by each method of its controller."""

from __future__ import annotations

import numpy as np
import pytest

import dual_proxy as dp
from dual_proxy.log import signal

HEAVY = {
    "device.device_mass": 4.0,
    "device.device_friction": 1.5,
    "device.max_force": 40.0,
    "haptic_controller.max_force": 40.0,
}


@pytest.fixture(scope="module")
def runs() -> dict[str, dp.Run]:
    return {
        method: dp.run(
            "plane",
            engine="bare",
            delay=0.05,
            duration=14.0,
            overrides={**HEAVY, "haptic_controller.method": method},
        )
        for method in ("open_loop", "force_feedback", "position")
    }


def test_every_method_is_steady(runs):
    for method, run in runs.items():
        assert run.metrics["finite"]
        assert run.metrics["limits_broken"] == [], method
        assert run.metrics["contact_losses"] == 0, method


def test_force_feedback_gives_the_hand_its_force(runs):
    log = runs["force_feedback"].log
    assert "handle_force_z" not in runs["open_loop"].log
    # The mass alone would take 4 kg x 0.1 m/s^2, the friction 1.5 N.
    for part in (log.loc[1.0:3.0], log.loc[6.0:14.0]):
        error = signal(part, "handle_force") - signal(part, "haptic_reference_force")
        assert np.sqrt((error**2).sum(axis=1).mean()) < 0.15


def test_position_holds_the_haptic_proxy(runs):
    def distance(method: str) -> float:
        log = runs[method].log.loc[6.0:14.0]
        apart = signal(log, "device_position") - signal(log, "haptic_proxy_position")
        return float(np.abs(apart[:, 2]).mean())

    assert distance("position") < 0.5 * distance("open_loop")
