# SPDX-License-Identifier: BSD-3-Clause
"""The bare engine beside Drake: the same loop, another plant."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import dual_proxy as dp
from dual_proxy import cli
from dual_proxy.log import load_log, signal
from dual_proxy.scenario import SCHEMES

DURATION = 7.0
# The tool lies on the table and slides along it, s.
PRESSED = slice(4.0, 7.0)
# In contact these swing and lose it, and what is small grows.
SWINGING = {"position_force", "four_channel"}
# Nothing damps their robot against the ground: it swings on the hand, touches
# early and bounces.
FLOATING = {"four_channel", "wave_variables"}


@pytest.fixture(scope="module", params=SCHEMES)
def runs(request) -> dict[str, dp.Run]:
    return {
        engine: dp.run(
            "plane", scheme=request.param, delay=0.05, duration=DURATION, engine=engine
        )
        for engine in ("bare", "drake")
    }


def test_log_is_whole_and_finite(runs):
    bare, drake = runs["bare"], runs["drake"]
    assert (bare.engine, drake.engine) == ("bare", "drake")
    assert list(bare.log.columns) == list(drake.log.columns)
    assert (bare.log.dtypes == drake.log.dtypes).all()
    np.testing.assert_allclose(bare.log.index, drake.log.index, rtol=0, atol=1e-9)
    assert np.isfinite(bare.log.to_numpy()).all()
    assert list(bare.metrics) == list(drake.metrics)
    assert bare.metrics["finite"]
    assert bare.metrics["limits_broken"] == []
    assert bare.metrics["sim_s"] == pytest.approx(DURATION)


def test_runs_agree(runs):
    bare, drake = runs["bare"].log, runs["drake"].log
    # Until the tool touches they differ by how the two integrate.
    touched = drake.index[drake["contact_force_z"] < -0.5][0]
    scheme = runs["bare"].scenario.scheme
    swings, floats = scheme in SWINGING, scheme in FLOATING
    assert (2.0 if floats else 3.0) < touched < 4.0
    tolerance = 2e-2 if swings else 3e-3
    for name in ("robot_position", "device_position"):
        difference = signal(bare, name) - signal(drake, name)
        before = np.abs(difference[drake.index < touched]).max()
        assert before < (5e-4 if floats else 5e-5), name
        assert np.abs(difference).max() < tolerance, name
    pressed = bare.loc[PRESSED], drake.loc[PRESSED]
    means = [signal(log, "contact_force").mean(axis=0) for log in pressed]
    assert means[1][2] < -3.0
    # Where friction holds the tool is where it happened to come to rest.
    np.testing.assert_allclose(*means, rtol=0, atol=0.5 if swings else 0.25)
    for log in pressed:
        assert (log["contact_dimension"] == 1).mean() > (0.4 if swings else 0.99)
        normal = signal(log, "contact_normal")[log["contact_dimension"] == 1]
        np.testing.assert_allclose(normal, [[0.0, 0.0, -1.0]] * len(normal), atol=1e-9)
    for run in runs.values():
        if not swings:
            assert run.metrics["contact_losses"] <= (5 if floats else 0)
        if "dimension" in bare:  # Half of the contact is before it slides.
            assert run.metrics["normal_error_mean_deg"] < 4.0
            assert run.metrics["dimension_accuracy"] > 0.95


def test_equal_runs_are_equal_bit_for_bit(runs):
    bare = runs["bare"]
    again = dp.run(bare.scenario.with_overrides({"duration": DURATION}), engine="bare")
    pd.testing.assert_frame_equal(again.log, bare.log, check_exact=True)
    other = dp.run(bare.scenario.with_overrides({"seed": 1}), engine="bare")
    assert not np.array_equal(other.log["sensed_force_x"], bare.log["sensed_force_x"])


def test_flat_tool_lies_flat_with_the_angular_filter():
    bare, drake = (
        dp.run("flat_tool", duration=8.0, engine=engine) for engine in ("bare", "drake")
    )
    assert list(bare.log.columns) == list(drake.log.columns)
    assert np.isfinite(bare.log.to_numpy()).all()
    pressed = bare.log.loc[5.0:]
    assert (pressed["contact_moment_dimension"] == 2).mean() > 0.95
    assert (pressed["moment_dimension"] == 2).mean() > 0.95
    axis = signal(pressed, "contact_rotation_axis")
    assert np.abs(axis[np.any(axis != 0.0, axis=1), 2]).min() > 0.999
    assert bare.metrics["contact_losses"] == 0
    difference = bare.log["contact_force_z"] - drake.log["contact_force_z"].to_numpy()
    assert abs(difference.loc[5.0:].mean()) < 0.2


@pytest.mark.parametrize("delay", [0.0, 0.35])
def test_cartesian_impedance_in_place_of_lambda(delay):
    run = dp.run(
        "plane",
        delay=delay,
        duration=DURATION,
        engine="bare",
        overrides={"controller.motion": "cartesian_impedance"},
    )
    assert run.metrics["limits_broken"] == []
    assert run.metrics["contact_losses"] == 0
    assert run.metrics["normal_error_mean_deg"] < 3.0
    assert run.metrics["dimension_accuracy"] > 0.95
    pressed = run.log.loc[PRESSED]
    assert -7.5 < pressed["contact_force_z"].mean() < -5.0
    # What moves the tool is a spring of 440 N/m and a damper of 88 N s/m.
    motion = signal(pressed, "motion_force")
    spring = -440.0 * signal(pressed, "motion_error")
    late = signal(pressed, "robot_velocity") - signal(pressed, "robot_proxy_velocity")
    # Beside the proxy's acceleration, which is fed forward, and is none on average.
    expected = (spring - 88.0 * late).mean(axis=0)
    np.testing.assert_allclose(motion.mean(axis=0)[0], expected[0], atol=0.3)


def test_auto_takes_drake_and_others_are_refused():
    assert dp.run("plane", duration=0.01).engine == "drake"
    with pytest.raises(
        dp.ScenarioError, match=r"^engine: expected one of auto, drake, bare, got 'od"
    ):
        dp.run("plane", duration=0.01, engine="ode")


def test_log_goes_on_where_it_was_interrupted():
    def progress(now, end):
        if now > 0.35:
            raise KeyboardInterrupt

    with pytest.raises(dp.RunError, match=r"after 0\.4 s: interrupted") as caught:
        dp.run("plane", duration=2.0, progress=progress, engine="bare")
    np.testing.assert_allclose(caught.value.run.log.index, 1e-3 * np.arange(1, 401))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("--set", "scene.contact_approximation=sap"),
            'plane.scene.contact_approximation: expected one of "lagged", "similar" '
            'with engine bare, whose contacts are Hunt and Crossley\'s, got "sap"',
        ),
        (("--meshcat",), "meshcat: expected False with engine bare, got True"),
    ],
)
def test_what_only_drake_has_is_refused_in_one_line(
    capsys, tmp_path, arguments, message
):
    out = tmp_path / "out"
    status = cli.main(
        ["run", "plane", "--engine", "bare", "--out", str(out), *arguments]
    )
    assert status == 2
    captured = capsys.readouterr()
    assert captured.err == f"dual-proxy: error: {message}\n"
    assert captured.out == ""
    assert not out.exists()


def test_command_runs_it(capsys, tmp_path):
    command = ["run", "plane", "--engine", "bare", "--duration", "0.5"]
    assert cli.main([*command, "--out", str(tmp_path)]) == 0
    assert "finite" in capsys.readouterr().out
    run = dp.run("plane", duration=0.5, engine="bare")
    pd.testing.assert_frame_equal(
        load_log(tmp_path / "log.npz"), run.log, check_exact=True
    )
    assert cli.main([*command, "--engine", "ode"]) == 2
    assert "argument --engine: invalid choice: 'ode'" in capsys.readouterr().err
