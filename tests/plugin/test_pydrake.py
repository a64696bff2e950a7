# SPDX-License-Identifier: BSD-3-Clause
"""What is said where pydrake cannot be loaded."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from dual_proxy import _pydrake

ROOT = Path(__file__).resolve().parents[2]


MISSING_LIBRARY = """
print("a page of advice")
raise ImportError("libglib-2.0.so.0: cannot open shared object file: No such file")
"""


def import_with(pydrake: str, folder: Path, module: str) -> str:
    """Returns the last line on standard error, with `pydrake` as that package."""
    (folder / "pydrake.py").write_text(pydrake)
    run = subprocess.run(
        [sys.executable, "-c", f"import dual_proxy.{module}"],
        env={**os.environ, "PYTHONPATH": str(folder)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.stdout == ""
    return run.stderr.splitlines()[-1]


@pytest.mark.parametrize("module", ["systems", "station", "panda", "replay"])
def test_missing_library_is_said_with_its_package(tmp_path, module):
    assert import_with(MISSING_LIBRARY, tmp_path, module) == (
        "ImportError: pydrake cannot be loaded: the shared library libglib-2.0.so.0 "
        "is missing (Debian: apt install libglib2.0-0)"
    )


@pytest.mark.parametrize(
    ("pydrake", "message"),
    [
        (
            MISSING_LIBRARY.replace("libglib-2.0.so.0", "libnew.so.1"),
            "the shared library libnew.so.1 is missing",
        ),
        (
            "raise ModuleNotFoundError(\"No module named 'pydrake'\")",
            "No module named 'pydrake' (pip install drake)",
        ),
        ("raise ImportError('built\\nfor another Python')", "built for another Python"),
    ],
)
def test_anything_else_is_one_line(tmp_path, pydrake, message):
    last = import_with(pydrake, tmp_path, "systems")
    assert last == f"ImportError: pydrake cannot be loaded: {message}"


def test_packages_are_those_that_make_installs():
    script = (ROOT / "cmake" / "install_debian_packages").read_text()
    for library, package in _pydrake._PACKAGES.items():
        assert f"need {package} {library} library {library}" in script
