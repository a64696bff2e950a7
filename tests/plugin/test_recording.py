# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest

from dual_proxy.recording import MOVE_TIME, read_recording, recorded_path
from dual_proxy.scenario import ScenarioError, load_scenario

HEADER = ["t", "px", "py", "pz"]


def table(n=400, rate=100.0, size=0.05):
    """A hand that comes down onto a board, circles on it and leaves."""
    t = np.arange(n) / rate
    phase = 2 * np.pi * t / t[-1]
    z = 0.3 + np.where((t > 1) & (t < 3), 0.0, 0.08)
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


def test_reads_rotations_and_ignores_other_columns(csv_file):
    n = 400
    header = [*HEADER, "note", *(f"R{i}{j}" for i in "123" for j in "123")]
    rotation = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    rows = [[*row, "free text", *rotation.ravel()] for row in table(n)]
    recording = read_recording(write(csv_file, rows, header))
    np.testing.assert_array_equal(recording.rotations, np.tile(rotation, (n, 1, 1)))


def replaced(row, column, value):
    rows = table().astype(object)
    rows[row - 1, column] = value
    return rows


@pytest.mark.parametrize(
    ("rows", "header", "message"),
    [
        (replaced(7, 2, "nan"), HEADER, "row 7, column 'py'.*finite number, got 'nan'"),
        (replaced(9, 3, "inf"), HEADER, "row 9, column 'pz'.*finite number"),
        (replaced(3, 1, "abc"), HEADER, "row 3, column 'px'.*got 'abc'"),
        (replaced(3, 1, ""), HEADER, "row 3, column 'px'.*got ''"),
        (replaced(20, 0, 0.0), HEADER, "row 20, column 't'.*after 0.18 s, got 0 s"),
        (table(), ["t", "px", "py", "height"], "column 'pz' is missing"),
        (table(), ["t", "px", "px", "pz"], "column 'px' is found more than once"),
        (table()[:, :3], HEADER, "row 1: expected 4 values, got 3"),
        (table(9), HEADER, "too short.*10 rows and 1 s, got 9 rows"),
        (table(50), HEADER, "too short.*got 50 rows and 0.49 s"),
        (table()[:0], HEADER, "too short.*got 0 rows"),
        (table(400, 0.1), HEADER, "too long"),
    ],
)
def test_bad_files_are_named_with_row_and_column(csv_file, rows, header, message):
    with pytest.raises(ScenarioError, match=f"motion.csv.*{message}") as caught:
        read_recording(write(csv_file, rows, header))
    assert "\n" not in str(caught.value)


def test_partial_or_wrong_orientation_is_refused(csv_file):
    rows = [[*row, 1.0] for row in table()]
    with pytest.raises(ScenarioError, match="column 'R12' is missing"):
        read_recording(write(csv_file, rows, [*HEADER, "R11"]))
    names = [f"R{i}{j}" for i in "123" for j in "123"]
    rows = [[*row, *np.diag([1, 1, -1]).ravel()] for row in table()]
    with pytest.raises(ScenarioError, match="row 1, columns 'R11' to 'R33'"):
        read_recording(write(csv_file, rows, [*HEADER, *names]))


def test_unreadable_files(tmp_path):
    with pytest.raises(ScenarioError, match=r"none\.csv: No such file"):
        read_recording(tmp_path / "none.csv")
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00t")
    with pytest.raises(ScenarioError, match="expected a CSV file"):
        read_recording(tmp_path / "binary.csv")
    (tmp_path / "empty.csv").write_text("")
    with pytest.raises(ScenarioError, match="column 't' is missing"):
        read_recording(tmp_path / "empty.csv")


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


def test_too_large_a_motion_is_scaled_to_fit(csv_file):
    scenario = load_scenario("plane")
    recording = read_recording(write(csv_file, table(size=0.6)))
    start = np.array(scenario.scene.start_position)
    _, points = recorded_path(
        recording, start, scenario.scene.contact_height, 0.04, scenario.reachable
    )
    assert scenario.reachable(points).all()
    extent = points.max(axis=0) - points.min(axis=0)
    # Down to the reach along x, in proportion along y.
    assert extent[0] == pytest.approx(2 * 0.95 * 0.055 * 2.5, rel=1e-3)
    assert extent[1] == pytest.approx(extent[0], rel=1e-3)
    assert points[:, 2].min() == pytest.approx(0.37)


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
    assert scenario.run_duration() == 20.0
    longer = str(write(csv_file.with_name("long.csv"), table(3000)))
    scenario = scenario.with_overrides({"operator.recording": longer})
    assert scenario.run_duration() == pytest.approx(2.0 + 29.99 + 2.0 + 4.5 + 2.0)
