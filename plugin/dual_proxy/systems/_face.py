# SPDX-License-Identifier: BSD-3-Clause
"""What the pydrake faces share: where an algorithm's state lives and when it
steps."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import (
    BasicVector,
    Context,
    EventStatus,
    InputPort,
    LeafSystem,
    State,
    ValueProducer,
)

Vector = NDArray[np.float64]

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


class Face(LeafSystem):
    """A system around one algorithm; it owns no mathematics.

    The algorithm's state is abstract state of the Context, so a diagram can be
    reset, cloned and run again with the same bits. It steps every `period`.

    With feedthrough, an output at time t is what the step at t gives, from the
    inputs at t: faces in a row all act on one tick's measurements, as the
    fused faces do. Put a ZeroOrderHold where the result goes to hardware.
    Without, an output is that of the last step.
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
        self._memory = self.DeclareAbstractState(AbstractValue.Make(start))
        self._prerequisites = {self.abstract_state_ticket(self._memory)}
        if self._feedthrough:
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

    def _calc_stepped(self, context: Context, value: AbstractValue) -> None:
        state = deepcopy(context.get_abstract_state(self._memory).get_value())
        self._step(context, state)
        value.set_value(state)

    def _advance(self, context: Context, state: State) -> EventStatus:
        memory = state.get_mutable_abstract_state(self._memory)
        if self._feedthrough:
            memory.set_value(self._stepped.Eval(context))
        else:
            self._step(context, memory.get_mutable_value())
        return EventStatus.Succeeded()

    def _result(self, context: Context) -> Any:
        """Returns the algorithm's state that the outputs show."""
        if self._feedthrough:
            return self._stepped.Eval(context)
        return context.get_abstract_state(self._memory).get_value()

    def _declare_vector_output(
        self, name: str, size: int, read: Callable[[Any], ArrayLike]
    ) -> None:
        def calc(context: Context, output: BasicVector) -> None:
            value = np.asarray(read(self._result(context)), dtype=np.float64)
            output.SetFromVector(value.reshape(size))

        self.DeclareVectorOutputPort(name, size, calc, self._prerequisites)

    def _declare_pose_output(self, name: str, read: Callable[[Any], Any]) -> None:
        """`read` returns an object with a position `p` and a rotation `R`."""

        def calc(context: Context, output: AbstractValue) -> None:
            pose = read(self._result(context))
            output.set_value(RigidTransform(RotationMatrix(pose.R), pose.p))

        self.DeclareAbstractOutputPort(
            name, Value[RigidTransform], calc, self._prerequisites
        )

    def _declare_object_output(
        self, name: str, model: object, read: Callable[[Any], object]
    ) -> None:
        def calc(context: Context, output: AbstractValue) -> None:
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
        return np.zeros(port.size())
    return np.asarray(port.Eval(context))


def pose(port: InputPort, context: Context) -> tuple[Vector, Vector]:
    """Returns position (3,) and rotation (3, 3) of a RigidTransform port."""
    X: RigidTransform = port.Eval(context)
    return X.translation(), X.rotation().matrix()
