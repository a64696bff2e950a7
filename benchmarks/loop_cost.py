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
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import dual_proxy as dp
from dual_proxy.bare import BareStation
from dual_proxy.bench.closed_loop import station_with_faces, take_turns
from dual_proxy.bench.pages import fill_page
from dual_proxy.bench.recorded_plant import RecordedPlant
from dual_proxy.station import Station

# Simulated time that is measured, s: the tool presses and slides.
BEGIN, END = 6.0, 10.0
WIRINGS = {"fused": "loop as one system", "systems": "separate systems"}
BARE = "bare engine, with its plant and log"


def make_station(faces: str, wiring: str, logged: bool) -> Station:
    """Builds scene `plane` with LeafSystems of one kind, `python` or `native`."""
    station: Station = station_with_faces(
        faces, dp.load_scenario("plane"), logged=logged, wiring=wiring
    )
    return station


def measure(
    plant: RecordedPlant, stations: dict[str, Station], repeats: int
) -> dict[str, list[float]]:
    """Returns the cost of each, us per simulated ms, one value per piece."""
    scenario = dp.load_scenario("plane")
    costs: dict[str, list[float]] = {name: [] for name in ("plant", *stations, BARE)}
    for _ in range(repeats):
        bare = BareStation(scenario, END)
        bare.advance_to(BEGIN)
        plant.start(BEGIN)
        advances: dict[str, Any] = {"plant": plant.simulator.AdvanceTo}
        for name, station in stations.items():
            simulator = station.simulator
            context: Any = simulator.get_system().CreateDefaultContext()
            simulator.reset_context(context)
            simulator.Initialize()
            simulator.AdvanceTo(BEGIN)
            advances[name] = simulator.AdvanceTo
        advances[BARE] = bare.advance_to
        for name, values in take_turns(advances, END, BEGIN, plant.follow).items():
            costs[name] += values.tolist()
    return costs


def main(arguments: Sequence[str] | None = None) -> None:
    """Measures and prints the table as Markdown."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--page", type=Path)
    options = parser.parse_args(arguments)
    recorded = make_station("python", "fused", logged=True)
    recorded.advance_to(END + 0.01)  # The plant takes up torques ahead of the log.
    plant_alone = RecordedPlant(recorded.scenario, recorded.log_frame())
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
    costs = measure(plant_alone, stations, options.repeats)
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
