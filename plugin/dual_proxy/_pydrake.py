# SPDX-License-Identifier: BSD-3-Clause
"""Imports pydrake, or says in one line what keeps it from being imported.

Modules that import pydrake import this one first.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import re

from dual_proxy.text import one_line

# What the pydrake wheel takes from its system, and Debian's packages of it.
_PACKAGES = {
    "libglib-2.0.so.0": "libglib2.0-0",
    "libX11.so.6": "libx11-6",
    "libSM.so.6": "libsm6",
}


def _explain(error: ImportError) -> str:
    if isinstance(error, ModuleNotFoundError):
        return f"{error.msg} (pip install drake)"
    missing = re.match(r"(\S+): cannot open shared object file", error.msg)
    if missing is None:
        return one_line(error.msg)
    package = _PACKAGES.get(missing[1])
    hint = f" (Debian: apt install {package})" if package else ""
    return f"the shared library {missing[1]} is missing{hint}"


def _import() -> None:
    try:
        # pydrake itself prints a page on a missing library.
        with contextlib.redirect_stdout(io.StringIO()):
            importlib.import_module("pydrake.common")
    except ImportError as error:
        raise ImportError(
            f"pydrake cannot be loaded: {_explain(error)}", name="pydrake"
        ) from error


_import()
