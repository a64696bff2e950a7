# SPDX-License-Identifier: BSD-3-Clause
"""Each side's work of a control period as one system.

A call from Drake into Python costs more than the algorithms themselves, so the
station runs each side as one face over one compiled call. The separate faces,
wired in a row, give the same bits.
"""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import EventStatus, LeafSystem

from dual_proxy import _core
from dual_proxy.panda import NUM_JOINTS, PandaModel, PandaTerms
from dual_proxy.systems._face import (
    Context,
    Output,
    State,
    check_vector,
    matrix,
    message,
    pose,
    rigid_transform,
    vector,
)
from dual_proxy.systems.control import declare_model_terms

_EMPTY = _core.PoseMessage()


class _Side(LeafSystem):
    """What both sides share: the algorithm's state in the Context, and all
    results of the last step as one vector, `signals`."""

    def __init__(self, layout: dict[str, slice], period: float) -> None:
        super().__init__()
        self.layout = layout
        self._period = period

    def _declare(self, start: object, size: int) -> None:
        self._memory = self.DeclareAbstractState(AbstractValue.Make(start))
        self._signals = self.DeclareDiscreteState(size)
        self.DeclareStateOutputPort("signals", self._signals)
        self.DeclarePeriodicUnrestrictedUpdateEvent(self._period, 0.0, self._advance)

    def _declare_slice(self, name: str) -> None:
        """Declares an output port with one of the signals."""
        where = self.layout[name]
        index = int(self._signals)

        def calc(context: Context, output: Output) -> None:
            output.SetFromVector(context.get_discrete_state(index).value()[where])

        self.DeclareVectorOutputPort(
            name,
            where.stop - where.start,
            calc,
            {self.discrete_state_ticket(self._signals)},
        )

    def _declare_message(self, name: str, model: object, attribute: str) -> None:
        def calc(context: Context, output: Output) -> None:
            state = context.get_abstract_state(int(self._memory)).get_value()
            output.set_value(getattr(state.output, attribute))

        self.DeclareAbstractOutputPort(
            name,
            lambda: AbstractValue.Make(model),
            calc,
            {self.abstract_state_ticket(self._memory)},
        )

    def _advance(self, context: Context, state: State) -> EventStatus:
        raise NotImplementedError


class RobotSide(_Side):
    """The robot's side: proxy, controller, means for the filter, sender.

    @system
    name: RobotSide
    input_ports:
    - haptic_message      # PoseMessage (optional: without it the robot waits)
    - robot_state         # 14, [q; v], rad, rad/s
    - sensed_wrench       # 6, [force; moment], N, N m, at E
    - force_selection     # 9, row-major 3x3 (optional, zero)
    - moment_selection    # 9, row-major 3x3 (optional, zero)
    output_ports:
    - signals             # all results, see `layout` (name -> slice)
    - torque              # 7, N m, with gravity compensation
    - robot_pose          # RigidTransform X_BE, at the current `robot_state`
    - message             # PoseMessage, to the haptic side
    - force_message       # ForceMessage, for the two-channel baseline
    - mean_sensed_force   # 3, N, mean over the filter's current period
    - mean_velocity       # 3, m/s, likewise
    - mean_motion_force   # 3, N, likewise
    - mean_contact_force  # 3, N, likewise
    @endsystem

    Everything in the base frame B. Steps every `params.controller.period`; all
    outputs but `robot_pose` are those of the last step. Before the first the
    torque holds the arm at `q_start`.

    Parameters
    ----------
    model : PandaModel, the arm.
    params : RobotSideParams.
    q_start : (7,) rad, where the arm will be when the run starts.
    """

    def __init__(
        self,
        model: PandaModel,
        params: _core.RobotSideParams | None = None,
        q_start: np.ndarray | None = None,
    ) -> None:
        self._side = _core.RobotSide(deepcopy(params or _core.RobotSideParams()))
        super().__init__(
            self._side.output_layout(), self._side.params.controller.period
        )
        self._message = self.DeclareAbstractInputPort(
            "haptic_message", AbstractValue.Make(_core.PoseMessage())
        )
        self._robot_state = self.DeclareVectorInputPort("robot_state", 2 * NUM_JOINTS)
        self._sensed_wrench = self.DeclareVectorInputPort("sensed_wrench", 6)
        self._force_selection = self.DeclareVectorInputPort("force_selection", 9)
        self._moment_selection = self.DeclareVectorInputPort("moment_selection", 9)
        self._terms = declare_model_terms(self, model, self._robot_state)
        start = self._side.make_state()
        size = max(s.stop for s in self.layout.values())
        self._declare(start, size)
        torque: Any = np.zeros(NUM_JOINTS)
        if q_start is not None:
            q = check_vector("RobotSide", "q_start", q_start, NUM_JOINTS)
            torque = -model.calc(q, np.zeros(NUM_JOINTS)).gravity
        self._torque = self.DeclareDiscreteState(torque)
        self.DeclareStateOutputPort("torque", self._torque)
        self.DeclareAbstractOutputPort(
            "robot_pose",
            Value[RigidTransform],
            self._calc_pose,
            {self._terms.ticket()},
        )
        self._declare_message("message", _core.PoseMessage(), "message")
        self._declare_message("force_message", _core.ForceMessage(), "force_message")
        for signal in (
            "mean_sensed_force",
            "mean_velocity",
            "mean_motion_force",
            "mean_contact_force",
        ):
            self._declare_slice(signal)

    def _calc_pose(self, context: Context, output: Output) -> None:
        terms: Any = self._terms.Eval(context)
        output.set_value(rigid_transform(terms.p_BE, terms.R_BE))

    def _advance(self, context: Context, state: State) -> EventStatus:
        x: Any = self._robot_state.Eval(context)
        value: Any = self._terms.Eval(context)
        terms: PandaTerms = value
        memory = state.get_mutable_abstract_state(int(self._memory)).get_mutable_value()
        self._side.update(
            context.get_time(),
            message(self._message, context, _EMPTY),
            *terms,
            x[:NUM_JOINTS],
            x[NUM_JOINTS:],
            matrix(self._force_selection, context),
            matrix(self._moment_selection, context),
            vector(self._sensed_wrench, context),
            memory,
        )
        outputs = state.get_mutable_discrete_state()
        signals = memory.output.as_vector()
        outputs.set_value(int(self._signals), signals)
        outputs.set_value(int(self._torque), signals[self.layout["torque"]])
        return EventStatus.Succeeded()


class HapticSide(_Side):
    """The device's side: proxy, controller, sender.

    @system
    name: HapticSide
    input_ports:
    - robot_message       # PoseMessage (optional: without it there is no force,
                          # but messages are sent)
    - device_pose         # RigidTransform X_DH, from the device's home
    - device_velocity     # 6, [linear; angular], m/s, rad/s
    output_ports:
    - signals             # all results, see `layout` (name -> slice)
    - device_wrench       # 6, [force; moment], N, N m, of the device on the hand
    - message             # PoseMessage, to the robot side
    @endsystem

    Everything in the device's frame D. Steps every `params.controller.period`;
    the outputs are those of the last step, zero before the first.

    Parameters
    ----------
    params : HapticSideParams.
    """

    def __init__(self, params: _core.HapticSideParams | None = None) -> None:
        self._side = _core.HapticSide(deepcopy(params or _core.HapticSideParams()))
        super().__init__(
            self._side.output_layout(), self._side.params.controller.period
        )
        self._message = self.DeclareAbstractInputPort(
            "robot_message", AbstractValue.Make(_core.PoseMessage())
        )
        self._pose = self.DeclareAbstractInputPort(
            "device_pose", Value[RigidTransform]()
        )
        self._velocity = self.DeclareVectorInputPort("device_velocity", 6)
        size = max(s.stop for s in self.layout.values())
        self._declare(self._side.make_state(), size)
        self._wrench = self.DeclareDiscreteState(6)
        self.DeclareStateOutputPort("device_wrench", self._wrench)
        self._declare_message("message", _core.PoseMessage(), "message")

    def _advance(self, context: Context, state: State) -> EventStatus:
        memory = state.get_mutable_abstract_state(int(self._memory)).get_mutable_value()
        self._side.update(
            context.get_time(),
            message(self._message, context, _EMPTY),
            *pose(self._pose, context),
            self._velocity.Eval(context),
            memory,
        )
        outputs = state.get_mutable_discrete_state()
        outputs.set_value(int(self._signals), memory.output.as_vector())
        outputs.set_value(int(self._wrench), memory.output.device_wrench)
        return EventStatus.Succeeded()
