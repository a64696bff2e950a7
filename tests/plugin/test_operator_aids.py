# SPDX-License-Identifier: BSD-3-Clause
"""A clutch in a whole run: the hand goes back while the robot presses on."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import dual_proxy as dp
from dual_proxy.log import signal
from dual_proxy.scenario import SCHEMES

# The hand slides along the table, 2.5 x faster in the robot's workspace, s.
PRESSED, RELEASED = 6.0, 7.0
# All that was under way has arrived, and the hand is free, s.
SETTLED = PRESSED + 0.4
NEW_COLUMNS = ("handle_position", "clutched", "force_gain", "fixture_force")


def run(**overrides) -> dp.Run:
    return dp.run(
        "plane",
        engine="bare",
        duration=9.0,
        delay=0.05,
        scheme=overrides.pop("scheme", "dual_proxy"),
        overrides=overrides.pop("overrides", {}),
    )


@pytest.fixture(scope="module")
def clutched() -> dp.Run:
    return run(overrides={"operator.clutch": [[PRESSED, RELEASED]]})


def test_robot_holds_its_place_and_its_force(clutched):
    log = clutched.log.loc[SETTLED:RELEASED]
    robot = signal(log, "robot_position")
    hand = signal(log, "handle_position")
    assert np.ptp(robot, axis=0).max() < 1e-3
    assert np.ptp(2.5 * hand[:, 0]) > 0.01
    assert (log["contact_dimension"] == 1).all()
    before = clutched.log.loc[PRESSED - 0.5 : PRESSED, "contact_force_z"].mean()
    assert before < -4.0
    assert log["contact_force_z"].mean() == pytest.approx(before, rel=0.1)


def test_hand_is_free_and_engages_without_a_jump(clutched):
    log = clutched.log
    pressed = log.loc[PRESSED + 0.15 : RELEASED - 1e-6]
    assert pressed["clutched"].all()
    assert not signal(pressed, "device_force").any()
    steps = np.linalg.norm(np.diff(signal(log, "device_position"), axis=0), axis=1)
    assert steps.max() < 1e-4
    force = signal(log.loc[RELEASED - 0.01 : RELEASED + 1.0], "device_force")
    assert np.linalg.norm(force, axis=1)[:10].max() < 1e-9
    assert np.linalg.norm(np.diff(force, axis=0), axis=1).max() < 0.05
    # The hand has gone to where it means to be: now both springs, its own and the
    # proxy's, share what the proxy's alone was stretched by.
    before = signal(log.loc[PRESSED - 0.5 : PRESSED], "haptic_reference_force")[:, 2]
    after = signal(log.loc[RELEASED + 0.9 : RELEASED + 1.0], "haptic_reference_force")
    share = 600 / (600 + 1250)
    assert after[:, 2].mean() == pytest.approx(share * before.mean(), rel=0.1)


def test_robot_goes_on_beside_the_path(clutched):
    log = clutched.log.loc[8.5:]
    map_ = clutched.scenario.map
    ahead = 2.5 * (signal(log, "handle_position") - signal(log, "device_position"))
    assert pytest.approx(np.eye(3)) == map_.R_DB
    # As far as the hand went while it was free.
    assert ahead[:, 0].min() > 0.02
    np.testing.assert_allclose(ahead, ahead[:1].repeat(len(ahead), axis=0), atol=1e-9)
    assert clutched.metrics["finite"]
    assert clutched.metrics["limits_broken"] == []
    assert clutched.metrics["contact_losses"] == 0


def test_every_scheme_has_it():
    for scheme in SCHEMES:
        log = run(
            scheme=scheme, overrides={"operator.clutch": [[PRESSED, RELEASED]]}
        ).log
        sent = signal(log.loc[PRESSED : RELEASED - 1e-6], "device_position")
        assert not np.ptp(sent, axis=0).any()


def test_buttons_that_nobody_presses_change_nothing():
    plain = run().log
    assert not [c for c in plain.columns if c.startswith(NEW_COLUMNS)]
    aided = run(overrides={"operator_aids.buttons": True}).log
    added = [c for c in aided.columns if c.startswith(NEW_COLUMNS)]
    assert set(aided.columns) == {*plain.columns, *added}
    pd.testing.assert_frame_equal(aided[plain.columns], plain, check_exact=True)


def test_force_scale_takes_over_during_a_run():
    log = run(overrides={"operator.force_scale": [[PRESSED, 0.5]]}).log
    late = log.loc[7.0:8.0]
    felt = signal(late, "haptic_reference_force")
    assert late["force_gain"].unique() == pytest.approx([0.5])
    # The hand, pushed back less, goes deeper, so that it is more than one half.
    before = signal(log.loc[5.5:6.0], "haptic_reference_force")[:, 2].mean()
    assert 0.5 * before < felt[:, 2].mean() < 0.9 * before


def test_guidance_and_wall_act_in_a_run():
    log = run(
        overrides={
            "operator_aids.guidance": {
                "shape": "plane",
                "direction": [1.0, 0.0, 0.0],
                "stiffness": 300.0,
            }
        }
    ).log
    force = signal(log, "fixture_force")
    assert np.abs(force).max() <= 3.0 + 1e-9
    # Sliding along x it is pulled back.
    assert force[-1, 0] < -1.0
    assert not force[:, 1:].any()


def test_problems_name_the_field():
    with pytest.raises(dp.ScenarioError, match=r"operator\.clutch\[0\]\[1\]: .*start"):
        run(overrides={"operator.clutch": [[2.0, 1.0]]})
    with pytest.raises(dp.ScenarioError, match=r"guidance\.direction"):
        run(
            overrides={
                "operator_aids.guidance": {"shape": "line", "direction": [0, 0, 0]}
            }
        )
