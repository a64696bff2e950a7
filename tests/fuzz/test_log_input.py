# SPDX-License-Identifier: BSD-3-Clause
"""Whatever a log's file holds, and whatever a log: an error that names the file,
or a log that can be measured."""

import io
import json
import tempfile
import zipfile
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import ARRAYS, require_line

from dual_proxy.log import SIGNALS, load_log, make_frame, save_log, write_mcap
from dual_proxy.metrics import (
    compute_metrics,
    describe_broken_limits,
    metrics_out_of_limits,
    normal_error_deg,
)
from dual_proxy.scenario import load_scenario

FOLDER = Path(tempfile.mkdtemp(prefix="dual-proxy-fuzz-"))
PLANE = load_scenario("plane")
ROWS = 12


def values() -> dict[str, np.ndarray]:
    random = np.random.default_rng(1)
    return {
        name: np.ones((ROWS, 1), np.int32)
        if entry.integer
        else random.normal(size=(ROWS, len(entry.components)))
        for name, entry in SIGNALS.items()
    }


VALUES = values()
TIME = 0.001 * np.arange(1, ROWS + 1)


def saved() -> bytes:
    save_log(make_frame(TIME, VALUES), FOLDER / "good.npz")
    return (FOLDER / "good.npz").read_bytes()


GOOD = saved()


def measure(frame: pd.DataFrame) -> None:
    metrics = compute_metrics(frame, PLANE, wall_s=1.0)
    json.dumps(metrics, allow_nan=False)
    assert metrics["finite"] in (True, False)
    metrics_out_of_limits(metrics)
    for line in describe_broken_limits(frame, PLANE):
        assert "\n" not in line
    if {"dimension", "contact_normal_x", "force_selection_xx"} <= set(frame.columns):
        error = normal_error_deg(frame)
        assert np.all(np.isnan(error) | ((error >= 0) & (error <= 90)))


def check(content: bytes) -> None:
    path = FOLDER / "log.npz"
    path.write_bytes(content)
    try:
        frame = load_log(path)
    except ValueError as error:
        require_line(error, f"^{path}: expected a log of dual_proxy: .")
        return
    assert np.all(np.diff(frame.index) > 0)
    measure(frame)


def archive(arrays: dict[str, np.ndarray]) -> bytes:
    file = io.BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()


def test_what_is_not_changed_is_read():
    check(GOOD)
    assert len(load_log(FOLDER / "good.npz")) == ROWS


@given(st.integers(0, len(GOOD) - 1))
def test_a_file_that_ends_early(size):
    check(GOOD[:size])


@given(
    st.lists(st.tuples(st.integers(0, len(GOOD) - 1), st.integers(0, 255)), max_size=5)
)
def test_a_file_with_wrong_bytes(changes):
    content = bytearray(GOOD)
    for place, byte in changes:
        content[place] = byte
    check(bytes(content))


@given(st.binary(max_size=100))
def test_any_bytes(content):
    check(content)
    check(b"\x93NUMPY" + content)


@given(st.sampled_from(["time", *SIGNALS, "other"]), ARRAYS)
def test_any_array(name, array):
    check(archive({"time": TIME, **VALUES, name: array}))


@given(st.binary(max_size=60))
def test_any_entry(content):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as entries:
        entries.writestr("time.npy", content)
        entries.writestr("../torque.npy", b"\x93NUMPY\x01\x00" + content)
    check(file.getvalue())


@pytest.mark.parametrize(
    "shape", ["(1000000000000000,)", "(-1,)", "(10**9,)", "(3, 1e9)"]
)
def test_a_header_that_promises_too_much(shape):
    header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}"
    text = header.ljust(117).encode() + b"\n"
    entry = b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as entries:
        entries.writestr("time.npy", entry)
    check(file.getvalue())


@given(
    st.integers(0, ROWS),
    st.dictionaries(
        st.sampled_from(list(SIGNALS)),
        st.sampled_from([np.nan, np.inf, -np.inf, 0.0, 1e300, -1e160, 5e-324]),
        max_size=4,
    ),
    st.sets(st.sampled_from(list(SIGNALS)), max_size=4),
    st.booleans(),
)
def test_an_odd_log_is_measured(rows, constants, missing, at_one_place):
    arrays = {name: array[:rows].copy() for name, array in VALUES.items()}
    for name, value in constants.items():
        if SIGNALS[name].integer:
            continue
        arrays[name][slice(1) if at_one_place else slice(None)] = value
    for name in missing:
        del arrays[name]
    try:
        measure(make_frame(TIME[:rows], arrays))
    except ValueError as error:
        require_line(error, "there is no signal `")
        if not missing:
            raise


@given(
    st.sampled_from([np.nan, np.inf, -np.inf, -1.0, 0.0, 1e300]),
    st.integers(0, ROWS - 1),
)
def test_a_log_with_an_odd_time(time, row):
    times = TIME.copy()
    times[row] = time
    try:
        frame = make_frame(times, VALUES)
    except ValueError as error:
        require_line(error, "time: expected")
        return
    assert np.all(np.isfinite(frame.index))
    measure(frame)


def test_what_is_not_finite_can_be_saved_and_shown(tmp_path):
    arrays = {name: array.copy() for name, array in VALUES.items()}
    arrays["torque"][3] = np.nan
    frame = make_frame(TIME, arrays)
    save_log(frame, tmp_path / "log.npz")
    pd.testing.assert_frame_equal(load_log(tmp_path / "log.npz"), frame)
    write_mcap(frame, tmp_path / "log.mcap")
