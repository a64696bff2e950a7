# SPDX-License-Identifier: BSD-3-Clause
"""examples/cpp/plane gives the metrics of `dual-proxy run`."""

import json
import subprocess
from pathlib import Path

import pytest

import dual_proxy as dp

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "tests" / "data"
PROGRAM = ROOT / "build" / "examples" / "cpp" / "plane"

needs_program = pytest.mark.skipif(
    not PROGRAM.exists(), reason="built where Drake's C++ library is found"
)


@needs_program
@pytest.mark.parametrize(
    ("name", "scheme"),
    [
        *(("plane", scheme) for scheme in dp.scenario.SCHEMES),
        ("flat_tool", "dual_proxy"),
        (DATA / "surfaces.yaml", "dual_proxy"),
    ],
)
def test_metrics_are_those_of_the_python_run(name, scheme, tmp_path):
    check_metrics(
        name,
        {"scheme": scheme, "link.delay": 0.05, "duration": 8.0, "seed": 3},
        tmp_path,
    )


@needs_program
def test_models_are_those_of_the_python_run(tmp_path):
    path = DATA / "models" / "block_and_ball.dmd.yaml"
    check_metrics(
        "plane", {"scene.model_directives": str(path), "duration": 8.0}, tmp_path
    )


def check_metrics(name, overrides, tmp_path):
    scenario = dp.load_scenario(name).with_overrides(overrides)
    expected = dp.run(scenario).metrics
    path = tmp_path / "scenario.yaml"
    path.write_text(scenario.to_yaml())
    subprocess.run([PROGRAM, path, tmp_path / "out"], check=True, timeout=300)
    metrics = json.loads((tmp_path / "out" / "metrics.json").read_text())
    assert list(metrics) == list(expected)
    assert metrics["contact_force_max_N"] > 1.0
    for key, value in metrics.items():
        if key not in ("wall_s", "real_time_factor"):
            assert value == expected[key], key


@needs_program
@pytest.mark.parametrize(
    ("arguments", "status", "message"),
    [
        ([], 2, "usage: plane"),
        (["no_such.yaml", "out"], 3, "no_such.yaml"),
    ],
)
def test_errors_are_one_line(arguments, status, message, tmp_path):
    run = subprocess.run(
        [PROGRAM, *arguments],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert run.returncode == status
    assert message in run.stderr
    assert run.stderr.count("\n") == 1
