# SPDX-License-Identifier: BSD-3-Clause
"""Each side's work of a control period as one system.

A call from Drake into Python costs more than the algorithms themselves, so the
station runs each side as one face over one compiled call for the side, and one
for the simulated hardware that it may hold. The separate faces, wired in a row,
give the same bits.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import deepcopy
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import EventStatus, LeafSystem

from dual_proxy import _core
from dual_proxy.native import NativeTwin
from dual_proxy.panda import NUM_JOINTS, PandaModel
from dual_proxy.systems._face import (
    Context,
    InputPort,
    Memory,
    Output,
    State,
    Vector,
    check_vector,
    flag,
    matrix,
    message,
    pose,
    rigid_transform,
    vector,
)
from dual_proxy.systems.control import model_terms


def _check_period(who: str, name: str, period: float, control_period: float) -> None:
    if period != control_period:
        raise ValueError(
            f"{who}: `{name}.period` expected the side's own {control_period:g}, "
            f"got {period:g}"
        )


# Ports mean_... -> fields of what the filters take.
_FORCE_MEANS = {
    "sensed_force": "sensed",
    "velocity": "velocity",
    "motion_force": "motion",
    "contact_force": "contact",
}
_MOMENT_MEANS = {
    "sensed_moment": "sensed",
    "angular_velocity": "velocity",
    "motion_moment": "motion",
    "contact_moment": "contact",
}


def _selection(port: InputPort, context: Context) -> Vector | None:
    return matrix(port, context) if port.HasValue(context) else None


class _Side(NativeTwin, LeafSystem):
    """What both sides share: the state in the Context, of the side and of the
    simulated hardware that it may hold, and all results of the last step as one
    vector, `signals`."""

    #: Of the port `signals`: name -> slice.
    layout: dict[str, slice]
    _side: Any

    def __init__(self, period: float) -> None:
        super().__init__()
        self._period = period

    def _declare(self, side: object, hardware: object, acts: Any) -> None:
        """Declares the states at the start, and what acts on the hardware."""
        start = Memory((side, hardware))
        self._memory = self.DeclareAbstractState(AbstractValue.Make(start))
        self._memory_index = int(self._memory)
        size = max(s.stop for s in self.layout.values())
        signals = self.DeclareDiscreteState(size)
        self._signals_index = int(signals)
        self.DeclareStateOutputPort("signals", signals)
        name, value = acts
        acting = self.DeclareDiscreteState(value)
        self._acting_index = int(acting)
        self.DeclareStateOutputPort(name, acting)
        self._hardware_counts: Any = None
        if hardware is not None:
            count = len(self._count_hardware(hardware))
            self._hardware_counts = self.DeclareDiscreteState(count)
        self.DeclarePeriodicUnrestrictedUpdateEvent(self._period, 0.0, self._advance)

    def _states(self, context: Context) -> Any:
        """Returns the side's state and the hardware's."""
        return context.get_abstract_state(self._memory_index).get_value().state

    def _declare_message(self) -> None:
        def calc(context: Context, output: Output) -> None:
            side, _ = self._states(context)
            output.set_value(side.message)

        self.DeclareAbstractOutputPort(
            "message",
            lambda: AbstractValue.Make(_core.Message()),
            calc,
            {self.abstract_state_ticket(self._memory)},
        )

    def _step(self, context: Context, side: Any, hardware: Any) -> Vector:
        """Advances both states in place; returns what acts on the hardware."""
        raise NotImplementedError

    def _count_hardware(self, hardware: Any) -> list[int]:
        """Returns what the simulated hardware has counted."""
        raise NotImplementedError

    def _advance(self, context: Context, state: State) -> EventStatus:
        memory = state.get_mutable_abstract_state(self._memory_index)
        side, hardware = memory.get_value().state
        side = side.__copy__()
        if hardware is not None:
            hardware = hardware.__copy__()
        acts = self._step(context, side, hardware)
        memory.set_value(Memory((side, hardware)))
        outputs = state.get_mutable_discrete_state()
        outputs.set_value(self._signals_index, self._side.signals(side))
        outputs.set_value(self._acting_index, acts)
        if hardware is not None:
            counts = self._count_hardware(hardware)
            outputs.set_value(int(self._hardware_counts), counts)
        return EventStatus.Succeeded()


class RobotSide(_Side):
    """The robot's side: proxy, controller, means for the filter, sender.

    @system
    name: RobotSide
    input_ports:
    - haptic_message      # Message (optional: without it the robot waits)
    - robot_state         # 14, [q; v], rad, rad/s
    - sensed_wrench       # 6, [force; moment], N, N m, at E (not with a
                          # simulated sensor)
    - reaction            # 6, [force; moment], N, N m, in S, of the arm on the
                          # tool (only with a simulated sensor)
    - force_selection     # 9, row-major 3x3: the directions of contact if
    - moment_selection    # somebody else knows them; the side's own filters
                          # rest if one of the two is connected
    - sensor_ready        # 1, > 0.5 if the force sensor can be relied on
                          # (optional: it can); otherwise the robot holds its
                          # place (not with a simulated sensor)
    - tare                # 1, asks for the sensor's bias to be learned anew when
                          # it comes to exceed 0.5 (only with a simulated
                          # sensor; optional)
    output_ports:
    - signals             # all results, see `layout` (name -> slice)
    - torque              # 7, N m, with gravity compensation
    - robot_pose          # RigidTransform X_BE, at the current `robot_state`
    - message             # Message, to the haptic side
    - mean_sensed_force   # 3, N, mean over the filter's current period
    - mean_velocity       # 3, m/s, likewise
    - mean_motion_force   # 3, N, likewise
    - mean_contact_force  # 3, N, likewise
    - force_selection     # 9, row-major 3x3, and
    - dimension           # 1: what the filter has found
    - sensed_wrench       # 6, as the input of that name (only with a simulated
                          # sensor)
    - sensor_counters     # 2, so far: samples that the sensor refused, times at
                          # rest that gave no bias (likewise)
    - mean_sensed_moment    # 3, N m, mean over the angular filter's period (only
                            # with an angular filter)
    - mean_angular_velocity # 3, rad/s (likewise)
    - mean_motion_moment    # 3, N m (likewise)
    - mean_contact_moment   # 3, N m (likewise)
    - moment_selection      # 9, row-major 3x3, found by it (likewise)
    - moment_dimension      # 1 (likewise)
    @endsystem

    Everything in the base frame B. Steps every `params.controller.period`; all
    outputs but `robot_pose` are those of the last step. Before the first the
    torque holds the arm at `q_start`.

    With a simulated sensor the face does the work of a ForceTorqueSensor, too,
    and gives the same bits as with that system in front of it.

    Parameters
    ----------
    params : RobotSideParams.
    model : PandaModel, the arm; by default with the project's own tool.
    q_start : (7,) rad, where the arm will be when the run starts.
    sensor : ForceTorqueSensorParams of the simulated sensor, if there is one.
    p_SE : (3,) m, tool point in the sensor's frame.
    seed : of the sensor's noise.
    filter_seed, angular_filter_seed : of the filters.
    """

    def __init__(
        self,
        params: _core.RobotSideParams | None = None,
        model: PandaModel | None = None,
        q_start: np.ndarray | None = None,
        sensor: _core.ForceTorqueSensorParams | None = None,
        p_SE: Vector | None = None,
        seed: int = 0,
        filter_seed: int = 0,
        angular_filter_seed: int = 1,
    ) -> None:
        self._side = _core.RobotSide(deepcopy(params or _core.RobotSideParams()))
        self.layout = self._side.layout
        self._tag = _core._scheme_tags(self._side.params.scheme)[0]
        super().__init__(self._side.params.controller.period)
        declare = self.DeclareVectorInputPort
        self._message = self.DeclareAbstractInputPort(
            "haptic_message", AbstractValue.Make(_core.Message())
        )
        self._robot_state = declare("robot_state", 2 * NUM_JOINTS)
        self._sensor: Any = None
        self._p_SE: Any = None
        sensor_state = None
        if sensor is None:
            self._sensed_wrench = declare("sensed_wrench", 6)
        else:
            self._sensor = _core.ForceTorqueSensor(deepcopy(sensor))
            _check_period("RobotSide", "sensor", sensor.period, self._period)
            self._p_SE = check_vector(
                "RobotSide", "p_SE", np.zeros(3) if p_SE is None else p_SE, 3
            )
            sensor_state = self._sensor.make_state(seed)
            self._reaction = declare("reaction", 6)
        self._force_selection = declare("force_selection", 9)
        self._moment_selection = declare("moment_selection", 9)
        self._flag = declare("sensor_ready" if sensor is None else "tare", 1)
        self._model = model = model or PandaModel()
        torque: Any = np.zeros(NUM_JOINTS)
        if q_start is not None:
            q_start = check_vector("RobotSide", "q_start", q_start, NUM_JOINTS)
            torque = -model.calc(q_start, np.zeros(NUM_JOINTS)).gravity
        self._native_arguments = {
            "params": self._side.params,
            "arm": model.arm_params,
            "q_start": q_start,
            "sensor": None if self._sensor is None else self._sensor.params,
            "p_SE": self._p_SE,
            "seed": seed,
            "filter_seed": filter_seed,
            "angular_filter_seed": angular_filter_seed,
        }
        self._declare(
            self._side.make_state(filter_seed, angular_filter_seed),
            sensor_state,
            ("torque", torque),
        )
        self.DeclareAbstractOutputPort(
            "robot_pose",
            Value[RigidTransform],
            self._calc_pose,
            {self._robot_state.ticket()},
        )
        self._declare_message()
        self._declare_means("filter_means", _FORCE_MEANS)
        self._declare_found("force_selection", "dimension", "filter")
        if sensor is not None:
            self.DeclareVectorOutputPort(
                "sensed_wrench",
                6,
                lambda context, output: output.SetFromVector(
                    self._states(context)[1].wrench
                ),
                {self.abstract_state_ticket(self._memory)},
            )
            self.DeclareStateOutputPort("sensor_counters", self._hardware_counts)
        if self._side.params.perception.angular_filter.enabled:
            self._declare_means("angular_filter_means", _MOMENT_MEANS)
            self._declare_found(
                "moment_selection", "moment_dimension", "angular_filter"
            )

    def _count_hardware(self, hardware: Any) -> list[int]:
        return [hardware.bad_inputs, hardware.tares_refused]

    def _declare_state_vector(
        self, name: str, size: int, read: Callable[[Any], ArrayLike]
    ) -> None:
        """Declares an output port with what `read` finds in the side's state."""

        def calc(context: Context, output: Output) -> None:
            side, _ = self._states(context)
            output.SetFromVector(np.reshape(read(side), size))

        self.DeclareVectorOutputPort(
            name, size, calc, {self.abstract_state_ticket(self._memory)}
        )

    def _declare_means(self, means: str, names: Mapping[str, str]) -> None:
        for name, field in names.items():
            read = attrgetter(f"{means}.{field}")
            self._declare_state_vector(f"mean_{name}", 3, read)

    def _declare_found(self, selection: str, dimension: str, found: str) -> None:
        read = attrgetter(f"{found}.force_selection")
        self._declare_state_vector(selection, 9, read)
        self._declare_state_vector(dimension, 1, attrgetter(f"{found}.dimension"))

    def _calc_pose(self, context: Context, output: Output) -> None:
        x: Any = self._robot_state.Eval(context)
        terms = model_terms(self._model, x)
        output.set_value(rigid_transform(terms.p_BE, terms.R_BE))

    def _step(self, context: Context, side: Any, hardware: Any) -> Vector:
        x: Any = self._robot_state.Eval(context)
        terms = model_terms(self._model, x)
        time = context.get_time()
        self._side.update(
            time,
            message(self._message, context, self._tag),
            *terms,
            x[:NUM_JOINTS],
            x[NUM_JOINTS:],
            _selection(self._force_selection, context),
            _selection(self._moment_selection, context),
            vector(self._sensed_wrench, context)
            if hardware is None
            else hardware.wrench,
            side,
            flag(self._flag, context, True) if hardware is None else hardware.ready,
        )
        # A simulated plant has no reaction before its first step.
        if hardware is not None and time > 0:
            self._sensor.update(
                self._reaction.Eval(context),
                terms.p_BE,
                terms.R_BE,
                self._p_SE,
                hardware,
                flag(self._flag, context, False),
                _core.RobotSide.calc_twist(terms.J_BE, x[NUM_JOINTS:]),
            )
        torque: Vector = side.torque
        return torque


class HapticSide(_Side):
    """The device's side: proxy, controller, sender.

    @system
    name: HapticSide
    input_ports:
    - robot_message       # Message (optional: without it there is no force,
                          # but messages are sent)
    - device_pose         # RigidTransform X_DH, from the device's home (not
                          # with a simulated device)
    - device_velocity     # 6, [linear; angular], m/s, rad/s (likewise)
    output_ports:
    - signals             # all results, see `layout` (name -> slice)
    - device_wrench       # 6, [force; moment], N, N m, of the device on the hand
    - message             # Message, to the robot side
    - device_pose         # as the input of that name (only with a simulated
                          # device)
    - device_bad_inputs   # 1, steps with an input that the device refused so far
                          # (likewise)
    @endsystem

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

    def __init__(
        self,
        params: _core.HapticSideParams | None = None,
        device: _core.SimulatedHapticDeviceParams | None = None,
        path: _core.OperatorPath | None = None,
    ) -> None:
        self._side = _core.HapticSide(deepcopy(params or _core.HapticSideParams()))
        self.layout = self._side.layout
        self._tag = _core._scheme_tags(self._side.params.scheme)[1]
        super().__init__(self._side.params.controller.period)
        self._message = self.DeclareAbstractInputPort(
            "robot_message", AbstractValue.Make(_core.Message())
        )
        if (device is None) != (path is None):
            raise ValueError("HapticSide: `device` and `path` go together")
        self._path: Any = path
        self._device: Any = None
        device_state = None
        if device is None:
            self._pose = self.DeclareAbstractInputPort(
                "device_pose", Value[RigidTransform]()
            )
            self._velocity = self.DeclareVectorInputPort("device_velocity", 6)
        else:
            self._device = _core.SimulatedHapticDevice(deepcopy(device))
            _check_period("HapticSide", "device", device.period, self._period)
            device_state = self._device.make_state()
        self._native_arguments = {
            "params": self._side.params,
            "device": None if self._device is None else self._device.params,
            "path": path,
        }
        start = self._side.make_state()
        self._declare(start, device_state, ("device_wrench", np.zeros(6)))
        self._declare_message()
        if device is not None:
            self.DeclareAbstractOutputPort(
                "device_pose",
                Value[RigidTransform],
                self._calc_pose,
                {self.abstract_state_ticket(self._memory)},
            )
            self.DeclareStateOutputPort("device_bad_inputs", self._hardware_counts)

    def _calc_pose(self, context: Context, output: Output) -> None:
        read = self._states(context)[1].read_pose
        output.set_value(rigid_transform(read.p, read.R))

    def _count_hardware(self, hardware: Any) -> list[int]:
        return [hardware.bad_inputs]

    def _step(self, context: Context, side: Any, hardware: Any) -> Vector:
        time = context.get_time()
        newest = message(self._message, context, self._tag)
        if hardware is None:
            p, R = pose(self._pose, context)
            self._side.update(time, newest, p, R, self._velocity.Eval(context), side)
        else:
            # What the device was told in the step before acts on it now.
            told = side.device_wrench
            read = hardware.read_pose
            self._side.update(
                time, newest, read.p, read.R, hardware.read_velocity, side
            )
            position, velocity = self._path.calc(time)
            rotation = self._path.calc_rotation(time)
            self._device.update(position, rotation, velocity, told, hardware)
        wrench: Vector = side.device_wrench
        return wrench
