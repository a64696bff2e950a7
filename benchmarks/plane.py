# SPDX-License-Identifier: BSD-3-Clause
"""Draws the README's picture, of scene `plane`.

python benchmarks/plane.py docs/images/plane.png
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np

import dual_proxy as dp
from dual_proxy.figures import mark_cut
from dual_proxy.log import signal
from dual_proxy.metrics import normal_error_deg


def draw(run: dp.Run, path: Path) -> None:
    """Draws heights, forces and the normal's error of a run."""
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    log = run.log
    time = log.index.to_numpy()
    scenario = run.scenario
    workspace_map = dp.WorkspaceMap(scenario.map)
    device = np.array(
        [
            workspace_map.robot_proxy(x_h, np.eye(3))[0]
            for x_h in signal(log, "device_position")
        ]
    )
    figure, axes = plt.subplots(3, 1, figsize=(9, 7), sharex=True)
    top, middle, bottom = axes
    top.plot(time, 1e3 * device[:, 2], label="hand, mapped")
    top.plot(time, 1e3 * signal(log, "robot_position")[:, 2], label="robot")
    top.set_ylabel("height, mm")
    middle.plot(time, -signal(log, "sensed_force")[:, 2], lw=0.4, label="sensed")
    middle.plot(time, -signal(log, "reference_force")[:, 2], label="robot's reference")
    middle.plot(time, signal(log, "device_force")[:, 2], label="on the hand")
    middle.set_ylabel("vertical force, N")
    middle.set_ylim(-6, 14)
    bottom.plot(time, normal_error_deg(log), label="error of the normal")
    bottom.set_ylabel("deg")
    bottom.set_ylim(0, 5)
    twin = bottom.twinx()
    twin.plot(time, log["dimension"], color="C3", lw=1, label="dimension")
    twin.set_ylim(0, 3)
    twin.set_yticks([0, 1, 2, 3])
    bottom.set_xlabel("time, s")
    for axis in (middle, bottom):
        mark_cut(axis)
    for axis in (top, middle):
        axis.legend(loc="upper right", frameon=False)
    handles = bottom.get_lines() + twin.get_lines()
    bottom.legend(
        handles, [h.get_label() for h in handles], loc="upper right", frameon=False
    )
    delay_ms = 1e3 * scenario.link.delay
    top.set_title(
        f"scene {scenario.name}, {delay_ms:g} ms each way, seed {scenario.seed}"
    )
    figure.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=100, metadata={"Software": None})
    plt.close(figure)


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs the scene with 50 ms of delay and draws it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("picture", type=Path)
    draw(dp.run("plane", delay=0.05), parser.parse_args(arguments).picture)


if __name__ == "__main__":
    main()
