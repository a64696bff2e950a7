# SPDX-License-Identifier: BSD-3-Clause
"""Writes the type stub of the compiled module `dual_proxy._core`.

python cmake/generate_stubs.py OUTPUT.pyi
"""

import subprocess
import sys
import tempfile
from pathlib import Path


def generate() -> str:
    """Returns the stub of the installed `dual_proxy._core`, formatted."""
    with tempfile.TemporaryDirectory() as directory:
        subprocess.run(
            [
                sys.executable,
                "-m",
                "pybind11_stubgen",
                "dual_proxy._core",
                "--numpy-array-use-type-var",
                "-o",
                directory,
            ],
            check=True,
            capture_output=True,
        )
        return (Path(directory) / "dual_proxy" / "_core.pyi").read_text()


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(generate())
