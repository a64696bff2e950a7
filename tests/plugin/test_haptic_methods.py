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


def test_position_makes_the_hand_feel_more_unless_the_robots_spring_is_matched(runs):
    def share(run: dp.Run) -> float:
        log = run.log.loc[12.0:14.0]
        hand, robot = (
            np.linalg.norm(signal(log, name), axis=1).mean()
            for name in ("device_force", "reference_force")
        )
        return float(hand / robot)

    scenario = runs["position"].scenario
    stiffness = scenario.haptic_controller.position_stiffness
    matched = scenario.map.scale * scenario.robot_proxy.stiffness
    assert share(runs["open_loop"]) == pytest.approx(1.0, abs=0.05)
    assert share(runs["position"]) == pytest.approx(stiffness / matched, rel=0.05)
    equal = dp.run(
        scenario,
        engine="bare",
        duration=14.0,
        overrides={"robot_proxy.stiffness": stiffness / scenario.map.scale},
    )
    assert share(equal) == pytest.approx(1.0, abs=0.05)
