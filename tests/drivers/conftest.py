# SPDX-License-Identifier: BSD-3-Clause
"""The stand-in for Force Dimension's SDK, in folders as the SDK has them."""

import ctypes
import os

import pytest

# Nothing here depends on what the LeafSystems are written in: `make test` runs it
# once.
if os.environ.get("DUAL_PROXY_FACES") == "python":
    collect_ignore_glob = ["test_*.py"]


@pytest.fixture
def stand_in(sdk_folder, monkeypatch):
    """The library itself, fresh, where drivers find it."""
    monkeypatch.setenv("FDSDK", str(sdk_folder))
    library = ctypes.CDLL(next(sdk_folder.glob("lib/release/*/libdrd.so.*")))
    library.standInCount.restype = ctypes.c_long
    library.standInSetYaw.argtypes = [ctypes.c_double]
    library.standInSetGripper.argtypes = [ctypes.c_double]
    library.standInReset()
    return library
