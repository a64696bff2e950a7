# SPDX-License-Identifier: BSD-3-Clause
"""Every example runs and shows what it says."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from dual_proxy.tool_calibration import (
    calibrate_tool,
    find_resting_poses,
    read_samples,
)

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def run(name, *arguments):
    """Returns the lines that the example prints."""
    result = subprocess.run(
        [sys.executable, str(EXAMPLES / name), *arguments],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    assert result.stderr == ""
    return result.stdout.splitlines()


def values(line):
    return [float(value) for value in re.findall(r"-?\d+\.\d+|-?\d+", line)]


def test_every_example_is_tested():
    assert {path.name for path in EXAMPLES.glob("*.py")} == {
        "01_filter_alone.py",
        "02_own_diagram.py",
        "03_driver.py",
        "04_tool_poses.py",
    }


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda p: p.name)
def test_example_is_short(path):
    assert len(path.read_text().splitlines()) < 100


def test_filter_alone_finds_the_wall():
    lines = run("01_filter_alone.py", "2.0")
    for line in lines:
        time, dimension, *found = values(line)
        if time < 1.0:
            assert dimension == 0
        if time > 1.5:
            assert dimension == 1
            assert found[-1] < 15.0
    assert values(lines[-1])[0] > 1.5


def test_driver_feels_what_pushes_the_robot():
    lines = [values(line) for line in run("03_driver.py", "3")]
    assert lines[0][-3:] == [0, 0, 0]
    assert lines[-1][-1] > 1.0  # N, upwards.


def test_own_diagram_goes_into_contact():
    lines = [values(line) for line in run("02_own_diagram.py", "4")]
    assert lines[0][2] == 0
    time, height, dimension, force = lines[-1]
    assert time == 4.0
    assert dimension == 1
    assert 0.09 < height < 0.1  # In touch with the floor, at 0.1 m.
    assert 3.0 < force < 12.0  # The hand is pushed up.


def test_tool_is_found_from_its_poses(tmp_path):
    samples = tmp_path / "poses.csv"
    assert run("04_tool_poses.py", samples) == [f"1800 samples in {samples}"]
    result = calibrate_tool(find_resting_poses(read_samples(samples)))
    assert len(result.poses) == 6
    assert abs(result.mass - 0.83) < 0.005
