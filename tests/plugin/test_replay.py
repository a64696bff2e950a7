# SPDX-License-Identifier: BSD-3-Clause
"""Drawing of log rows, live and as a recording in one file."""

from __future__ import annotations

import base64
import re

import numpy as np
import pandas as pd
import pytest
from pydrake.geometry import Meshcat, MeshcatParams

from dual_proxy.log import SIGNALS
from dual_proxy.panda import Q_REST
from dual_proxy.replay import REPLAY_COLUMNS, SceneDrawer, write_replay
from dual_proxy.scene_params import SceneParams, SurfaceParams

ARROWS = "/dual_proxy/arrows"
MARKERS = "/dual_proxy/markers"


class Map:
    """Stands in for the workspace map: x_B = (0.5, 0, 0.1) + 2 x_D."""

    def robot_proxy(self, x_h, R_h):
        return np.array([0.5, 0.0, 0.1]) + 2.0 * np.asarray(x_h), R_h


class SpyMeshcat(Meshcat):
    """A Meshcat that remembers what it was told, by (path, property)."""

    def __init__(self):
        super().__init__(MeshcatParams(host="localhost"))
        self.last = {}
        self.calls = []

    def SetProperty(self, path, property, value, time_in_recording=None):
        super().SetProperty(path, property, value, time_in_recording)
        self.last[path, property] = value
        self.calls.append((path, property, time_in_recording))

    def SetTransform(self, path, X_ParentPath, time_in_recording=None):
        super().SetTransform(path, X_ParentPath, time_in_recording)
        self.last[path, "X"] = X_ParentPath
        self.calls.append((path, "X", time_in_recording))


def make_row(**changes):
    """A row of the log in contact; change whole signals by name."""
    values = {
        "joint_position": Q_REST,
        "robot_position": [0.45, 0.0, 0.11],
        "robot_proxy_position": [0.46, 0.0, 0.09],
        "device_position": [0.01, 0.02, 0.03],
        "haptic_proxy_position": [0.0, 0.0, 0.01],
        "sensed_force": [0.0, 0.0, -10.0],
        "reference_force": [0.0, 0.0, -8.0],
        "force_direction": [0.0, 0.0, -1.0],
        "dimension": [1.0],
    } | changes
    return {
        f"{name}_{c}" if c else name: float(v)
        for name, vector in values.items()
        for c, v in zip(SIGNALS[name].components, vector, strict=True)
    }


def make_log(duration, rate=100.0):
    time = np.arange(round(duration * rate) + 1) / rate
    rows = [
        make_row(
            joint_position=Q_REST + 0.2 * np.sin(t),
            sensed_force=[0.0, 0.0, -10.0 * (t > 0.5)],
            dimension=[float(t > 0.5)],
        )
        for t in time
    ]
    return pd.DataFrame(rows, index=pd.Index(time, name="time"))


@pytest.fixture
def meshcat():
    return SpyMeshcat()


def test_markers_stand_where_the_log_says(meshcat):
    SceneDrawer(meshcat, workspace_map=Map()).update(make_row())
    for signal, p_B in (
        ("robot_proxy_position", [0.46, 0.0, 0.09]),
        ("device_position", [0.52, 0.04, 0.16]),
        ("haptic_proxy_position", [0.5, 0.0, 0.12]),
    ):
        X = meshcat.last[f"{MARKERS}/{signal}", "X"]
        np.testing.assert_allclose(X.translation(), p_B, atol=1e-12)
        assert meshcat.last[f"{MARKERS}/{signal}", "visible"] is True


def test_without_a_map_nothing_of_the_device_is_drawn(meshcat):
    SceneDrawer(meshcat).update(make_row())
    assert meshcat.HasPath(f"{MARKERS}/robot_proxy_position")
    assert not meshcat.HasPath(f"{MARKERS}/device_position")
    assert not meshcat.HasPath(f"{MARKERS}/haptic_proxy_position")


def test_force_arrow_has_the_forces_length_and_ends_at_the_tool(meshcat):
    drawer = SceneDrawer(meshcat)
    for force in ([0.0, 0.0, -10.0], [3.0, -4.0, -12.0]):
        drawer.update(make_row(sensed_force=force))
        path = f"{ARROWS}/sensed_force"
        assert meshcat.last[path, "visible"] is True
        X = meshcat.last[path, "X"]
        size = np.linalg.norm(force)
        axis = X.rotation().matrix()[:, 2]
        np.testing.assert_allclose(axis, np.array(force) / size, atol=1e-12)
        # 20 mm per newton from foot to the head's point.
        head = X.translation() + 0.02 * size * axis
        offset = head - np.array([0.45, 0.0, 0.11])
        assert np.linalg.norm(offset) < 0.1
        shaft = meshcat.last[f"{path}/shaft", "scale"]
        assert shaft[:2] == [1.0, 1.0]
        assert 0.7 * 0.02 * size < shaft[2] < 0.02 * size
        assert meshcat.last[f"{path}/head", "position"] == [0.0, 0.0, shaft[2]]


def test_no_force_no_arrow(meshcat):
    drawer = SceneDrawer(meshcat)
    drawer.update(make_row())
    drawer.update(make_row(sensed_force=[0.0, 0.0, 0.0]))
    assert meshcat.last[f"{ARROWS}/sensed_force", "visible"] is False
    assert meshcat.last[f"{ARROWS}/reference_force", "visible"] is True


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_normal_points_out_of_the_surface_while_there_is_one(meshcat, sign):
    drawer = SceneDrawer(meshcat)
    path = f"{ARROWS}/force_direction"
    drawer.update(make_row(dimension=[0.0]))
    assert meshcat.last[path, "visible"] is False
    drawer.update(make_row(force_direction=[0.0, 0.0, sign]))
    assert meshcat.last[path, "visible"] is True
    axis = meshcat.last[path, "X"].rotation().matrix()[:, 2]
    np.testing.assert_allclose(axis, [0, 0, 1], atol=1e-12)


def test_a_row_of_a_run_without_a_filter_has_no_normal(meshcat):
    row = make_row()
    of_filter = [c for c in row if c.startswith(("dimension", "force_direction"))]
    for column in of_filter:
        del row[column]
    SceneDrawer(meshcat).update(row)
    assert meshcat.last[f"{ARROWS}/force_direction", "visible"] is False
    assert meshcat.last[f"{ARROWS}/sensed_force", "visible"] is True


def test_what_is_not_finite_is_not_drawn(meshcat):
    drawer = SceneDrawer(meshcat, workspace_map=Map())
    drawer.update(make_row())
    nan = [np.nan, 0.0, 0.0]
    drawer.update(
        make_row(
            joint_position=[np.nan] * 7,
            robot_proxy_position=nan,
            device_position=nan,
            sensed_force=nan,
        )
    )
    assert meshcat.last[f"{MARKERS}/robot_proxy_position", "visible"] is False
    assert meshcat.last[f"{MARKERS}/device_position", "visible"] is False
    assert meshcat.last[f"{ARROWS}/sensed_force", "visible"] is False
    for (_, name), value in meshcat.last.items():
        if name == "X":
            assert np.isfinite(value.GetAsMatrix4()).all()


def test_scene_is_drawn_before_the_first_row(meshcat):
    surfaces = [
        SurfaceParams(name="wall", shape="box", size=(0.1, 0.1, 0.2)),
        SurfaceParams(name="ball", shape="sphere", radius=0.1),
        SurfaceParams(name="rod", shape="capsule", radius=0.02, length=0.1),
        SurfaceParams(name="floor"),
        # What Drake cannot simulate it can draw, as the bare engine's world.
        SurfaceParams(
            name="bore", shape="cylinder", radius=0.3, length=0.0, hollow=True
        ),
    ]
    SceneDrawer(meshcat, SceneParams(surfaces=surfaces))
    names = [surface.name for surface in surfaces]
    for name in (*names, "table", "panda/panda_link7", "panda/tool"):
        assert meshcat.HasPath(f"/dual_proxy/scene/{name}")


def test_recording_starts_with_every_visibility(meshcat):
    # A track without a first key would show its second one from the start.
    drawer = SceneDrawer(meshcat)
    drawer.update(make_row(dimension=[0.0]))
    meshcat.calls.clear()
    drawer.update(make_row(dimension=[0.0]), 0.25)
    paths = {path for path, name, time in meshcat.calls if name == "visible"}
    assert f"{ARROWS}/force_direction" in paths
    assert f"{MARKERS}/robot_proxy_position" in paths
    assert {time for _, _, time in meshcat.calls} == {0.25}


def decoded(page):
    """The binary messages that a static page carries."""
    blobs = re.findall(rb"base64,([A-Za-z0-9+/=]{40,})", page)
    return [base64.b64decode(blob) for blob in blobs]


def test_replay_is_one_small_file_with_an_animation(tmp_path):
    path = tmp_path / "replay.html"
    write_replay(make_log(2.0), path, workspace_map=Map(), title="a < b")
    page = path.read_bytes()
    assert b"<b>a &lt; b</b>" in page
    assert b"device, mapped" in page
    assert not re.findall(rb"<(?:script|link)[^>]+(?:src|href)=", page)
    (animation,) = (m for m in decoded(page) if b"set_animation" in m)
    for token in (
        b"panda/panda_link7",
        b"markers/device_position",
        b"arrows/sensed_force/shaft",
        b"scale",
        b"visible",
    ):
        assert token in animation
    assert [p.name for p in tmp_path.iterdir()] == ["replay.html"]


def test_twenty_seconds_stay_below_six_megabytes(tmp_path):
    short, long = tmp_path / "1.html", tmp_path / "20.html"
    write_replay(make_log(1.0), short, workspace_map=Map())
    write_replay(make_log(20.0), long, workspace_map=Map())
    assert short.stat().st_size < long.stat().st_size < 6e6


def test_frame_rate_sets_how_much_is_recorded(tmp_path):
    sizes = []
    for rate in (10.0, 30.0):
        path = tmp_path / "replay.html"
        write_replay(make_log(4.0), path, frame_rate=rate)
        (animation,) = (m for m in decoded(path.read_bytes()) if b"set_animation" in m)
        sizes.append(len(animation))
    assert 2.5 < sizes[1] / sizes[0] < 3.5


def test_bad_arguments_are_refused(tmp_path):
    path = tmp_path / "replay.html"
    log = make_log(0.1)
    with pytest.raises(ValueError, match=r"lacks the columns \['joint_position_3'\]"):
        write_replay(log.drop(columns="joint_position_3"), path)
    with pytest.raises(ValueError, match="empty"):
        write_replay(log.iloc[:0], path)
    with pytest.raises(ValueError, match="`frame_rate` expected > 0, got 0"):
        write_replay(log, path, frame_rate=0.0)
    assert not path.exists()


def test_replay_columns_are_signals_of_the_log():
    columns = {
        f"{name}_{c}" if c else name
        for name, signal in SIGNALS.items()
        for c in signal.components
    }
    assert set(REPLAY_COLUMNS) <= columns
