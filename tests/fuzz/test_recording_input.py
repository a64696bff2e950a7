# SPDX-License-Identifier: BSD-3-Clause
"""Whatever stands in a recording: a motion, or one line that says what is wrong."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import FLOATS, TEXTS, require_line

from dual_proxy.recording import read_recording
from dual_proxy.scenario import ScenarioError

FOLDER = Path(tempfile.mkdtemp(prefix="dual-proxy-fuzz-"))
NAMES = ["t", "px", "py", "pz", "qw", "qx", "qy", "qz"]


def rows(count: int) -> list[list[str]]:
    """A hand on a circle, as text."""
    t = np.arange(count) / 20
    circle = 0.05 * np.column_stack([np.cos(t), np.sin(t), 0 * t])
    still = np.tile([1.0, 0, 0, 0], (count, 1))
    return [[f"{x:.6g}" for x in row] for row in np.column_stack([t, circle, still])]


@st.composite
def tables(draw: st.DrawFn) -> str:
    """A recording in which some cells, rows or columns are otherwise."""
    table = [list(NAMES), *rows(draw(st.sampled_from([25, 25, 25, 9, 40])))]
    if draw(st.booleans()):
        table = [row[:4] for row in table]
    for _ in range(draw(st.integers(0, 3))):
        what = draw(st.sampled_from(["cell", "swap", "drop", "column", "twice", "row"]))
        i = draw(st.integers(0, len(table) - 1))
        k = draw(st.integers(0, max(0, len(table[0]) - 1)))
        if what == "cell" and k < len(table[i]):
            table[i][k] = draw(
                FLOATS.map(repr)
                | TEXTS
                | st.sampled_from(["1,5", '"', "+1", "1e9", "nan"])
            )
        elif what == "swap":
            table[i], table[-1] = table[-1], table[i]
        elif what == "drop" and len(table) > 1:
            del table[i]
        elif what == "column" and len(table[0]) > 1:
            table = [row[:k] + row[k + 1 :] for row in table]
        elif what == "twice":
            table.insert(i, list(table[i]))
        else:
            table.insert(i, draw(st.lists(TEXTS, max_size=9)))
    separator = draw(st.sampled_from([",", ",", ",", ";", "\t", " ", ", "]))
    end = draw(st.sampled_from(["\n", "\n", "\r\n", "\r"]))
    mark = draw(st.sampled_from(["", "", "\ufeff"]))
    return mark + end.join(separator.join(row) for row in table) + end


def check(content: bytes, units: str = "m", scale: float = 1.0) -> None:
    path = FOLDER / "motion.csv"
    path.write_bytes(content)
    try:
        recording = read_recording(path, units, scale)
    except ScenarioError as error:
        require_line(error, rf"^({path}(: |, row )|ReadRecording: field `scale`)")
        return
    n = len(recording.times)
    assert n >= 10
    assert recording.times[0] == 0.0
    assert np.all(np.diff(recording.times) > 0)
    assert 1 <= recording.times[-1] <= 3600
    assert recording.positions.shape == (n, 3)
    assert np.all(np.isfinite(recording.positions))
    if recording.rotations is not None:
        turns = recording.rotations @ recording.rotations.transpose(0, 2, 1)
        np.testing.assert_allclose(turns, np.tile(np.eye(3), (n, 1, 1)), atol=2e-3)


@given(tables(), st.sampled_from(["m", "cm", "mm"]), st.sampled_from([1.0, 0.3, 100.0]))
def test_a_changed_table(text, units, scale):
    check(text.encode("utf-8", "surrogatepass"), units, scale)


@given(tables(), st.sampled_from(["utf-16", "utf-32", "latin-1", "utf-7", "cp1252"]))
def test_other_encodings(text, encoding):
    check(text.encode(encoding, "replace"))


@given(st.binary(max_size=300))
def test_any_bytes(content):
    check(content)


@pytest.mark.parametrize("scale", [0.0, -1.0, np.nan, np.inf, 5e-324, 1e308])
def test_any_scale(scale):
    text = "\n".join(",".join(row) for row in [NAMES, *rows(25)])
    check(text.encode(), "m", scale)
