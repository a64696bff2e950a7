# SPDX-License-Identifier: BSD-3-Clause
"""What each departure from the printed law does on scene `plane`: the tables of
docs/notes_on_the_paper.md.

python benchmarks/law.py [--page docs/notes_on_the_paper.md]
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import dual_proxy as dp
from dual_proxy.bench.pages import fill_page, markdown_table
from dual_proxy.panda import PandaModel

PRINTED = {"law": "printed"}
# Added one after the other to the printed law; with the last it is the default.
STEPS: dict[str, dict[str, Any]] = {
    "printed": {},
    "+ bumpless hand-over": {"robot_proxy.handover": "bumpless"},
    "+ unit-mass command to the filter": {"controller.unit_mass_motion_force": True},
    "+ motion error capped at 20 mm": {"robot_proxy.max_motion_error": 0.02},
    "+ interpolation and feed-forward": {
        "robot_proxy.interpolate": True,
        "controller.feed_forward": True,
    },
    "+ force gain 1, 100 Hz force filter, passivity, blend, delayed integral": {
        "controller.force_gain": 1.0,
        "controller.force_filter_cutoff": 100.0,
        "controller.passivity": True,
        "controller.selection_blend_time": 0.03,
        "controller.force_integral_delay": 0.1,
    },
    "+ filter `friction_cone`, 100 Hz": {
        "filter.likelihood": "friction_cone",
        "filter.period": 0.01,
    },
    "+ friction fed forward, and the hand's side": {
        "controller.friction_feedback.gain": 0.8,
        "haptic_proxy.unilateral": True,
        "haptic_controller.selection_blend_time": 0.03,
    },
}
# Each alone, from the default law.
SINGLE: dict[str, dict[str, Any]] = {
    "default": {},
    "k_vir_h = 200 N/m as printed (8.1)": {"haptic_proxy.stiffness": 200.0},
    "no interpolation, with feed-forward": {"robot_proxy.interpolate": False},
    "no feed-forward (11.7)": {"controller.feed_forward": False},
    "no passivity controller (11.13)": {"controller.passivity": False},
    "force gain 2.5 as printed (11.13)": {"controller.force_gain": 2.5},
    "friction not fed forward": {"controller.friction_feedback.gain": 0.0},
    "no averaging of poses (8.6)": {"link.average": False},
    "filter at 15 Hz": {"filter.period": 1 / 15},
    "filter `paper` at 15 Hz": {
        "filter.likelihood": "paper",
        "filter.period": 1 / 15,
    },
    "filter `paper` at 15 Hz, scatter 0.01 (8.4)": {
        "filter.likelihood": "paper",
        "filter.period": 1 / 15,
        "filter.scatter_std": 0.01,
    },
    "filter `paper` at 15 Hz, scatter 0.05 (8.4)": {
        "filter.likelihood": "paper",
        "filter.period": 1 / 15,
        "filter.scatter_std": 0.05,
    },
    "filter `paper` at 100 Hz (11.2)": {"filter.likelihood": "paper"},
    "F_h not limited in its rate (8.6)": {"haptic_proxy.force_rate": 1e4},
    "no limit of 10 N on the robot": {"robot_proxy.max_force": 20.0},
}
KEYS = {
    "dimension right": ("dimension_accuracy", 1.0, "{:.3f}"),
    "normal mean, deg": ("normal_error_mean_deg", 1.0, "{:.1f}"),
    "p95, deg": ("normal_error_p95_deg", 1.0, "{:.1f}"),
    "found after, ms": ("detection_latency_ms", 1.0, "{:.0f}"),
    "lost": ("contact_losses", 1.0, "{:.0f}"),
    "contact force max, N": ("contact_force_max_N", 1.0, "{:.0f}"),
    "contact force AC, N": ("contact_force_ac_N", 1.0, "{:.2f}"),
    "free position error, mm": (
        "position_rms_free_delay_compensated_m",
        1e3,
        "{:.1f}",
    ),
}


def lowered(scenario: dp.Scenario, height: float) -> dp.Scenario:
    """Returns the scenario with the table's top, and all above, lower."""
    mapping = scenario.to_mapping()
    drop = mapping["scene"]["table_height"] - height
    mapping["scene"]["table_height"] = height
    mapping["scene"]["start_position"][2] -= drop
    for waypoint in mapping["operator"]["waypoints"]:
        waypoint["position"][2] -= drop
    return dp.Scenario.from_mapping(scenario.name, mapping)


def print_coupling(scenario: dp.Scenario) -> None:
    """Prints the arm's apparent mass where the tool first touches the table."""
    model = PandaModel()
    x, y, _ = scenario.scene.start_position
    p_BE = [x, y, scenario.scene.contact_height]
    q = model.inverse_kinematics(p_BE, q_near=scenario.controller.q_rest)
    terms = model.calc(q, np.zeros(7))
    Lambda, _ = dp.calc_operational_space_inertia(terms.J_BE, terms.mass)
    print(
        f"Table at {scenario.scene.table_height:.2f} m: Lambda_zz = "
        f"{Lambda[2, 2]:.1f} kg, Lambda_xz / Lambda_zz = "
        f"{Lambda[0, 2] / Lambda[2, 2]:.2f}"
    )


def row(name: str, scenario: dp.Scenario, changes: Mapping[str, Any]) -> list[str]:
    """Runs a variant and returns its cells."""
    metrics = dp.run(scenario, overrides=changes).metrics
    cells = [
        "-" if metrics[key] is None else form.format(metrics[key] * factor)
        for key, factor, form in KEYS.values()
    ]
    return [name, *cells]


def main(arguments: Sequence[str] | None = None) -> None:
    """Prints the three tables as Markdown."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--page", type=Path)
    options = parser.parse_args(arguments)
    plane = dp.load_scenario("plane")
    low = lowered(plane, 0.10)
    for scenario in (plane, low):
        print_coupling(scenario)

    def sums() -> dict[str, dict[str, Any]]:
        changes: dict[str, Any] = dict(PRINTED)
        added = {}
        for name, step in STEPS.items():
            changes |= step
            added[name] = dict(changes)
        return added

    for title, scenario, variants in (
        ("law.py: added at 0.40 m", plane, sums()),
        ("law.py: added at 0.10 m", low, sums()),
        ("law.py: single", plane, SINGLE),
    ):
        table = markdown_table(
            ["variant", *KEYS],
            [row(name, scenario, changes) for name, changes in variants.items()],
        )
        print(f"\n{title}:\n\n{table}", flush=True)
        if options.page:
            fill_page(options.page, title, table)


if __name__ == "__main__":
    main()
