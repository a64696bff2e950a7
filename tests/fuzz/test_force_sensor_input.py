# SPDX-License-Identifier: BSD-3-Clause
"""Whatever a force sensor's page or a file of its samples holds: what it means, or
one line that says what is wrong."""

import math
import tempfile
from pathlib import Path

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from strategies import FLOATS, TEXTS, require_line

import dual_proxy as dp
from dual_proxy.ft_sensor import rdt_params_from_xml
from dual_proxy.tool_calibration import (
    CalibrationError,
    calibrate_tool,
    find_resting_poses,
    read_samples,
)

FOLDER = Path(tempfile.mkdtemp(prefix="dual-proxy-fuzz-"))
NAMES = ["t", "qw", "qx", "qy", "qz", "fx", "fy", "fz", "mx", "my", "mz"]
FIELDS = ["cfgcpf", "cfgcpt", "scfgfu", "scfgtu", "cfgfu", "cfgtu", "comrdte"]
TEXT = TEXTS | FLOATS.map(repr) | st.sampled_from(["1000", "2", "N", "N-m", "Enabled"])


@st.composite
def pages(draw: st.DrawFn) -> bytes:
    given = {"cfgcpf": "1000", "cfgcpt": "1000", "scfgfu": "N", "scfgtu": "Nm"}
    for name in draw(st.lists(st.sampled_from(FIELDS), max_size=2)):
        given[name] = draw(TEXT)
    page = "".join(f"<{name}>{text}</{name}>" for name, text in given.items())
    content = bytearray(f"<netft>{page}</netft>".encode(errors="replace"))
    for _ in range(draw(st.integers(0, 2))):
        content[draw(st.integers(0, len(content) - 1))] = draw(st.integers(0, 255))
    return bytes(content)


@given(pages() | st.binary(max_size=200))
def test_page(page):
    try:
        params = rdt_params_from_xml(page)
    except dp.DriverError as error:
        require_line(error)
        return
    params.validate()
    assert 0 < params.counts_per_force < math.inf


def rows() -> list[list[str]]:
    """Six poses of a tool of a kilogram, the last two alike but for a turn."""
    table = [list(NAMES)]
    for i, axis in enumerate(np.repeat(np.eye(3), 2, axis=0)):
        turn = np.deg2rad(60) * (-1) ** i
        quaternion = [np.cos(turn / 2), *(np.sin(turn / 2) * axis)]
        side = np.cross([0, 0, 1], axis)
        up = np.array([0, 0, 1]) if i > 3 else [*(np.sin(turn) * side[:2]), 0.5]
        force = 9.81 * np.array(up)
        wrench = [*force, *np.cross([0, 0, 0.1], force)]
        for k in range(10):
            numbers = [i + k / 10, *quaternion, *wrench]
            table.append([f"{number:.9g}" for number in numbers])
    return table


def text_of(table: list[list[str]]) -> str:
    return "\n".join(",".join(row) for row in table)


@st.composite
def tables(draw: st.DrawFn) -> str:
    """Samples in which some cells or rows are otherwise."""
    table = rows()
    for _ in range(draw(st.integers(0, 3))):
        row = draw(st.integers(0, len(table) - 1))
        column = draw(st.integers(0, len(NAMES) - 1))
        what = draw(st.sampled_from(["cell", "drop", "twice", "row"]))
        if what == "cell" and column < len(table[row]):
            table[row][column] = draw(TEXT)
        elif what == "drop":
            del table[row]
        elif what == "twice":
            table.insert(row, list(table[row]))
        else:
            table.insert(row, draw(st.lists(TEXT, max_size=12)))
    return text_of(table)


def check(content: bytes) -> None:
    path = FOLDER / "samples.csv"
    path.write_bytes(content)
    try:
        result = calibrate_tool(find_resting_poses(read_samples(path)))
    except CalibrationError as error:
        require_line(error)
        return
    assert 0 < result.mass < math.inf
    assert np.isfinite(result.com).all()
    result.adapter_params().validate()


def test_samples_are_good_ones():
    path = FOLDER / "samples.csv"
    path.write_text(text_of(rows()))
    assert abs(calibrate_tool(find_resting_poses(read_samples(path))).mass - 1) < 1e-6


@given(tables())
def test_samples(text):
    check(text.encode(errors="surrogatepass"))


@given(st.binary(max_size=300))
def test_bytes(content):
    check(content)
