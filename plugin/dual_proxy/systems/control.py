# SPDX-License-Identifier: BSD-3-Clause
"""Faces of the local controllers, and the arm's kinematics that they need."""

from __future__ import annotations

from copy import deepcopy
from operator import attrgetter
from typing import Any

from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import LeafSystem

from dual_proxy import _core
from dual_proxy.native import NativeTwin
from dual_proxy.panda import NUM_JOINTS, PandaModel, PandaTerms
from dual_proxy.systems._face import (
    Context,
    Face,
    Output,
    Stepped,
    Vector,
    flag,
    matrix,
    rigid_transform,
    vector,
)


def model_terms(model: PandaModel, robot_state: Vector) -> PandaTerms:
    """Returns the model terms at [q; v], not numbers where the state is none."""
    return model.calc(robot_state[:NUM_JOINTS], robot_state[NUM_JOINTS:])


class ArmKinematics(NativeTwin, LeafSystem):
    """Pose and twist of the tool point from the arm's state; no memory.

    @system
    name: ArmKinematics
    input_ports:
    - robot_state      # 14, [q; v], rad, rad/s
    output_ports:
    - robot_pose       # RigidTransform X_BE
    - robot_velocity   # 6, [linear; angular] of E in B, m/s, rad/s
    @endsystem

    Parameters
    ----------
    model : PandaModel, the arm; by default with the project's own tool.
    """

    def __init__(self, model: PandaModel | None = None) -> None:
        super().__init__()
        self._model = model or PandaModel()
        self._native_arguments = {"arm": self._model.arm_params}
        self._robot_state = self.DeclareVectorInputPort("robot_state", 2 * NUM_JOINTS)
        inputs = {self._robot_state.ticket()}
        self.DeclareAbstractOutputPort(
            "robot_pose", Value[RigidTransform], self._calc_pose, inputs
        )
        self.DeclareVectorOutputPort(
            "robot_velocity",
            6,
            self._calc_velocity,
            inputs,
        )

    def _calc_pose(self, context: Context, output: Output) -> None:
        x: Any = self._robot_state.Eval(context)
        terms = model_terms(self._model, x)
        output.set_value(rigid_transform(terms.p_BE, terms.R_BE))

    def _calc_velocity(self, context: Context, output: Output) -> None:
        x: Any = self._robot_state.Eval(context)
        terms = model_terms(self._model, x)
        v = x[NUM_JOINTS:]
        output.SetFromVector(_core.RobotSide.calc_twist(terms.J_BE, v))


class OperationalSpaceController(Face):
    """Unified force/motion control of the arm, eq. (10) to (17).

    @system
    name: OperationalSpaceController
    input_ports:
    - robot_state          # 14, [q; v], rad, rad/s
    - motion_error         # 3, m
    - rotation_error       # 3, rad
    - reference_force      # 3, N
    - reference_moment     # 3, N m
    - force_selection      # 9, row-major 3x3
    - moment_selection     # 9, row-major 3x3
    - sensed_wrench        # 6, [force; moment], N, N m, at E
    - proxy_velocity       # 6, [linear; angular], m/s, rad/s
    - proxy_acceleration   # 6, [linear; angular], m/s^2, rad/s^2
    - sensor_ready         # 1, > 0.5 if the force sensor can be relied on
    output_ports:
    - torque               # 7, N m, with gravity compensation
    - motion_force         # 3: F_m, N, or of a unit mass (see the params)
    - contact_force        # 3, N: F_f
    - observed_energy      # 1, J
    - injected_damping     # 1, N s/m
    @endsystem

    Everything in the base frame B. All inputs but `robot_state` are optional
    and zero; without a connection the sensor is ready. Steps every
    `params.period`, with feedthrough.

    Parameters
    ----------
    params : OperationalSpaceControllerParams.
    model : PandaModel, the arm; by default with the project's own tool.
    """

    def __init__(
        self,
        params: _core.OperationalSpaceControllerParams | None = None,
        model: PandaModel | None = None,
    ) -> None:
        super().__init__(feedthrough=True)
        self._model = model or PandaModel()
        self._controller = _core.OperationalSpaceController(
            deepcopy(params or _core.OperationalSpaceControllerParams())
        )
        self._native_arguments = {
            "params": self._controller.params,
            "arm": self._model.arm_params,
        }
        declare = self.DeclareVectorInputPort
        self._robot_state = declare("robot_state", 2 * NUM_JOINTS)
        self._motion_error = declare("motion_error", 3)
        self._rotation_error = declare("rotation_error", 3)
        self._reference_force = declare("reference_force", 3)
        self._reference_moment = declare("reference_moment", 3)
        self._force_selection = declare("force_selection", 9)
        self._moment_selection = declare("moment_selection", 9)
        self._sensed_wrench = declare("sensed_wrench", 6)
        self._proxy_velocity = declare("proxy_velocity", 6)
        self._proxy_acceleration = declare("proxy_acceleration", 6)
        self._sensor_ready = declare("sensor_ready", 1)
        self._declare_memory(
            Stepped(self._controller.make_state()), self._controller.params.period
        )
        for name, size in (
            ("torque", NUM_JOINTS),
            ("motion_force", 3),
            ("contact_force", 3),
            ("observed_energy", 1),
            ("injected_damping", 1),
        ):
            self._declare_vector_output(name, size, attrgetter(f"output.{name}"))

    def _step(self, context: Context, state: Stepped) -> None:
        x: Any = self._robot_state.Eval(context)
        terms = model_terms(self._model, x)
        state.output = self._controller.update(
            terms.J_BE,
            terms.mass,
            terms.bias,
            terms.gravity,
            terms.Jdot_v,
            x[:NUM_JOINTS],
            x[NUM_JOINTS:],
            vector(self._motion_error, context),
            vector(self._rotation_error, context),
            vector(self._proxy_velocity, context),
            vector(self._proxy_acceleration, context),
            vector(self._reference_force, context),
            vector(self._reference_moment, context),
            matrix(self._force_selection, context),
            matrix(self._moment_selection, context),
            vector(self._sensed_wrench, context),
            state.state,
            flag(self._sensor_ready, context, True),
        )


class HapticController(Face):
    """The device's controller, eq. (18): the force on the hand, with damping.

    @system
    name: HapticController
    input_ports:
    - reference_force    # 3, N: F_h
    - reference_moment   # 3, N m
    - device_velocity    # 6, [linear; angular], m/s, rad/s
    - force_selection    # 9, row-major 3x3
    output_ports:
    - device_wrench      # 6, [force; moment], N, N m: of the device on the hand
    @endsystem

    Everything in the device's frame D; inputs that are not connected are zero.
    Steps every `params.period`, with feedthrough.

    Parameters
    ----------
    params : HapticControllerParams.
    """

    def __init__(self, params: _core.HapticControllerParams | None = None) -> None:
        super().__init__(feedthrough=True)
        self._controller = _core.HapticController(
            deepcopy(params or _core.HapticControllerParams())
        )
        self._native_arguments = {"params": self._controller.params}
        declare = self.DeclareVectorInputPort
        self._reference_force = declare("reference_force", 3)
        self._reference_moment = declare("reference_moment", 3)
        self._device_velocity = declare("device_velocity", 6)
        self._force_selection = declare("force_selection", 9)
        self._declare_memory(
            Stepped(self._controller.make_state()), self._controller.params.period
        )
        self._declare_vector_output("device_wrench", 6, lambda state: state.output)

    def _step(self, context: Context, state: Stepped) -> None:
        state.output = self._controller.update(
            vector(self._reference_force, context),
            vector(self._reference_moment, context),
            vector(self._device_velocity, context),
            matrix(self._force_selection, context),
            state.state,
        )
