# SPDX-License-Identifier: BSD-3-Clause
"""What the pydrake faces share: where an algorithm's state lives and when it
steps."""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import copy
from functools import cache
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import EventStatus, LeafSystem, ValueProducer

from dual_proxy import _core
from dual_proxy.native import NativeTwin

Vector = NDArray[np.float64]

# pydrake's type stubs name array types that no array has and call the values of
# ports plain objects: what passes between Drake and a face goes by these names.
Context: TypeAlias = Any
State: TypeAlias = Any
InputPort: TypeAlias = Any
Output: TypeAlias = Any

#: Elements of every `link_status` port: status (0 waiting, 1 connected, 2
#: lost), age of the message in use (s), messages received, dropped (stale or
#: out of order), sequence numbers skipped, latency spikes, times lost.
LINK_STATUS_FIELDS = (
    "status",
    "age",
    "received",
    "dropped",
    "gaps",
    "spikes",
    "losses",
)


def link_status(monitor: Any) -> list[float]:
    """Returns the elements of a `link_status` port from a LinkMonitorState."""
    return [float(getattr(monitor, field)) for field in LINK_STATUS_FIELDS]


@cache
def _zeros(size: int) -> Vector:
    zeros = np.zeros(size)
    zeros.setflags(write=False)
    return zeros


# When a face that has not stepped has stepped last.
_NEVER: Any = np.array([-math.inf])


class Memory:
    """An algorithm's state as a value in a Context.

    What is in a Context is never changed: a step works on a copy and puts that
    in its place. So Contexts share it, and Drake, which copies the state of the
    whole diagram for every unrestricted update, copies a reference.
    """

    __slots__ = ("state",)

    def __init__(self, state: Any) -> None:
        self.state = state

    def __deepcopy__(self, memo: dict[int, Any]) -> Memory:
        return self


class Stepped:
    """The state of an algorithm that returns its output instead of keeping it,
    with that output (None before the first step)."""

    __slots__ = ("output", "state")

    def __init__(self, state: Any, output: Any = None) -> None:
        self.state = state
        self.output = output

    def __copy__(self) -> Stepped:
        return Stepped(copy(self.state), self.output)


class Face(NativeTwin, LeafSystem):
    """A system around one algorithm; it owns no mathematics.

    The algorithm's state is abstract state of the Context, so a diagram can be
    reset, cloned and run again with the same bits. It steps every `period`.

    With feedthrough, an output at time t is what the step at t gives, from the
    inputs at t: faces in a row all act on one tick's measurements, as the
    fused faces do. Once that step has been taken its result stands for the
    rest of the instant, whatever the inputs have become by then. So a Drake
    ZeroOrderHold of the same period, which samples at t after all faces and
    the plant have stepped, holds the result of the step at t: put one where
    the result goes to hardware or to a plant.

    Without feedthrough, an output is that of the last step.

    An input that is not finite is no error here: it is handed to the algorithm,
    which refuses it, counts it and goes to its safe output.
    """

    def __init__(self, *, feedthrough: bool) -> None:
        super().__init__()
        self._feedthrough = feedthrough

    def _step(self, context: Context, state: Any) -> None:
        """Reads the inputs and advances the algorithm's state in place."""
        raise NotImplementedError

    def _declare_memory(
        self, start: object, period: float, offset: float = 0.0
    ) -> None:
        """Declares the algorithm's state and its periodic step.

        Called when all inputs are declared and before the outputs.
        """
        self._start = start
        self._memory = self.DeclareAbstractState(AbstractValue.Make(Memory(start)))
        self._held: list[tuple[int, int, Callable[[Any], ArrayLike]]] = []
        self._prerequisites = {self.abstract_state_ticket(self._memory)}
        if self._feedthrough:
            self._last_step = self.DeclareDiscreteState(_NEVER)
            stepped = self.DeclareCacheEntry(
                "stepped state",
                ValueProducer(
                    allocate=lambda: AbstractValue.Make(start),
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
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, offset, self._advance)

    def _calc_stepped(self, context: Context, value: Output) -> None:
        state = context.get_abstract_state(int(self._memory)).get_value().state
        last_step = context.get_discrete_state(int(self._last_step)).value()[0]
        if last_step != context.get_time():
            state = copy(state)
            self._step(context, state)
        value.set_value(state)

    def _advance(self, context: Context, state: State) -> EventStatus:
        memory = state.get_mutable_abstract_state(self._memory)
        outputs = state.get_mutable_discrete_state()
        if self._feedthrough:
            stepped: Any = self._stepped.Eval(context)
            outputs.set_value(int(self._last_step), [context.get_time()])
        else:
            stepped = copy(memory.get_value().state)
            self._step(context, stepped)
            for index, size, read in self._held:
                outputs.set_value(index, np.asarray(read(stepped)).reshape(size))
        memory.set_value(Memory(stepped))
        return EventStatus.Succeeded()

    def _result(self, context: Context) -> Any:
        """Returns the algorithm's state that the outputs show."""
        if self._feedthrough:
            return self._stepped.Eval(context)
        return context.get_abstract_state(int(self._memory)).get_value().state

    def _declare_vector_output(
        self, name: str, size: int, read: Callable[[Any], ArrayLike]
    ) -> None:
        if not self._feedthrough:
            start: Any = np.asarray(read(self._start), dtype=np.float64)
            held = self.DeclareDiscreteState(start.reshape(size))
            self._held.append((int(held), size, read))
            self.DeclareStateOutputPort(name, held)
            return

        def calc(context: Context, output: Output) -> None:
            value = np.asarray(read(self._result(context)), dtype=np.float64)
            output.SetFromVector(value.reshape(size))

        self.DeclareVectorOutputPort(name, size, calc, self._prerequisites)

    def _declare_pose_output(self, name: str, read: Callable[[Any], Any]) -> None:
        """`read` returns an object with a position `p` and a rotation `R`."""

        def calc(context: Context, output: Output) -> None:
            pose = read(self._result(context))
            output.set_value(rigid_transform(pose.p, pose.R))

        self.DeclareAbstractOutputPort(
            name, Value[RigidTransform], calc, self._prerequisites
        )

    def _declare_object_output(
        self, name: str, model: object, read: Callable[[Any], object]
    ) -> None:
        def calc(context: Context, output: Output) -> None:
            output.set_value(read(self._result(context)))

        self.DeclareAbstractOutputPort(
            name, lambda: AbstractValue.Make(model), calc, self._prerequisites
        )

    def _declare_pose_input(self, name: str) -> InputPort:
        return self.DeclareAbstractInputPort(name, Value[RigidTransform]())

    def _declare_object_input(self, name: str, model: object) -> InputPort:
        return self.DeclareAbstractInputPort(name, AbstractValue.Make(model))


def matrix(port: InputPort, context: Context) -> Vector:
    """Returns the 3x3 matrix of a row-major port, zero if not connected."""
    return vector(port, context).reshape(3, 3)


def vector(port: InputPort, context: Context) -> Vector:
    """Returns a vector port's value, zero if it is not connected."""
    if not port.HasValue(context):
        return _zeros(port.size())
    value: Vector = port.Eval(context)
    return value


def flag(port: InputPort, context: Context, otherwise: bool) -> bool:
    """Returns whether a port of size 1 holds more than 0.5; `otherwise` if it is
    not connected."""
    if not port.HasValue(context):
        return otherwise
    return bool(port.Eval(context)[0] > 0.5)


def pose(port: InputPort, context: Context) -> tuple[Vector, Vector]:
    """Returns position (3,) and rotation (3, 3) of a RigidTransform port."""
    X = port.Eval(context)
    return X.translation(), X.rotation().matrix()


def _wrong(port: InputPort, expected: str, got: str) -> TypeError:
    system = port.get_system()
    return TypeError(
        f"{system.get_name() or type(system).__name__}: input port "
        f"`{port.get_name()}` expected {expected}, got {got}"
    )


def typed(port: InputPort, context: Context, kind: type) -> Any:
    """Returns the value of an object port, which must be connected.

    To Drake all Python objects are of one type: Connect takes any.

    Raises
    ------
    TypeError
        Naming system and port, if the value is not of that kind.
    """
    value = port.Eval(context)
    if not isinstance(value, kind):
        raise _wrong(port, kind.__name__, type(value).__name__)
    return value


def message(port: InputPort, context: Context, tag: int) -> Any:
    """Returns the message at a port; the empty one if none has come, or it is not
    connected.

    Raises
    ------
    TypeError
        Naming system and port, if there is something else, or a message with
        another tag.
    """
    if not port.HasValue(context):
        return _core.Message()
    value = port.Eval(context)
    if not isinstance(value, MESSAGES):
        raise _wrong(port, describe(tag), type(value).__name__)
    if value.sequence == -1:
        return _core.Message()
    if tag_of(value) != tag:
        raise _wrong(port, describe(tag), describe(tag_of(value)))
    return value


def pose_message(port: InputPort, context: Context) -> _core.PoseMessage:
    """Returns the same as a PoseMessage; errors are those of `message`."""
    value = message(port, context, _core.PoseMessage.TAG)
    if isinstance(value, _core.PoseMessage):
        return value
    return _core.PoseMessage.from_message(value)


#: What may be at a port for messages.
MESSAGES = (_core.Message, _core.PoseMessage, _core.ForceMessage)


def tag_of(value: Any) -> int:
    """Returns what a message holds."""
    tag: int = value.tag if isinstance(value, _core.Message) else value.TAG
    return tag


def describe(tag: int) -> str:
    """Returns a tag for people: "PoseMessage", or its number."""
    empty = _core.Message()
    empty.tag = tag
    return empty.describe()


def rigid_transform(p: Any, R: Any) -> RigidTransform:
    """Returns a pose as Drake's type with the very same numbers: never raises.

    Drake's documentation asks more of a rotation (orthonormal to 3e-14) than the
    algorithms do, and what is no pose stays none: whoever acts on it refuses it.
    """
    return RigidTransform(RotationMatrix(R), p)


def check_positive(who: str, field: str, value: float) -> None:
    """Raises ValueError naming who and field unless finite and > 0."""
    if not (math.isfinite(value) and value > 0):
        raise ValueError(f"{who}: `{field}` expected a finite number > 0, got {value}")


def check_vector(who: str, field: str, value: ArrayLike, size: int) -> Vector:
    """Returns a vector as a float64 array of its own.

    Raises ValueError naming who and field unless it has that size and is
    finite.
    """
    array = np.array(value, dtype=np.float64)
    if array.shape != (size,):
        raise ValueError(
            f"{who}: `{field}` expected shape ({size},), got {array.shape}"
        )
    if not np.all(np.isfinite(array)):
        raise ValueError(f"{who}: `{field}` expected finite values, got {array}")
    return array
