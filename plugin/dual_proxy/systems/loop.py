# SPDX-License-Identifier: BSD-3-Clause
"""Everything but the robot as one system: the fast way to run a scenario."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialForce
from pydrake.systems.framework import EventStatus, LeafSystem

from dual_proxy import _core
from dual_proxy.native import NativeTwin
from dual_proxy.panda import NUM_JOINTS, PandaModel
from dual_proxy.systems._face import (
    Context,
    Memory,
    Output,
    State,
    check_vector,
    rigid_transform,
)


class TeleopLoop(NativeTwin, LeafSystem):
    """Both sides, the link, the simulated sensor, device and operator.

    @system
    name: TeleopLoop
    input_ports:
    - robot_state         # 14, [q; v], rad, rad/s
    - reaction_forces     # abstract, list of SpatialForce, of the plant
    output_ports:
    - torque              # 7, N m, with gravity compensation
    - signals             # all results, see `layout` (name -> slice)
    - sensed_wrench       # 6, [force; moment] at E, N, N m
    - device_pose         # RigidTransform X_DH, in the device's frame D
    - device_wrench       # 6, [force; moment], N, N m, on the hand, in D
    - force_selection     # 9, row-major 3x3, and
    - dimension           # 1: what the filter has found
    - moment_selection    # 9 and
    - moment_dimension    # 1: the angular filter, likewise
    @endsystem

    In the base frame B unless said. Steps every control period; the outputs are
    those of the last step. Before the first the torque holds the arm at
    `q_start`. The same bits as RobotSide, HapticSide and two
    CommunicationChannels, in a fraction of the time: a call from Drake into
    Python costs more than the algorithms.

    Parameters
    ----------
    scenario : Scenario, what to run; not changed.
    model : PandaModel, the arm with the scenario's tool.
    sensor_joint : `PandaScene.sensor_joint`.
    q_start : (7,) rad, where the arm will be when the run starts.
    """

    def __init__(
        self,
        scenario: Any,
        model: PandaModel,
        sensor_joint: int,
        q_start: np.ndarray | None = None,
    ) -> None:
        super().__init__()
        self._loop = _core._TeleopLoop(scenario, model.arm_params)
        self._sensor_joint = sensor_joint
        self._native_arguments = {
            "scenario": scenario,
            "arm": model.arm_params,
            "sensor_joint": sensor_joint,
            "q_start": q_start,
        }
        #: Of the port `signals`: name -> slice.
        self.layout = self._loop.layout
        self._robot_state = self.DeclareVectorInputPort("robot_state", 2 * NUM_JOINTS)
        self._forces = self.DeclareAbstractInputPort(
            "reaction_forces", Value[list[SpatialForce]]()
        )
        start = Memory(self._loop.make_state())
        memory = self.DeclareAbstractState(AbstractValue.Make(start))
        self._memory = int(memory)
        self._memory_ticket = self.abstract_state_ticket(memory)
        torque: Any = np.zeros(NUM_JOINTS)
        if q_start is not None:
            q_start = check_vector("TeleopLoop", "q_start", q_start, NUM_JOINTS)
            torque = self._loop.holding_torque(q_start)
        held = self.DeclareDiscreteState(torque)
        self._torque = int(held)
        self.DeclareStateOutputPort("torque", held)
        size = max(where.stop for where in self.layout.values())
        signals = self.DeclareDiscreteState(size)
        self._signals = int(signals)
        self.DeclareStateOutputPort("signals", signals)
        self._declare_output("sensed_wrench", 6, lambda state: state.sensed_wrench)
        self.DeclareAbstractOutputPort(
            "device_pose",
            Value[RigidTransform],
            self._calc_device_pose,
            {self._memory_ticket},
        )
        self._declare_output("device_wrench", 6, lambda state: state.device_wrench)
        self._declare_found("force_selection", "dimension", "filter")
        self._declare_found("moment_selection", "moment_dimension", "angular_filter")
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            self._loop.period, 0.0, self._advance
        )

    def _state(self, context: Context) -> Any:
        return context.get_abstract_state(self._memory).get_value().state

    def _declare_output(
        self, name: str, size: int, read: Callable[[Any], ArrayLike]
    ) -> None:
        def calc(context: Context, output: Output) -> None:
            output.SetFromVector(np.reshape(read(self._state(context)), size))

        self.DeclareVectorOutputPort(name, size, calc, {self._memory_ticket})

    def _declare_found(self, selection: str, dimension: str, found: str) -> None:
        self._declare_output(
            selection, 9, lambda state: getattr(state, found).force_selection
        )
        self._declare_output(
            dimension, 1, lambda state: getattr(state, found).dimension
        )

    def _calc_device_pose(self, context: Context, output: Output) -> None:
        X_DH = self._state(context).device_pose
        output.set_value(rigid_transform(X_DH.p, X_DH.R))

    def _advance(self, context: Context, state: State) -> EventStatus:
        memory = state.get_mutable_abstract_state(self._memory)
        time = context.get_time()
        x: Any = self._robot_state.Eval(context)
        force = moment = None
        # A simulated plant has no reaction before its first step.
        if time > 0:
            forces: Any = self._forces.Eval(context)
            reaction = forces[self._sensor_joint]
            force, moment = reaction.translational(), reaction.rotational()
        outputs = state.get_mutable_discrete_state()
        after = self._loop.step(
            time,
            memory.get_value().state,
            x,
            force,
            moment,
            outputs.get_mutable_value(self._torque),
            outputs.get_mutable_value(self._signals),
        )
        memory.set_value(Memory(after))
        return EventStatus.Succeeded()
