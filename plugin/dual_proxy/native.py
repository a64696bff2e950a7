# SPDX-License-Identifier: BSD-3-Clause
"""Which LeafSystems serve: those written in C++ or those written in Python.

Both have the same ports and give the same numbers; those in C++ are there where
the package was built with Drake's headers, and cost a fraction. The environment
variable DUAL_PROXY_FACES chooses: `python`, `native`, or `auto` (the default:
`native` where available).
"""

from __future__ import annotations

import functools
import importlib
import os
from typing import Any

__all__ = ["FACES_VARIABLE", "native_available", "native_in_use"]

#: Of the environment: what `native_in_use` goes by.
FACES_VARIABLE = "DUAL_PROXY_FACES"
_CHOICES = ("python", "native", "auto")


@functools.cache
def _load() -> tuple[Any, str]:
    """Returns the module with the C++ systems, or None and why not."""
    try:
        return importlib.import_module("dual_proxy._native"), ""
    except ImportError as error:
        return None, str(error)


def native_available() -> bool:
    """Whether the C++ LeafSystems can be used under pydrake here."""
    return _load()[0] is not None


def native_in_use() -> bool:
    """Whether `add_to` adds C++ systems, by DUAL_PROXY_FACES.

    Raises
    ------
    ValueError
        If the variable is none of its choices, or `native` without there being
        C++ systems.
    """
    choice = os.environ.get(FACES_VARIABLE, "auto")
    if choice not in _CHOICES:
        raise ValueError(
            f"{FACES_VARIABLE}: expected one of {', '.join(_CHOICES)}, got {choice!r}"
        )
    if choice == "native" and not native_available():
        raise ValueError(
            f"{FACES_VARIABLE}: expected python or auto, as this build has no C++ "
            f"systems ({_load()[1]}; see docs/use_from_cpp.md), got 'native'"
        )
    return choice != "python" and native_available()


def native_module() -> Any:
    """Returns the module `dual_proxy._native`.

    Raises
    ------
    ImportError
        If this build has none.
    """
    module, reason = _load()
    if module is None:
        raise ImportError(reason)
    return module


class NativeTwin:
    """A mixin of pydrake systems that have a C++ system of the same name.

    The constructor checks its arguments, for both, and leaves what adds the C++
    system, and what that is made from.
    """

    _native_name: str
    _native_arguments: dict[str, Any]

    @classmethod
    def add_to(
        cls, builder: Any, *args: Any, name: str | None = None, **kwargs: Any
    ) -> Any:
        """Adds this system to a diagram: in C++ where that is in use.

        Parameters
        ----------
        builder : pydrake DiagramBuilder.
        name : of the system in the diagram, by default that of the class.
        args, kwargs : as for the class itself.

        Returns
        -------
        The system, as pydrake sees it. The C++ one has the same ports, found by
        name, but not this class's attributes.

        Raises
        ------
        ValueError
            As the class itself, and as `native_in_use`.
        """
        return cls(*args, **kwargs)._join(builder, name or cls.__name__)

    def _join(self, builder: Any, name: str) -> Any:
        if not native_in_use():
            return builder.AddNamedSystem(name, self)
        add = getattr(native_module(), f"add_{self._native_name}")
        add(builder, name, **self._native_arguments)
        return builder.GetSubsystemByName(name)
