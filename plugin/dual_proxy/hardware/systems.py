# SPDX-License-Identifier: BSD-3-Clause
"""Hardware as Drake systems, with the ports of what is simulated in its place.

In a diagram that runs at real time (`Simulator.set_target_realtime_rate(1)`) each
system talks to its hardware once a period; its outputs are the last readings. What is
simulated may be replaced by hardware one by one. There is one piece of hardware: such
a diagram is run once, not cloned.
"""

from __future__ import annotations

import math
import time
from typing import Any

import dual_proxy._pydrake  # noqa: F401

# isort: split
import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import EventStatus, LeafSystem

from dual_proxy._core import ForceTorqueAdapter, ForceTorqueAdapterParams
from dual_proxy.hardware.arms import Arm
from dual_proxy.hardware.devices import HapticDevice as Device
from dual_proxy.panda import PandaModel, p_SE_S

__all__ = ["ForceTorqueSensor", "HapticDevice", "PandaHardware"]

#: s: a device's reading that is older is none.
_STALE = 0.02
_NOWHERE: Any = np.full(3, math.nan)


class _Hardware(LeafSystem):
    """Does `_exchange` every period, from time 0 on."""

    def __init__(self, period: float) -> None:
        super().__init__()
        self.DeclarePeriodicPublishEvent(period, 0.0, self._step)

    def _step(self, context: Any) -> EventStatus:
        self._exchange(context)
        return EventStatus.Succeeded()

    def _exchange(self, context: Any) -> None:
        raise NotImplementedError

    def _vector_output(self, name: str, size: int, calc: Any) -> None:
        # What hardware says changes with time, whatever the context.
        self.DeclareVectorOutputPort(
            name,
            size,
            lambda context, output: output.SetFromVector(calc()),
            {self.time_ticket()},
        )


class HapticDevice(_Hardware):
    """A haptic device in a diagram, in place of `systems.SimulatedHapticDevice`.

    Input `device_wrench` (6), [force; moment] on the hand, N, N m, in D. Outputs
    `device_pose`, X_DH, not finite while the device cannot be relied on, so that
    the haptic side refuses it; `device_velocity` (6); `clutch` (1);
    `gripper_opening` (1), m.

    Parameters
    ----------
    device : open, as `OmegaDevice`; the system writes to it, and leaves it open.
    period : s.
    """

    def __init__(self, device: Device, period: float = 0.001) -> None:
        super().__init__(period)
        self._device = device
        self._handle = device.read()
        self._wrench = self.DeclareVectorInputPort("device_wrench", 6)
        self.DeclareAbstractOutputPort(
            "device_pose",
            lambda: Value(RigidTransform()),
            self._calc_pose,
            {self.time_ticket()},
        )
        self._vector_output("device_velocity", 6, lambda: self._handle.velocity)
        self._vector_output("clutch", 1, lambda: [float(self._handle.clutch)])
        self._vector_output(
            "gripper_opening", 1, lambda: [self._handle.gripper_opening]
        )

    def _exchange(self, context: Any) -> None:
        self._handle = self._device.read()
        if self._wrench.HasValue(context):
            self._device.write(self._wrench.Eval(context))

    def _calc_pose(self, _: Any, output: Any) -> None:
        output.set_value(self._pose())

    def _pose(self) -> RigidTransform:
        handle = self._handle
        if not handle.valid or time.monotonic() - handle.time > _STALE:
            return RigidTransform(RotationMatrix(), _NOWHERE)
        return RigidTransform(RotationMatrix(handle.pose.R), handle.pose.p)


class PandaHardware(_Hardware):
    """An arm in a diagram, in place of the plant.

    Input `torque` (7), N m, without the arm's weight, of a RobotSide with
    `make_hardware_defaults`. Output `robot_state` (14), rad, rad/s. Raises ArmFault
    where the arm stops by itself: the diagram ends there.

    Parameters
    ----------
    arm : started, as FrankaArm or SimulatedPanda; its `read` paces the diagram.
    period : s.
    """

    def __init__(self, arm: Arm, period: float = 0.001) -> None:
        super().__init__(period)
        self._arm = arm
        self._reading = arm.look()
        self._torque = self.DeclareVectorInputPort("torque", 7)
        self._vector_output(
            "robot_state",
            14,
            lambda: np.concatenate([self._reading.q, self._reading.v]),
        )

    def _exchange(self, context: Any) -> None:
        # The torque that the readings of the period before have led to.
        torque = np.array(self._torque.Eval(context))
        self._reading = self._arm.read()
        self._arm.write(torque)


class ForceTorqueSensor(_Hardware):
    """A real force/torque sensor in a diagram, in place of `systems.ForceTorqueSensor`.

    Input `robot_state` (14). Outputs `sensed_wrench` (6), [force; moment about E], N,
    N m, in B, of the robot on its environment; `ready` (1): whether the bias is known
    and the last good reading is younger than 10 ms.

    Parameters
    ----------
    sensor : open, with `read`, as RdtSensor.
    adapter : its ForceTorqueAdapterParams.
    p_SE : (3,) m, tool point in the sensor's frame.
    """

    _MAX_AGE = 0.01

    def __init__(
        self,
        sensor: Any,
        adapter: ForceTorqueAdapterParams | None = None,
        p_SE: Any = p_SE_S,
    ) -> None:
        params = ForceTorqueAdapterParams(tare=True) if adapter is None else adapter
        super().__init__(params.period)
        self._sensor = sensor
        self._adapter = ForceTorqueAdapter(params)
        self._state = self._adapter.make_state()
        self._model = PandaModel(max(params.tool_mass, 1e-3))
        self._p_SE = np.array(p_SE, dtype=np.float64)
        self._read_at = -math.inf
        self._robot = self.DeclareVectorInputPort("robot_state", 14)
        self._vector_output("sensed_wrench", 6, lambda: self._state.wrench)
        self._vector_output("ready", 1, lambda: [float(self._is_ready())])

    def _exchange(self, context: Any) -> None:
        reading = self._sensor.read()
        if not reading.valid or reading.time <= self._read_at:
            return
        self._read_at = reading.time
        x: Any = self._robot.Eval(context)
        terms = self._model.calc(x[:7], x[7:])
        self._adapter.update(
            reading.value, terms.p_BE, terms.R_BE, self._p_SE, self._state
        )

    def _is_ready(self) -> bool:
        return self._state.ready and time.monotonic() - self._read_at <= self._MAX_AGE
