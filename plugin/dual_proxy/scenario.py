# SPDX-License-Identifier: BSD-3-Clause
"""A scenario: everything that decides what a run does, from one YAML file.

The file has one top-level key, the scenario's name; below it are the sections
of `Scenario`. What is not written keeps its default, an unknown key is an
error. The schema is the C++ `Scenario` (plugin/experiment/scenario.h), and
Drake's YAML reader reads the same files into it. The sections that belong to an
algorithm *are* its `...Params` struct, so their fields, units and ranges are
those of the class.

Some values are needed in several places. Each is written once and copied where
it is needed; writing a copy is an error that names the original:

- `control_period` is the period of everything that runs at the control rate, the
  log among it; the plant's step, `scene.time_step`, is another matter.
- `scene.start_position` is `map.p_cw`: the device's home is the robot's start.
- `map` and the link's monitor belong to both sides.
- `robot_proxy.stiffness` is what the haptic side matches its own to.

In order of precedence, later wins: defaults, the YAML file, the presets of
`scheme` and `law`, and explicit overrides (`--set` on the command line,
`Scenario.with_overrides`, or the section `overrides` in YAML, which has the
same keys as the scenario itself).
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dual_proxy import _core
from dual_proxy._core import LinkParams, OperatorParams, ScenarioError, Waypoint
from dual_proxy.settings import dump_yaml, parse_yaml, read_text

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
SCHEMES = _core.Scenario.SCHEMES
#: `default` is this project's law, `printed` the paper's to the letter.
LAWS = _core.Scenario.LAWS


class OperatorMotion(NamedTuple):
    """Where the operator means the robot's tool to go."""

    times: NDArray[np.float64]
    """(n,), s, strictly increasing from 0."""
    positions: NDArray[np.float64]
    """(n, 3), m, in B."""
    sampled: bool
    """True: a densely sampled path; False: waypoints, a minimum-jerk move
    between each and the next."""
    rotations: NDArray[np.float64]
    """(n, 3), rad, in B: rotation vectors of the tool from `map.R_cw`; (0, 3) if
    it is not to turn."""
    scale: float
    """Lengths in it per length that was recorded; 1 for waypoints."""
    note: str
    """One line about the recording: how long, how large, what was scaled, what
    ignored; empty for waypoints."""


class Scenario(_core.Scenario):
    """Everything that decides what a run does; see `Scenario.fields`.

    Made by `load_scenario`. Fields may be changed; call `validate` afterwards
    (`dual_proxy.run` does), or use `with_overrides`, which leaves the original
    as it is.
    """

    # What presets replaced, to put back when another preset is chosen: a part
    # of the mapping that `_read` reads.
    __slots__ = ("_displaced",)
    _displaced: dict[str, Any]

    def __init__(self, **fields: Any) -> None:
        super().__init__(**fields)
        self._displaced = {}

    def __getstate__(self) -> Any:
        return super().__getstate__(), self._displaced

    def __setstate__(self, state: Any) -> None:
        fields, self._displaced = state
        super().__setstate__(fields)

    def __copy__(self) -> Scenario:
        return copy.deepcopy(self)

    def __deepcopy__(self, memo: dict[int, Any]) -> Scenario:
        twin = Scenario.__new__(Scenario)
        twin.__setstate__(copy.deepcopy(self.__getstate__(), memo))
        return twin

    @classmethod
    def from_mapping(
        cls, name: str, mapping: Any, directory: str | Path = ""
    ) -> Scenario:
        """Make a checked scenario from the mapping below the top-level key.

        A path in it is relative to `directory`, by default the working one.

        Raises
        ------
        ScenarioError
            One line: the dotted field, what was expected, what was found.
        """
        if not (isinstance(name, str) and 0 < len(name) <= 100 and name.isprintable()):
            raise ScenarioError(
                f"a scenario's name: expected 1 to 100 printable characters, got "
                f"{name!r:.200}"
            )
        if not isinstance(mapping, Mapping):
            raise ScenarioError(f"{name}: expected a mapping, got {mapping!r:.200}")
        scenario = cls(name=name)
        scenario._read(dict(mapping))
        plain = cls(name=name)
        choices = ("scheme", "law", "overrides")
        plain._read({k: v for k, v in mapping.items() if k not in choices})
        plain.scheme, plain.law = scenario.scheme, scenario.law
        before = plain._write()
        plain._apply_presets()
        scenario._displaced = _difference(before, plain._write())
        scenario._resolve_paths(str(directory))
        scenario.validate()
        return scenario

    def validate(self) -> None:
        """Copy shared values to where they are needed and check everything.

        A recording's path becomes absolute; a relative one is in the working
        directory.

        Raises
        ------
        ScenarioError
            For the first field that is out of range or contradicts another.
        """
        super().validate()

    def with_overrides(self, overrides: Mapping[str, Any]) -> Scenario:
        """Return a checked copy with some values replaced.

        Parameters
        ----------
        overrides : Mapping[str, Any]
            Dotted keys below the scenario's name, e.g. `{"link.delay": 0.15}`.
            `scheme` and `law` bring their presets; the other keys win over any
            preset. `duration` turns `extend_for_delay` off.

        Raises
        ------
        ScenarioError
            If a key or a value is wrong, or `overrides` is no mapping.
        """
        if not isinstance(overrides, Mapping):
            raise ScenarioError(
                f"overrides: expected a mapping of dotted keys, got {overrides!r:.200}"
            )
        mapping = self.to_mapping()
        explicit = mapping.pop("overrides", {})
        _merge(mapping, self._displaced)
        if "duration" in overrides:
            explicit["extend_for_delay"] = False
        for key, value in overrides.items():
            for part in reversed(key.split(".")):
                value = {part: value}
            _merge(mapping if key in ("scheme", "law") else explicit, value)
        return Scenario.from_mapping(self.name, {**mapping, "overrides": explicit})

    def to_mapping(self) -> dict[str, Any]:
        """Return what `from_mapping` makes an equal scenario of."""
        mapping = self._write()
        preset = copy.copy(self)
        preset._apply_presets()
        overrides = _difference(mapping, preset._write())
        return {**mapping, "overrides": overrides} if overrides else mapping

    def to_yaml(self) -> str:
        """Return the scenario with every value, as `load_scenario` reads it."""
        return dump_yaml({self.name: self.to_mapping()})

    def operator_motion(self) -> OperatorMotion:
        """Return the operator's intended path.

        Raises
        ------
        ScenarioError
            If a recording cannot be read; the message names file, row, column.
        """
        return OperatorMotion(*self._calc_operator_path())


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
        available = list_scenarios()
        if text not in available:
            raise ScenarioError(
                f"unknown scenario {text!r:.100}, available: {', '.join(available)}"
                " (or the path of a .yaml file)"
            )
    document = parse_yaml(read_text(path), str(path))
    if not isinstance(document, Mapping) or len(document) != 1:
        raise ScenarioError(f"{path}: expected one top-level key, the scenario's name")
    ((name, mapping),) = document.items()
    return Scenario.from_mapping(name, mapping, path.parent)


def _scenario_directory() -> Path:
    """Return where the scenarios are: in the package, or in the source tree."""
    package = Path(__file__).resolve().parent
    installed = package / "scenarios"
    return (
        installed if installed.is_dir() else package.parents[1] / "examples/scenarios"
    )


def _difference(mapping: dict[str, Any], other: dict[str, Any]) -> dict[str, Any]:
    """Return the leaves of `mapping` that `other`, of the same keys, has not."""
    result: dict[str, Any] = {}
    for key, value in mapping.items():
        if isinstance(value, dict):
            if inner := _difference(value, other[key]):
                result[key] = inner
        elif value != other[key]:
            result[key] = value
    return result


def _merge(mapping: dict[str, Any], changes: Mapping[str, Any]) -> None:
    """Set the leaves of `changes` in `mapping`, which is changed in place."""
    for key, value in changes.items():
        if isinstance(value, Mapping) and isinstance(mapping.get(key), dict):
            _merge(mapping[key], value)
        else:
            mapping[key] = copy.deepcopy(value)
