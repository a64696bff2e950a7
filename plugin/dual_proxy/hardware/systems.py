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

from dual_proxy.hardware.arms import PolledArm
from dual_proxy.hardware.devices import HapticDevice as Device
from dual_proxy.hardware.devices import is_reliable

__all__ = ["ForceTorqueSensor", "HapticDevice", "PandaHardware"]

_NOWHERE: Any = np.full(3, math.nan)


def _check_positive(system: object, name: str, value: float) -> None:
    if not 0 < value < math.inf:
        raise ValueError(
            f"{type(system).__name__}: field `{name}` expected s > 0, got {value}"
        )


class _Hardware(LeafSystem):
    """Does `_exchange` every period, from time 0 on."""

    def __init__(self, period: float) -> None:
        super().__init__()
        _check_positive(self, "period", period)
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
        if not is_reliable(handle, time.monotonic()):
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

    def __init__(self, arm: PolledArm, period: float = 0.001) -> None:
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
    """A real force/torque sensor in a diagram, in place of `systems.SensorReaction`.

    Output `reaction` (6), [force; moment], N, N m, in S, of the arm on the tool: not
    finite while there is no good reading that is young, so that the adapter behind it
    (`systems.ForceTorqueSensor`, or a RobotSide's own) refuses it.

    Parameters
    ----------
    sensor : open, with `read`, as RdtSensor.
    period : s.
    max_age : s, of a reading.
    """

    def __init__(
        self, sensor: Any, period: float = 0.001, max_age: float = 0.01
    ) -> None:
        super().__init__(period)
        _check_positive(self, "max_age", max_age)
        self._sensor = sensor
        self._max_age = max_age
        self._reading = sensor.read()
        self._vector_output("reaction", 6, self._reaction)

    def _exchange(self, _: Any) -> None:
        self._reading = self._sensor.read()

    def _reaction(self) -> Any:
        reading = self._reading
        if not reading.valid or time.monotonic() - reading.time > self._max_age:
            return np.full(6, math.nan)
        return reading.value
