# SPDX-License-Identifier: BSD-3-Clause
"""What the teleoperation loop costs over the simulated arm alone.

python benchmarks/loop_cost.py [--repeats N]

Simulates scene `plane` while the tool presses and slides, with the LeafSystems
written in Python and, where this build has them, with those in C++; and the
same motion of the plant alone, driven by the logged torques. Prints Markdown:
microseconds of wall clock per simulated millisecond. The three take turns, in
short pieces of the same simulated time, since a machine's speed drifts.
"""

from __future__ import annotations

import argparse
import os
import time as clock
from collections.abc import Sequence
from typing import Any

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

import dual_proxy as dp
from dual_proxy.log import signal
from dual_proxy.panda import add_panda_scene
from dual_proxy.station import Station, build_station

# Simulated time that is measured, s: the tool presses and slides.
BEGIN, END, PIECE = 6.0, 10.0, 0.25


def make_station(faces: str) -> Station:
    """Builds scene `plane` with LeafSystems of one kind."""
    before = os.environ.get("DUAL_PROXY_FACES")
    os.environ["DUAL_PROXY_FACES"] = faces
    try:
        return build_station(dp.load_scenario("plane"))
    finally:
        del os.environ["DUAL_PROXY_FACES"]
        if before is not None:
            os.environ["DUAL_PROXY_FACES"] = before


def make_plant(station: Station) -> Simulator:
    """Builds the plant alone, to be driven by the torques that a run logged."""
    log = station.log_frame()
    times = log.index.to_numpy()
    torques: Any = signal(log, "torque")
    # A row of the log holds the torque of the period that ends with it.
    period = station.scenario.scene.time_step
    hold = PiecewisePolynomial.ZeroOrderHold(
        np.append(times - period, times[-1]), np.vstack([torques, torques[-1:]]).T
    )
    builder = DiagramBuilder()
    q_start: Any = signal(log, "joint_position")[0]
    scene = add_panda_scene(builder, station.scenario.scene, q_start, drawn=False)
    source = builder.AddSystem(TrajectorySource(hold))
    builder.Connect(source.get_output_port(), scene.actuation_port)
    simulator = Simulator(builder.Build())
    simulator.Initialize()
    # Its motion is that of the run.
    simulator.AdvanceTo(BEGIN)
    plant = scene.plant
    q: Any = plant.GetPositions(plant.GetMyContextFromRoot(simulator.get_context()))
    row = np.searchsorted(times, BEGIN + period / 2)
    np.testing.assert_allclose(q, signal(log, "joint_position")[row], atol=1e-5)
    simulator.reset_context(simulator.get_system().CreateDefaultContext())
    simulator.Initialize()
    return simulator


def measure(simulators: dict[str, Simulator], repeats: int) -> dict[str, list[float]]:
    """Returns the cost of each, us per simulated ms, one value per piece."""
    costs: dict[str, list[float]] = {name: [] for name in simulators}
    for _ in range(repeats):
        for simulator in simulators.values():
            context = simulator.get_system().CreateDefaultContext()
            simulator.reset_context(context)
            simulator.Initialize()
            simulator.AdvanceTo(BEGIN)
        for end in np.arange(BEGIN + PIECE, END + PIECE / 2, PIECE):
            for name, simulator in simulators.items():
                began = clock.perf_counter()
                simulator.AdvanceTo(float(end))
                cost = clock.perf_counter() - began
                costs[name].append(1e6 * cost / (1e3 * PIECE))
    return costs


def main(arguments: Sequence[str] | None = None) -> None:
    """Measures and prints the table as Markdown."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args(arguments)
    kinds = ["python", *(["native"] if dp.native_available() else [])]
    stations = {kind: make_station(kind) for kind in kinds}
    recorded = stations["python"]
    recorded.advance_to(END + PIECE)
    simulators = {"plant": make_plant(recorded)}
    simulators |= {kind: station.simulator for kind, station in stations.items()}
    costs = measure(simulators, options.repeats)
    plant = np.array(costs["plant"])
    over = {kind: np.array(costs[kind]) - plant for kind in kinds}
    print("| | us per simulated ms | over the plant, median (5 %, 95 %) | ratio |")
    print("| --- | --- | --- | --- |")
    print(f"| plant alone, in contact | {np.median(plant):.1f} | | |")
    for kind in kinds:
        low, middle, high = np.percentile(over[kind], [5, 50, 95])
        ratio = middle / np.median(over["python"])
        print(
            f"| LeafSystems in {'Python' if kind == 'python' else 'C++'} | "
            f"{np.median(costs[kind]):.1f} | {middle:.1f} ({low:.1f}, {high:.1f}) | "
            f"{ratio:.3f} |"
        )


if __name__ == "__main__":
    main()
