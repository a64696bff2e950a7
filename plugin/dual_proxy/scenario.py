# SPDX-License-Identifier: BSD-3-Clause
"""A scenario: everything that decides what a run does, from one YAML file.

The file has one top-level key, the scenario's name; below it are the sections
of `Scenario`. What is not written keeps its default, an unknown key is an
error. The sections that belong to an algorithm *are* its C++ `...Params`
struct, so their fields, units and ranges are those of the class.

Some values are needed in several places. Each is written once and copied where
it is needed; writing a copy is an error that names the original:

- `scene.time_step` is the period of everything that runs at the control rate.
- `scene.start_position` is `map.p_cw`: the device's home is the robot's start.
- `map` and the link's monitor belong to both sides.
- `robot_proxy.stiffness` is what the haptic side matches its own to.

In order of precedence, later wins: defaults, the YAML file, the presets of
`scheme` and `law`, and explicit overrides (`--set` on the command line,
`Scenario.with_overrides`, or the section `overrides` in YAML).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml
from numpy.typing import NDArray

from dual_proxy._core import (
    CommunicationChannelParams,
    ForceSpaceParticleFilterParams,
    ForceTorqueSensorParams,
    HapticControllerParams,
    HapticSideProxyParams,
    LinkMonitorParams,
    OperationalSpaceControllerParams,
    PoseSenderParams,
    PositionForceHapticSideParams,
    RobotSideProxyParams,
    SimulatedHapticDeviceParams,
    WorkspaceMapParams,
)
from dual_proxy.panda_params import TOOL_COM_S, PandaSceneParams
from dual_proxy.recording import read_recording, recorded_path
from dual_proxy.settings import (
    ScenarioError,
    check,
    fill,
    get_value,
    is_params,
    owners,
    parse_yaml,
    plain,
    read_text,
    set_value,
    to_mapping,
)

__all__ = [
    "LAWS",
    "SCHEMES",
    "LinkParams",
    "OperatorMotion",
    "OperatorParams",
    "Scenario",
    "ScenarioError",
    "Waypoint",
    "list_scenarios",
    "load_scenario",
]

#: Teleoperation schemes: the dual proxy, and the two-channel baseline.
SCHEMES = ("dual_proxy", "position_force")
#: `default` is this project's law, `printed` the paper's to the letter.
LAWS = ("default", "printed")

# What a choice sets, over the YAML's values and under explicit overrides.
_PRESETS: dict[tuple[str, str], dict[str, Any]] = {
    # The paper's gains for its two-channel controller; none of what the dual
    # proxy's controller adds.
    ("scheme", "position_force"): {
        "controller.position_stiffness": 100.0,
        "controller.position_damping": 20.0,
        "controller.feed_forward": False,
        "robot_proxy.max_motion_error": 0.0,
    },
    ("law", "printed"): {
        "robot_proxy.handover": "printed",
        "robot_proxy.interpolate": False,
        "robot_proxy.max_motion_error": 0.0,
        "controller.unit_mass_motion_force": False,
        "controller.feed_forward": False,
        "controller.selection_blend_time": 0.0,
        "controller.force_filter_cutoff": 0.0,
        "controller.passivity": False,
    },
}

# Copies of values that are written elsewhere: dotted key -> the original.
_SHARED = {
    "map.p_cw": "scene.start_position",
    "robot_proxy.map": "map",
    "robot_proxy.link": "link",
    "haptic_proxy.map": "map",
    "haptic_proxy.link": "link",
    "haptic_proxy.robot_stiffness": "robot_proxy.stiffness",
    "position_force.map": "map",
    "position_force.link": "link",
    "controller.force_passivity.enabled": "controller.passivity",
    "controller.moment_passivity.enabled": "controller.passivity",
    "sensor.tool_mass": "scene.tool_mass",
    "sensor.tool_com": "scene",
    "sensor.gravity": "scene.gravity",
}

# Share of the device's workspace that an intended path may use.
_REACH = 0.95


class OperatorMotion(NamedTuple):
    """Where the operator means the robot's tool to go."""

    times: NDArray[np.float64]
    """(n,), s, strictly increasing from 0."""
    positions: NDArray[np.float64]
    """(n, 3), m, in B."""
    sampled: bool
    """True: a densely sampled path; False: waypoints, a minimum-jerk move
    between each and the next."""


@dataclass(slots=True)
class LinkParams:
    """Both directions of the link alike; its keys stand directly in `link`."""

    sender: PoseSenderParams = field(
        default_factory=PoseSenderParams, metadata={"flat": True}
    )
    channel: CommunicationChannelParams = field(
        default_factory=CommunicationChannelParams, metadata={"flat": True}
    )
    monitor: LinkMonitorParams = field(
        default_factory=LinkMonitorParams, metadata={"flat": True}
    )

    @property
    def rate(self) -> float:
        """Messages per second."""
        return float(self.sender.rate)

    @property
    def delay(self) -> float:
        """One-way delay, s."""
        return float(self.channel.delay)


@dataclass(slots=True)
class Waypoint:
    """A place to be at rest at a time."""

    time: float = field(
        default=0.0, metadata={"doc": "s", "min": 0.0, "max": 3600.0, "required": True}
    )
    position: tuple[float, ...] = field(
        default=(0.0, 0.0, 0.0),
        metadata={"doc": "m, in B", "min": -2.0, "max": 2.0, "required": True},
    )


@dataclass(slots=True)
class OperatorParams:
    """What the operator means to do, in the robot's frame B."""

    waypoints: list[Waypoint] = field(
        default_factory=list,
        metadata={"doc": "minimum-jerk moves from each to the next; first at time 0"},
    )
    recording: str = field(
        default="",
        metadata={
            "doc": "CSV file of a human motion, in place of the waypoints; relative "
            "to the working directory"
        },
    )
    press_depth: float = field(
        default=0.04,
        metadata={
            "doc": "how far below first touch a recording's contact height goes, m",
            "min": 0.0,
            "max": 0.1,
        },
    )


@dataclass(slots=True)
class Scenario:
    """Everything that decides what a run does.

    Made by `load_scenario`. Fields may be changed; call `validate` afterwards
    (`dual_proxy.run` does), or use `with_overrides`, which leaves the original
    as it is.
    """

    name: str = field(default="scenario", metadata={"hidden": True})
    description: str = ""
    robot: str = field(default="panda", metadata={"choices": ("panda",)})
    scheme: str = field(default="dual_proxy", metadata={"choices": SCHEMES})
    law: str = field(default="default", metadata={"choices": LAWS})
    duration: float = field(
        default=20.0, metadata={"doc": "s", "min": 1e-3, "max": 3600.0}
    )
    extend_for_delay: bool = field(
        default=True,
        metadata={
            "doc": "lengthen the run to the end of the operator's path + 3 x delay "
            "+ 2 s, so that a late release is part of it; setting `duration` by an "
            "override turns this off"
        },
    )
    seed: int = field(
        default=0,
        metadata={"doc": "of everything random", "min": 0, "max": 2**63 - 1},
    )
    scene: PandaSceneParams = field(default_factory=PandaSceneParams)
    map: WorkspaceMapParams = field(default_factory=WorkspaceMapParams)
    link: LinkParams = field(default_factory=LinkParams)
    robot_proxy: RobotSideProxyParams = field(default_factory=RobotSideProxyParams)
    controller: OperationalSpaceControllerParams = field(
        default_factory=OperationalSpaceControllerParams
    )
    filter: ForceSpaceParticleFilterParams = field(
        default_factory=ForceSpaceParticleFilterParams
    )
    haptic_proxy: HapticSideProxyParams = field(default_factory=HapticSideProxyParams)
    haptic_controller: HapticControllerParams = field(
        default_factory=HapticControllerParams
    )
    position_force: PositionForceHapticSideParams = field(
        default_factory=PositionForceHapticSideParams
    )
    device: SimulatedHapticDeviceParams = field(
        default_factory=SimulatedHapticDeviceParams
    )
    sensor: ForceTorqueSensorParams = field(default_factory=ForceTorqueSensorParams)
    operator: OperatorParams = field(default_factory=OperatorParams)
    # Values that a preset replaced, to put back when another preset is chosen.
    _displaced: dict[str, Any] = field(
        default_factory=dict, repr=False, compare=False, metadata={"hidden": True}
    )

    @classmethod
    def from_mapping(cls, name: str, mapping: Any) -> Scenario:
        """Make a checked scenario from the mapping below the top-level key.

        Raises
        ------
        ScenarioError
            One line: the dotted field, what was expected, what was found.
        """
        scenario = cls(name=name)
        derived = _derived(scenario)
        if not isinstance(mapping, Mapping):
            raise ScenarioError(f"{name}: expected a mapping, got {mapping!r}")
        values = dict(mapping)
        overrides = values.pop("overrides", {})
        if not isinstance(overrides, Mapping):
            raise ScenarioError(
                f"{name}.overrides: expected a mapping, got {overrides!r}"
            )
        fill(scenario, values, name, derived)
        for key, value in scenario._presets().items():
            scenario._displaced[key] = plain(get_value(scenario, key))
            set_value(scenario, key, value, name)
        for key, value in overrides.items():
            if key in ("scheme", "law"):
                raise ScenarioError(f"{name}.overrides.{key}: set {name}.{key} instead")
            set_value(scenario, key, value, name, derived)
        scenario.validate()
        return scenario

    def validate(self) -> None:
        """Copy shared values to where they are needed and check everything.

        Raises
        ------
        ScenarioError
            For the first field that is out of range or contradicts another.
        """
        self._distribute()
        check(self, self.name)
        self.scene.validate(f"{self.name}.scene")
        self._check_across()

    def with_overrides(self, overrides: Mapping[str, Any]) -> Scenario:
        """Return a checked copy with some values replaced.

        Parameters
        ----------
        overrides : Mapping[str, Any]
            Dotted keys below the scenario's name, e.g. `{"link.delay": 0.15}`.
            `scheme` and `law` bring their presets; the other keys win over any
            preset. `duration` turns `extend_for_delay` off.
        """
        mapping = self.to_mapping()
        explicit = mapping.pop("overrides", {})
        for key, value in self._displaced.items():
            owner, _, leaf = key.rpartition(".")
            node = mapping
            for part in owner.split("."):
                node = node[part]
            node[leaf] = value
        if "duration" in overrides:
            explicit["extend_for_delay"] = False
        for key, value in overrides.items():
            (mapping if key in ("scheme", "law") else explicit)[key] = value
        return Scenario.from_mapping(self.name, {**mapping, "overrides": explicit})

    def to_mapping(self) -> dict[str, Any]:
        """Return what `from_mapping` makes an equal scenario of."""
        mapping = to_mapping(self, _derived(self))
        overrides = {
            key: plain(get_value(self, key))
            for key, value in self._presets().items()
            if get_value(self, key) != value
        }
        if overrides:
            mapping["overrides"] = overrides
        return mapping

    def to_yaml(self) -> str:
        """Return the scenario with every value, as `load_scenario` reads it."""
        return yaml.safe_dump(
            {self.name: self.to_mapping()},
            sort_keys=False,
            default_flow_style=None,
            width=88,
            allow_unicode=True,
        )

    def operator_motion(self) -> OperatorMotion:
        """Return the operator's intended path.

        Raises
        ------
        ScenarioError
            If a recording cannot be read; the message names file, row, column.
        """
        if not self.operator.recording:
            return OperatorMotion(
                np.array([point.time for point in self.operator.waypoints]),
                np.array([point.position for point in self.operator.waypoints]),
                sampled=False,
            )
        times, positions = recorded_path(
            read_recording(self.operator.recording),
            start=np.array(self.scene.start_position),
            contact_height=self.scene.contact_height,
            press_depth=self.operator.press_depth,
            reachable=self.reachable,
        )
        return OperatorMotion(times, positions, sampled=True)

    def reachable(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Tell which points, (n, 3), m, in B, the device can ask for.

        They lie, mapped to the device, within 95 % of its workspace, and over
        the table. The set is convex.
        """
        x_h = (points - self.map.p_cw) @ self.map.R_DB.T / self.map.scale
        aside = np.abs(points[:, :2] - np.array(self.scene.table_center))
        on_table = (aside <= np.array(self.scene.table_size) / 2.0).all(axis=1)
        in_radius = np.hypot(x_h[:, 1], x_h[:, 2]) <= (
            _REACH * self.device.workspace_radius
        )
        in_length = np.abs(x_h[:, 0]) <= _REACH * self.device.workspace_half_length
        return np.asarray(on_table & in_radius & in_length)

    def run_duration(self) -> float:
        """Return how long a run lasts, s; see `extend_for_delay`."""
        if not self.extend_for_delay:
            return self.duration
        end = float(self.operator_motion().times[-1])
        needed = end + 3.0 * self.link.delay + 2.0
        # Rounded up to whole milliseconds, free of floating-point dust.
        return max(self.duration, float(np.ceil(round(needed * 1e3, 6))) / 1e3)

    def _presets(self) -> dict[str, Any]:
        values: dict[str, Any] = {}
        for kind, choice in (("scheme", self.scheme), ("law", self.law)):
            values.update(_PRESETS.get((kind, choice), {}))
        return values

    def _distribute(self) -> None:
        self.map.p_cw = self.scene.start_position
        for side in (self.robot_proxy, self.haptic_proxy, self.position_force):
            side.map = self.map
            side.link = self.link.monitor
        self.haptic_proxy.robot_stiffness = self.robot_proxy.stiffness
        # The controller ignores its loops' own switches; the copies are kept
        # right for whoever reads them.
        for name in ("force_passivity", "moment_passivity"):
            getattr(self.controller, name).enabled = self.controller.passivity
        self.sensor.tool_mass = self.scene.tool_mass
        self.sensor.tool_com = TOOL_COM_S
        self.sensor.gravity = self.scene.gravity
        for _, owner in _periods(self):
            owner.period = self.scene.time_step

    def _check_across(self) -> None:
        delay, rate = self.link.delay, self.link.rate
        step = self.scene.time_step
        name = self.name
        if delay > 10.0:
            raise ScenarioError(
                f"{name}.link.delay: expected a number in [0, 10], got {delay!r}"
            )
        if self.link.monitor.timeout * rate < 2.0:
            raise ScenarioError(
                f"{name}.link.timeout: expected at least two messages long "
                f"({2.0 / rate:g} s at {rate:g} Hz), got {self.link.monitor.timeout!r}"
            )
        if self.link.monitor.max_age <= delay + 1.0 / rate:
            raise ScenarioError(
                f"{name}.link.max_age: expected more than the delay and a message "
                f"interval ({delay + 1.0 / rate:g} s), "
                f"got {self.link.monitor.max_age!r}"
            )
        if self.filter.period < step:
            raise ScenarioError(
                f"{name}.filter.period: expected at least scene.time_step "
                f"({step:g} s), got {self.filter.period!r}"
            )
        if not self.operator.recording:
            self._check_waypoints()

    def _check_waypoints(self) -> None:
        path = f"{self.name}.operator.waypoints"
        points = self.operator.waypoints
        if len(points) < 2:
            raise ScenarioError(
                f"{path}: expected at least two (or operator.recording), "
                f"got {len(points)}"
            )
        if points[0].time != 0.0:
            raise ScenarioError(f"{path}[0].time: expected 0, got {points[0].time!r}")
        for index, (before, after) in enumerate(itertools.pairwise(points)):
            if after.time <= before.time:
                raise ScenarioError(
                    f"{path}[{index + 1}].time: expected more than the one before "
                    f"({before.time:g} s), got {after.time!r}"
                )
        positions = np.array([point.position for point in points])
        for index in np.flatnonzero(~self.reachable(positions)).tolist():
            raise ScenarioError(
                f"{path}[{index}].position: expected a place over the table that "
                f"the device reaches from map.p_cw, got {list(points[index].position)}"
            )


def list_scenarios() -> list[str]:
    """Return the names of the scenarios that come with the package."""
    return sorted(path.stem for path in _scenario_directory().glob("*.yaml"))


def load_scenario(name_or_path: str | Path) -> Scenario:
    """Load a scenario by the name of one that is packaged, or from a YAML file.

    Raises
    ------
    ScenarioError
        If there is no such scenario or its file is wrong.
    """
    text = str(name_or_path)
    path = Path(name_or_path)
    if path.suffix not in (".yaml", ".yml") and len(path.parts) == 1:
        path = _scenario_directory() / f"{text}.yaml"
        if not path.is_file():
            raise ScenarioError(
                f"unknown scenario {text!r}, available: {', '.join(list_scenarios())}"
                " (or the path of a .yaml file)"
            )
    document = parse_yaml(read_text(path), str(path))
    if not isinstance(document, Mapping) or len(document) != 1:
        raise ScenarioError(f"{path}: expected one top-level key, the scenario's name")
    ((name, mapping),) = document.items()
    return Scenario.from_mapping(name, mapping)


def _scenario_directory() -> Path:
    """Return where the scenarios are: in the package, or in the source tree."""
    package = Path(__file__).resolve().parent
    installed = package / "scenarios"
    return (
        installed if installed.is_dir() else package.parents[1] / "examples/scenarios"
    )


def _periods(node: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    """Yield dotted key and owner of each `period` that is the control period."""
    for name, owner in owners(node).items():
        child = f"{key}.{name}" if key else name
        if child == "filter.period":  # The filter has a rate of its own.
            continue
        if name == "period" and is_params(owner):
            yield child, owner
        else:
            value = getattr(owner, name)
            if is_params(value) or hasattr(type(value), "__dataclass_fields__"):
                yield from _periods(value, child)


def _derived(scenario: Scenario) -> dict[str, str]:
    derived = dict.fromkeys((key for key, _ in _periods(scenario)), "scene.time_step")
    return derived | _SHARED
