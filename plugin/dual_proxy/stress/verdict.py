# SPDX-License-Identifier: BSD-3-Clause
"""What a watched run must keep to: `judge`."""

from __future__ import annotations

import re
from typing import NamedTuple

from dual_proxy._core import ArmMismatchParams
from dual_proxy.scenario import Scenario
from dual_proxy.watch import Watched

__all__ = ["Verdict", "judge", "rest_time", "swings"]

# J: the springs of proxy and hand at the device's greatest force, and some.
_MOST_ENERGY = 0.5
_ENERGIES = ("device_energy", "force_loop_energy")
# s: as long as the dual proxy catches up at most after a loss; until it has met
# the hand or that is over, it keeps to `robot_proxy.recovery_speed`.
_CATCH_UP = 10.0
# At rest, N and m; what the sensor's noise moves comes on top.
_SWING_FORCE = 0.1
_SWING_POSITION = 1e-4
# Of the force that noise makes, sensed by 1 kHz samples, what is felt.
_NOISE_SHARE = 1.0
# m: of the tool from where motion control wants it, at rest.
_NEAR = 5e-3
_CONNECTED = 1


class Verdict(NamedTuple):
    """What was wrong with a run, in words; empty if nothing."""

    safety: list[str]
    stability: list[str]
    """Each begins with the name of what was watched."""

    @property
    def limits(self) -> list[str]:
        """What of safety is wrong: names of limits, of any joint, each once."""
        names = (re.sub(r"^joint \d+", "joint", text) for text in self.safety)
        return list(dict.fromkeys(re.sub(r"[ -]*\d.*", "", name) for name in names))

    @property
    def kinds(self) -> list[str]:
        """What of stability is wrong: names of what was watched, each once; "rest"
        is all that swings at rest."""
        names = (text.split()[0] for text in self.stability)
        return list(
            dict.fromkeys("rest" if n.startswith("rest_") else n for n in names)
        )

    @property
    def wrong(self) -> str:
        """All of it, in one line."""
        return "; ".join([*self.safety, *self.stability])


def judge(watched: Watched, scenario: Scenario) -> Verdict:
    """Judge a run by what was watched of it.

    *Safety*: what is sent to arm and device is finite; every limit of both is kept
    in every period; selections are projections to 1e-12, rotations unit
    quaternions to 1e-9. *Stability*: in any stretch of time, beyond 1 mW, neither
    the device gives the hand more than 0.5 J nor the feedback of the robot's closed
    force loop the robot; at rest nothing swings (`swings`); both sides are
    connected again, and the tool is where motion control wants it. The dual proxy
    follows the hand again after the end of a fault in `link.timeout`,
    `link.jitter` and the 10 s of systems/proxy/robot_side_proxy.h.
    """
    safety = []
    for name, watch in watched.items():
        most, value = watch["most"], watch["value"]
        if most is None or (value is not None and value <= most):
            continue
        if name == "rows_not_finite" and _has_bad_numbers(scenario):
            continue  # As measured: what is sent has a row of its own.
        text = watch["detail"]
        if not text:
            text = f"{name} {_text(value)} {watch['unit']} at {watch['time']:g} s"
        safety.append(text)
    return Verdict(safety, _judge_stability(watched, scenario))


def rest_time(scenario: Scenario) -> float:
    """Return how long before the end of a run all should be at rest, s: as long as
    what goes to and fro over the link needs to be seen."""
    return 2.0 + 4.0 * scenario.link.delay


def swings(watched: Watched, scenario: Scenario) -> list[str]:
    """Tell what does not come to rest: forces swing by more than 0.1 N and what the
    sensor's noise makes, positions by more than 0.1 mm (RMS about a line, for
    `rest_time`)."""
    noise = _NOISE_SHARE * scenario.sensor.force_noise_std
    return _too_large(
        watched,
        {
            "rest_contact_force": _SWING_FORCE + noise,
            "rest_device_force": _SWING_FORCE,
            "rest_robot_position": _SWING_POSITION,
            "rest_device_position": _SWING_POSITION,
        },
    )


def _judge_stability(watched: Watched, scenario: Scenario) -> list[str]:
    wrong = _too_large(watched, dict.fromkeys(_ENERGIES, _MOST_ENERGY))
    wrong += swings(watched, scenario)
    if not _should_be_connected(scenario):
        return wrong
    for side in ("robot", "haptic"):
        name = f"{side}_link_status"
        if watched[name]["value"] != _CONNECTED:
            wrong.append(f"{name} {watched[name]['value']:g} at the end, not 1")
    if scenario.mismatch == ArmMismatchParams():
        wrong += _too_large(watched, {"motion_error": _NEAR})
    # Where a planner leads, the robot is not where the hand is.
    if scenario.scheme == "dual_proxy" and not scenario.planner.active:
        link = scenario.link
        most = link.timeout + link.jitter + _CATCH_UP
        wrong += _too_large(watched, {"recovery_time": most})
    return wrong


def _too_large(watched: Watched, limits: dict[str, float]) -> list[str]:
    wrong = []
    for name, most in limits.items():
        if name not in watched:
            continue
        value, unit = watched[name]["value"], watched[name]["unit"]
        if value is None or not value <= most:
            wrong.append(f"{name} {_text(value)} {unit}, not {most:.3g} or less")
    return wrong


def _text(value: float | None) -> str:
    return "not finite" if value is None else f"{value:.4g}"


def _has_bad_numbers(scenario: Scenario) -> bool:
    return any(fault.kind in ("nan", "infinite", "huge") for fault in scenario.faults)


def _should_be_connected(scenario: Scenario) -> bool:
    """Whether messages come often enough for their side to be connected."""
    link = scenario.link
    wait = link.timeout * link.rate
    return link.loss**wait < 1e-4 and link.jitter < 0.2 * link.timeout
