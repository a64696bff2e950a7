# SPDX-License-Identifier: BSD-3-Clause
"""What a run is judged by, from its log and scenario alone.

All truth comes from the simulator's contacts, never from the filter. The
*interaction* is the time with a true contact force above 0.5 N; true free
directions are those orthogonal to the true contact normal. The *hand presses*
while its intended position lies beyond the surface that was touched last.
*Steady contact* runs from first contact + 3 x delay + 1 s until the hand begins
to lift; where the hand presses several times, each time counts.

A metric that cannot be given is None (null in JSON): there was no contact, or a
value that it needs is not finite. `finite` says whether the latter happened.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dual_proxy.log import signal

if TYPE_CHECKING:
    from dual_proxy.scenario import Scenario

__all__ = [
    "METRICS",
    "Metric",
    "compute_metrics",
    "device_in_robot_frame",
    "format_metric",
    "normal_error_deg",
]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: True contact force above which the tool counts as touching, N.
CONTACT_FORCE = 0.5
#: True contact force below which a contact counts as lost, N.
LOST_FORCE = 0.05
#: A contact is new if there was none for so long before it, s.
NEW_CONTACT_PAUSE = 0.1
#: The hand lifts when it moves out of the surface faster than this, m/s.
LIFT_SPEED = 1e-3
#: Window of the moving average that the `_ac_` metrics remove, s.
AC_WINDOW = 0.5


class Metric(NamedTuple):
    """What a metric means."""

    unit: str
    description: str


#: The keys of metrics.json, in order.
METRICS: dict[str, Metric] = {
    "position_rms_free_m": Metric(
        "m",
        "robot against mapped device during the interaction, in the true free "
        "directions: RMS per axis of B, then the mean over the axes, each "
        "weighted by how much of it was free",
    ),
    "position_rms_free_delay_compensated_m": Metric(
        "m", "the same, against the device as it was one delay ago"
    ),
    "position_rms_contact_m": Metric(
        "m", "robot against mapped device along the true normal, RMS"
    ),
    "force_tracking_rms_N": Metric(
        "N", "RMS of Omega_f (F_s - F_r) while the filter's dimension is not 0"
    ),
    "haptic_force_rms_free_N": Metric(
        "N",
        "RMS of the force on the hand in the true free directions during the "
        "interaction",
    ),
    "haptic_force_std_contact_N": Metric(
        "N",
        "standard deviation of the force on the hand along the true normal in "
        "steady contact",
    ),
    "haptic_force_max_N": Metric("N", "largest force on the hand"),
    "contact_force_max_N": Metric("N", "largest true contact force"),
    "normal_error_mean_deg": Metric(
        "deg",
        "angle between the filter's first direction and the true normal while "
        "both are there; with two true normals or more, between their resultant "
        "and the estimated force space",
    ),
    "normal_error_p95_deg": Metric("deg", "95th percentile of that angle"),
    "dimension_accuracy": Metric(
        "", "share of the interaction with the true dimension, onset included"
    ),
    "detection_latency_ms": Metric(
        "ms",
        "from the onset of a contact until the filter's dimension is not 0 (or "
        "the contact's end); mean over the onsets",
    ),
    "contact_losses": Metric(
        "", "times the true contact broke while the hand was pressing"
    ),
    "haptic_force_ac_N": Metric(
        "N",
        "RMS of the force on the hand in steady contact, less its moving average "
        "over 0.5 s",
    ),
    "contact_force_ac_N": Metric("N", "the same of the true contact force"),
    "observed_energy_min_J": Metric(
        "J", "least energy that the passivity observer saw"
    ),
    "link_messages_dropped": Metric(
        "", "messages refused by both sides: too old or out of order"
    ),
    "finite": Metric("", "no NaN or infinity anywhere in the log"),
    "sim_s": Metric("s", "simulated time"),
    "wall_s": Metric("s", "time it took"),
    "real_time_factor": Metric("", "sim_s / wall_s"),
}


def compute_metrics(
    log: pd.DataFrame, scenario: Scenario, wall_s: float | None = None
) -> dict[str, Any]:
    """Compute every metric of `METRICS`.

    Parameters
    ----------
    log : DataFrame
        As `dual_proxy.log.make_frame` makes it; may be cut short or empty.
    scenario : Scenario
        What was run: its `map` and `link.delay` are used.
    wall_s : float, optional
        How long the run took, s.

    Returns
    -------
    dict
        Keys of `METRICS`; numbers, booleans or None, all valid JSON.
    """
    values: dict[str, Any] = dict.fromkeys(METRICS)
    values["finite"] = bool(np.isfinite(log.to_numpy(np.float64)).all())
    values["sim_s"] = float(log.index[-1]) if len(log) else 0.0  # Starts at 0.
    values["wall_s"] = wall_s
    if wall_s:
        values["real_time_factor"] = values["sim_s"] / wall_s
    if len(log) > 1:
        # What is not finite gives None, not a warning.
        with np.errstate(invalid="ignore", over="ignore"):
            truth = _Truth.of(log, scenario)
            values |= _position_metrics(log, scenario, truth)
            values |= _force_metrics(log, scenario, truth)
            values |= _perception_metrics(log, scenario, truth)
    return {key: _json_value(values[key]) for key in METRICS}


def device_in_robot_frame(scenario: Scenario, x_D: Array) -> Array:
    """Map device positions, (n, 3), m, in D, to the robot, in B, eq. (1)."""
    mapped: Array = scenario.map.p_cw + scenario.map.scale * (x_D @ scenario.map.R_DB)
    return mapped


def format_metric(value: Any) -> str:
    """Return a metric as people read it: four digits, "-" for None."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:d}" if isinstance(value, int) else f"{value:.4g}"


def normal_error_deg(log: pd.DataFrame) -> Array:
    """Return the angle between estimated and true normal at each row.

    Returns
    -------
    (n,), deg, in [0, 90]
        NaN where there is no true contact or no estimate; see `METRICS`.
    """
    normal = signal(log, "contact_normal")
    along_first = np.abs(np.sum(signal(log, "force_direction") * normal, axis=1))
    selection = signal(log, "force_selection").reshape(-1, 3, 3)
    in_space = np.linalg.norm(np.einsum("nij,nj->ni", selection, normal), axis=1)
    several = signal(log, "contact_dimension") > 1
    cosine = np.where(several, in_space, along_first)
    angle = np.degrees(np.arccos(np.clip(cosine, 0.0, 1.0)))
    valid = _touching(log) & (signal(log, "dimension") > 0) & (_norm(normal) > 0.5)
    return np.where(valid, angle, np.nan)


@dataclass(frozen=True, slots=True)
class _Truth:
    """When the tool really touches, when the hand presses, along which normal."""

    touching: Mask
    normal: Array
    """(n, 3), of the last contact so far; zero before the first."""
    presses: Sequence[tuple[int, int]]
    """Rows [contact, lift) of each time that the hand presses."""
    steady: Sequence[tuple[int, int]]
    """Rows [start, lift) of steady contact."""

    @classmethod
    def of(cls, log: pd.DataFrame, scenario: Scenario) -> _Truth:
        time = log.index.to_numpy(np.float64)
        touching = _touching(log)
        last = np.maximum.accumulate(np.where(touching, np.arange(len(time)), -1))
        held = (last >= 0)[:, None]
        normal = np.where(held, signal(log, "contact_normal")[last], 0.0)
        surface = signal(log, "robot_position")[last]
        hand = device_in_robot_frame(scenario, signal(log, "hand_position"))
        depth = np.sum(normal * (hand - surface), axis=1)
        speed = np.zeros(len(time))
        speed[1:] = np.sum(normal[1:] * np.diff(hand, axis=0), axis=1) / np.diff(time)
        presses, steady = [], []
        for begin, end in _intervals((depth > 0.0) & held[:, 0]):
            contacts = np.flatnonzero(touching[begin:end])
            if not contacts.size:
                continue
            contact = begin + int(contacts[0])
            lift = end
            if end < len(time):
                while lift > contact and speed[lift - 1] < -LIFT_SPEED:
                    lift -= 1
            presses.append((contact, lift))
            settled = time[contact] + 3.0 * scenario.link.delay + 1.0
            start = int(np.searchsorted(time, settled - 1e-9))
            if start < lift:
                steady.append((start, lift))
        return cls(touching, normal, presses, steady)


def _position_metrics(
    log: pd.DataFrame, scenario: Scenario, truth: _Truth
) -> dict[str, Any]:
    time = log.index.to_numpy(np.float64)
    robot = signal(log, "robot_position")
    device = device_in_robot_frame(scenario, signal(log, "device_position"))
    then = time - scenario.link.delay
    delayed = np.column_stack([np.interp(then, time, axis) for axis in device.T])
    touching, normal = truth.touching, truth.normal
    if not touching.any():
        return {}
    error = robot - device
    along = np.sum(error * normal, axis=1)[touching]
    return {
        "position_rms_free_m": _free_rms(error[touching], normal[touching]),
        "position_rms_free_delay_compensated_m": _free_rms(
            (robot - delayed)[touching], normal[touching]
        ),
        "position_rms_contact_m": _rms(along),
    }


def _force_metrics(
    log: pd.DataFrame, scenario: Scenario, truth: _Truth
) -> dict[str, Any]:
    time = log.index.to_numpy(np.float64)
    device_force = signal(log, "device_force")
    contact_force = signal(log, "contact_force")
    values: dict[str, Any] = {
        "haptic_force_max_N": _norm(device_force).max(),
        "contact_force_max_N": _norm(contact_force).max(),
        "observed_energy_min_J": signal(log, "observed_energy").min(),
        "link_messages_dropped": int(signal(log, "robot_link_dropped")[-1])
        + int(signal(log, "haptic_link_dropped")[-1]),
    }
    active = signal(log, "dimension") > 0
    if active.any():
        selection = signal(log, "force_selection").reshape(-1, 3, 3)
        error = signal(log, "sensed_force") - signal(log, "reference_force")
        selected = np.einsum("nij,nj->ni", selection, error)
        values["force_tracking_rms_N"] = _rms(_norm(selected[active]))
    # The true normal in the device's frame D.
    normal_D = truth.normal @ scenario.map.R_DB.T
    along = np.sum(device_force * normal_D, axis=1)
    if truth.touching.any():
        free = device_force - along[:, None] * normal_D
        values["haptic_force_rms_free_N"] = _rms(_norm(free[truth.touching]))
    if truth.steady:
        rows = np.concatenate([np.arange(*span) for span in truth.steady])
        values["haptic_force_std_contact_N"] = np.std(along[rows])
        for key, force in (
            ("haptic_force_ac_N", device_force),
            ("contact_force_ac_N", contact_force),
        ):
            parts = [
                force[a:b] - _moving_average(time[a:b], force[a:b])
                for a, b in truth.steady
            ]
            values[key] = _rms(_norm(np.concatenate(parts)))
    return values


def _perception_metrics(
    log: pd.DataFrame, scenario: Scenario, truth: _Truth
) -> dict[str, Any]:
    time = log.index.to_numpy(np.float64)
    dimension = signal(log, "dimension")
    touching = truth.touching
    values: dict[str, Any] = {"contact_losses": _contact_losses(log, truth)}
    # The other schemes have no filter that could be right or wrong.
    if not touching.any() or scenario.scheme != "dual_proxy":
        return values
    right = dimension == signal(log, "contact_dimension")
    values["dimension_accuracy"] = right[touching].mean()
    error = normal_error_deg(log)
    error = error[np.isfinite(error)]
    if error.size:
        values["normal_error_mean_deg"] = error.mean()
        values["normal_error_p95_deg"] = np.percentile(error, 95.0)
    latencies = []
    for begin, end in _contacts(time, touching):
        found = np.flatnonzero(dimension[begin:end] > 0)
        last = begin + int(found[0]) if found.size else end - 1
        latencies.append(time[last] - time[begin])
    values["detection_latency_ms"] = 1e3 * float(np.mean(latencies))
    return values


def _contact_losses(log: pd.DataFrame, truth: _Truth) -> int:
    force = _norm(signal(log, "contact_force"))
    losses = 0
    for begin, end in truth.presses:
        # With hysteresis: 1 where it touches, 0 where it is lost, else as before.
        state = np.where(
            force[begin:end] > CONTACT_FORCE,
            1,
            np.where(force[begin:end] < LOST_FORCE, 0, -1),
        )
        known = np.maximum.accumulate(np.where(state >= 0, np.arange(len(state)), 0))
        losses += int(np.count_nonzero(np.diff(state[known]) < 0))
    return losses


def _touching(log: pd.DataFrame) -> Mask:
    touching: Mask = _norm(signal(log, "contact_force")) > CONTACT_FORCE
    return touching


def _contacts(time: Array, touching: Mask) -> list[tuple[int, int]]:
    """Return the intervals of contact, joined over pauses too short to count."""
    joined: list[tuple[int, int]] = []
    for begin, end in _intervals(touching):
        if joined and time[begin] - time[joined[-1][1] - 1] < NEW_CONTACT_PAUSE:
            joined[-1] = (joined[-1][0], end)
        else:
            joined.append((begin, end))
    return joined


def _free_rms(error: Array, normal: Array) -> float | None:
    """RMS per axis of the part orthogonal to the normal, mean over the axes."""
    free = error - np.sum(error * normal, axis=1)[:, None] * normal
    share = np.sum(1.0 - normal**2, axis=0)
    total = float(share.sum())
    if not total > 0.0:
        return None
    rms = np.sqrt(np.sum(free**2, axis=0) / np.maximum(share, 1e-9 * total))
    return float(np.sum(share * rms) / total)


def _moving_average(time: Array, values: Array) -> Array:
    """Centred mean over AC_WINDOW, over what there is of it at the ends."""
    half = AC_WINDOW / 2.0
    first = np.searchsorted(time, time - half - 1e-9)
    last = np.searchsorted(time, time + half + 1e-9)
    total = np.concatenate([np.zeros((1, 3)), np.cumsum(values, axis=0)])
    mean: Array = (total[last] - total[first]) / (last - first)[:, None]
    return mean


def _intervals(mask: Mask) -> list[tuple[int, int]]:
    """Return [begin, end) of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]])))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def _norm(vectors: Array) -> Array:
    norm: Array = np.sqrt(np.sum(vectors**2, axis=1))
    return norm


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _json_value(value: Any) -> Any:
    if value is None or isinstance(value, bool | int):
        return value
    number = float(value)
    return number if math.isfinite(number) else None
