# SPDX-License-Identifier: BSD-3-Clause
"""Poses of an arm that is guided by hand, in a time that goes by when it is slept."""

import math
import os
import signal
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import dual_proxy as dp
from dual_proxy.cli import main
from dual_proxy.hardware import pose_recorder
from dual_proxy.hardware.arms import ArmFault
from dual_proxy.hardware.pose_recorder import GuidedPanda, PoseRecorder
from dual_proxy.scene_params import TOOL_COM_S, TOOL_MASS
from dual_proxy.tool_calibration import (
    calibrate_tool,
    find_resting_poses,
    read_samples,
)


@pytest.fixture(autouse=True)
def clock(monkeypatch):
    """A time in which a session of a minute takes a second."""
    clock = SimpleNamespace(now=100.0)
    clock.monotonic = lambda: clock.now

    def sleep(seconds):
        clock.now += seconds

    clock.sleep = sleep
    monkeypatch.setattr(pose_recorder, "time", clock)
    return clock


class Guided(GuidedPanda):
    """With what happens at times, s: `events` from when to until when, and what."""

    def __init__(self, clock, events=()):
        super().__init__()
        self._clock = clock
        self._events = events
        self.last = None

    def within(self, what):
        now = self._clock.now - 100
        return any(a <= now < b for a, b, name in self._events if name == what)

    def wrench(self):
        reading = super().wrench()
        if self.within("silent"):
            return self.last
        if self.within("touched"):
            push = 5 * math.sin(20 * self._clock.now)
            reading = replace(reading, value=reading.value + push * np.eye(6)[0])
        self.last = reading
        return replace(reading, valid=not self.within("invalid"))

    def look(self):
        reading = super().look()
        if self.within("gone"):
            raise ArmFault("no connection")
        if self.within("still"):
            return replace(reading, q=np.array(pose_recorder.Q_REST))
        if self.within("turned little"):
            return replace(reading, q=pose_recorder.Q_REST + 0.1 * np.eye(7)[5])
        return reading


def same_poses(recorded, path):
    """Whether those of the file are those that were told."""
    found = find_resting_poses(read_samples(path))
    assert len(found) == len(recorded)
    for a, b in zip(recorded, found, strict=True):
        assert (a.rotation == b.rotation).all()
        np.testing.assert_allclose(a.wrench, b.wrench, atol=1e-12)
    return found


def test_command_records_what_calibrate_tool_takes(tmp_path, capsys):
    out = tmp_path / "made" / "poses.csv"
    record = ["record-poses", "--arm", "simulated", "--sensor", "own"]
    assert main([*record, "--out", str(out), "--poses", "6"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("pose 1 of 6: 0 deg from down, noise 0.2")
    assert lines[0].endswith("condition not known yet (at most 10)")
    assert lines[5].startswith("pose 6 of 6")
    assert lines[6] == f"saved: {out}, 6 poses"
    assert main(["calibrate-tool", str(out), "--out", str(tmp_path / "tool.yaml")]) == 0
    assert "6 poses, condition" in capsys.readouterr().out
    tool = calibrate_tool(find_resting_poses(read_samples(out)))
    assert tool.mass == pytest.approx(TOOL_MASS, abs=0.01)
    np.testing.assert_allclose(tool.com, TOOL_COM_S, atol=0.005)
    # It is never overwritten.
    before = out.read_bytes()
    assert main([*record, "--out", str(out)]) == 2
    assert "poses.csv: File exists" in capsys.readouterr().err
    assert out.read_bytes() == before


def test_what_would_spoil_the_file_is_told_and_not_in_it(clock, tmp_path, capsys):
    out = tmp_path / "poses.csv"
    events = [
        (2.0, 3.5, "touched"),  # The second pose: it is taken by a later round.
        (4.6, 5.2, "silent"),
        (6.5, 8.5, "turned little"),
        (9.0, 9.2, "invalid"),
    ]
    recorder = PoseRecorder(Guided(clock, events), None, out, 6, live=False)
    assert recorder.run() == 6
    told = capsys.readouterr().out.splitlines()
    print(told)
    assert sum("not recorded: expected noise" in line for line in told) >= 1
    assert sum(line.startswith("no samples of the sensor") for line in told) == 2
    assert told.count("the sensor is there again") == 2
    assert sum("not recorded: as pose 1;" in line for line in told) >= 1
    same_poses(recorder.poses, out)


def test_who_does_not_move_has_one_pose(clock, tmp_path, capsys):
    out = tmp_path / "poses.csv"
    arm = Guided(clock, [(0, 20, "still"), (20, 30, "gone")])
    recorder = PoseRecorder(arm, None, out, live=True)
    with pytest.raises(ArmFault, match="no connection"):
        recorder.run()
    # What there was until then is there.
    assert len(same_poses(recorder.poses, out)) == 1
    captured = capsys.readouterr()
    assert captured.out.count("\n") == 1
    assert captured.out.startswith("pose 1 of 6 or more")
    assert "still for 0.6 of 1.25 s" in captured.err
    assert "turn the tool to another side" in captured.err


def test_each_pose_is_written_at_once_and_ctrl_c_ends_it(
    clock, tmp_path, capsys, monkeypatch
):
    out = tmp_path / "poses.csv"
    look = GuidedPanda.look

    def interrupted(self):
        if clock.now - 100 > 4:
            assert len(find_resting_poses(read_samples(out))) == 2
            os.kill(os.getpid(), signal.SIGINT)
        return look(self)

    monkeypatch.setattr(GuidedPanda, "look", interrupted)
    record = ["record-poses", "--arm", "simulated", "--sensor", "own"]
    assert main([*record, "--out", str(out)]) == 3
    captured = capsys.readouterr()
    assert captured.out.splitlines()[-1] == f"saved: {out}, 2 poses"
    assert captured.err.endswith("error: expected at least 4 poses\n")


@pytest.mark.parametrize(
    ("arm", "sensor", "more", "said"),
    [
        ("arm.lab", "own", [], "--sensor: expected rdt:HOST[:PORT], got 'own'"),
        (
            "simulated",
            "rdt:",
            [],
            "--sensor: expected own or rdt:HOST[:PORT], got 'rdt:'",
        ),
        ("", "rdt:x", [], "--arm: FrankaRobotSideParams: field `host` expected a name"),
        ("simulated", "own", ["--poses", "3"], "--poses: expected at least 4, got 3"),
    ],
)
def test_refuses_before_anything(arm, sensor, more, said, tmp_path, capsys):
    out = tmp_path / "poses.csv"
    options = ["--arm", arm, "--sensor", sensor, "--out", str(out), *more]
    assert main(["record-poses", *options]) == 2
    captured = capsys.readouterr()
    assert said in captured.err
    assert captured.err.count("\n") == 1
    assert not out.exists()


def test_a_sensor_that_is_not_there(tmp_path):
    class Sensor:
        def open(self):
            raise dp.DriverError("nothing at 192.168.1.1")

        def close(self):
            pass

    out = tmp_path / "poses.csv"
    recorder = PoseRecorder(GuidedPanda(), Sensor(), out)
    with pytest.raises(dp.DriverError, match=r"nothing at 192\.168"):
        recorder.run()
    assert not out.exists()
