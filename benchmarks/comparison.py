# SPDX-License-Identifier: BSD-3-Clause
"""The schemes compared: the tables and the figure of docs/comparison.md.

python benchmarks/comparison.py [--schemes a,b] [--page docs/comparison.md]
    [--picture docs/images/comparison.png]

First scene `plane` over the delays with a firm and a soft hand, as `dual-proxy
compare` runs it. Then what the hand feels:

Felt stiffness: the tool is pressed on a table of a known stiffness, a firm hand
holds still at two depths, and the force on the hand changes by so much per
metre that the handle has moved, in the robot's scale. Felt damping: the hand
moves to and fro in free space, and the force on it is so large for its speed, in
its own scale. What lies between the two a hand can tell apart with a scheme (its
Z-width). All with the bare engine, seed 0.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import dual_proxy as dp
from dual_proxy.bench.pages import fill_page, markdown_table
from dual_proxy.compare import compare, summary_cells
from dual_proxy.log import signal

DELAYS = (0.0, 0.05, 0.15, 0.35, 1.5)
WALLS = (300.0, 1000.0, 30000.0)
# m, below first touch, and s: when the hand has been there for long.
DEPTHS = ((0.02, 20.0), (0.04, 40.0))
# Unsteady beyond this, N: standard deviation in the time that is looked at, s.
MOST_STD = 0.5
HELD = 4.0


def scenario(walls: bool) -> dp.Scenario:
    """Returns scene `plane` with a hand that presses at two depths, or that moves
    to and fro, 10 cm in 4 s, where there is no table."""
    mapping = dp.load_scenario("plane").to_mapping()
    x, y, z = mapping["scene"]["start_position"]
    touch = dp.load_scenario("plane").scene.contact_height
    points = [(0.0, x, z), (1.0, x, z)]
    if walls:
        for depth, time in DEPTHS:
            points += [(time - 16, x, touch - depth), (time, x, touch - depth)]
    else:
        mapping["scene"]["table"] = False
        points += [(3 + 2 * i, x + 0.1 * (i % 2 == 0), z) for i in range(8)]
    mapping["operator"]["waypoints"] = [
        {"time": time, "position": [x, y, z]} for time, x, z in points
    ]
    mapping["duration"] = points[-1][0]
    mapping["extend_for_delay"] = False
    return dp.Scenario.from_mapping("transparency", mapping)


def felt_stiffness(scheme: str, delay: float, wall: float) -> str:
    """N/m, in the robot's scale; "swings" where there is nothing steady."""
    run = dp.run(
        scenario(walls=True),
        scheme=scheme,
        delay=delay,
        engine="bare",
        overrides={"scene.contact_stiffness": wall},
    )
    forces, places = [], []
    for _, time in DEPTHS:
        held = run.log.loc[time - HELD : time - 0.01]
        force = signal(held, "device_force")[:, 2]
        if force.std() > MOST_STD:
            return "swings"
        forces.append(force.mean())
        places.append(signal(held, "device_position")[:, 2].mean())
    way = run.scenario.map.scale * (places[0] - places[1])
    return f"{(forces[1] - forces[0]) / way:.0f}"


def felt_damping(scheme: str, delay: float) -> str:
    """N s/m, in the hand's scale."""
    run = dp.run(scenario(walls=False), scheme=scheme, delay=delay, engine="bare")
    moved = run.log.loc[5.0:]
    force = signal(moved, "device_force")
    velocity = signal(moved, "device_velocity")
    return f"{np.sqrt((force**2).sum() / (velocity**2).sum()):.1f}"


def main(arguments: Sequence[str] | None = None) -> None:
    """Prints the tables as Markdown."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--schemes", default=",".join(dp.Scenario.SCHEMES))
    parser.add_argument("--page", type=Path)
    parser.add_argument("--picture", type=Path)
    options = parser.parse_args(arguments)
    schemes = options.schemes.split(",")

    with tempfile.TemporaryDirectory() as folder:
        table = compare(
            "plane", schemes, DELAYS, ("firm", "soft"), engine="bare", out=folder
        )
        if options.picture:
            shutil.copy(Path(folder) / "errors_firm.png", options.picture)
    tables = {"comparison.py: plane": markdown_table(*summary_cells(table))}
    headers = ["scheme", "delay, ms", "felt damping in the air, N s/m"]
    headers += [f"felt stiffness of {wall:.0f} N/m" for wall in WALLS]
    rows = [
        [
            scheme,
            f"{1e3 * delay:.0f}",
            felt_damping(scheme, delay),
            *(felt_stiffness(scheme, delay, wall) for wall in WALLS),
        ]
        for scheme in schemes
        for delay in DELAYS
    ]
    tables["comparison.py: felt"] = markdown_table(headers, rows)
    for title, text in tables.items():
        print(f"{title}:\n\n{text}\n", flush=True)
        if options.page:
            fill_page(options.page, title, text)


if __name__ == "__main__":
    main()
