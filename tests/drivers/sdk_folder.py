# SPDX-License-Identifier: BSD-3-Clause
"""The stand-in for Force Dimension's SDK, in folders as the SDK has them."""

import platform
import subprocess
from pathlib import Path

SOURCE = Path(__file__).with_name("force_dimension_stand_in.cc")


def build_sdk(folder):
    library = folder / f"lib/release/lin-{platform.machine()}-gcc/libdrd.so.3.17.5"
    library.parent.mkdir(parents=True)
    options = ["-std=c++20", "-O1", "-fPIC", "-shared", "-fvisibility=hidden"]
    subprocess.run(["c++", *options, SOURCE, "-o", library, "-pthread"], check=True)
    return folder
