# SPDX-License-Identifier: BSD-3-Clause
"""Poses of a tool for `dual-proxy calibrate-tool`, of an arm that a person guides.

The arm is looked at, not controlled. What it holds still for is a pose, written in
whole as soon as it is known to be one; what is between is left out.
"""

from __future__ import annotations

import argparse
import csv
import math
import sys
import time
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dual_proxy._core import DriverError
from dual_proxy.hardware.arms import (
    ArmReading,
    FrankaArm,
    PandaArm,
    Wrench,
    make_franka_arm,
)
from dual_proxy.hardware.options import SIMULATED
from dual_proxy.hardware.sensors import make_rdt_sensor, rdt_host
from dual_proxy.panda import Q_REST, PandaModel
from dual_proxy.scenario import ScenarioError
from dual_proxy.scene_params import TOOL_COM_S, TOOL_MASS
from dual_proxy.tool_calibration import (
    FEWEST_POSES,
    JOINT_COLUMNS,
    LARGEST_CONDITION,
    REST_TIME,
    SETTLE_TIME,
    WRENCH_COLUMNS,
    CalibrationError,
    RestFollower,
    RestingPose,
    find_resting_poses,
    pose_condition,
)

__all__ = ["GuidedPanda", "PoseRecorder", "make_pose_recorder"]

Vector = NDArray[np.float64]

#: s between two samples.
_PERIOD = 0.005
#: s for which a pose is held: more noise is averaged than it takes to be one.
_HOLD = SETTLE_TIME + 2 * REST_TIME
#: rad: poses whose tilts differ by less tell nothing new.
_ALIKE = math.radians(10)
#: s without a good sample after which that is said, and a pose begins anew.
_SILENT = 0.1
#: How many poses are asked for.
_RECOMMENDED = 6

_COLUMNS = ["t", *JOINT_COLUMNS, *WRENCH_COLUMNS]
# Expected of --sensor; a real arm's own estimate has the tool's weight taken out.
_OF_ARM = "rdt:HOST[:PORT]"
_OF_TOY = "own or rdt:HOST[:PORT]"


class _Arm(Protocol):
    """What is needed of an arm: see Arm."""

    def open(self) -> None: ...
    def look(self) -> ArmReading: ...
    def wrench(self) -> Any: ...
    def close(self) -> None: ...


class PoseRecorder:
    """Records poses until `stop`, and tells people how far it is.

    Parameters
    ----------
    arm : opened by `run`; it is guided by hand.
    sensor : with open, read and close, as RdtSensor; None: the arm's own.
    out : CSV file that is not there yet.
    most : poses after which it ends, or None.
    live : whether standard error is a terminal, with a line that changes.
    """

    def __init__(
        self,
        arm: _Arm,
        sensor: Any,
        out: Path,
        most: int | None = None,
        live: bool | None = None,
    ) -> None:
        self._arm = arm
        self._sensor = sensor
        self._out = out
        self._most = math.inf if most is None else most
        self._live = sys.stderr.isatty() if live is None else live
        self._stop = False
        self.poses: list[RestingPose] = []

    def stop(self) -> None:
        """Have `run` end; for signal handlers."""
        self._stop = True

    def run(self) -> int:
        """Record; return the number of poses.

        Raises
        ------
        DriverError, ArmFault
            If arm or sensor is not there, or the file is; what was recorded stays.
        """
        sensor = self._sensor
        try:
            self._arm.open()
            if sensor is not None:
                sensor.open()
            try:
                self._out.parent.mkdir(parents=True, exist_ok=True)
                with self._out.open("x", newline="", encoding="utf-8") as file:
                    self._record(file)
            except OSError as error:
                raise DriverError(f"{self._out}: {error.strerror}") from None
            return len(self.poses)
        finally:
            self._arm.close()
            if sensor is not None:
                sensor.close()
            self._say("")

    def _record(self, file: Any) -> None:
        writer = csv.writer(file)
        writer.writerow(_COLUMNS)
        file.flush()
        read = self._arm.wrench if self._sensor is None else self._sensor.read
        begin = last = heard = time.monotonic()
        rest = RestFollower()
        rows: list[list[float]] = []
        done = silent = False
        while not self._stop and len(self.poses) < self._most:
            time.sleep(_PERIOD)
            q = self._arm.look().q
            wrench = read()
            now = time.monotonic()
            if not wrench.valid or wrench.time <= last:
                if now - heard > _SILENT and not silent:
                    silent = True
                    fault = getattr(self._sensor, "fault", "")
                    self._tell(f"no samples of the sensor {fault}".rstrip())
                continue
            if silent:
                self._tell("the sensor is there again")
                rest, silent = RestFollower(), False
            last, heard = wrench.time, now
            if rest.add(last, q):
                rows, done = [], False
            rows.append([last - begin, *map(float, q), *map(float, wrench.value)])
            if done:
                self._say("turn the tool to another side")
            elif rest.duration < _HOLD:
                self._say(f"still for {rest.duration:.1f} of {_HOLD:g} s")
            else:
                try:
                    (pose,) = find_resting_poses(pd.DataFrame(rows, columns=_COLUMNS))
                except CalibrationError as error:
                    self._tell(f"not recorded: {error}")
                    rest = RestFollower()  # Held on, it may be one yet.
                    continue
                done = True
                if alike := self._alike(pose):
                    self._tell(f"not recorded: as pose {alike}; turn the tool further")
                    continue
                writer.writerows(rows)
                file.flush()
                self.poses.append(pose)
                self._tell(self._progress())

    def _alike(self, pose: RestingPose) -> int:
        """Return the number of the pose that it is too much like, or 0."""
        for number, other in enumerate(self.poses, 1):
            if np.dot(pose.rotation[2], other.rotation[2]) > math.cos(_ALIKE):
                return number
        return 0

    def _progress(self) -> str:
        count, pose = len(self.poses), self.poses[-1]
        of = f"{_RECOMMENDED} or more" if self._most == math.inf else f"{self._most}"
        tilt = math.degrees(math.acos(float(np.clip(-pose.rotation[2, 2], -1, 1))))
        condition = pose_condition(self.poses)
        shown = f"{condition:.2g}" if condition < 1e3 else "not known yet"
        return (
            f"pose {count} of {of}: {tilt:.0f} deg from down, noise "
            f"{pose.noise:.2g} N, condition {shown} (at most {LARGEST_CONDITION:g})"
        )

    def _tell(self, text: str) -> None:
        self._say("")
        print(text, flush=True)

    def _say(self, text: str) -> None:
        if self._live:
            print(f"\r{text:<40}\r", end="", file=sys.stderr, flush=True)


class GuidedPanda:
    """A simulated arm that a simulated person guides from pose to pose, with a sensor
    that has bias and noise: to try it with."""

    #: rad: how joints 5 and 6 are turned from Q_REST: down, and to six sides.
    _TURNS = (
        *((0.0, 0.0), (0.0, -0.9), (0.0, 0.9), (1.2, 0.9), (-1.2, 0.9)),
        *((0.9, -0.3), (-0.9, -0.3)),
    )
    #: s in each pose, and to the next.
    _HELD, _MOVE = 1.6, 0.6
    _BIAS = np.array([3.1, -7.4, 12.9, 0.21, -0.34, 0.08])
    _NOISE = np.array([0.2, 0.2, 0.2, 0.005, 0.005, 0.005])

    def __init__(self) -> None:
        self._model = PandaModel()
        self._random = np.random.default_rng(1)
        self._start = math.nan

    def open(self) -> None:
        """See Arm."""
        self._start = time.monotonic()

    def look(self) -> ArmReading:
        """See Arm."""
        return ArmReading(self._joints(), np.zeros(7), np.zeros(7))

    def wrench(self) -> Wrench:
        """See Arm."""
        R_BS = self._model.calc(self._joints(), np.zeros(7)).R_BE
        force = 9.81 * TOOL_MASS * R_BS[2]
        value = np.concatenate([force, np.cross(TOOL_COM_S, force)]) + self._BIAS
        noise = self._NOISE * self._random.normal(size=6)
        return Wrench(time.monotonic(), True, value + noise)

    def close(self) -> None:
        """See Arm."""

    def _joints(self) -> Vector:
        step, into = divmod(time.monotonic() - self._start, self._HELD + self._MOVE)
        count = len(self._TURNS)
        here, there = (np.array(self._TURNS[int(step + i) % count]) for i in (0, 1))
        share = max(0.0, (into - self._HELD) / self._MOVE)
        q = np.array(Q_REST)
        q[4:6] += here + share * (there - here)
        return q


def make_pose_recorder(options: argparse.Namespace) -> PoseRecorder:
    """Return what `record-poses` is to run. Raises ScenarioError, DriverError."""
    arm: FrankaArm | PandaArm | GuidedPanda
    if options.poses is not None and options.poses < FEWEST_POSES:
        raise ScenarioError(
            f"--poses: expected at least {FEWEST_POSES}, got {options.poses}"
        )
    if options.arm == SIMULATED:
        arm = GuidedPanda()
        host = None if options.sensor == "own" else rdt_host(options.sensor, _OF_TOY)
    else:
        host = rdt_host(options.sensor, _OF_ARM)
        arm = make_franka_arm(options.arm, observe=True)
    # Before anything is connected to.
    if options.out.exists():
        raise ScenarioError(f"--out {options.out}: File exists")
    sensor = None if host is None else make_rdt_sensor(host)
    return PoseRecorder(arm, sensor, options.out, options.poses)
