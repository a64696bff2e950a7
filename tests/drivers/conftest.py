# SPDX-License-Identifier: BSD-3-Clause
"""The stand-in for Force Dimension's SDK, in folders as the SDK has them."""

import ctypes
import os
import platform
import subprocess
from pathlib import Path

import pytest

SOURCE = Path(__file__).with_name("force_dimension_stand_in.cc")

# Nothing here depends on what the LeafSystems are written in: `make test` runs it
# once.
if os.environ.get("DUAL_PROXY_FACES") == "python":
    collect_ignore_glob = ["test_*.py"]


@pytest.fixture(scope="session")
def sdk_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sdk")
    library = folder / f"lib/release/lin-{platform.machine()}-gcc/libdrd.so.3.17.5"
    library.parent.mkdir(parents=True)
    options = ["-std=c++20", "-O1", "-fPIC", "-shared", "-fvisibility=hidden"]
    subprocess.run(["c++", *options, SOURCE, "-o", library, "-pthread"], check=True)
    return folder


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
