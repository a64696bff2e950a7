# SPDX-License-Identifier: BSD-3-Clause
"""A tool is found again from what a sensor would measure of it."""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from scipy.spatial.transform import Rotation

import dual_proxy as dp
from dual_proxy.cli import main
from dual_proxy.panda import Q_REST, PandaModel
from dual_proxy.tool_calibration import (
    CalibrationError,
    RestingPose,
    calibrate_tool,
    find_resting_poses,
    read_samples,
)

ROOT = Path(__file__).resolve().parents[2]
MASS = 0.83
COM = np.array([0.004, -0.011, 0.062])
BIAS = np.array([3.1, -7.4, 12.9, 0.21, -0.34, 0.08])
FORCE_NOISE = 0.2
MOMENT_NOISE = 0.005
# Down, and from there 60 deg to four sides, and on a side.
TILTS = [[0, 0], [60, 0], [-60, 0], [0, 60], [0, -60], [90, 20]]
DOWN = Rotation.from_euler("x", 180, degrees=True)
TURNS = [DOWN * Rotation.from_euler("xy", tilt, degrees=True) for tilt in TILTS]


def wrench(turn, mass=MASS, com=COM, bias=BIAS):
    """What the arm exerts on a tool at rest, in S, and the bias."""
    force = turn.inv().apply([0, 0, mass * 9.81])
    return np.concatenate([force, np.cross(com, force)]) + bias


def hold(turns, seconds=1.0, rate=200, noise=1.0, seed=1):
    """Samples at rest in each pose, with moves of half a second between."""
    random = np.random.default_rng(seed)
    rows = []
    for i, turn in enumerate(turns):
        way = (turn.inv() * turns[min(i + 1, len(turns) - 1)]).as_rotvec()
        end = seconds if i == len(turns) - 1 else seconds + 0.5
        for step in range(int(rate * end)):
            share = np.clip((step / rate - seconds) / 0.5, 0, 1)
            now = turn * Rotation.from_rotvec(share * way)
            # Of the scalar first quaternions one may as well be the negative.
            quaternion = np.roll(now.as_quat(), 1) * random.choice([-1, 1])
            error = random.normal(size=6) * ([FORCE_NOISE] * 3 + [MOMENT_NOISE] * 3)
            rows.append([len(rows) / rate, *quaternion, *wrench(now), *noise * error])
    values = np.array(rows)
    values[:, 5:11] += values[:, 11:]
    columns = ["t", "qw", "qx", "qy", "qz", "fx", "fy", "fz", "mx", "my", "mz"]
    return pd.DataFrame(values[:, :11], columns=columns)


def pose(turn, measured=None):
    measured = wrench(turn) if measured is None else measured
    return RestingPose(0.0, 1, turn.as_matrix(), measured, 0.0)


def test_without_noise_the_numbers_are_exact():
    result = calibrate_tool([pose(turn) for turn in TURNS])
    assert result.mass == pytest.approx(MASS, abs=1e-9)
    np.testing.assert_allclose(result.com, COM, atol=1e-9)
    np.testing.assert_allclose(result.bias, BIAS, atol=1e-9)
    assert result.force_residuals.max() < 1e-9
    assert result.moment_residuals.max() < 1e-9


def test_all_around_is_the_best_condition():
    axes = [axis for i in range(3) for axis in (np.eye(3)[i], -np.eye(3)[i])]
    turns = [Rotation.align_vectors([axis], [[0, 0, 1]])[0] for axis in axes]
    result = calibrate_tool([pose(turn) for turn in turns])
    assert result.condition == pytest.approx(np.sqrt(1.5))


def test_with_noise_the_errors_are_as_large_as_is_said():
    errors = []
    random = np.random.default_rng(1)
    scale = np.array([FORCE_NOISE] * 3 + [MOMENT_NOISE] * 3)
    for _ in range(200):
        noise = random.normal(size=(len(TURNS), 6)) * scale / 10
        result = calibrate_tool(
            [pose(turn, wrench(turn) + n) for turn, n in zip(TURNS, noise, strict=True)]
        )
        errors.append(
            [
                (result.mass - MASS) / result.mass_std,
                *(result.com - COM) / result.com_std,
                *(result.bias - BIAS) / result.bias_std,
            ]
        )
    assert result.mass_std < 0.01
    assert result.com_std.max() < 0.001
    size = np.sqrt(np.mean(np.square(errors)))
    assert 0.9 < size < 1.3


def test_moves_and_their_ends_are_left_out():
    samples = hold(TURNS, noise=0)
    # A hand that moves the tool exerts a force on it, and it swings after.
    moving = samples["t"] % 1.5 > 1
    after = samples["t"] % 1.5 < 0.2
    samples.loc[moving | after, ["fx", "my"]] += 20
    result = calibrate_tool(find_resting_poses(samples))
    assert result.mass == pytest.approx(MASS, abs=1e-6)
    assert [round(pose.start, 2) for pose in result.poses] == [
        pytest.approx(1.5 * i + 0.25, abs=0.03) for i in range(len(TURNS))
    ]


def test_panda_joints_in_place_of_an_orientation():
    model = PandaModel()
    rows = []
    for change in ([0] * 7, [0, 0, 0, 0, 0, 1, 0], [0, 0, 0, 0, 1, -1, 0.5]):
        for side in (1, -1):
            q = Q_REST + side * np.array(change, dtype=float)
            turn = Rotation.from_matrix(model.forward_kinematics(q).rotation().matrix())
            for _ in range(80):
                rows.append([len(rows) / 100, *q, *wrench(turn)])
    names = ["t", *(f"q{i}" for i in range(1, 8)), "fx", "fy", "fz", "mx", "my", "mz"]
    samples = pd.DataFrame(rows, columns=names)
    result = calibrate_tool(find_resting_poses(samples))
    assert result.mass == pytest.approx(MASS, abs=1e-6)
    np.testing.assert_allclose(result.com, COM, atol=1e-6)


def test_adapter_reads_nothing_in_new_poses():
    """The simulated sensor gives the samples, and the adapter what is left."""
    sensor = dp.ForceTorqueSensor(
        dp.ForceTorqueSensorParams(
            force_bias=BIAS[:3],
            moment_bias=BIAS[3:],
            force_noise_std=FORCE_NOISE,
            moment_noise_std=MOMENT_NOISE,
        )
    )
    state = sensor.make_state(3)

    def measure(turn):
        reaction = wrench(turn, bias=np.zeros(6))
        arguments = (np.zeros(3), turn.as_matrix(), np.zeros(3), state)
        sensor.update(reaction, *arguments)
        return state.measured

    poses = [
        pose(turn, np.mean([measure(turn) for _ in range(500)], axis=0))
        for turn in TURNS
    ]
    result = calibrate_tool(poses)

    adapter = dp.ForceTorqueAdapter(result.adapter_params())
    memory = adapter.make_state()

    def update(turn):
        adapter.update(
            measure(turn), np.zeros(3), turn.as_matrix(), np.zeros(3), memory
        )
        return memory.wrench

    for _ in range(600):
        update(TURNS[0])
    assert memory.tares == 1
    np.testing.assert_allclose(memory.bias, BIAS, atol=0.05)
    for turn in Rotation.random(10, random_state=2):
        for _ in range(15):
            update(turn)  # Until it knows that the tool does not accelerate.
        left = np.mean([update(turn) for _ in range(400)], axis=0)
        # Far below the noise of a sample.
        assert np.abs(left[:3]).max() < 0.3 * FORCE_NOISE
        assert np.abs(left[3:]).max() < 0.6 * MOMENT_NOISE


def refusal(poses, **limits):
    with pytest.raises(CalibrationError) as error:
        calibrate_tool(poses, **limits)
    assert "\n" not in str(error.value)
    return str(error.value)


def test_too_few_poses():
    assert "at least 4 poses" in refusal([pose(turn) for turn in TURNS[:3]])


def test_poses_that_are_alike():
    near = [DOWN * Rotation.from_euler("xy", [x, y]) for x, y in np.eye(2).repeat(3, 0)]
    assert "condition" in refusal([pose(turn) for turn in near])
    # Turned about the vertical, which says nothing.
    around = [Rotation.from_euler("z", i) * DOWN for i in range(8)]
    assert "expected poses that differ more" in refusal([pose(t) for t in around])
    # In one plane: the centre of mass along the axis of tilting is not seen.
    tilts = [DOWN * Rotation.from_euler("x", x) for x in np.linspace(-0.05, 0.05, 8)]
    assert "condition" in refusal([pose(turn) for turn in tilts])


def test_reverse_force():
    text = refusal([pose(turn, -wrench(turn)) for turn in TURNS])
    assert "expected a mass > 0, got -0.83 kg: the sensor reports the reverse" in text


def test_mounted_turned_and_not_said():
    turned = Rotation.from_euler("z", 30, degrees=True)
    measured = [
        np.concatenate([turned.apply(part) for part in np.split(wrench(t), 2)])
        for t in TURNS
    ]
    poses = [pose(t, m) for t, m in zip(TURNS, measured, strict=True)]
    text = refusal(poses)
    assert "expected a residual force of at most 0.5 N rms, got" in text
    assert "R_SN" in text


def test_touched_in_one_pose():
    poses = [pose(turn) for turn in TURNS]
    touched = wrench(TURNS[2]) + np.array([4, 0, 0, 0, 0.2, 0])
    poses[2] = RestingPose(7.5, 1, TURNS[2].as_matrix(), touched, 0.0)
    assert "N in the pose at 7.50 s" in refusal(poses)
    assert "residual moment" in refusal(poses, max_force_residual=10)


def test_no_tool():
    random = np.random.default_rng(1)
    poses = [
        pose(turn, wrench(turn, mass=0) + random.normal(size=6, scale=0.01))
        for turn in TURNS
    ]
    assert "expected a tool whose weight is seen" in refusal(poses)


def test_not_finite():
    bad = wrench(TURNS[0])
    bad[4] = np.nan
    poses = [pose(TURNS[0], bad), *map(pose, TURNS[1:])]
    assert "finite" in refusal(poses)


def test_moving_arm_has_no_poses():
    turns = [DOWN * Rotation.from_euler("x", 0.3 * i) for i in range(20)]
    samples = hold(turns, seconds=0.0)
    assert find_resting_poses(samples) == []


def test_moves_without_turning():
    samples = hold(TURNS)
    samples["fz"] += 5 * np.sin(20 * samples["t"])
    with pytest.raises(CalibrationError, match="expected noise of at most 1 N at rest"):
        find_resting_poses(samples)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t.drop(columns=["mz", "fx"]), "missing fx, mz"),
        (lambda t: t.drop(columns="qx"), "missing qx"),
        (lambda t: t.drop(columns="qw"), "missing q1, q2, q3, q4, q5, q6, q7"),
        (
            lambda t: t.assign(fy=[*t["fy"][:-1], np.nan]),
            "numbers up to 10000, got fy = nan",
        ),
        (lambda t: t.assign(fy=["x", *t["fy"][1:]]), "got fy = 'x' in row 1"),
        (lambda t: t.assign(t=0.0), "increasing times, got t = 0.0 in row 2"),
        (lambda t: t.assign(qw=2.0), "a unit quaternion, got qw = 2.0 in row 1"),
    ],
)
def test_bad_samples_are_named(change, message, tmp_path):
    path = tmp_path / "samples.csv"
    change(hold(TURNS[:1], rate=20)).to_csv(path, index=False)
    with pytest.raises(CalibrationError, match=message):
        read_samples(path)


@pytest.mark.parametrize("content", [b"", b"\xff\xfe\x00", b"a\n1,2,3\n4\n"])
def test_no_table_at_all(content, tmp_path):
    path = tmp_path / "samples.csv"
    path.write_bytes(content)
    with pytest.raises(CalibrationError, match=r"samples\.csv"):
        read_samples(path)


def test_command(tmp_path, capsys):
    samples, out = tmp_path / "poses.csv", tmp_path / "made" / "tool.yaml"
    hold(TURNS).to_csv(samples, index=False)
    assert main(["calibrate-tool", str(samples), "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "6 poses, condition" in printed
    params = dp.ForceTorqueAdapterParams(**yaml.safe_load(out.read_text()))
    assert params.tool_mass == pytest.approx(MASS, abs=0.02)
    np.testing.assert_allclose(params.tool_com, COM, atol=0.002)
    assert params.tare
    # The bias is larger than the default takes for one.
    assert np.linalg.norm(BIAS[:3]) + 9 < params.tare_max_force < 26.2


def test_page_shows_what_the_commands_print(tmp_path, capsys):
    page = (ROOT / "docs" / "force_sensor.md").read_text()
    commands, shown, saved = re.findall(r"```(?:sh|text|yaml)\n(.*?)```", page, re.S)[
        :3
    ]
    samples, out = tmp_path / "poses.csv", tmp_path / "tool.yaml"
    example = ROOT / "examples" / "04_tool_poses.py"
    subprocess.run([sys.executable, example, samples], check=True, capture_output=True)
    assert main(["calibrate-tool", str(samples), "--out", str(out)]) == 0
    assert "python examples/04_tool_poses.py poses.csv" in commands
    assert "dual-proxy calibrate-tool poses.csv --out tool.yaml" in commands
    printed = capsys.readouterr().out.replace(str(out), "tool.yaml")
    for text, expected in ((printed, shown), (out.read_text(), saved)):
        number = re.compile(r"-?\d+\.\d+")
        assert number.sub("#", text) == number.sub("#", expected)
        np.testing.assert_allclose(
            [float(value) for value in number.findall(text)],
            [float(value) for value in number.findall(expected)],
            atol=2e-3,
        )


def test_command_refuses(tmp_path, capsys):
    samples = tmp_path / "poses.csv"
    hold(TURNS[:2]).to_csv(samples, index=False)
    out = tmp_path / "tool.yaml"
    assert main(["calibrate-tool", str(samples), "--out", str(out)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("dual-proxy: error: expected at least 4 poses")
    assert captured.err.count("\n") == 1
    assert not out.exists()
    assert main(["calibrate-tool", str(tmp_path / "none.csv")]) == 2
    assert "none.csv: No such file" in capsys.readouterr().err


def test_from_the_sensors_stream_to_the_tool(tmp_path):
    """A sensor that is mounted turned, its counts over the network, and all of it."""
    mounted = Rotation.from_euler("z", -45, degrees=True)
    server = subprocess.Popen(
        [sys.executable, Path(__file__).parent / "rdt_server.py"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )

    def load(turn):
        """Put on the sensor what the tool exerts on it, in its own axes."""
        parts = np.split(-wrench(turn), 2)
        counts = np.concatenate([mounted.apply(part) for part in parts]) * 1e6
        settings = {"counts": counts.round().astype(int).tolist(), "noise": 50_000}
        server.stdin.write(json.dumps(settings) + "\n")
        server.stdin.flush()
        server.stdout.readline()

    ports = json.loads(server.stdout.readline())
    params = dp.RdtSensorParams(
        host="127.0.0.1", port=ports["rdt"], R_SN=mounted.inv().as_matrix(), silence=5
    )
    rows = []
    try:
        load(TURNS[0])
        with dp.RdtSensor(params) as sensor:
            for turn in TURNS:
                load(turn)
                # What was on its way when it changed is over by then.
                start = sensor.counts.taken + 20
                last = None
                samples = 0
                while samples < 100:
                    reading = sensor.read()
                    if sensor.counts.taken < start or reading.time == last:
                        continue
                    last = reading.time
                    samples += 1
                    quaternion = np.roll(turn.as_quat(), 1)
                    rows.append([0.01 * len(rows), *quaternion, *reading.value])
    finally:
        server.stdin.close()
        server.wait(timeout=5)
        server.stdout.close()
    columns = ["t", "qw", "qx", "qy", "qz", "fx", "fy", "fz", "mx", "my", "mz"]
    path = tmp_path / "poses.csv"
    pd.DataFrame(rows, columns=columns).to_csv(path, index=False)
    result = calibrate_tool(find_resting_poses(read_samples(path)))
    assert result.mass == pytest.approx(MASS, abs=0.01)
    np.testing.assert_allclose(result.com, COM, atol=0.005)
