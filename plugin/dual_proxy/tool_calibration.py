# SPDX-License-Identifier: BSD-3-Clause
"""Mass, centre of mass and bias from what a wrist sensor measures at rest.

A tool that nothing touches is carried by the sensor, so that the arm exerts on
it, in S,

    f = m g n + b_f        with n = R_BS^T z_B, which points up
    t = c x (m g n) + b_t

Each pose gives its mean f and t. Both equations are linear, in (m, b_f) and in
(m c, b_t), and are solved by least squares.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dual_proxy._core import ForceTorqueAdapterParams
from dual_proxy.bench.pages import markdown_table
from dual_proxy.settings import dump_yaml
from dual_proxy.text import one_line

if TYPE_CHECKING:
    from dual_proxy.panda import PandaModel

__all__ = [
    "CalibrationError",
    "RestFollower",
    "RestingPose",
    "ToolCalibration",
    "calibrate_tool",
    "find_resting_poses",
    "pose_condition",
    "read_samples",
]

Array = NDArray[np.float64]

FEWEST_POSES = 4
"""One more than determine the numbers, so that there is a residual."""
LARGEST_CONDITION = 10.0
"""Tilts of 18 deg to four sides; an error of a pose or of the base's level may
count ten times in what comes out."""
SETTLE_TIME = 0.25
"""s, after a move, left out."""
REST_TIME = 0.5
"""s, after that, of a pose at least."""
REST_TURN = np.deg2rad(0.5)
"""rad: a tool that turns, or joints that move, by less are at rest."""
LARGEST_NOISE = 1.0
"""N, standard deviation per axis in a pose; more is a touch or a move."""

WRENCH_COLUMNS = ["fx", "fy", "fz", "mx", "my", "mz"]
JOINT_COLUMNS = [f"q{i}" for i in range(1, 8)]

# As kMaxTime and kMaxForce of systems/common/possible.h.
_LATEST = 1e11
_LARGEST = 1e4

_QUATERNION = ["qw", "qx", "qy", "qz"]


class CalibrationError(ValueError):
    """Samples that no tool can be calibrated with, and why, in one line."""


@dataclass(frozen=True, slots=True)
class RestingPose:
    """A pose at rest, and what the sensor measured on average."""

    start: float
    """s, in the samples' time, without the time to settle."""
    samples: int
    rotation: Array
    """(3, 3): R_BS."""
    wrench: Array
    """(6,) [force; moment], N, N m, in S: of the arm on the tool."""
    noise: float
    """N: largest standard deviation of a force's axis."""


@dataclass(frozen=True, slots=True)
class ToolCalibration:
    """What hangs on the sensor. Uncertainties are standard deviations."""

    mass: float
    """kg."""
    mass_std: float
    com: Array
    """(3,) m, in S."""
    com_std: Array
    bias: Array
    """(6,) [force; moment], N, N m, in S: what is sensed without a tool."""
    bias_std: Array
    force_residuals: Array
    """(poses,) N: what is left of each pose's force."""
    moment_residuals: Array
    """(poses,) N m."""
    condition: float
    """How much worse the worst combination of numbers is seen than the best."""
    poses: tuple[RestingPose, ...]

    def adapter_params(self) -> ForceTorqueAdapterParams:
        """Return an adapter's parameters; it learns the bias itself, each time.

        What it takes for a bias is one as large as this, and what the default
        allows beyond that.
        """
        usual = ForceTorqueAdapterParams().tare_max_force
        return ForceTorqueAdapterParams(
            tool_mass=round(self.mass, 5),
            tool_com=self.com.round(5),
            tare=True,
            tare_max_force=float(np.ceil(np.linalg.norm(self.bias[:3]) + usual)),
        )

    def table(self) -> str:
        """Return the result and its poses, for people."""
        rows = [
            ("mass", _number(self.mass), _number(self.mass_std), "kg"),
            ("centre of mass, in S", _numbers(self.com), _numbers(self.com_std), "m"),
            ("bias", _numbers(self.bias[:3]), _numbers(self.bias_std[:3]), "N"),
            ("", _numbers(self.bias[3:]), _numbers(self.bias_std[3:]), "N m"),
        ]
        residuals = [
            f"residual {name} {_rms(of):.3g} {unit} rms, {of.max():.3g} {unit} at most"
            for name, of, unit in (
                ("force", self.force_residuals, "N"),
                ("moment", self.moment_residuals, "N m"),
            )
        ]
        poses = [
            (
                f"{pose.start:.2f}",
                str(pose.samples),
                _numbers(pose.rotation[2]),
                f"{pose.noise:.3f}",
                f"{force:.3f}",
                f"{moment:.4f}",
            )
            for pose, force, moment in zip(
                self.poses, self.force_residuals, self.moment_residuals, strict=True
            )
        ]
        head = ("from, s", "samples", "up, in S", "noise, N", "left, N", "left, N m")
        return "\n".join(
            [
                markdown_table(("", "value", "+-", "unit"), rows),
                "",
                *residuals,
                f"{len(self.poses)} poses, condition {self.condition:.2g} "
                f"(1.2 is the best, {LARGEST_CONDITION:g} the limit)",
                "",
                markdown_table(head, poses),
            ]
        )

    def yaml(self, source: str) -> str:
        """Return the fields of `ForceTorqueAdapterParams` that it gives.

        Parameters
        ----------
        source : what was calibrated with, for the comment.
        """
        comments = [
            f"{len(self.poses)} poses of {source}",
            f"residual {_rms(self.force_residuals):.3g} N rms, "
            f"{_rms(self.moment_residuals):.3g} N m rms",
            f"bias then, in S: {_numbers(self.bias[:3])} N, "
            f"{_numbers(self.bias[3:])} N m; tare learns it anew",
        ]
        params = self.adapter_params()
        fields = {
            "tool_mass": params.tool_mass,
            "tool_com": params.tool_com.tolist(),
            "tare": params.tare,
            "tare_max_force": params.tare_max_force,
        }
        return "".join(f"# {line}\n" for line in comments) + dump_yaml(fields)


def calibrate_tool(
    poses: Sequence[RestingPose],
    *,
    gravity: float = 9.81,
    max_force_residual: float = 0.5,
    max_moment_residual: float = 0.05,
) -> ToolCalibration:
    """Find what the sensor carries.

    Parameters
    ----------
    poses : of `find_resting_poses`, at least four, unlike each other.
    gravity : m/s^2, along -z of B.
    max_force_residual, max_moment_residual : N, N m: root mean square over the
        poses, above which the numbers do not explain what was measured.

    Raises
    ------
    CalibrationError
        If they do not determine the tool.
    """
    poses = tuple(poses)
    if len(poses) < FEWEST_POSES:
        raise CalibrationError(
            f"expected at least {FEWEST_POSES} poses at rest, got {len(poses)}; hold "
            f"each for {SETTLE_TIME + REST_TIME:g} s or longer"
        )
    up = np.array([pose.rotation[2] for pose in poses])
    wrenches = np.array([pose.wrench for pose in poses])
    if not (np.isfinite(up).all() and np.isfinite(wrenches).all()):
        raise CalibrationError("expected finite rotations and wrenches")

    of_force, of_moment = _designs(poses)
    condition = pose_condition(poses)
    if not condition <= LARGEST_CONDITION:
        raise CalibrationError(
            f"expected poses that differ more: condition {condition:.3g}, at most "
            f"{LARGEST_CONDITION:g}; tilt the tool to several sides, best by 90 deg"
        )
    force = _solve(of_force, wrenches[:, :3])
    moment = _solve(of_moment, wrenches[:, 3:])
    weight, weight_std = force.value[0], force.std[0]
    if weight < -2 * weight_std:
        raise CalibrationError(
            f"expected a mass > 0, got {weight / gravity:.3g} kg: the sensor reports "
            "the reverse force (RdtSensorParams.reports), or S is upside down (R_SN)"
        )
    calibration = ToolCalibration(
        mass=float(weight / gravity),
        mass_std=float(weight_std / gravity),
        com=moment.value[:3] / weight,
        com_std=np.hypot(
            moment.std[:3] / weight, moment.value[:3] * weight_std / weight**2
        ),
        bias=np.concatenate([force.value[1:], moment.value[3:]]),
        bias_std=np.concatenate([force.std[1:], moment.std[3:]]),
        force_residuals=force.residuals,
        moment_residuals=moment.residuals,
        condition=condition,
        poses=poses,
    )
    for name, unit, residuals, most in (
        ("force", "N", force.residuals, max_force_residual),
        ("moment", "N m", moment.residuals, max_moment_residual),
    ):
        if not _rms(residuals) <= most:
            worst = poses[int(np.argmax(residuals))]
            raise CalibrationError(
                f"expected a residual {name} of at most {most:g} {unit} rms, got "
                f"{_rms(residuals):.3g} {unit}, worst {residuals.max():.3g} {unit} in "
                f"the pose at {worst.start:.2f} s: the tool touched something, a cable "
                "pulls, or the orientation is not that of the sensor (R_SN)"
            )
    if weight <= 2 * weight_std:
        raise CalibrationError(
            f"expected a tool whose weight is seen, got {weight / gravity:.3g} kg +- "
            f"{weight_std / gravity:.3g} kg"
        )
    return calibration


def pose_condition(poses: Sequence[RestingPose]) -> float:
    """Return how much worse the worst combination of a tool's numbers is seen by these
    poses than the best; infinite, or nearly so: not at all."""
    if len(poses) < 2:
        return float("inf")
    return max(
        float(np.linalg.cond(design.reshape(-1, design.shape[2])))
        for design in _designs(poses)
    )


class RestFollower:
    """Tells from sample to sample for how long a tool is at rest.

    It is for as long as it turns, or its joints move, by less than `REST_TURN`.
    """

    def __init__(self) -> None:
        self._place: Array | None = None
        self._since = 0.0
        self.duration = 0.0
        """s, of the rest so far."""

    def add(self, time: float, place: Array) -> bool:
        """Take a sample, s and rad; return whether a new rest begins with it."""
        place_before = self._place
        if (
            place_before is not None
            and np.linalg.norm(place - place_before) < REST_TURN
        ):
            self.duration = time - self._since
            return False
        self._place, self._since, self.duration = place, time, 0.0
        return True

    @property
    def is_pose(self) -> bool:
        """Whether it is long enough."""
        return self.duration >= SETTLE_TIME + REST_TIME


def find_resting_poses(samples: pd.DataFrame) -> list[RestingPose]:
    """Find where the tool was at rest.

    A pose is a stretch of `SETTLE_TIME` and `REST_TIME` or longer in which the
    tool turns, or its joints move, by less than `REST_TURN`; the rest is left out.

    Parameters
    ----------
    samples : of `read_samples`.

    Raises
    ------
    CalibrationError
        If the force of a pose has more noise than `LARGEST_NOISE`.
    """
    by_joints = "qw" not in samples
    if by_joints:
        place = samples[JOINT_COLUMNS].to_numpy()
        rotations = np.empty((0, 3, 3))
    else:
        rotations = _rotations(samples[_QUATERNION].to_numpy())
        # So that the distance of two is the angle between them.
        place = rotations.reshape(-1, 9) / np.sqrt(2)
    time = samples["t"].to_numpy()
    wrenches = samples[WRENCH_COLUMNS].to_numpy()
    poses = []
    for first, last in _rests(time, place):
        rows = slice(np.searchsorted(time, time[first] + SETTLE_TIME), last)
        if by_joints:
            rotation = (
                _panda_model()
                .forward_kinematics(place[rows].mean(axis=0))
                .rotation()
                .matrix()
            )
        else:
            left, _, right = np.linalg.svd(rotations[rows].mean(axis=0))
            rotation = left @ right
        noise = float(wrenches[rows, :3].std(axis=0).max())
        start = float(time[rows.start])
        if noise > LARGEST_NOISE:
            raise CalibrationError(
                f"expected noise of at most {LARGEST_NOISE:g} N at rest, got "
                f"{noise:.3g} N in the pose at {start:.2f} s: it touches something, "
                "or moves without turning"
            )
        poses.append(
            RestingPose(
                start=start,
                samples=rows.stop - rows.start,
                rotation=np.asarray(rotation, dtype=np.float64),
                wrench=wrenches[rows].mean(axis=0),
                noise=noise,
            )
        )
    return poses


def read_samples(path: str | Path) -> pd.DataFrame:
    """Read samples from a CSV file.

    Its columns, in any order: `t`, s; `qw`, `qx`, `qy`, `qz`, the unit quaternion
    of R_BS, or `q1` to `q7`, rad, a Panda's joints; `fx`, `fy`, `fz`, N, and `mx`,
    `my`, `mz`, N m, in S about its origin, of the arm on the tool. Others are
    ignored, and so are lines that begin with #.

    Raises
    ------
    CalibrationError
        Naming the column or the row that is not as it should be.
    """
    try:
        with open(path, encoding="utf-8") as file:
            table = pd.read_csv(file, comment="#", skipinitialspace=True)
    except OSError as error:
        raise CalibrationError(f"{path}: {error.strerror}") from None
    except ValueError as error:  # Also pandas' own, and of the text's encoding.
        raise CalibrationError(f"{path}: {one_line(error, 200)}") from None
    orientation = JOINT_COLUMNS if "qw" not in table else _QUATERNION
    columns = ["t", *orientation, *WRENCH_COLUMNS]
    if missing := [name for name in columns if name not in table]:
        expected = "t, qw to qz or q1 to q7, fx to mz"
        raise CalibrationError(
            f"{path}: expected columns {expected}; missing {', '.join(missing)}"
        )
    samples: pd.DataFrame = table[columns].apply(pd.to_numeric, errors="coerce")
    samples = samples.astype(np.float64)
    values = samples.to_numpy()
    bad = ~(np.abs(values) <= [_LATEST, *[_LARGEST] * (len(columns) - 1)])
    values = np.where(bad, 0.0, values)
    if "qw" in samples:
        lengths = np.linalg.norm(values[:, 1:5], axis=1)
        bad[:, 1] |= np.abs(lengths - 1) > 1e-3
    bad[1:, 0] |= np.diff(values[:, 0]) <= 0
    if bad.any():
        row, column = np.argwhere(bad)[0]
        expected = {"t": "increasing times", "qw": "a unit quaternion"}.get(
            columns[column], f"numbers up to {_LARGEST:g}"
        )
        value = table[columns[column]].iloc[row]
        shown = repr(value) if isinstance(value, str) else str(value)
        raise CalibrationError(
            f"{path}: expected {expected}, got {columns[column]} = {shown:.80} "
            f"in row {row + 1}"
        )
    return samples


@dataclass(frozen=True, slots=True)
class _Solution:
    value: Array
    std: Array
    residuals: Array
    """(poses,)"""


def _solve(design: Array, measured: Array) -> _Solution:
    """Solve design[i] x = measured[i], (n, 3, k) and (n, 3)."""
    flat = design.reshape(-1, design.shape[2])
    value = np.asarray(
        np.linalg.lstsq(flat, measured.ravel(), rcond=None)[0], dtype=np.float64
    )
    left = measured - design @ value
    variance = (left**2).sum() / (len(flat) - flat.shape[1])
    std = np.sqrt(variance * np.diag(np.linalg.inv(flat.T @ flat)))
    return _Solution(value, std, np.linalg.norm(left, axis=1))


def _cross(vectors: Array) -> Array:
    """Return (n, 3, 3): of each v the matrix of v x."""
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.moveaxis(np.array(rows), 2, 0)


def _rests(time: Array, place: Array) -> Iterator[tuple[int, int]]:
    """Yield first row and row after the last of what is long enough at rest."""
    follower = RestFollower()
    first = 0
    for row, (now, here) in enumerate(zip(time, place, strict=True)):
        was_pose = follower.is_pose
        if follower.add(now, here):
            if was_pose:
                yield first, row
            first = row
    if follower.is_pose:
        yield first, len(time)


def _designs(poses: Sequence[RestingPose]) -> tuple[Array, Array]:
    """Return what the unknowns are multiplied by in forces and moments of poses."""
    up = np.array([pose.rotation[2] for pose in poses])
    units = np.tile(np.eye(3), (len(poses), 1, 1))
    of_force = np.concatenate([up[:, :, None], units], axis=2)
    return of_force, np.concatenate([-_cross(up), units], axis=2)


def _rotations(quaternions: Array) -> Array:
    w, x, y, z = (quaternions / np.linalg.norm(quaternions, axis=1)[:, None]).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


@cache
def _panda_model() -> PandaModel:
    # Here, as it needs pydrake, which takes a second.
    from dual_proxy.panda import PandaModel

    return PandaModel()


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _number(value: float) -> str:
    return f"{value:.4f}"


def _numbers(values: Array) -> str:
    return f"[{', '.join(map(_number, values))}]"
