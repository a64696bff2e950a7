# SPDX-License-Identifier: BSD-3-Clause
"""The scene of a Panda above a table, as plain numbers (no Drake).

The frame is the robot base B, which is Drake's world.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from dual_proxy.settings import ScenarioError, check

__all__ = ["TIP_RADIUS", "TOOL_COM_S", "TOOL_MASS", "BoxParams", "PandaSceneParams"]

#: Radius of the tool's spherical tip around E, m.
TIP_RADIUS = 0.010
#: Mass beyond the flange, kg, and its centre of mass, (3,), m, in S.
TOOL_MASS = 0.2
TOOL_COM_S = (0.0, 0.0, 0.035)


@dataclass(slots=True)
class BoxParams:
    """A box fixed in the world that the tool can touch."""

    name: str = field(
        default="", metadata={"doc": "unique within the scene", "required": True}
    )
    center: tuple[float, ...] = field(
        default=(0.5, 0.0, 0.1), metadata={"doc": "in B, m", "required": True}
    )
    size: tuple[float, ...] = field(
        default=(0.1, 0.1, 0.1),
        metadata={
            "doc": "full edge lengths along the box's axes, m",
            "min": 1e-4,
            "max": 10.0,
            "required": True,
        },
    )
    yaw: float = field(
        default=0.0, metadata={"doc": "rotation of the box about base z, rad"}
    )
    color: tuple[float, ...] = field(
        default=(0.80, 0.70, 0.56, 1.0),
        metadata={"doc": "red, green, blue, opacity", "min": 0.0, "max": 1.0},
    )

    def __post_init__(self) -> None:
        check(self, "BoxParams")


@dataclass(slots=True)
class PandaSceneParams:
    """The simulated arm's surroundings and how contact is computed."""

    table_height: float = field(
        default=0.10,
        metadata={
            "doc": "height of the table's top over B, m; the table stands on z = 0",
            "min": 1e-3,
            "max": 1.5,
        },
    )
    table_center: tuple[float, ...] = field(
        default=(0.5, 0.0), metadata={"doc": "x and y of the table's centre, m"}
    )
    table_size: tuple[float, ...] = field(
        default=(0.6, 0.8),
        metadata={"doc": "edge lengths along x and y, m", "min": 1e-3, "max": 10.0},
    )
    boxes: list[BoxParams] = field(
        default_factory=list,
        metadata={"doc": "further boxes that the tool can touch (walls, steps)"},
    )
    friction: float = field(
        default=0.3,
        metadata={
            "doc": "Coulomb coefficient between the tool and everything",
            "min": 0.0,
            "max": 5.0,
        },
    )
    contact_stiffness: float = field(
        default=3e4,
        metadata={
            "doc": "of tool and surface together, N/m",
            "min": 1.0,
            "max": 1e8,
        },
    )
    contact_dissipation: float = field(
        default=10.0,
        metadata={
            "doc": "Hunt-Crossley coefficient d in f = k x (1 + d dx/dt), s/m; "
            "for the approximations lagged and similar",
            "min": 0.0,
            "max": 1e3,
        },
    )
    relaxation_time: float = field(
        default=0.01,
        metadata={
            "doc": "linear dissipation in place of contact_dissipation for sap, s",
            "min": 0.0,
            "max": 10.0,
        },
    )
    contact_approximation: str = field(
        default="lagged",
        metadata={
            "doc": "Drake's discrete contact approximation; lagged and similar "
            "keep Coulomb's law without sap's gap of friction * time_step * slip",
            "choices": ("lagged", "similar", "sap"),
        },
    )
    time_step: float = field(
        default=1e-3,
        metadata={
            "doc": "step of the plant, and period of both sides' control, s",
            "min": 1e-5,
            "max": 1e-2,
        },
    )
    tool_mass: float = field(
        default=TOOL_MASS,
        metadata={
            "doc": "of all that is beyond the flange, kg; the inertia scales with it",
            "min": 1e-3,
            "max": 3.0,
        },
    )
    gravity: float = field(
        default=9.81, metadata={"doc": "along -z of B, m/s^2", "min": 0.0, "max": 100.0}
    )
    start_position: tuple[float, ...] = field(
        default=(0.45, 0.0, 0.18),
        metadata={"doc": "of the tool point at time 0, m", "min": -2.0, "max": 2.0},
    )

    def __post_init__(self) -> None:
        self.validate()

    def validate(self, path: str = "PandaSceneParams") -> None:
        """Check every field.

        Parameters
        ----------
        path : str
            What errors call this object.

        Raises
        ------
        ScenarioError
            Naming the field, the range and the value.
        """
        check(self, path)
        names = [box.name for box in self.all_boxes()]
        if len(set(names)) != len(names) or "" in names:
            raise ScenarioError(
                f"{path}.boxes: expected names used once, not empty and not "
                f"'table', got {names[1:]}"
            )

    def all_boxes(self) -> tuple[BoxParams, ...]:
        """Return the table followed by `boxes`."""
        table = BoxParams(
            name="table",
            center=(*self.table_center, self.table_height / 2),
            size=(*self.table_size, self.table_height),
        )
        return (table, *self.boxes)

    @property
    def contact_height(self) -> float:
        """Height of the tool point when the tool touches the table, m."""
        return self.table_height + TIP_RADIUS
