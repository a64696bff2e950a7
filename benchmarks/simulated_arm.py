# SPDX-License-Identifier: BSD-3-Clause
"""What a step of the arm that is simulated without Drake costs.

python benchmarks/simulated_arm.py [--repeats N]

A Panda with a ball or a flat tool of four balls hangs in the air, presses on a
table, slides on it, or is pressed into a corner. Prints Markdown: microseconds of
wall clock per step of 1 ms, the least of some repeats as a machine has other
things to do, model terms included; the last column is those terms alone.
"""

from __future__ import annotations

import argparse
import time as clock
from collections.abc import Callable

import numpy as np

import dual_proxy as dp
from dual_proxy.bench.pages import markdown_table
from dual_proxy.panda import R_BE_DOWN, PandaModel

HEIGHT = 0.1  # m, of the table.
STEPS = 400
BALLS = {
    "ball": np.zeros((3, 1)),
    "flat": 0.02 * np.array([[-1, 1, -1, 1], [-1, -1, 1, 1], [0, 0, 0, 0]]),
}
# What pushes the tool, N, and its speed along the table, m/s.
CASES = {
    "in the air": ([0.0, 0.0, 0.0], 0.0),
    "presses": ([0.0, 0.0, -8.0], 0.0),
    "slides": ([0.0, 0.0, -8.0], 0.05),
    "in a corner": ([0.0, 6.0, -8.0], 0.0),
}


def make_arm(model: PandaModel, balls: np.ndarray) -> dp.SimulatedArm:
    """An arm over a table, beside a wall at the ball that is nearest to it."""
    common = {"stiffness": 3e4, "dissipation": 10.0, "friction": 0.3}
    table = dp.ContactSurfaceParams(position=[0, 0, HEIGHT], **common)
    wall = dp.ContactSurfaceParams(
        position=[0, 0.02 + balls[1].max(), 0],
        rotation=[[1, 0, 0], [0, 0, -1], [0, 1, 0]],
        **common,
    )
    return dp.SimulatedArm(
        dp.SimulatedArmParams(p_EBall=balls),
        model.arm_params,
        dp.ContactSceneParams(surfaces=[table, wall], tool_radius=0.01),
    )


def time_per_step(
    model: PandaModel, arm: dp.SimulatedArm, push: list[float], speed: float
) -> float:
    """Seconds per step, once the tool has come to where it is to be."""
    height = HEIGHT + (0.011 if push[2] else 0.1)
    state = arm.make_state(model.inverse_kinematics([0.45, 0.0, height]))
    spent = 0.0
    for i in range(2 * STEPS):
        terms = model.calc(state.q, state.v)
        twist = state.velocity
        error = np.sum(np.cross(R_BE_DOWN.T, terms.R_BE.T), axis=0) / 2
        force = np.array(push) - 20 * twist[:3]
        force[0] += 200 * (speed - twist[0])
        wrench = np.concatenate([force, -150 * error - 3 * twist[3:]])
        torque = terms.J_BE.T @ wrench - terms.gravity + terms.bias - state.v
        start = clock.perf_counter()
        arm.update(torque, state)
        if i >= STEPS:
            spent += clock.perf_counter() - start
    assert bool(state.contact_truth[6]) == bool(push[2])
    return spent / STEPS


def least(repeats: int, measure: Callable[[], float]) -> str:
    """The least of some measurements, in microseconds."""
    return f"{1e6 * min(measure() for _ in range(repeats)):.1f}"


def time_of_terms(model: PandaModel) -> float:
    """Seconds for the model terms alone."""
    arm = dp.ArmModel(model.arm_params)
    q = model.inverse_kinematics([0.45, 0.0, 0.2])
    v = np.ones(7)
    start = clock.perf_counter()
    for _ in range(STEPS):
        arm.calc(q, v)
    return (clock.perf_counter() - start) / STEPS


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=10)
    repeats = parser.parse_args().repeats
    model = PandaModel()
    terms = least(repeats, lambda: time_of_terms(model))
    rows = []
    for name, balls in BALLS.items():
        arm = make_arm(model, balls)
        times = [
            least(repeats, lambda arm=arm, case=case: time_per_step(model, arm, *case))
            for case in CASES.values()
        ]
        rows.append([name, *times, terms])
    print(markdown_table(["tool", *CASES, "terms"], rows))


if __name__ == "__main__":
    main()
