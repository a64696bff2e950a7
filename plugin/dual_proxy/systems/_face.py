# SPDX-License-Identifier: BSD-3-Clause
"""The pydrake LeafSystem of every algorithm: one class around a block, which has
the ports, the memory and the step (`systems/faces/block.h`)."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable
from functools import cache
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.math import SpatialForce
from pydrake.systems.framework import EventStatus, LeafSystem, ValueProducer

from dual_proxy import _core
from dual_proxy.native import NativeTwin
from dual_proxy.panda import PandaModel

Vector = NDArray[np.float64]

# pydrake's type stubs name array types that no array has and call the values of
# ports plain objects: what passes between Drake and a face goes by these names.
Context: TypeAlias = Any
State: TypeAlias = Any
Output: TypeAlias = Any

# When a face that has not stepped has stepped last.
_NEVER: Any = np.array([-math.inf])


class Face(NativeTwin, LeafSystem):
    """A block as a system; it owns no mathematics.

    Its memory is abstract state of the Context, so a diagram can be reset,
    cloned and run again with the same bits. It steps every `period`.

    With feedthrough, an output at time t is what the step at t gives, from the
    inputs at t: faces in a row all act on one tick's measurements, as the
    fused faces do. Once that step has been taken its result stands for the
    rest of the instant, whatever the inputs have become by then. So a Drake
    ZeroOrderHold of the same period, which samples at t after all faces and
    the plant have stepped, holds the result of the step at t: put one where
    the result goes to hardware or to a plant.

    Without feedthrough, an output is that of the last step.

    An input that is not finite is no error here: it is handed to the algorithm,
    which refuses it, counts it and goes to its safe output. A required input
    that is not connected is one, and so is a message of another kind: both are
    found at the first step, and named with the system.
    """

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        cls.__doc__ = (cls.__doc__ or "").replace("@ports", _describe(cls.__name__))

    #: The output ports that are read in every period, None for all. Drake finds
    #: these in discrete state, which a step fills; for the others it calls Python.
    _often_read: tuple[str, ...] | None = None

    def __init__(self, block: _core._Block) -> None:
        super().__init__()
        self._block = block
        self._native_name = "block"
        self._native_arguments = {"block": block}
        #: Of the port `signals`, if there is one: name -> slice.
        self.layout = block.layout
        self._readers = [self._declare_input(port) for port in block.inputs]
        # Of each output port the discrete state that it shows, if it is one.
        self._held: list[int | None] = []
        self._declare_step()
        for index, port in enumerate(block.outputs):
            self._declare_output(index, port)

    # Inputs.

    def _declare_input(self, info: _core._Port) -> Callable[[Context], Any]:
        """Declares a port, and returns what reads it for the block."""
        port: Any
        if info.type == "vector":
            port = self.DeclareVectorInputPort(info.name, info.size)
            read: Callable[[Context], Any] = port.Eval
        else:
            port = self.DeclareAbstractInputPort(info.name, _model(info))
            read = {
                "pose": lambda context: _pair(port.Eval(context)),
                "message": port.Eval,
                "normals": port.Eval,
                "reaction": lambda context: self._reaction(port.Eval(context), info),
            }[info.type]
        if info.after_start:
            return lambda context: read(context) if context.get_time() > 0 else None
        if info.required:
            return read
        return lambda context: read(context) if port.HasValue(context) else None

    def _reaction(self, forces: Any, info: _core._Port) -> tuple[Vector, Vector]:
        if info.joint >= len(forces):
            raise IndexError(
                f"{self._who()}: `sensor_joint` expected an index of {len(forces)} "
                f"joints of the plant, got {info.joint}"
            )
        force = forces[info.joint]
        return force.translational(), force.rotational()

    def _who(self) -> str:
        return self.get_name() or type(self).__name__

    def _step(self, context: Context, memory: Any, arrays: list[Any]) -> Any:
        """Returns the memory after a step."""
        values = [read(context) for read in self._readers]
        try:
            return self._block.step(context.get_time(), memory, values, arrays)
        except TypeError as error:
            raise TypeError(f"{self._who()}: {error}") from None

    # Steps.

    def _declare_step(self) -> None:
        block = self._block
        self._prerequisites = {self.nothing_ticket()}
        if block.period == 0:
            return
        memory = self.DeclareAbstractState(AbstractValue.Make(block.start))
        self._memory = int(memory)
        self._prerequisites = {self.abstract_state_ticket(memory)}
        self._stepped = None
        if block.feedthrough:
            self._last_step = self.DeclareDiscreteState(_NEVER)
            stepped = self.DeclareCacheEntry(
                "stepped memory",
                ValueProducer(
                    allocate=lambda: AbstractValue.Make(block.start),
                    calc=self._calc_stepped,
                ),
                {
                    self.all_input_ports_ticket(),
                    self.all_state_ticket(),
                    self.time_ticket(),
                },
            )
            self._stepped = stepped
            self._prerequisites = {stepped.ticket()}
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            block.period, block.offset, self._advance
        )

    def _calc_stepped(self, context: Context, value: Output) -> None:
        memory = context.get_abstract_state(self._memory).get_value()
        last_step = context.get_discrete_state(int(self._last_step)).value()[0]
        if last_step != context.get_time():
            memory = self._step(context, memory, [])
        value.set_value(memory)

    def _advance(self, context: Context, state: State) -> EventStatus:
        memory = state.get_mutable_abstract_state(self._memory)
        outputs = state.get_mutable_discrete_state()
        if self._stepped is not None:
            after = self._stepped.Eval(context)
            outputs.set_value(int(self._last_step), [context.get_time()])
        else:
            arrays = [
                None if index is None else outputs.get_mutable_value(index)
                for index in self._held
            ]
            after = self._step(context, memory.get_value(), arrays)
        memory.set_value(after)
        return EventStatus.Succeeded()

    # Outputs.

    def _declare_output(self, index: int, info: _core._Port) -> None:
        block = self._block
        direct = {name: self.GetInputPort(name).get_index() for name in info.direct}

        def read(context: Context) -> Any:
            values = {name: self._readers[i](context) for name, i in direct.items()}
            return block.read(index, context.get_time(), self._result(context), values)

        if direct:
            tickets = {self.input_port_ticket(i) for i in direct.values()}
        else:
            tickets = set(self._prerequisites)
        if info.timed:
            tickets.add(self.time_ticket())
        self._held.append(None)
        if info.type != "vector":
            convert = (lambda X: rigid_transform(*X)) if info.type == "pose" else None

            def calc(context: Context, output: Output) -> None:
                value = read(context)
                output.set_value(convert(value) if convert else value)

            self.DeclareAbstractOutputPort(
                info.name, lambda: _model(info), calc, tickets
            )
        elif direct or block.feedthrough or not self._is_held(info.name):

            def calc_vector(context: Context, output: Output) -> None:
                output.SetFromVector(read(context))

            self.DeclareVectorOutputPort(info.name, info.size, calc_vector, tickets)
        else:
            start = block.read(index, 0.0, block.start, {})
            held = self.DeclareDiscreteState(start)
            self._held[-1] = int(held)
            self.DeclareStateOutputPort(info.name, held)

    def _is_held(self, name: str) -> bool:
        return self._often_read is None or name in self._often_read

    def _result(self, context: Context) -> Any:
        """Returns the memory that the outputs show."""
        if self._block.period == 0:
            return self._block.start
        if self._stepped is not None:
            return self._stepped.Eval(context)
        return context.get_abstract_state(self._memory).get_value()


def _model(info: _core._Port) -> Any:
    """Returns a value of the kind that a port carries."""
    model: Any
    if info.type == "pose":
        return Value[RigidTransform]()
    if info.type == "reaction":
        return Value[list[SpatialForce]]()
    if info.type == "normals":
        return AbstractValue.Make(np.zeros((3, 0)))
    if info.tag == _core.PoseMessage.TAG:
        model = _core.PoseMessage()
    elif info.tag == _core.ForceMessage.TAG:
        model = _core.ForceMessage()
    else:
        model = _core.Message()
    return AbstractValue.Make(model)


def _pair(X: Any) -> tuple[Vector, Vector]:
    return X.translation(), X.rotation().matrix()


def rigid_transform(p: Any, R: Any) -> RigidTransform:
    """Returns a pose as Drake's type with the very same numbers: never raises.

    Drake's documentation asks more of a rotation (orthonormal to 3e-14) than the
    algorithms do, and what is no pose stays none: whoever acts on it refuses it.
    """
    return RigidTransform(RotationMatrix(R), p)


# Parameters.


def arm_of(model: PandaModel) -> _core.ArmModelParams:
    """Return the arm of what is, or is to be, a model."""
    if not isinstance(model, PandaModel):
        raise TypeError(f"`model` expected PandaModel, got {model!r:.200}")
    return model.arm_params


# Documentation.

_CARRIES = {
    "pose": "RigidTransform",
    "normals": "array (3, k)",
    "reaction": "list of SpatialForce",
}


@cache
def _examples() -> dict[str, list[_core._Block]]:
    examples: dict[str, list[_core._Block]] = {}
    for block in _core._example_blocks():
        examples.setdefault(block.name, []).append(block)
    return examples


def _describe(name: str) -> str:
    """Returns the list of a block's ports for a docstring."""
    lines = ["@system", f"name: {name}"]
    for title, which in (("input_ports", "inputs"), ("output_ports", "outputs")):
        lines.append(f"{title}:")
        ports: dict[str, _core._Port] = {}
        for block in _examples()[name]:
            ports |= {port.name: port for port in getattr(block, which)}
        width = max(map(len, ports)) + 1
        for port in ports.values():
            text = textwrap.wrap(f"{_carries(port)}: {port.meaning}", 84 - width)
            lines.append(f"- {port.name:{width}} # {text[0]}")
            lines += [f"  {'':{width}} # {line}" for line in text[1:]]
    lines.append("@endsystem")
    return "\n    ".join(lines)


def _carries(port: _core._Port) -> str:
    if port.type == "vector":
        return "9, a 3x3 matrix row by row" if port.size == 9 else str(port.size)
    if port.type == "message":
        message = _core.Message()
        message.tag = port.tag
        return message.describe()
    return _CARRIES[port.type]
