# SPDX-License-Identifier: BSD-3-Clause
"""Faces of what stands in for a person and for hardware."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import numpy as np

from dual_proxy import _core
from dual_proxy.systems._face import (
    Context,
    Face,
    Vector,
    check_vector,
    flag,
    pose,
    vector,
)


class ForceTorqueSensor(Face):
    """A wrist force/torque sensor: noise, bias, low-pass; and its adapter, which
    learns the bias and removes the tool's weight and inertia.

    @system
    name: ForceTorqueSensor
    input_ports:
    - reaction        # 6, [force; moment], N, N m, in S: of the arm on the tool
    - robot_pose      # RigidTransform X_BE
    - tare            # 1, asks for the bias to be learned anew when it comes to
                      # exceed 0.5 (optional)
    - robot_velocity  # 6, [linear; angular], m/s, rad/s, in B: of the tool point
                      # (optional: where poses do not come at a whole multiple of
                      # the period, the tool's inertia can not be told from them)
    output_ports:
    - sensed_wrench   # 6, [force; moment], N, N m, in B, at E: of the robot on
                      # its environment; zero while the bias is being learned
    - ready           # 1: 1 if the bias is known, else 0
    - counters        # 2, so far: samples refused, times at rest that gave no bias
    @endsystem

    Steps every `params.period`, for the first time after one period, as a
    simulated plant has no reaction before its first step. The output is that of
    the last step, zero before the first.

    Parameters
    ----------
    params : ForceTorqueSensorParams.
    p_SE : (3,) m, tool point in the sensor's frame, whose axes are E's.
    seed : of the noise.
    """

    def __init__(
        self,
        params: _core.ForceTorqueSensorParams | None = None,
        p_SE: Vector | None = None,
        seed: int = 0,
    ) -> None:
        super().__init__(feedthrough=False)
        self._sensor = _core.ForceTorqueSensor(
            deepcopy(params or _core.ForceTorqueSensorParams())
        )
        self._p_SE = check_vector(
            "ForceTorqueSensor", "p_SE", np.zeros(3) if p_SE is None else p_SE, 3
        )
        self._native_arguments = {
            "params": self._sensor.params,
            "p_SE": self._p_SE,
            "seed": seed,
        }
        self._reaction = self.DeclareVectorInputPort("reaction", 6)
        self._pose = self._declare_pose_input("robot_pose")
        self._tare = self.DeclareVectorInputPort("tare", 1)
        self._velocity = self.DeclareVectorInputPort("robot_velocity", 6)
        period = self._sensor.params.period
        self._declare_memory(self._sensor.make_state(seed), period)
        self._declare_vector_output("sensed_wrench", 6, lambda state: state.wrench)
        self._declare_vector_output("ready", 1, lambda state: [state.ready])
        self._declare_vector_output(
            "counters", 2, lambda state: (state.bad_inputs, state.tares_refused)
        )

    def _step(self, context: Context, state: Any) -> None:
        # Not by an event's offset: period + k period is not always the others'
        # (k + 1) period, and the sensor would step before or after them.
        if context.get_time() <= 0.0:
            return
        self._sensor.update(
            self._reaction.Eval(context),
            *pose(self._pose, context),
            self._p_SE,
            state,
            flag(self._tare, context, False),
            self._velocity.Eval(context) if self._velocity.HasValue(context) else None,
        )


class SimulatedHapticDevice(Face):
    """A simulated Omega.7 in the hand of a simulated operator.

    @system
    name: SimulatedHapticDevice
    input_ports:
    - device_wrench       # 6, [force; moment], N, N m, on the hand (optional)
    output_ports:
    - device_pose         # RigidTransform X_DH, as the driver reads it
    - device_velocity     # 6, [linear; angular], m/s, rad/s, as read
    - hand_position       # 3, m: where the operator wants the handle
    - bad_inputs          # 1: steps with an input that was refused so far
    @endsystem

    Everything in the device's frame D. Steps every `params.period`; the outputs
    are those of the last step, the device at its home before the first.

    Parameters
    ----------
    path : OperatorPath with points in D: where the operator wants the handle.
    params : SimulatedHapticDeviceParams.
    """

    def __init__(
        self,
        path: _core.OperatorPath,
        params: _core.SimulatedHapticDeviceParams | None = None,
    ) -> None:
        super().__init__(feedthrough=False)
        self._device = _core.SimulatedHapticDevice(
            deepcopy(params or _core.SimulatedHapticDeviceParams())
        )
        self._path = path
        self._native_arguments = {"path": path, "params": self._device.params}
        self._wrench = self.DeclareVectorInputPort("device_wrench", 6)
        self._declare_memory(self._device.make_state(), self._device.params.period)
        self._declare_pose_output("device_pose", lambda state: state.read_pose)
        self._declare_vector_output(
            "device_velocity", 6, lambda state: state.read_velocity
        )
        self._declare_vector_output("hand_position", 3, lambda state: state.intended.p)
        self._declare_vector_output("bad_inputs", 1, lambda state: state.bad_inputs)

    def _step(self, context: Context, state: Any) -> None:
        time = context.get_time()
        position, velocity = self._path.calc(time)
        rotation = self._path.calc_rotation(time)
        self._device.update(
            position, rotation, velocity, vector(self._wrench, context), state
        )
