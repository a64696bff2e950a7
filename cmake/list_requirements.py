# SPDX-License-Identifier: BSD-3-Clause
"""Prints every requirement of pyproject.toml: to build, to run, to develop.

With them installed, the package builds without build isolation, so that one
build directory serves the wheel and the C++ tests.
"""

import tomllib
from pathlib import Path

project = tomllib.loads(
    (Path(__file__).resolve().parents[1] / "pyproject.toml").read_text()
)
requirements = [
    *project["build-system"]["requires"],
    *project["project"]["dependencies"],
    *project["project"]["optional-dependencies"]["dev"],
    "cmake",
    "ninja",
]
print("\n".join(dict.fromkeys(requirements)))
