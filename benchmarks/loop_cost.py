# SPDX-License-Identifier: BSD-3-Clause
"""What the teleoperation loop costs over the simulated arm alone.

python benchmarks/loop_cost.py [--repeats N] [--page docs/benchmarks.md]

Simulates scene `plane` while the tool presses and slides, with the loop fused
into one system and with separate systems, written in Python and, where this
build has them, in C++; with the bare engine; and the same motion of the plant
alone, driven by the logged torques. Prints Markdown: microseconds of processor time
per simulated millisecond, of the loop alone (both sides, link, filter, sensor,
device) and with the log of all signals and true contacts. They take turns, in
short pieces of the same simulated time, as a machine's speed drifts.
"""

from __future__ import annotations

import argparse
import os
import time as clock
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

import dual_proxy as dp
from dual_proxy.bare import BareStation
from dual_proxy.bench.pages import fill_page
from dual_proxy.log import signal
from dual_proxy.panda import add_panda_scene
from dual_proxy.station import Station, build_station

# Simulated time that is measured, s: the tool presses and slides.
BEGIN, END, PIECE = 6.0, 10.0, 0.25
WIRINGS = {"fused": "loop as one system", "systems": "separate systems"}
BARE = "bare engine, with its plant and log"


def make_station(faces: str, wiring: str, logged: bool) -> Station:
    """Builds scene `plane` with LeafSystems of one kind, `python` or `native`."""
    before = os.environ.get("DUAL_PROXY_FACES")
    os.environ["DUAL_PROXY_FACES"] = faces
    try:
        scenario = dp.load_scenario("plane")
        return build_station(scenario, logged=logged, wiring=wiring)
    finally:
        del os.environ["DUAL_PROXY_FACES"]
        if before is not None:
            os.environ["DUAL_PROXY_FACES"] = before


class Plant:
    """The plant alone, driven by the torques that a run logged."""

    def __init__(self, station: Station) -> None:
        log = station.log_frame()
        self._times = log.index.to_numpy()
        self._q: Any = signal(log, "joint_position")
        self._v: Any = signal(log, "joint_velocity")
        torques: Any = signal(log, "torque")
        # A row of the log holds the torque of the period that ends with it. It is
        # taken up at that period's begin: the pieces change half a period earlier.
        self._period = station.scenario.control_period
        hold = PiecewisePolynomial.ZeroOrderHold(
            self._times - 1.5 * self._period, torques.T
        )
        builder = DiagramBuilder()
        scene = add_panda_scene(
            builder, station.scenario.scene, self._q[0], drawn=False
        )
        source = builder.AddSystem(TrajectorySource(hold))
        builder.Connect(source.get_output_port(), scene.actuation_port)
        self._plant = scene.plant
        self.simulator = Simulator(builder.Build())

    def _row(self, time: float) -> int:
        # The controller, and the log, see the state of the step before.
        return int(np.searchsorted(self._times, time + 1.5 * self._period))

    def follow(self, time: float) -> None:
        """Puts the arm where it was in the run. Without a controller the elbow's
        free motion is unstable, so this is needed now and then."""
        root = self.simulator.get_mutable_context()
        context: Any = self._plant.GetMyMutableContextFromRoot(root)
        row = self._row(time)
        if time > BEGIN:
            away = np.abs(self._plant.GetPositions(context) - self._q[row]).max()
            assert away < 1e-3, f"not the motion of the run: {away} rad at {time} s"
        self._plant.SetPositions(context, self._q[row])
        self._plant.SetVelocities(context, self._v[row])


def measure(
    plant: Plant, stations: dict[str, Station], repeats: int
) -> dict[str, list[float]]:
    """Returns the cost of each, us per simulated ms, one value per piece."""
    scenario = dp.load_scenario("plane")
    simulators = {"plant": plant.simulator}
    simulators |= {kind: station.simulator for kind, station in stations.items()}
    costs: dict[str, list[float]] = {name: [] for name in (*simulators, BARE)}

    def time_piece(name: str, advance: Callable[[float], Any], end: float) -> None:
        began = clock.process_time()
        advance(end)
        cost = clock.process_time() - began
        costs[name].append(1e6 * cost / (1e3 * PIECE))

    for _ in range(repeats):
        bare = BareStation(scenario, END + PIECE)
        bare.advance_to(BEGIN)
        for simulator in simulators.values():
            context: Any = simulator.get_system().CreateDefaultContext()
            simulator.reset_context(context)
            if simulator is plant.simulator:
                context.SetTime(BEGIN)
            simulator.Initialize()
            simulator.AdvanceTo(BEGIN)
        for end in np.arange(BEGIN + PIECE, END + PIECE / 2, PIECE).tolist():
            plant.follow(end - PIECE)
            for name, simulator in simulators.items():
                time_piece(name, simulator.AdvanceTo, end)
            time_piece(BARE, bare.advance_to, end)
    return costs


def main(arguments: Sequence[str] | None = None) -> None:
    """Measures and prints the table as Markdown."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--page", type=Path)
    options = parser.parse_args(arguments)
    recorded = make_station("python", "fused", logged=True)
    recorded.advance_to(END + PIECE)
    names = {"python": "Python"}
    if dp.native_available():
        names["native"] = "C++"
    stations = {
        f"{WIRINGS[wiring]} in {name}{', and log' if logged else ''}": make_station(
            faces, wiring, logged
        )
        for faces, name in names.items()
        for wiring in WIRINGS
        for logged in (False, True)
    }
    costs = measure(Plant(recorded), stations, options.repeats)
    plant = np.array(costs["plant"])
    lines = [
        "| | us per simulated ms | over the plant: median (5, 95 %) | x real time |",
        "| --- | --- | --- | --- |",
        f"| plant alone, in contact | {np.median(plant):.1f} | | "
        f"{1e3 / np.median(plant):.1f} |",
    ]
    for name in stations:
        low, middle, high = np.percentile(np.array(costs[name]) - plant, [5, 50, 95])
        lines.append(
            f"| {name} | {np.median(costs[name]):.1f} | "
            f"{middle:.1f} ({low:.1f}, {high:.1f}) | "
            f"{1e3 / np.median(costs[name]):.1f} |"
        )
    bare = np.median(costs[BARE])
    lines.append(f"| {BARE} | {bare:.1f} | | {1e3 / bare:.1f} |")
    table = "\n".join(lines)
    print(table)
    if options.page:
        fill_page(options.page, "loop_cost.py", table)


if __name__ == "__main__":
    main()
