# SPDX-License-Identifier: BSD-3-Clause
"""The Panda's plant in Drake alone, along a motion that a run has logged."""

from __future__ import annotations

from typing import Any

import dual_proxy._pydrake  # noqa: F401

# isort: split
import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pydrake.geometry import (
    AddContactMaterial,
    CollisionFilterDeclaration,
    GeometrySet,
    ProximityProperties,
    Role,
)
from pydrake.multibody.plant import CoulombFriction
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from dual_proxy.log import signal
from dual_proxy.panda import PandaScene, add_panda_scene
from dual_proxy.scenario import Scenario

__all__ = ["RecordedPlant"]


class RecordedPlant:
    """The plant of a scenario, driven by the torques of a run of it.

    Without a controller the elbow's free motion is unstable: it has to be put back
    now and then (`follow`).

    Parameters
    ----------
    scenario : what was run.
    log : of the run, every period.
    drawn : whether arm, tool and surfaces can be seen.
    colliding : whether the arm's links can touch the surfaces, with the shapes that
        are seen; they have to be `drawn`.
    """

    def __init__(
        self,
        scenario: Scenario,
        log: pd.DataFrame,
        drawn: bool = False,
        colliding: bool = False,
    ) -> None:
        self._times = log.index.to_numpy()
        self._q: Any = signal(log, "joint_position")
        self._v: Any = signal(log, "joint_velocity")
        torques: Any = signal(log, "torque")
        # A row of the log holds the torque of the period that ends with it. It is
        # taken up at that period's begin: the pieces change half a period earlier.
        self._period = scenario.control_period
        hold = PiecewisePolynomial.ZeroOrderHold(
            self._times - 1.5 * self._period, torques.T
        )
        builder = DiagramBuilder()
        scene = add_panda_scene(builder, scenario.scene, self._q[0], drawn=drawn)
        if colliding:
            _make_links_collide(scene)
        source = builder.AddSystem(TrajectorySource(hold))
        builder.Connect(source.get_output_port(), scene.actuation_port)
        self._plant = scene.plant
        self.simulator = Simulator(builder.Build())

    def start(self, time: float) -> None:
        """Begin at a time of the run, s."""
        context: Any = self.simulator.get_system().CreateDefaultContext()
        context.SetTime(time)
        self.simulator.reset_context(context)
        self.simulator.Initialize()
        self._put(time)

    def follow(self, time: float) -> None:
        """Put the arm where it was in the run at this time, s, from where it is
        near to it."""
        away = np.abs(self.state[: len(self._q[0])] - self._q[self._row(time)]).max()
        assert away < 1e-3, f"not the motion of the run: {away} rad at {time} s"
        self._put(time)

    @property
    def state(self) -> NDArray[np.float64]:
        """Joint positions, rad, and velocities, rad/s."""
        state: Any = self._plant.GetPositionsAndVelocities(self._context())
        return np.asarray(state, dtype=np.float64)

    def _put(self, time: float) -> None:
        row = self._row(time)
        self._plant.SetPositions(self._context(), self._q[row])
        self._plant.SetVelocities(self._context(), self._v[row])

    def _context(self) -> Any:
        root = self.simulator.get_mutable_context()
        return self._plant.GetMyMutableContextFromRoot(root)

    def _row(self, time: float) -> int:
        # The controller, and the log, see the state of the step before.
        return int(np.searchsorted(self._times, time + 1.5 * self._period))


def _make_links_collide(scene: PandaScene) -> None:
    """Let what is seen of the links touch everything but the arm itself."""
    plant, graph = scene.plant, scene.scene_graph
    inspector = graph.model_inspector()
    properties = ProximityProperties()
    AddContactMaterial(
        dissipation=scene.params.contact_dissipation,
        point_stiffness=scene.params.contact_stiffness,
        friction=CoulombFriction(scene.params.friction, scene.params.friction),
        properties=properties,
    )
    own = GeometrySet()
    for index in plant.GetBodyIndices(scene.arm):
        frame = plant.GetBodyFrameIdOrThrow(index)
        own.Add(frame)
        if index == scene.tool_body:
            continue
        for geometry in inspector.GetGeometries(frame, Role.kIllustration):
            graph.AssignRole(plant.get_source_id(), geometry, properties)
    graph.collision_filter_manager().Apply(
        CollisionFilterDeclaration().ExcludeWithin(own)
    )
