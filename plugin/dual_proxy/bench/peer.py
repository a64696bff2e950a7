# SPDX-License-Identifier: BSD-3-Clause
"""This package beside what people write today: `dual-proxy bench peer`.

The Panda in MuJoCo with an operational-space controller in NumPy
(`dual_proxy.bench.mujoco_arm`), with MuJoCo's terms and with Pinocchio's, follows
the path of the robot's proxy of a run of scene `plane`.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterable
from pathlib import Path as FilePath
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from dual_proxy.bare import BareStation
from dual_proxy.bench.closed_loop import make_yardstick, station_with_faces, take_turns
from dual_proxy.bench.pages import markdown_table, number_text, optional_text
from dual_proxy.bench.subject import (
    Results,
    Subject,
    by_plan,
    make_axes,
    progress,
    save_axes,
)
from dual_proxy.log import signal
from dual_proxy.native import native_available
from dual_proxy.run import change_scenario
from dual_proxy.scenario import Scenario

__all__ = ["FULL", "QUICK", "SUBJECT", "Plan", "check_peers", "measure", "peer_table"]

Row = dict[str, Any]
Array = NDArray[np.float64]

_MUJOCO = "MuJoCo, NumPy"
_PINOCCHIO = "MuJoCo, NumPy with Pinocchio's terms"
_DEFAULT = "MuJoCo, NumPy, MuJoCo's default contact"
_MUJOCO_ALONE = "MuJoCo's plant alone"
_BARE = "bare engine"
_TELEOPERATION = "plant and teleoperation, with its log"
_CONTROL = "plant and controller"


class Plan(NamedTuple):
    """How much is run."""

    duration: float
    """s."""
    sliding: float
    """s: from when the tool slides, with a reference that is at rest."""


FULL = Plan(duration=14.5, sliding=5.0)
QUICK = Plan(duration=6.0, sliding=5.0)


def check_peers() -> None:
    """Raise ImportError unless there is what this package is held against."""
    for module in ("mujoco", "pinocchio"):
        try:
            importlib.import_module(module)
        except ImportError as error:
            raise ImportError(
                "bench peer: expected mujoco and pin "
                f"(pip install 'drake-dual-proxy[bench]'): {error}",
                name=module,
            ) from None


def measure(plan: Plan) -> list[Row]:
    """Run every contender.

    Returns
    -------
    rows
        Each with `contender`, what it `does`, `us_per_ms` and `yardsticks` (see
        `Cost`; medians of the pieces), and while sliding, as root mean squares,
        `force_N` (true contact force against what the virtual spring asks for,
        down the table's normal) and `along_um` (tool against proxy along the
        table); None where nothing is controlled.

    Raises
    ------
    ImportError
        As `check_peers`.
    """
    check_peers()
    from dual_proxy.bench.mujoco_arm import MujocoArm, Path
    from dual_proxy.station import start_posture

    scenario = change_scenario(
        "plane",
        overrides={"sensor.force_noise_std": 0.0, "sensor.moment_noise_std": 0.0},
    )
    _, q_start = start_posture(scenario)
    first = BareStation(scenario, plan.duration)
    first.advance_to(plan.duration)
    log = first.log_frame()
    path = Path(
        np.array(signal(log, "robot_proxy_position")),
        np.array(signal(log, "robot_proxy_velocity")),
    )

    def make_peer(**options: Any) -> MujocoArm:
        return MujocoArm(scenario, path, q_start, **options)

    recorded = make_peer()
    recorded.advance_to(plan.duration)
    peers = {
        _MUJOCO: make_peer(),
        _PINOCCHIO: make_peer(pinocchio=True),
        _DEFAULT: make_peer(matched=False),
        _MUJOCO_ALONE: make_peer(torques=np.array(recorded.torques)),
    }
    stations = _make_stations(scenario, plan.duration)
    for name in (*stations, *peers):
        progress(name)
    yardstick = make_yardstick(plan.duration)
    costs = take_turns(
        {name: each.advance_to for name, each in (stations | peers).items()}
        | {"yardstick": yardstick.advance_to},
        plan.duration,
    )
    errors = {
        name: _errors_of_log(station.log_frame(), plan.sliding)
        for name, station in stations.items()
    }
    errors |= {
        name: _errors_of_peer(peer, path.positions, scenario, plan.sliding)
        for name, peer in peers.items()
        if peer.torques
    }
    does = dict.fromkeys(stations, _TELEOPERATION) | dict.fromkeys(peers, _CONTROL)
    does[_MUJOCO_ALONE] = "plant"
    return [
        {
            "contender": name,
            "does": does[name],
            "us_per_ms": float(np.median(costs[name])),
            "yardsticks": float(np.median(costs[name] / costs["yardstick"])),
        }
        | errors.get(name, {"force_N": None, "along_um": None})
        for name in does
    ]


def _make_stations(scenario: Scenario, duration: float) -> dict[str, Any]:
    """Return this package's ways to simulate a scenario."""
    faces = {"python": "Drake, loop in Python"}
    if native_available():
        faces = {"native": "Drake, loop in C++"} | faces
    stations: dict[str, Any] = {_BARE: BareStation(scenario, duration)}
    for kind, name in faces.items():
        stations[name] = station_with_faces(kind, scenario)
    return stations


def _rms(values: ArrayLike) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _errors_of_log(log: pd.DataFrame, begin: float) -> dict[str, float]:
    log = log[log.index >= begin]
    force = signal(log, "contact_force") - signal(log, "reference_force")
    position = signal(log, "robot_position") - signal(log, "robot_proxy_position")
    return {
        "force_N": _rms(force[:, 2]),
        "along_um": 1e6 * _rms(np.linalg.norm(position[:, :2], axis=1)),
    }


def _errors_of_peer(
    peer: Any, path: Array, scenario: Scenario, begin: float
) -> dict[str, float]:
    first = round(begin / scenario.control_period)
    positions = np.array(peer.positions)[first:]
    away = positions - path[first : first + len(positions)]
    force = np.array(peer.forces[first:]) - np.array(peer.references[first:])
    return {
        "force_N": _rms(force),
        "along_um": 1e6 * _rms(np.linalg.norm(away[:, :2], axis=1)),
    }


def peer_table(rows: Iterable[Row]) -> str:
    """Return what `measure` found, as Markdown."""
    return markdown_table(
        [
            *("", "does", "us per simulated ms", "x real time", "yardsticks"),
            *("force, N", "along the table, um"),
        ],
        (
            [
                *(row["contender"], row["does"], number_text(row["us_per_ms"])),
                number_text(1e3 / row["us_per_ms"]),
                number_text(row["yardsticks"]),
                *(optional_text(row[key]) for key in ("force_N", "along_um")),
            ]
            for row in rows
        ),
    )


def draw(results: Results, path: FilePath) -> None:
    """Draw the errors over run time."""
    rows = [row for row in results["rows"] if row["force_N"] is not None]
    shown = {"force_N": "force, N", "along_um": "along the table, um"}
    axes = make_axes(1, len(shown), (11, 4.5))
    for axis, (key, title) in zip(axes.flat, shown.items(), strict=True):
        for row in rows:
            axis.loglog(row["yardsticks"], row[key], "o", label=row["contender"])
        axis.set_title(title, fontsize=9)
        axis.set_xlabel("run time, yardsticks")
    axes[0, 0].legend(frameon=False, fontsize=7)
    save_axes(axes, path)


def _measure(quick: bool) -> Results:
    return by_plan(measure, QUICK, FULL)(quick) | {"versions": _versions()}


def _versions() -> dict[str, str]:
    return {
        name: importlib.import_module(name).__version__
        for name in ("mujoco", "pinocchio")
    }


_MARK = "dual-proxy bench peer"
SUBJECT = Subject(
    name="peer",
    marks=(_MARK,),
    measure=_measure,
    tables=lambda results: {_MARK: peer_table(results["rows"])},
    draw=draw,
)
