# SPDX-License-Identifier: BSD-3-Clause
"""A robot side that waits for a push before it follows: right, wrong, none."""

import math
import time
from types import SimpleNamespace

import numpy as np
import pytest

import dual_proxy as dp
from dual_proxy.hardware.arms import SimulatedPanda
from dual_proxy.hardware.events import Events
from dual_proxy.hardware.replay import replay_side
from dual_proxy.hardware.robot_side import RobotSideProcess

# s: for which a busy machine may hold a process up.
BUSY = 0.4


class PushedPanda(SimulatedPanda):
    """A hand pushes its tool point, N, in B; its sensor may have the wrong sign."""

    def __init__(self, scenario, sign=1.0):
        super().__init__(scenario, patience=BUSY)
        self.push = np.zeros(3)
        self._sign = sign

    def _advance(self):
        terms = self._model.calc(self._state.q, self._state.v)
        hand = terms.J_BE[:3].T @ self.push
        self._plant.update(self._sent[-1] - terms.gravity + hand, self._state)

    def wrench(self):
        # What a hand does to the tool passes through the sensor, too.
        wrench = super().wrench()
        push = self._state.pose.R.T @ self.push
        value = wrench.value - [*push, *np.cross([0, 0, 0.1], push)]
        return SimpleNamespace(time=wrench.time, valid=True, value=self._sign * value)


def make_side(arm, scenario, **options):
    return RobotSideProcess(
        scenario,
        arm,
        None,
        push_force=5.0,
        confirm=lambda _: True,
        events=Events("robot", tell=lambda _: None),
        **options,
    )


def push_when_asked(side, arm, then=lambda: None):
    def on_cycle(*_):
        asked = side.events.count("push")
        if asked == 1:
            # As a hand does: more and more.
            rate = np.array([0.0, 0.02, 0.0])
            arm.push = np.minimum(arm.push + rate, [0.0, 10.0, 0.0])
        elif asked == 2:
            then()

    side.on_cycle = on_cycle


def test_it_follows_once_the_force_has_opposed_a_push(tmp_path):
    scenario = dp.load_scenario("plane")
    arm = PushedPanda(scenario)
    log = tmp_path / "log.mcap"
    side = make_side(arm, scenario, log=log)
    held = []

    def then():
        # Without another side it holds, but no more because it is asked to.
        arm.push = np.zeros(3)
        if len(held) < 20:
            held.append(side.state.side.hold)
        else:
            side.stop()

    push_when_asked(side, arm, then)
    assert side.run(30)
    asked, passed = (e.text for e in side.events.all if e.kind == "push")
    assert "with more than 5 N" in asked
    assert passed == "the force is that of the arm on the hand: right"
    assert held[-1] == "no_link"
    assert side.events.count("refused") == 0
    replayed = replay_side(log)
    assert replayed.cycles > 100
    assert replayed.different == 0


def test_a_force_of_the_wrong_sign_is_refused():
    scenario = dp.load_scenario("plane")
    arm = PushedPanda(scenario, sign=-1.0)
    side = make_side(arm, scenario)
    push_when_asked(side, arm)
    with pytest.raises(dp.DriverError, match=r"does not oppose the push \(cosine -"):
        side.run(30)
    kinds = [event.kind for event in side.events.all]
    assert kinds[-2:] == ["refused", "ended"]
    assert side.events.count("follow") == 0


def test_without_a_push_it_ends():
    scenario = dp.load_scenario("plane")
    arm = PushedPanda(scenario)
    side = make_side(arm, scenario, push_time=0.2)
    begin = time.monotonic()
    with pytest.raises(dp.DriverError, match=r"no push of 5 N was sensed within 0.2 s"):
        side.run(30)
    assert time.monotonic() - begin < 20
    assert "push" in [event.kind for event in side.events.all]


def test_the_push_test_of_python_is_that_of_the_driver():
    push = dp.PushTest(force=5, period=0.001)
    p = np.array([0.4, 0.1, 0.3])
    assert push.update(p, np.zeros(3)) == "none"
    pushed = p + np.array([0.003, 0, 0])
    results = [push.update(pushed, [8.0, 0, 0]) for _ in range(100)]
    assert results == 99 * ["none"] + ["failed"]
    assert push.cosine == -1
    for bad in (0, -1, math.nan):
        with pytest.raises(ValueError, match="force"):
            dp.PushTest(force=bad, period=0.001)
