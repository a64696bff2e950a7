# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of a run in the browser: live, or afterwards as one HTML file.

`SceneDrawer` draws one row of the log with Meshcat. During a run it shows the
present; `write_replay` calls it for about thirty rows per second of log and
saves the recording as a file that needs neither server nor network.

What is drawn (frame B):

- the arm, or a ball for a point mass, the scene's surfaces (of a bore, what
  fills it) and further models as they were at the start;
- spheres: the robot proxy (blue), the device mapped into the robot's workspace
  (orange), the haptic proxy mapped alike (violet: the robot as the hand's side
  knows it, one link delay old);
- arrows: sensed force F_s (red) and reference force F_r (amber), 20 mm per
  newton, heads at the surface; the estimated contact direction (green,
  pointing out of the surface) while the filter's dimension is above 0. They
  stand beside the tool, which would hide them.
"""

from __future__ import annotations

import html
import logging
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import dual_proxy._pydrake  # noqa: F401

# isort: split
import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pydrake.geometry import (
    Cylinder,
    Meshcat,
    MeshcatCone,
    MeshcatParams,
    MeshcatVisualizer,
    MeshcatVisualizerParams,
    Rgba,
    Role,
    Sphere,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import DiagramBuilder

from dual_proxy.log import column_names, replace_file
from dual_proxy.panda import add_panda_scene, scene_picture
from dual_proxy.scene_params import TIP_RADIUS, SceneParams

__all__ = ["REPLAY_COLUMNS", "PoseMap", "SceneDrawer", "write_replay"]

Vector = NDArray[np.float64]

_IDENTITY = np.eye(3)
_ROOT = "/dual_proxy"


class _Marker(NamedTuple):
    """A sphere: its log signal, whether that is in D, radius in m, colour."""

    label: str
    signal: str
    in_device_frame: bool
    radius: float
    color: Rgba


class _Arrow(NamedTuple):
    """An arrow beside the tool point.

    `scale` is metres per unit of the signal, `offset` its place relative to
    the tool point in B (m); with `outward` it starts there and points against
    the signal, else its head ends there.
    """

    label: str
    signal: str
    scale: float
    offset: tuple[float, float, float]
    outward: bool
    color: Rgba


_MARKERS = (
    _Marker(
        "robot proxy", "robot_proxy_position", False, 0.016, Rgba(0.13, 0.42, 0.86, 1)
    ),
    _Marker(
        "device, mapped", "device_position", True, 0.014, Rgba(0.95, 0.49, 0.10, 1)
    ),
    _Marker(
        "haptic proxy, mapped",
        "haptic_proxy_position",
        True,
        0.011,
        Rgba(0.56, 0.32, 0.76, 1),
    ),
)

_ARROWS = (
    _Arrow(
        "sensed force F_s",
        "sensed_force",
        0.02,
        (0.0, -0.045, -0.01),
        False,
        Rgba(0.84, 0.15, 0.16, 1),
    ),
    _Arrow(
        "reference force F_r",
        "reference_force",
        0.02,
        (0.0, -0.075, -0.01),
        False,
        Rgba(0.95, 0.71, 0.13, 1),
    ),
    _Arrow(
        "estimated normal",
        "force_direction",
        0.15,
        (0.0, 0.07, -0.01),
        True,
        Rgba(0.17, 0.63, 0.25, 1),
    ),
)

_SHAFT_RADIUS = 0.005
_HEAD_RADIUS = 0.011
_HEAD_LENGTH = 0.024
# Shorter arrows than this (m) are not shown.
_SHORTEST_ARROW = 0.004

# Camera and the point it looks at, m, in B.
_CAMERA = (2.05, -1.45, 1.02)
_CAMERA_TARGET = (0.33, 0.0, 0.31)
# Vertical field of view, deg: narrow, for a calm perspective.
_FIELD_OF_VIEW_DEG = 30.0

_SURFACE_OPACITY = 0.75
_BALL_COLOR = Rgba(0.16, 0.17, 0.19, 1)


# pydrake's type stubs name array types that no array has: arrays that go into
# Drake pass through these as Any.
def _translation(p: Any) -> RigidTransform:
    return RigidTransform(p)


def _along_z(direction: Any, foot: Any) -> RigidTransform:
    """Returns the pose at `foot` whose z axis is the unit vector `direction`."""
    return RigidTransform(RotationMatrix.MakeFromOneVector(direction, 2), foot)


def _into_surface(direction: Vector, dimension: float, force: Vector) -> Vector:
    """Returns the estimated direction with the sign of the push, or zero.

    A singular vector has no sign of its own.
    """
    if not dimension > 0:
        return np.zeros(3)
    return -direction if direction @ force < 0 else direction


def _columns(signals: Iterable[str]) -> tuple[str, ...]:
    return tuple(name for signal in signals for name in column_names(signal))


_FILTER_SIGNALS = ("dimension", "force_direction")
# What a scheme without a filter has not; its normal is not drawn.
_FILTER_COLUMNS = _columns(_FILTER_SIGNALS)

#: Columns of the log that a row must have to be drawn; for an arm those of
#: `joint_position` as well.
REPLAY_COLUMNS = _columns(
    (
        "robot_position",
        *(marker.signal for marker in _MARKERS),
        *(arrow.signal for arrow in _ARROWS if arrow.signal not in _FILTER_SIGNALS),
    )
)


class PoseMap(Protocol):
    """The part of `dual_proxy.WorkspaceMap` that drawing needs."""

    def robot_proxy(self, x_h: Any, R_h: Any) -> tuple[Any, Any]:
        """Maps a device pose (D) to the robot's workspace (B)."""
        ...


class _Arm:
    """The Panda in its scene, drawn by its joint positions."""

    signal = "joint_position"

    def __init__(self, meshcat: Any, params: SceneParams) -> None:
        builder = DiagramBuilder()
        self._scene = add_panda_scene(builder, params, touching=False)
        options = MeshcatVisualizerParams()
        options.role = Role.kIllustration
        options.prefix = f"{_ROOT}/scene"
        options.enable_alpha_slider = False
        self._visualizer = MeshcatVisualizer.AddToBuilder(
            builder, self._scene.scene_graph, meshcat, options
        )
        self._diagram = builder.Build()
        self._context = self._diagram.CreateDefaultContext()
        self._plant_context = self._scene.plant.GetMyContextFromRoot(self._context)
        self._visualizer_context = self._visualizer.GetMyContextFromRoot(self._context)
        # The first publication sends the shapes, whose properties exist from
        # then on.
        self._visualizer.ForcedPublish(self._visualizer_context)

    def move(self, q: Vector, time: float | None) -> None:
        plant: Any = self._scene.plant
        plant.SetPositions(self._plant_context, self._scene.arm, q)
        self._context.SetTime(time if time is not None else 0.0)
        self._visualizer.ForcedPublish(self._visualizer_context)


class _Ball:
    """A point mass in the same surroundings, drawn by its position."""

    signal = "robot_position"

    def __init__(self, meshcat: Any, params: SceneParams) -> None:
        self._meshcat = meshcat
        self._path = f"{_ROOT}/scene/ball"
        meshcat.SetObject(self._path, Sphere(TIP_RADIUS), _BALL_COLOR)
        for name, shape, pose, color in scene_picture(params):
            path = f"{_ROOT}/scene/{name}"
            meshcat.SetObject(path, shape, Rgba(*color))
            meshcat.SetTransform(path, pose)

    def move(self, p_BE: Vector, time: float | None) -> None:
        self._meshcat.SetTransform(self._path, _translation(p_BE), time)


class SceneDrawer:
    """Draws rows of the log into a Meshcat.

    It owns a copy of the scene, so it neither needs nor touches the simulation
    that it shows.

    Parameters
    ----------
    meshcat : the viewer.
    params : the scene; default as `add_panda_scene`.
    robot : what is in it, as `Scenario.robot`.
    workspace_map : maps device positions into B; without it, what is known in
        D is not drawn.
    """

    def __init__(
        self,
        meshcat: Meshcat,
        params: SceneParams | None = None,
        workspace_map: PoseMap | None = None,
        robot: str = "panda",
    ) -> None:
        self._meshcat: Any = meshcat
        self._map = workspace_map
        params = params if params is not None else SceneParams()
        self._robot: _Arm | _Ball
        if robot == "point_mass":
            self._robot = _Ball(meshcat, params)
        else:
            self._robot = _Arm(meshcat, params)
        # The proxies sink into what is pressed on: it must not hide them.
        for surface in params.all_surfaces():
            path = f"{_ROOT}/scene/{surface.name}"
            meshcat.SetProperty(path, "modulated_opacity", _SURFACE_OPACITY)
        self._markers = tuple(
            marker
            for marker in _MARKERS
            if workspace_map is not None or not marker.in_device_frame
        )
        # What was last shown, by path, on the screen (False) and in the
        # recording (True), so that only changes are sent.
        self._visible: dict[tuple[str, bool], bool] = {}
        self._set_up()

    def update(
        self, row: Mapping[str, float], time_in_recording: float | None = None
    ) -> None:
        """Draws one row of the log.

        What is not finite is not drawn; an arm without finite joint positions
        stays where it is.

        Parameters
        ----------
        row : value by column name, at least `REPLAY_COLUMNS`; with a filter's
            `dimension` and `force_direction` its normal is drawn, too.
        time_in_recording : s, place of this row in the recording that
            `Meshcat.StartRecording` began; None when drawing live.
        """
        time = time_in_recording
        state = self._vector(row, self._robot.signal)
        if np.isfinite(state).all():
            self._robot.move(state, time)
        for marker in self._markers:
            p_B = self._vector(row, marker.signal)
            if marker.in_device_frame and self._map is not None:
                p_B = np.asarray(self._map.robot_proxy(p_B, _IDENTITY)[0])
            path = f"{_ROOT}/markers/{marker.signal}"
            shown = bool(np.isfinite(p_B).all())
            self._show(path, shown, time)
            if shown:
                self._move(path, _translation(p_B), time)
        p_BE = self._vector(row, "robot_position")
        sensed_force = self._vector(row, "sensed_force")
        for arrow in _ARROWS:
            if arrow.signal != "force_direction":
                value = self._vector(row, arrow.signal)
            elif "dimension" in row:
                value = self._vector(row, arrow.signal)
                value = _into_surface(value, row["dimension"], sensed_force)
            else:
                continue
            self._draw_arrow(arrow, p_BE, value, time)

    def _set_up(self) -> None:
        meshcat = self._meshcat
        for path in ("/Axes", "/Grid"):
            meshcat.SetProperty(path, "visible", False)
        meshcat.SetProperty("/Background", "top_color", [0.86, 0.90, 0.94])
        meshcat.SetProperty("/Background", "bottom_color", [0.97, 0.98, 0.98])
        meshcat.SetObject(f"{_ROOT}/floor", Cylinder(1.1, 0.004), Rgba(0.78, 0.8, 0.83))
        self._move(f"{_ROOT}/floor", _translation(np.array([0.3, 0.0, -0.01])), None)
        for marker in self._markers:
            meshcat.SetObject(
                f"{_ROOT}/markers/{marker.signal}", Sphere(marker.radius), marker.color
            )
        shaft = Cylinder(_SHAFT_RADIUS, 1.0)
        head = MeshcatCone(_HEAD_LENGTH, _HEAD_RADIUS, _HEAD_RADIUS)
        for arrow in _ARROWS:
            path = f"{_ROOT}/arrows/{arrow.signal}"
            # The shaft, of unit length, stands on the origin of a frame that
            # is scaled along z; the head hangs upside down in its own.
            meshcat.SetObject(f"{path}/shaft/rod", shaft, arrow.color)
            self._move(
                f"{path}/shaft/rod", _translation(np.array([0.0, 0.0, 0.5])), None
            )
            meshcat.SetObject(f"{path}/head/cone", head, arrow.color)
            self._move(
                f"{path}/head/cone",
                _along_z(
                    np.array([0.0, 0.0, -1.0]), np.array([0.0, 0.0, _HEAD_LENGTH])
                ),
                None,
            )
            self._show(path, False, None)
        meshcat.SetCamera(Meshcat.PerspectiveCamera(fov=_FIELD_OF_VIEW_DEG))
        meshcat.SetCameraPose(np.array(_CAMERA), np.array(_CAMERA_TARGET))

    def _draw_arrow(
        self, arrow: _Arrow, p_BE: Vector, value: Vector, time: float | None
    ) -> None:
        path = f"{_ROOT}/arrows/{arrow.signal}"
        size = math.sqrt(value @ value)
        length = arrow.scale * size
        shown = bool(length > _SHORTEST_ARROW and np.isfinite(p_BE).all())
        self._show(path, shown, time)
        if not shown:
            return
        direction = value / size
        foot = p_BE + arrow.offset
        if arrow.outward:
            direction = -direction
        else:
            foot = foot - length * direction
        self._move(path, _along_z(direction, foot), time)
        shaft = max(length - _HEAD_LENGTH, 1e-4)
        self._meshcat.SetProperty(f"{path}/shaft", "scale", [1.0, 1.0, shaft], time)
        self._meshcat.SetProperty(f"{path}/head", "position", [0.0, 0.0, shaft], time)

    def _move(self, path: str, X_B: RigidTransform, time: float | None) -> None:
        self._meshcat.SetTransform(path, X_B, time)

    def _show(self, path: str, visible: bool, time: float | None) -> None:
        key = (path, time is not None)
        if self._visible.get(key) != visible:
            self._visible[key] = visible
            self._meshcat.SetProperty(path, "visible", visible, time)

    @staticmethod
    def _vector(row: Mapping[str, float], signal: str) -> Vector:
        return np.array([row[name] for name in column_names(signal)])


def write_replay(
    log: pd.DataFrame,
    path: str | Path,
    params: SceneParams | None = None,
    workspace_map: PoseMap | None = None,
    title: str = "",
    frame_rate: float = 30.0,
    robot: str = "panda",
) -> None:
    """Writes a recording of a run as one self-contained HTML file.

    Parameters
    ----------
    log : the run's log (see `dual_proxy.log`): its index is the time in s,
        increasing, its columns hold at least `REPLAY_COLUMNS`.
    path : file to write; it appears complete or not at all.
    params, workspace_map, robot : as for `SceneDrawer`.
    title : text over the legend.
    frame_rate : Hz, > 0, frames per second of log.

    Raises
    ------
    ValueError
        If the log is empty, lacks columns, or frame_rate is out of range.
    """
    if not (math.isfinite(frame_rate) and frame_rate > 0):
        raise ValueError(f"write_replay: `frame_rate` expected > 0, got {frame_rate}")
    needed = REPLAY_COLUMNS
    if robot != "point_mass":
        needed += _columns([_Arm.signal])
    missing = [name for name in needed if name not in log.columns]
    if missing:
        raise ValueError(f"write_replay: the log lacks the columns {missing}")
    if log.empty:
        raise ValueError("write_replay: the log is empty")
    time = log.index.to_numpy(dtype=float)
    elapsed = time - time[0]
    num_frames = math.floor(elapsed[-1] * frame_rate + 1e-6) + 1
    frame_times = np.arange(num_frames) / frame_rate
    # The last row at or before each frame; rows' times carry rounding errors.
    rows = np.searchsorted(elapsed, frame_times + 1e-9, side="right") - 1
    names = [*needed, *(name for name in _FILTER_COLUMNS if name in log)]
    columns = np.column_stack([log[name].to_numpy(dtype=float)[rows] for name in names])

    meshcat = _quiet_meshcat()
    drawer = SceneDrawer(meshcat, params, workspace_map, robot)
    # Before the animation starts, a viewer shows its first frame.
    drawer.update(dict(zip(names, columns[0], strict=True)))
    meshcat.StartRecording(
        frames_per_second=frame_rate, set_visualizations_while_recording=False
    )
    for frame, row in enumerate(columns):
        # Meshcat rounds times down to frames: aim at the frame's inside.
        drawer.update(dict(zip(names, row, strict=True)), (frame + 0.5) / frame_rate)
    meshcat.StopRecording()
    meshcat.PublishRecording()
    # It may be large: no more copies of it than needed.
    page = meshcat.StaticHtml().encode()
    end = page.rindex(b"</body>")
    legend = _legend(title, workspace_map is not None).encode()
    parts = memoryview(page)
    replace_file(path, parts[:end], legend, parts[end:])


def _quiet_meshcat() -> Any:
    """Returns a Meshcat that does not announce itself: nobody is to look."""
    logger = logging.getLogger("drake")
    level = logger.level
    logger.setLevel(logging.WARNING)
    try:
        return Meshcat(MeshcatParams(host="localhost", show_stats_plot=False))
    finally:
        logger.setLevel(level)


def _legend(title: str, with_device: bool) -> str:
    """Returns an HTML block that names what the colours mean."""
    entries = [
        ("&#9679;", marker.label, marker.color)
        for marker in _MARKERS
        if with_device or not marker.in_device_frame
    ]
    entries += [("&#8594;", arrow.label, arrow.color) for arrow in _ARROWS]
    lines = [f"<b>{html.escape(title)}</b>"] if title else []
    for sign, label, color in entries:
        css = ",".join(str(round(255 * x)) for x in (color.r(), color.g(), color.b()))
        lines.append(f'<span style="color:rgb({css})">{sign}</span> {label}')
    style = (
        "position:fixed;left:12px;bottom:12px;padding:8px 12px;border-radius:6px;"
        "background:rgba(255,255,255,.85);font:13px/1.5 sans-serif;color:#222;"
        "pointer-events:none"
    )
    return f'<div style="{style}">{"<br>".join(lines)}</div>'
