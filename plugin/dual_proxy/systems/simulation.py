# SPDX-License-Identifier: BSD-3-Clause
"""Faces of what stands in for a person and for hardware."""

from __future__ import annotations

from numpy.typing import ArrayLike

from dual_proxy import _core
from dual_proxy.systems._face import Face


class ForceTorqueSensor(Face):
    """A wrist force/torque sensor: noise, bias, low-pass; and its adapter, which
    learns the bias and removes the tool's weight and inertia.

    @ports

    In the base frame B unless said. Steps every `params.period`, for the first
    time after one period, as a simulated plant has no reaction before its first
    step. The output is that of the last step, zero before the first.

    Parameters
    ----------
    params : ForceTorqueSensorParams.
    p_SE : (3,) m, tool point in the sensor's frame, whose axes are E's.
    seed : of the noise.
    """

    def __init__(
        self,
        params: _core.ForceTorqueSensorParams | None = None,
        p_SE: ArrayLike = (0.0, 0.0, 0.0),
        seed: int = 0,
    ) -> None:
        params = _core.ForceTorqueSensorParams() if params is None else params
        super().__init__(_core._make_ForceTorqueSensor(params, p_SE, seed))


class SensorReaction(Face):
    """What a simulated wrist sensor takes; no memory.

    @ports

    It has the project's sign already: pressing on a table, the arm pushes the
    tool (and the tool the table) down. It still holds the tool's weight and
    inertia, as a real sensor's reading does.

    Parameters
    ----------
    sensor_joint : `PandaScene.sensor_joint`, >= 0; one that the plant has not is
        an error where its forces are read.
    """

    def __init__(self, sensor_joint: int) -> None:
        super().__init__(_core._make_SensorReaction(sensor_joint))


class SimulatedHapticDevice(Face):
    """A simulated Omega.7 in the hand of a simulated operator.

    @ports

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
        params = _core.SimulatedHapticDeviceParams() if params is None else params
        super().__init__(_core._make_SimulatedHapticDevice(path, params))
