# SPDX-License-Identifier: BSD-3-Clause
"""What a watched run must keep to: `judge`."""

from __future__ import annotations

from typing import Any, NamedTuple

from dual_proxy._core import ArmMismatchParams
from dual_proxy.scenario import Scenario

__all__ = ["SAFETY", "STABILITY", "Verdict", "judge"]

# J: the springs of proxy and hand at the device's greatest force, and some.
_MOST_ENERGY = 0.5
# At rest, N and m; what the sensor's noise moves comes on top.
_SWING_FORCE = 0.1
_SWING_POSITION = 1e-4
# Of the force that noise makes, sensed by 1 kHz samples, what is felt.
_NOISE_SHARE = 1.0
# m: of the tool from where motion control wants it, at rest.
_NEAR = 5e-3
_CONNECTED = 1

#: Kinds of what may be wrong: what must never be, and what a stable law does.
SAFETY, STABILITY = "safety", "stability"


class Verdict(NamedTuple):
    """What was wrong with a run, in words; empty if nothing."""

    safety: list[str]
    stability: list[str]

    @property
    def wrong(self) -> str:
        """All of it, in one line."""
        return "; ".join([*self.safety, *self.stability])


def judge(watched: dict[str, dict[str, Any]], scenario: Scenario) -> Verdict:
    """Judge a run by what was watched of it.

    *Safety*: what is sent to arm and device is finite; every limit of both is kept
    in every period; selections are projections to 1e-12, rotations unit
    quaternions to 1e-9. *Stability*: the device gives the hand no more than 0.5 J
    in any stretch of time, beyond 1 mW; at rest forces swing by no more than 0.1 N
    and what the sensor's noise makes, positions by 0.1 mm (RMS, for 2 s); both
    sides are connected again, and the tool is where motion control wants it.
    """
    safety = []
    for name, watch in watched.items():
        most, value = watch["most"], watch["value"]
        if most is None or (value is not None and value <= most):
            continue
        if name == "rows_not_finite" and _has_bad_numbers(scenario):
            continue  # As measured: what is sent has a row of its own.
        text = watch["detail"] or f"{name} {value} {watch['unit']}".strip()
        safety.append(f"{text} at {watch['time']:g} s" if not watch["detail"] else text)
    return Verdict(safety, _judge_stability(watched, scenario))


def _judge_stability(
    watched: dict[str, dict[str, Any]], scenario: Scenario
) -> list[str]:
    wrong = []

    def at_most(name: str, most: float) -> None:
        value = watched[name]["value"] if name in watched else 0.0
        if value is None or not value <= most:
            unit = watched[name]["unit"]
            wrong.append(f"{name} {value} {unit}, not {most:.3g} or less")

    at_most("device_energy", _MOST_ENERGY)
    force = _SWING_FORCE + _NOISE_SHARE * scenario.sensor.force_noise_std
    at_most("rest_contact_force", force)
    at_most("rest_device_force", _SWING_FORCE)
    at_most("rest_robot_position", _SWING_POSITION)
    at_most("rest_device_position", _SWING_POSITION)
    if _should_be_connected(scenario):
        for side in ("robot", "haptic"):
            name = f"{side}_link_status"
            if watched[name]["value"] != _CONNECTED:
                wrong.append(f"{name} {watched[name]['value']:g} at the end, not 1")
        if scenario.mismatch == ArmMismatchParams():
            at_most("motion_error", _NEAR)
    return wrong


def _has_bad_numbers(scenario: Scenario) -> bool:
    return any(fault.kind in ("nan", "infinite", "huge") for fault in scenario.faults)


def _should_be_connected(scenario: Scenario) -> bool:
    """Whether messages come often enough for their side to be connected."""
    link = scenario.link
    wait = link.timeout * link.rate
    return link.loss**wait < 1e-4 and link.jitter < 0.2 * link.timeout
