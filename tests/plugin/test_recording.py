# SPDX-License-Identifier: BSD-3-Clause
from pathlib import Path

import numpy as np
import pytest

from dual_proxy.recording import (
    MOVE_TIME,
    RECORDING_EXAMPLE,
    RECORDING_FORMAT,
    read_recording,
    recorded_path,
)
from dual_proxy.scenario import ScenarioError, load_scenario

HEADER = ["t", "px", "py", "pz"]


def table(n=400, rate=100.0, size=0.05):
    """A hand that comes down onto a board, circles on it and leaves."""
    t = np.arange(n) / rate
    phase = 2 * np.pi * t / t[-1]
    z = 0.3 + 0.16 * np.clip(np.abs(t - 2.0) - 1.0, 0.0, 0.5)
    return np.column_stack(
        [t, 1.0 + size * np.cos(phase), -2.0 + size * np.sin(phase), z]
    )


def write(path, rows, header=HEADER):
    lines = [",".join(header)] + [",".join(map(str, row)) for row in rows]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture
def csv_file(tmp_path):
    return tmp_path / "motion.csv"


def test_reads_positions_and_starts_at_zero(csv_file):
    rows = table()
    rows[:, 0] += 7.0
    recording = read_recording(write(csv_file, rows))
    assert recording.times[0] == 0.0
    assert recording.times[-1] == pytest.approx(3.99)
    np.testing.assert_array_equal(recording.positions, rows[:, 1:])
    assert recording.rotations is None


def test_reads_rotations_units_and_scale(csv_file):
    n = 400
    header = [*HEADER, "note", *(f"R{i}{j}" for i in "123" for j in "123")]
    rotation = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    rows = [[*row, "free text", *rotation.ravel()] for row in table(n)]
    recording = read_recording(write(csv_file, rows, header), units="cm", scale=10)
    np.testing.assert_array_equal(recording.rotations, np.tile(rotation, (n, 1, 1)))
    np.testing.assert_allclose(recording.positions, 0.1 * table(n)[:, 1:])
    with pytest.raises(ScenarioError, match="`units` expected one of"):
        read_recording(csv_file, units="inch")


def replaced(row, column, value):
    rows = table().astype(object)
    rows[row - 1, column] = value
    return rows


@pytest.mark.parametrize(
    ("rows", "header", "message"),
    [
        (replaced(7, 2, "nan"), HEADER, "row 7, column 'py'.*finite number, got 'nan'"),
        (replaced(3, 1, ""), HEADER, "row 3, column 'px'.*got ''"),
        (replaced(20, 0, 0.0), HEADER, "row 20, column 't'.*after 0.18 s, got 0 s"),
        (replaced(9, 3, 1e308), HEADER, r"row 9, column 'pz'.*within 1e\+09 m"),
        (replaced(9, 3, 5), HEADER, "row 9: the hand moves.*at most 3 m/s.*remove"),
        (table()[:, :3], HEADER, "row 1: expected 4 values, got 3"),
        (table(9), HEADER, "too short.*10 rows and 1 s, got 9 rows"),
        (table(400, 0.1), HEADER, "rows are 10 s apart.*times must be in s"),
    ],
)
def test_bad_files_are_named_with_row_and_column(csv_file, rows, header, message):
    with pytest.raises(ScenarioError, match=f"motion.csv.*{message}") as caught:
        read_recording(write(csv_file, rows, header))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("time,x,y,z\n0,0,0,0\n", "'time,x,y,z', without t, px, py, pz"),
        ("t;px;py;pz\n", "'t;px;py;pz', separated by semicolons"),
        ("0,0.45,0,0.2\n", "'0,0.45,0,0.2', without names"),
        ("", "no line in the file"),
    ],
)
def test_what_was_expected_and_found_is_said(csv_file, text, found):
    csv_file.write_text(text)
    with pytest.raises(ScenarioError) as caught:
        read_recording(csv_file)
    assert (
        str(caught.value) == f"{csv_file}: expected {RECORDING_FORMAT}; found {found}"
    )


def test_readme_describes_the_format_in_the_same_words():
    readme = Path(__file__).parents[2] / "README.md"
    text = readme.read_text()
    assert RECORDING_FORMAT in text
    assert RECORDING_EXAMPLE in text


def test_path_presses_where_the_hand_worked(csv_file):
    scenario = load_scenario("plane")
    recording = read_recording(write(csv_file, table()))
    start = np.array(scenario.scene.start_position)
    times, points = recorded_path(
        recording, start, scenario.scene.contact_height, 0.04, scenario.reachable
    )
    assert np.all(np.diff(times) > 0)
    assert times[0] == 0.0
    assert times[-1] == pytest.approx(3.99 + 2 * MOVE_TIME)
    np.testing.assert_allclose(points[[0, -1]], [start, start], atol=1e-12)
    inside = (times >= MOVE_TIME - 1e-9) & (times <= times[-1] - MOVE_TIME + 1e-9)
    placed = points[inside]
    assert scenario.scene.contact_height == pytest.approx(0.41)
    assert placed[:, 2].min() == pytest.approx(0.37)
    assert placed[:, 2].max() == pytest.approx(0.45)  # Not scaled.
    middle = (placed.min(axis=0) + placed.max(axis=0)) / 2.0
    np.testing.assert_allclose(middle[:2], start[:2], atol=1e-12)
    # A person's speed stays as it is; the moves in and out are slow.
    speed = np.linalg.norm(np.diff(points[~inside], axis=0), axis=1) / 0.01
    assert np.sort(speed)[-2] < 0.2


def test_too_large_a_motion_is_shrunk_or_refused(csv_file):
    scenario = load_scenario("plane")
    start = np.array(scenario.scene.start_position)

    def placed(size):
        recording = read_recording(write(csv_file, table(size=size)))
        height = scenario.scene.contact_height
        return recorded_path(recording, start, height, 0.04, scenario.reachable)

    _, points = placed(0.2)
    assert scenario.reachable(points).all()
    extent = points.max(axis=0) - points.min(axis=0)
    # Down to the reach along x, in proportion along y.
    assert extent[0] == pytest.approx(2 * 0.95 * 0.055 * 2.5, rel=1e-3)
    assert extent[1] == pytest.approx(extent[0], rel=1e-3)
    assert points[:, 2].min() == pytest.approx(0.37)
    with pytest.raises(ScenarioError, match=r"recording: row \d+: .*at least 0\.5"):
        placed(0.4)


def test_depth_out_of_reach_is_refused(csv_file):
    recording = read_recording(write(csv_file, table()))
    start = np.array([0.45, 0.0, 0.18])
    with pytest.raises(ScenarioError, match=r"operator\.press_depth: expected a depth"):
        recorded_path(
            recording, start, 0.11, 0.04, lambda points: np.zeros(len(points), bool)
        )


def test_scenario_follows_a_recording(csv_file):
    path = str(write(csv_file, table()))
    scenario = load_scenario("plane").with_overrides(
        {"operator.recording": path, "link.delay": 1.5}
    )
    motion = scenario.operator_motion()
    assert motion.sampled
    assert motion.scale == 1.0
    assert "not scaled; orientation not followed" in motion.note
    assert motion.rotations.shape == (0, 3)
    assert scenario.run_duration() == 20.0
    longer = str(write(csv_file.with_name("long.csv"), table(3000)))
    scenario = scenario.with_overrides({"operator.recording": longer})
    assert scenario.run_duration() == pytest.approx(2.0 + 29.99 + 2.0 + 4.5 + 2.0)


def test_scenario_follows_quaternions_units_and_scale(csv_file):
    rows = table()
    rows[:, 1:] *= 1e3
    turn = 0.5 * np.linspace(0.0, 0.4, len(rows))
    q = np.column_stack([0 * turn, np.cos(turn), np.sin(turn), 0 * turn])
    header = [*HEADER, "qw", "qx", "qy", "qz", "yaw"]
    write(csv_file, np.column_stack([rows, q, turn]), header)
    scenario = load_scenario("plane")
    changes = {"operator.recording": str(csv_file)}
    with pytest.raises(ScenarioError, match="recording-units mm"):
        scenario.with_overrides(changes).operator_motion()
    changes |= {"operator.recording_units": "mm", "operator.recording_scale": 0.5}
    motion = scenario.with_overrides(changes).operator_motion()
    assert motion.scale == 0.5
    assert "50 x 50 x 40 mm, scaled by 0.5 as asked for" in motion.note
    assert motion.note.endswith("; orientation followed, ignored: yaw")
    np.testing.assert_allclose(
        motion.rotations[200:600], [[0, 0, 2 * angle] for angle in turn], atol=1e-9
    )


def test_every_way_of_giving_a_recording_ends_in_an_absolute_path(
    tmp_path, monkeypatch, csv_file
):
    write(csv_file, table())
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    plane = load_scenario("plane")
    for path in ("motion.csv", "~/motion.csv", str(csv_file)):
        scenario = plane.with_overrides({"operator.recording": path})
        assert scenario.operator.recording == str(csv_file)
    plane.operator.recording = "motion.csv"
    plane.validate()
    assert plane.operator.recording == str(csv_file)
    # In a file it is relative to that, in a section of overrides, too.
    (tmp_path / "elsewhere").mkdir()
    for section in ("", "  overrides:\n  "):
        inner = "  " + "  " * bool(section)
        text = f"s:\n{section}  operator:\n  {inner}recording: motion.csv\n"
        (tmp_path / "s.yaml").write_text(text)
        monkeypatch.chdir(tmp_path / "elsewhere")
        scenario = load_scenario("../s.yaml")
        assert scenario.operator.recording == str(csv_file)
        # What is saved is found from anywhere.
        (tmp_path / "elsewhere" / "saved.yaml").write_text(scenario.to_yaml())
        monkeypatch.chdir("/")
        again = load_scenario(tmp_path / "elsewhere" / "saved.yaml")
        assert again == scenario
        assert again.operator_motion().note
