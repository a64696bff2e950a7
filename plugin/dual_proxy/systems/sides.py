# SPDX-License-Identifier: BSD-3-Clause
"""Each side's work of a control period as one system.

A call from Drake into Python costs more than the algorithms themselves, so a
side is one face over one compiled step, also where it holds simulated hardware.
The separate faces, wired in a row, give the same bits.
"""

from __future__ import annotations

from numpy.typing import ArrayLike

from dual_proxy import _core
from dual_proxy.panda import PandaModel
from dual_proxy.systems._face import Face, arm_of


class RobotSide(Face):
    """The robot's side: the scheme's half, controller, perception, the arm's model.

    @ports

    In the base frame B unless said. Steps every `params.controller.period`; all
    outputs but `robot_pose` are those of the last step, zero before the first.

    With a simulated sensor the face does the work of a ForceTorqueSensor, too,
    and gives the same bits as with that system in front of it.

    Parameters
    ----------
    params : RobotSideParams.
    model : PandaModel, the arm; by default with the project's own tool.
    q_start : (7,) rad, where the arm will be when the run starts; before the
        first step the torque holds it there. By default it is zero.
    sensor : ForceTorqueSensorParams of the simulated sensor, if there is one.
    p_SE : (3,) m, tool point in the sensor's frame, whose axes are E's.
    seed : of the sensor's noise.
    filter_seed : of the filter of forces.
    angular_filter_seed : of the filter of moments.
    """

    _often_read = ("signals", "torque", "sensor_counters")

    def __init__(
        self,
        params: _core.RobotSideParams | None = None,
        model: PandaModel | None = None,
        q_start: ArrayLike | None = None,
        sensor: _core.ForceTorqueSensorParams | None = None,
        p_SE: ArrayLike = (0.0, 0.0, 0.0),
        seed: int = 0,
        filter_seed: int = 0,
        angular_filter_seed: int = 1,
    ) -> None:
        super().__init__(
            _core._make_RobotSide(
                _core.RobotSideParams() if params is None else params,
                arm_of(PandaModel() if model is None else model),
                q_start,
                sensor,
                p_SE,
                seed,
                filter_seed,
                angular_filter_seed,
            )
        )


class HapticSide(Face):
    """The device's side: operator's aids, the scheme's half, device controller.

    @ports

    Everything in the device's frame D. Steps every `params.controller.period`;
    the outputs are those of the last step, zero before the first.

    With a simulated device the face does the work of a SimulatedHapticDevice,
    too, and gives the same bits as with that system in front of it.

    Parameters
    ----------
    params : HapticSideParams.
    device : SimulatedHapticDeviceParams of the simulated device, if there is
        one.
    path : OperatorPath with points in D, with a simulated device: where its
        operator wants the handle.
    """

    _often_read = ("signals", "device_wrench", "device_bad_inputs")

    def __init__(
        self,
        params: _core.HapticSideParams | None = None,
        device: _core.SimulatedHapticDeviceParams | None = None,
        path: _core.OperatorPath | None = None,
    ) -> None:
        params = _core.HapticSideParams() if params is None else params
        super().__init__(_core._make_HapticSide(params, device, path))
