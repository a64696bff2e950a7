# SPDX-License-Identifier: BSD-3-Clause
"""What each departure from the printed law does on scene `plane`, and what both
readings of the paper do where it is inconsistent: the tables of
docs/notes_on_the_paper.md.

python benchmarks/law.py [--page docs/notes_on_the_paper.md]
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import dual_proxy as dp
from dual_proxy.bench.pages import fill_page, markdown_table
from dual_proxy.log import signal
from dual_proxy.panda import PandaModel

Array = NDArray[np.float64]

PRINTED = {"law": "printed"}
PAPER_FILTER = {"filter.likelihood": "paper", "filter.period": 1 / 15}
NO_JERK_LIMIT = {
    "robot_proxy.limiter.max_jerk": 0.0,
    "robot_proxy.limiter.max_angular_jerk": 0.0,
}
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
    "+ jerk limited": {
        "robot_proxy.limiter.max_jerk": 100.0,
        "robot_proxy.limiter.max_angular_jerk": 200.0,
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
        # What does not show on `plane`.
        "robot_proxy.recovery_speed": 0.06,
        "angular_filter.method": "pressure_centre",
        "angular_filter.period": 0.01,
    },
}
# Each alone, from the default law.
SINGLE: dict[str, dict[str, Any]] = {
    "default": {},
    "no interpolation, with feed-forward": {"robot_proxy.interpolate": False},
    "jerk not limited": NO_JERK_LIMIT,
    "neither of both": {"robot_proxy.interpolate": False, **NO_JERK_LIMIT},
    "no feed-forward (11.7)": {"controller.feed_forward": False},
    "no passivity controller (11.13)": {"controller.passivity": False},
    "force gain 2.5 as printed (11.13)": {"controller.force_gain": 2.5},
    "friction not fed forward": {"controller.friction_feedback.gain": 0.0},
    "filter at 15 Hz": {"filter.period": 1 / 15},
    "filter `paper` at 15 Hz": PAPER_FILTER,
    "filter `paper` at 100 Hz (11.2)": {"filter.likelihood": "paper"},
    "no limit of 10 N on the robot": {"robot_proxy.max_force": 20.0},
}
# Both readings, or more where a number is missing: what is set, and the scenes.
READINGS: dict[str, tuple[dict[str, Any], tuple[str, ...]]] = {
    "1: k_vir_h = scale x k_vir_r": ({}, ("plane",)),
    "1: k_vir_h = 200 N/m, printed": ({"haptic_proxy.stiffness": 200.0}, ("plane",)),
    "1: the same, robot not limited to 10 N": (
        {"haptic_proxy.stiffness": 200.0, "robot_proxy.max_force": 30.0},
        ("plane",),
    ),
    "2: dimension clamped": (
        PAPER_FILTER,
        ("plane", "sim_cylinder_wall", "inner_corner"),
    ),
    "2: dimension as printed": (
        {**PAPER_FILTER, "filter.dimension_rule": "printed"},
        ("plane", "sim_cylinder_wall", "inner_corner"),
    ),
    **{
        f"4: scatter {std:g}": (
            {**PAPER_FILTER, "filter.scatter_std": std},
            ("plane", "sim_cylinder", "inner_corner"),
        )
        for std in (0.01, 0.025, 0.05)
    },
    "6: limited rates, mean poses": ({}, ("plane",)),
    "6: F_h at any rate": ({"haptic_proxy.force_rate": 1e4}, ("plane",)),
    "6: F_r at any rate": ({"robot_proxy.force_rate": 1e4}, ("plane",)),
    "6: newest pose in place of the mean": ({"link.average": False}, ("plane",)),
    "6: integral from the first instant": (
        {"controller.force_integral_delay": 0.0},
        ("plane",),
    ),
}
# With the bare engine.
SEEDS = range(5)
# The scenes, and the laws, in which updates without any likely particle are
# counted.
COUNTED = ("plane", "inner_corner", "sim_cylinder", "sim_cylinder_wall", "sim_surfaces")
COUNTED_LAWS = {"filter `paper`": PAPER_FILTER, "printed law": PRINTED}
# Where F_s is given to the filter with the other sign.
NEGATED = ("plane", "inner_corner", "sim_cylinder")
NEGATED_FILTERS: dict[str, dict[str, Any]] = {
    "`paper`": PAPER_FILTER,
    "`friction_cone`": {},
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


def felt(run: dp.Run) -> dict[str, float]:
    """N, N and N/ms: what robot and hand press with where there is contact, the
    median over it, and the largest step of the hand's force."""
    hand = signal(run.log, "device_force")
    robot = np.linalg.norm(signal(run.log, "contact_force"), axis=1)
    contact = robot > 0.5
    return {
        "robot presses, N": float(np.median(robot[contact])),
        "hand feels, N": float(np.median(np.linalg.norm(hand[contact], axis=1))),
        "step at the hand, N/ms": float(
            np.linalg.norm(np.diff(hand, axis=0), axis=1).max()
        ),
    }


def readings_table() -> str:
    """What READINGS come to, the mean over the seeds."""
    keys = {name: KEYS[name] for name in KEYS if name != "contact force AC, N"}
    rows = []
    for name, (changes, scenes) in READINGS.items():
        for scene in scenes:
            runs = [
                dp.run(scene, overrides=changes, seed=seed, engine="bare")
                for seed in SEEDS
            ]
            cells = []
            for key, factor, form in keys.values():
                values = [run.metrics[key] for run in runs]
                known = [value * factor for value in values if value is not None]
                if key == "contact_losses":
                    form = "{:.1f}"
                cells.append(form.format(np.mean(known)) if known else "-")
            forces = [felt(run) for run in runs]
            cells += [f"{np.mean([f[key] for f in forces]):.2f}" for key in forces[0]]
            rows.append([name, scene, *cells])
    return markdown_table(["reading", "scene", *keys, *forces[0]], rows)


def replay(
    run: dp.Run, sign: float = 1.0
) -> Iterator[tuple[int, str, dp.ForceSpaceParticleFilter]]:
    """Gives the filter alone what a run's filter got, but F_s times `sign`.

    Yields after each update the row of the log, what the update came to, and the
    filter.
    """
    params = run.scenario.filter
    step = run.scenario.controller.period
    dut = dp.ForceSpaceParticleFilter(params, seed=run.scenario.seed)
    names = ("sensed_force", "robot_velocity", "motion_force", "force_space_force")
    inputs = [signal(run.log, name) for name in names]
    start = 0
    for update in range(1, int(len(run.log) * step / params.period)):
        end = round(update * params.period / step)
        means = [values[start:end].mean(axis=0) for values in inputs]
        means[0] = sign * means[0]
        yield end - 1, dut.update(*means), dut
        start = end


def resample_as_printed(particles: Array, weights: Array, r: float) -> Array:
    """Algorithm 2 in the arithmetic of IEEE 754, particles as columns."""
    count = particles.shape[1]
    with np.errstate(invalid="ignore"):
        cumulative = np.cumsum(weights) / np.sum(weights)
    chosen = []
    k = 0
    for i in range(count):
        while cumulative[k] < (i + r) / count:
            k += 1
        chosen.append(k)
    return particles[:, chosen]


def angle_deg(a: Array, b: Array) -> float:
    """The angle between two unit vectors."""
    return float(np.degrees(np.arccos(np.clip(a @ b, -1.0, 1.0))))


def all_weights_zero_table() -> str:
    """How often nothing is likely, and what then is left of a contact."""
    rows = []
    for scene in COUNTED:
        for law, changes in COUNTED_LAWS.items():
            updates = counted = replayed = 0
            kept, printed, different = [], [], []
            for seed in SEEDS:
                run = dp.run(scene, overrides=changes, seed=seed, engine="bare")
                counted += int(run.log["filter_all_weights_zero"].iloc[-1])
                normals = signal(run.log, "contact_normal")
                for i, status, dut in replay(run):
                    updates += 1
                    if status != "all_weights_zero" or dut.dimension == 0:
                        continue
                    replayed += 1
                    moved = dut.particles
                    left = resample_as_printed(moved, np.zeros(moved.shape[1]), 0.5)
                    different.append(np.unique(left, axis=1).shape[1])
                    if normals[i].any():
                        kept.append(angle_deg(dut.contact_normals[:, 0], normals[i]))
                        printed.append(angle_deg(left[:, 0], normals[i]))
            cells = [
                f"{np.mean(values):.0f}" if values else "-"
                for values in (different, kept, printed)
            ]
            rows.append([scene, law, f"{updates}", f"{counted}", f"{replayed}", *cells])
    head = [
        *("scene", "law", "updates", "nothing likely", "in a contact that was found"),
        "printed: different particles left",
        "kept: U1 off, deg",
        "printed: U1 off, deg",
    ]
    return markdown_table(head, rows)


def sign_table() -> str:
    """What the filter says of the forces of a run, and of the same with the other
    sign."""
    rows = []
    for scene in NEGATED:
        for name, changes in NEGATED_FILTERS.items():
            run = dp.run(scene, overrides=changes, engine="bare")
            dimensions = signal(run.log, "contact_dimension").ravel()
            normals = signal(run.log, "contact_normal")
            cells = []
            for sign in (1.0, -1.0):
                right, angles = [], []
                for i, _, dut in replay(run, sign):
                    if dimensions[i] == 0:
                        continue
                    right.append(dut.dimension == dimensions[i])
                    if dut.dimension == 1 and dimensions[i] == 1:
                        angles.append(angle_deg(dut.contact_normals[:, 0], normals[i]))
                cells.append(f"{np.mean(right):.3f}")
                cells.append(f"{np.mean(angles):.1f}" if angles else "-")
            rows.append([scene, name, *cells])
    head = ["scene", "filter", "dimension right", "normal mean, deg"]
    head += ["F_s negated: dimension right", "F_s negated: normal mean, deg"]
    return markdown_table(head, rows)


def main(arguments: Sequence[str] | None = None) -> None:
    """Prints the tables as Markdown."""
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

    def publish(title: str, table: str) -> None:
        print(f"\n{title}:\n\n{table}", flush=True)
        if options.page:
            fill_page(options.page, title, table)

    for title, scenario, variants in (
        ("law.py: added at 0.40 m", plane, sums()),
        ("law.py: added at 0.10 m", low, sums()),
        ("law.py: single", plane, SINGLE),
    ):
        table = markdown_table(
            ["variant", *KEYS],
            [row(name, scenario, changes) for name, changes in variants.items()],
        )
        publish(title, table)
    publish("law.py: readings", readings_table())
    publish("law.py: all weights zero", all_weights_zero_table())
    publish("law.py: sign of F_s", sign_table())


if __name__ == "__main__":
    main()
