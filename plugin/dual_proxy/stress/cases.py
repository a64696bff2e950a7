# SPDX-License-Identifier: BSD-3-Clause
"""Cases of `dual-proxy stress`: a scene, a scheme, and factors that make it hard.

A case is drawn from its number alone, so that the number repeats it, on any
machine, whatever else was run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dual_proxy.run import change_scenario
from dual_proxy.scenario import SCHEMES, Scenario
from dual_proxy.scene_params import CORNER_RADIUS, TIP_RADIUS

__all__ = ["FACTORS", "SCENES", "Case", "case_scenario", "draw_case", "long_case"]

Random = np.random.Generator
Overrides = dict[str, Any]
Points = NDArray[np.float64]

#: What cases begin with, and how often, beside each other.
SCENES: dict[str, int] = {
    "plane": 6,
    "inner_corner": 2,
    "outer_corner": 2,
    "remote_ultrasound": 1,
    "flat_tool": 2,
    "shared": 1,
    "sim_cylinder": 1,
    "sim_cylinder_wall": 1,
    "sim_surfaces": 1,
    "reach": 2,
}
# Of the dual proxy's cases among all; the other schemes share the rest.
_DUAL_PROXY_SHARE = 0.6
# How many factors a case has, and how often.
_COUNTS = {0: 0.02, 1: 0.38, 2: 0.3, 3: 0.2, 5: 0.1}
# s, and in delays of the link: the hand rests at the end of its path. Both sides
# agree on a place in round trips, each of which leaves up to two thirds of what the
# one before has left, the more the softer the contact.
REST = 6.0
REST_DELAYS = 24.0
# Waypoints, m in B, in free space, as far as the arm reaches and beyond.
_REACH = {
    "scene.table": False,
    "scene.start_position": [0.45, 0.0, 0.45],
    "map.scale": 10.0,
    "operator.waypoints": [
        {"time": 0.0, "position": [0.45, 0.0, 0.45]},
        {"time": 2.0, "position": [0.80, 0.0, 0.45]},
        {"time": 4.0, "position": [0.45, 0.45, 0.60]},
        {"time": 6.0, "position": [0.20, 0.0, 0.80]},
        {"time": 8.0, "position": [0.25, -0.40, 0.20]},
        {"time": 10.0, "position": [0.92, 0.0, 0.30]},
        {"time": 12.0, "position": [0.45, 0.0, 0.45]},
    ],
}


class Case(NamedTuple):
    """Something to be run."""

    number: int
    scene: str
    scheme: str
    seed: int
    factors: dict[str, Overrides]
    """By name: the values that each sets."""

    def without(self, factor: str) -> Case:
        """Return the case that lacks a factor."""
        rest = {name: keys for name, keys in self.factors.items() if name != factor}
        return self._replace(factors=rest)


def _log_uniform(random: Random, low: float, high: float) -> float:
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def _vector(random: Random, spread: float) -> list[float]:
    return [float(x) for x in random.normal(0, spread, 3)]


def _one_of(random: Random, choices: Iterable[Any]) -> Any:
    choices = list(choices)
    return choices[int(random.integers(len(choices)))]


def _waypoints(times: Points, points: Points) -> list[dict[str, Any]]:
    return [
        {"time": round(float(time), 6), "position": [round(float(x), 6) for x in point]}
        for time, point in zip(times, points, strict=True)
    ]


def _own_points(base: Scenario) -> Points:
    """The places of a scene's path: what lies between them is within reach."""
    return np.array([point.position for point in base.operator.waypoints])


def _random_path(random: Random, base: Scenario) -> Overrides:
    own = _own_points(base)
    count = int(random.integers(4, 12))
    shares = random.dirichlet(np.full(len(own), 0.5), count)
    points = np.vstack([own[:1], shares @ own])
    times = np.cumsum(np.r_[0.0, random.uniform(0.2, 3.0, count)])
    return {"operator.waypoints": _waypoints(times, points)}


def _step_path(random: Random, base: Scenario) -> Overrides:
    own = _own_points(base)
    picked = own[random.integers(len(own), size=5)]
    starts = np.arange(1.0, 11.0, 2.0)
    # 5 ms for a way of centimetres.
    times = np.r_[0.0, np.sort(np.r_[starts, starts + 0.005])]
    before = np.vstack([own[:1], picked[:-1]])
    points = np.vstack([own[:1], np.stack([before, picked], 1).reshape(-1, 3)])
    return {"operator.waypoints": _waypoints(times, points)}


def _wave_path(random: Random, base: Scenario, noise: bool) -> Overrides:
    """A chirp up to 8 Hz, or white noise, around a place of the path."""
    own = _own_points(base)
    home = own[0]
    place = home + 0.7 * (own[random.integers(1, len(own))] - home)
    times = np.arange(0.0, 8.0, 0.02)
    if noise:
        offsets = random.normal(0.0, 0.003, (len(times), 3))
    else:
        axis = random.normal(size=3)
        axis *= random.uniform(0.003, 0.012) / np.linalg.norm(axis)
        phase = 2 * np.pi * (0.1 * times + 0.5 * times**2)
        offsets = np.sin(phase)[:, None] * axis
    points = np.vstack([home, place + offsets])
    times = np.r_[0.0, 2.0 + times]
    return {"operator.waypoints": _waypoints(times, points)}


def _hand(random: Random) -> Overrides:
    return {
        "device.hand_mass": _log_uniform(random, 0.05, 5),
        "device.hand_stiffness": _log_uniform(random, 40, 4000),
        "device.hand_damping": _log_uniform(random, 3, 100),
        "device.device_mass": _log_uniform(random, 0.05, 2.5),
    }


def _scale(random: Random, base: Scenario) -> Overrides:
    """Another scale; the path shrinks to what the device then reaches."""
    scale = _log_uniform(random, 0.1, 10)
    share = min(1.0, scale / base.map.scale)
    own = _own_points(base)
    times = np.array([point.time for point in base.operator.waypoints])
    points = own[0] + share * (own - own[0])
    return {"map.scale": scale, "operator.waypoints": _waypoints(times, points)}


def _rates(random: Random) -> Overrides:
    period = _one_of(random, [0.00025, 0.0005, 0.001, 0.0015, 0.002, 0.004])
    return {
        "control_period": period,
        "scene.time_step": min(period, _one_of(random, [0.0002, 0.0005, 0.001])),
        "filter.period": max(period, _one_of(random, [0.001, 0.005, 0.01, 0.05, 0.2])),
    }


def _sensor(random: Random) -> Overrides:
    choices: list[Overrides] = [
        {"sensor.force_noise_std": _log_uniform(random, 0.01, 0.95)},
        {"sensor.force_bias": _vector(random, 3)},
        {"sensor.force_drift": _vector(random, 0.02)},
        {"sensor.dropout": float(random.uniform(0, 0.95))},
        {"sensor.force_step": _log_uniform(random, 0.01, 1)},
        {
            "sensor.spike_rate": float(random.uniform(0.1, 5)),
            "sensor.spike_force": _log_uniform(random, 3, 300),
        },
        {"sensor.delay": _one_of(random, [0.001, 0.002, 0.004, 0.008])},
        {"sensor.cutoff": _log_uniform(random, 10, 400)},
        {"sensor.tare": False, "sensor.force_bias": [0.5, 0.0, 0.5]},
    ]
    picked: Overrides = _one_of(random, choices)
    return picked


def _model(random: Random) -> Overrides:
    offset = [0.0, 0.0, float(random.uniform(-0.02, 0.05))]
    return {
        f"mismatch.{key}": value
        for key, value in _one_of(
            random,
            [
                {"mass_scale": float(random.uniform(0.7, 1.3))},
                {"payload": float(random.uniform(0.0, 1.0))},
                {"joint_friction": _log_uniform(random, 0.05, 2)},
                {"tool_offset": offset},
                {"torque_step": _log_uniform(random, 1e-3, 0.1)},
                {"torque_delay": int(random.integers(1, 4))},
            ],
        ).items()
    }


def _fault(random: Random, inputs: list[str], kinds: list[str]) -> Overrides:
    start = float(random.uniform(1.0, 7.0))
    return {
        "faults": [
            {
                "input": _one_of(random, inputs),
                "kind": _one_of(random, kinds),
                "start": start,
                "end": start + _log_uniform(random, 0.001, 1.0),
            }
        ]
    }


def _bad_input(random: Random) -> Overrides:
    inputs = ["robot_position", "robot_velocity", "sensor", "device_pose"]
    inputs += ["device_velocity", "message_to_robot", "message_to_device"]
    return _fault(random, inputs, ["nan", "infinite", "huge", "denormal", "frozen"])


def _outage(random: Random) -> Overrides:
    start = float(random.uniform(1.0, 7.0))
    return {"link.outages": [[start, start + _log_uniform(random, 0.05, 4)]]}


def _penetration(random: Random, base: Scenario) -> Overrides:
    """A small ball beside the tool, which is inside of it at the start: with its
    own ball or, if it is flat, with that of a corner. The tool point is outside, as
    the scenario's checks want it."""
    depth = _log_uniform(random, 1e-4, 4e-3)
    radius = float(random.uniform(0.01, 0.05))
    away = random.normal(size=3)
    place, own = np.asarray(base.map.p_cw), TIP_RADIUS
    if base.scene.tool == "flat":
        R_cw = np.asarray(base.map.R_cw)
        place, own = place + R_cw @ base.scene.corners()[0], CORNER_RADIUS
        away = R_cw[:, 2]
    distance = radius + own - depth
    ball = {
        "name": "at the start",
        "shape": "sphere",
        "position": [float(x) for x in place + distance * away / np.linalg.norm(away)],
        "radius": radius,
    }
    return {"scene.surfaces": [*base.to_mapping()["scene"]["surfaces"], ball]}


#: What a case may have, by name: draws the values that it sets.
FACTORS: dict[str, Callable[[Random, Scenario], Overrides]] = {
    "delay": lambda random, _: {
        "link.delay": _log_uniform(random, 0.002, 3),
        "link.max_age": 10.0,
    },
    "jitter": lambda random, _: {
        "link.jitter": _log_uniform(random, 0.001, 0.3),
        "link.reordering": bool(random.integers(2)),
    },
    "loss": lambda random, _: {"link.loss": float(random.uniform(0, 1) ** 2)},
    "dead link": lambda *_: {"link.loss": 1.0},
    "outage": lambda random, _: _outage(random),
    "clock": lambda random, _: {
        "link.clock_offset": float(random.normal(0, 1)),
        "link.clock_drift": float(random.normal(0, 1e-4)),
    },
    "link rate": lambda random, _: {"link.rate": _log_uniform(random, 5, 1000)},
    "stiffness": lambda random, _: {
        "scene.contact_stiffness": _log_uniform(random, 1e2, 1e6)
    },
    "friction": lambda random, _: {"scene.friction": float(random.uniform(0, 1.2))},
    "dissipation": lambda random, _: {
        "scene.contact_dissipation": _log_uniform(random, 0.01, 100)
    },
    "hand": lambda random, _: _hand(random),
    "scale": _scale,
    "rates": lambda random, _: _rates(random),
    "sensor": lambda random, _: _sensor(random),
    "random path": _random_path,
    "step": _step_path,
    "chirp": lambda random, base: _wave_path(random, base, noise=False),
    "noise": lambda random, base: _wave_path(random, base, noise=True),
    "penetration": _penetration,
    "selections": lambda random, _: _fault(
        random, ["selections"], ["flipping", "tilted"]
    ),
    "model": lambda random, _: _model(random),
    "bad input": lambda random, _: _bad_input(random),
}

# Those that a point mass has not.
_OF_ARMS = {"model"}
_PATHS = {"scale", "random path", "step", "chirp", "noise"}
_FAULTS = {"selections", "bad input"}
_LINKS = {"loss", "dead link"}


def base_scenario(scene: str) -> Scenario:
    """Return a scene of `SCENES` as it is."""
    if scene == "reach":
        return change_scenario("plane", overrides=_REACH)
    return change_scenario(scene)


def draw_case(number: int, bases: Mapping[str, Scenario]) -> Case:
    """Draw a case.

    Parameters
    ----------
    number : int
        Of the case, >= 0: equal numbers give equal cases.
    bases : mapping
        Of each scene, `base_scenario`.
    """
    random = np.random.default_rng([20250101, number])
    weights = np.array(list(SCENES.values()), dtype=float)
    scene = str(random.choice(list(SCENES), p=weights / weights.sum()))
    scheme = "dual_proxy"
    if random.uniform() > _DUAL_PROXY_SHARE:
        scheme = _one_of(random, [name for name in SCHEMES if name != scheme])
    base = bases[scene]
    count = int(random.choice(list(_COUNTS), p=list(_COUNTS.values())))
    factors: dict[str, Overrides] = {}
    names = [str(name) for name in random.permutation(list(FACTORS))]
    for name in names:
        if len(factors) == count:
            break
        if base.robot == "point_mass" and name in _OF_ARMS:
            continue
        # One of each kind: they would set the same keys.
        if any(
            name in kind and kind & set(factors) for kind in (_PATHS, _FAULTS, _LINKS)
        ):
            continue
        factors[name] = FACTORS[name](random, base)
    return Case(number, scene, scheme, number, factors)


def long_case(hours: float, base: Scenario) -> Case:
    """Return a case of many hours: the path of scene `plane` again and again, over
    a link that is late, jitters and loses, with a clock and a sensor that drift.

    Parameters
    ----------
    hours : float
        How long, h, rounded up to whole turns of the path.
    base : Scenario
        Of `plane`.
    """
    path = base.operator.waypoints
    turn = path[-1].time + 1.0
    turns = int(np.ceil(3600 * hours / turn))
    points = [
        {"time": i * turn + point.time, "position": list(point.position)}
        for i in range(turns)
        for point in path
    ]
    # By its end the sensor is off by half a newton, the clock by seconds.
    drift = 0.5 / (turns * turn)
    factors: dict[str, Overrides] = {
        "link": {"link.delay": 0.05, "link.jitter": 0.01, "link.loss": 0.1},
        "clock": {"link.clock_drift": 5e-5},
        "sensor": {"sensor.force_drift": [drift, 0.0, drift]},
        "path": {"operator.waypoints": points},
    }
    return Case(0, "plane", "dual_proxy", 0, factors)


def case_scenario(case: Case, base: Scenario) -> Scenario:
    """Return what is run of a case: the hand rests at its end.

    Raises
    ------
    ScenarioError
        If a scenario's checks refuse it, which is right of many.
    """
    overrides: Overrides = {"seed": case.seed, "scheme": case.scheme}
    without_planner = {"scheme": case.scheme, "planner.active": []}
    if not base.with_overrides(without_planner).uses_selections:
        overrides |= without_planner
    for keys in case.factors.values():
        overrides |= keys
    points = overrides.get("operator.waypoints")
    if points is None:
        points = [
            {
                "time": point.time,
                "position": list(point.position),
                "rotation": list(point.rotation),
            }
            for point in base.operator.waypoints
        ]
    last = dict(points[-1])
    delay = overrides.get("link.delay", base.link.delay)
    last["time"] += REST + REST_DELAYS * delay
    overrides["operator.waypoints"] = [*points, last]
    return base.with_overrides(overrides)
