# SPDX-License-Identifier: BSD-3-Clause
"""Messages at the ports of pydrake systems, whichever faces are in use.

The Python faces pass messages as Python objects, the C++ faces as C++ values
that pydrake does not know. A system of your own in Python that takes or gives
messages uses these functions and works with both.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import DiagramBuilder

from dual_proxy._core import ForceMessage, Message, PoseMessage
from dual_proxy.native import native_in_use, native_module


def make_value(message: Any) -> Any:
    """Returns an AbstractValue to declare a port with, or to fix an input port to.

    Parameters
    ----------
    message : Message, PoseMessage, ForceMessage, an array (3, k) of normals, or what
        has a C++ type in pydrake, as a RigidTransform.
    """
    messages = (Message, PoseMessage, ForceMessage, np.ndarray)
    if not (native_in_use() and isinstance(message, messages)):
        return AbstractValue.Make(message)
    builder = DiagramBuilder()
    native_module().add_prototype(builder, "prototype", message)
    system: Any = builder.GetSubsystemByName("prototype")
    value: Any = system.get_output_port(0).Allocate()
    native_module().set_value(value, message)
    return value


def set_value(value: Any, message: Any) -> None:
    """Puts a message into a value, as an output port's calculation does."""
    if _is_native(value):
        native_module().set_value(value, message)
    else:
        value.set_value(message)


def get_value(value: Any) -> Any:
    """Returns the message in a value, as `port.EvalAbstract(context)` gives it."""
    return native_module().get_value(value) if _is_native(value) else value.get_value()


def _is_native(value: Any) -> bool:
    # pydrake has a class of its own for each type that it knows.
    return type(value) is AbstractValue
