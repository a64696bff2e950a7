# SPDX-License-Identifier: BSD-3-Clause
import contextlib
import json
import resource
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from dual_proxy import _core
from dual_proxy.log import (
    SIGNALS,
    column_names,
    load_log,
    log_store,
    make_frame,
    release,
    save_log,
    signal,
    signals,
    write_mcap,
)


def random_values(n=50, seed=1):
    random = np.random.default_rng(seed)
    return {
        name: random.integers(0, 3, (n, 1))
        if entry.integer
        else random.normal(size=(n, len(entry.components)))
        for name, entry in SIGNALS.items()
    }


@pytest.fixture
def frame():
    return make_frame(np.arange(50) * 1e-3, random_values())


def test_columns(frame):
    assert frame.index.name == "time"
    assert column_names("robot_position") == [f"robot_position_{c}" for c in "xyz"]
    assert column_names("torque")[6] == "torque_6"
    assert column_names("force_selection")[1] == "force_selection_xy"
    assert column_names("robot_orientation")[0] == "robot_orientation_w"
    assert column_names("dimension") == ["dimension"]
    assert list(frame.columns) == [c for name in SIGNALS for c in column_names(name)]


def test_signal_gives_back_what_went_in(frame):
    values = random_values()
    for name, entry in SIGNALS.items():
        expected = values[name] if len(entry.components) > 1 else values[name][:, 0]
        np.testing.assert_array_equal(signal(frame, name), expected)


@pytest.mark.parametrize("loaded", [False, True])
def test_no_value_can_be_changed_except_in_a_copy(frame, tmp_path, loaded):
    if loaded:
        save_log(frame, tmp_path / "log.npz")
        frame = load_log(tmp_path / "log.npz")
    before = frame.copy()
    for column in range(len(frame.columns)):
        with pytest.raises(ValueError, match="read-only"):
            frame.iloc[0, column] = 1
    pd.testing.assert_frame_equal(frame, before, check_exact=True)
    before.iloc[0, :] = 1
    assert (before.iloc[0] == 1).all()


def test_a_log_leaves_the_arrays_that_it_is_made_of_writable():
    values = random_values()
    make_frame(np.arange(50) * 1e-3, values)
    assert all(array.flags.writeable for array in values.values())


def test_matrices_and_scalars_come_in_their_natural_shape():
    values = random_values()
    values["force_selection"] = values["force_selection"].reshape(-1, 3, 3)
    values["observed_energy"] = values["observed_energy"][:, 0]
    frame = make_frame(np.arange(50), values)
    assert frame["force_selection_zy"].iloc[3] == values["force_selection"][3, 2, 1]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda v: v.update(torqe=0), "unknown.*torqe"),
        (lambda v: v.update(torque=np.zeros((50, 6))), r"torque: expected.*\(50, 7\)"),
        (lambda v: v.update(dimension=np.zeros(49)), "dimension: expected"),
    ],
)
def test_wrong_signals_are_refused(change, message):
    values = random_values()
    change(values)
    with pytest.raises(ValueError, match=message):
        make_frame(np.arange(50), values)


def test_a_log_has_those_signals_that_the_run_has():
    values = random_values()
    some = {name: values[name] for name in ("torque", "hand_position", "dimension")}
    frame = make_frame(np.arange(50), some)
    expected = ["hand_position", "torque", "dimension"]  # In the catalogue's order.
    assert list(frame.columns) == [c for name in expected for c in column_names(name)]
    assert signals(frame.columns) == expected
    assert make_frame(np.arange(50), {}).shape == (50, 0)


def test_every_signal_is_described():
    assert len(SIGNALS) == len(set(SIGNALS)) > 80
    for name, entry in SIGNALS.items():
        assert entry.description, name
        assert entry.frame in ("", "B", "D"), name
    assert SIGNALS["torque"].unit == "N m"
    assert SIGNALS["torque"].components == tuple("0123456")
    assert SIGNALS["dimension"].integer
    assert not SIGNALS["dimension"].counter
    assert SIGNALS["robot_bad_inputs"].counter
    assert SIGNALS["robot_bad_inputs"].description.endswith(", so far")


def test_time_must_increase():
    with pytest.raises(ValueError, match="time: expected"):
        make_frame(np.zeros(50), random_values())


def test_saved_log_is_the_same_log(frame, tmp_path):
    path = tmp_path / "log.npz"
    save_log(frame, path)
    pd.testing.assert_frame_equal(load_log(path), frame, check_exact=True)
    assert [p.name for p in tmp_path.iterdir()] == ["log.npz"]
    with np.load(path) as archive:
        assert archive["robot_position"].shape == (50, 3)


def test_empty_log_is_saved_too(frame, tmp_path):
    save_log(frame.iloc[:0], tmp_path / "log.npz")
    assert load_log(tmp_path / "log.npz").shape == (0, frame.shape[1])


def test_equal_logs_are_equal_files(frame, tmp_path):
    one, two, other = (tmp_path / name for name in ("1.npz", "2.npz", "3.npz"))
    save_log(frame, one)
    save_log(make_frame(np.arange(50) * 1e-3, random_values()), two)
    save_log(make_frame(np.arange(50) * 1e-3, random_values(seed=2)), other)
    assert one.read_bytes() == two.read_bytes()
    assert one.read_bytes() != other.read_bytes()


def memory_of_files():
    """What this process has in memory of files, MB."""
    text = Path("/proc/self/status").read_text()
    return int(text.split("RssFile:")[1].split()[0]) / 1024


def test_log_on_disk_is_read_where_it_is_needed(tmp_path):
    """A run of two minutes, as a station's store has it."""
    rows = 120_000
    names = {name: len(column_names(name)) for name in SIGNALS}
    width = sum(names.values())
    store = _core._RunLogStore(width, rows)
    for start in range(0, rows, 1000):
        times = 1e-3 * np.arange(start + 1, start + 1001)
        store.append(times, np.add.outer(np.arange(width), times))
    parts = np.split(store.values, np.cumsum(list(names.values()))[:-1], axis=1)
    frame = make_frame(store.time, dict(zip(names, parts, strict=True)))
    assert log_store(frame) is store
    del store, parts
    release(frame)
    before = memory_of_files()

    column = frame["torque_3"]
    np.testing.assert_allclose(column - column.iloc[0], frame.index - frame.index[0])
    torque = signal(frame, "torque")
    np.testing.assert_array_equal(torque[:, 3], column)
    assert np.shares_memory(torque, column.to_numpy())
    with pytest.raises(ValueError, match="read-only"):
        frame.iloc[0, 0] = 1.0
    assert memory_of_files() < before + 10.0
    assert frame.to_numpy().shape == (rows, width)
    assert memory_of_files() > before + 50.0
    release(frame)
    assert memory_of_files() < before + 10.0
    save_log(frame.iloc[-5000:], tmp_path / "log.npz")
    pd.testing.assert_frame_equal(
        load_log(tmp_path / "log.npz"), frame.iloc[-5000:], check_exact=True
    )


def test_signal_of_any_frame(frame):
    for changed in (frame.copy(), frame[frame.columns[::-1]], frame.iloc[::7]):
        for name in ("robot_position", "force_selection", "dimension"):
            expected = changed[column_names(name)].to_numpy().reshape(len(changed), -1)
            actual = signal(changed, name).reshape(len(changed), -1)
            np.testing.assert_array_equal(actual, expected)


def test_file_that_cannot_be_written_leaves_the_old_one(frame, tmp_path):
    path = tmp_path / "log.npz"
    path.write_text("old")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))
    try:
        for write in (save_log, write_mcap):
            with pytest.raises(OSError, match="File too large"):
                write(frame, path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_what_is_no_log_is_refused(tmp_path):
    path = tmp_path / "log.npz"
    path.write_bytes(b"PK not really")
    with pytest.raises(ValueError, match="expected a log"):
        load_log(path)
    np.savez(path, a=1)
    with pytest.raises(ValueError, match="no array 'time'"):
        load_log(path)
    with path.open("wb") as file:
        np.save(file, np.ones(3))
    with pytest.raises(ValueError, match="expected a log"):
        load_log(path)


def test_a_damaged_log_is_refused(frame, tmp_path):
    path = tmp_path / "log.npz"
    save_log(frame, path)
    whole = path.read_bytes()
    for place in range(40, len(whole) // 2, 97):
        damaged = bytearray(whole)
        damaged[place] ^= 0x55
        path.write_bytes(damaged)
        with contextlib.suppress(ValueError):  # It may be a harmless bit.
            load_log(path)


def test_mcap_holds_every_signal(frame, tmp_path):
    from mcap.reader import make_reader

    frame = frame.copy()
    frame.loc[frame.index[2], "torque_3"] = np.nan
    path = tmp_path / "log.mcap"
    write_mcap(frame, path)
    count = 0
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            count += 1
            row = message.log_time // 1_000_000
            name = channel.topic.removeprefix("/")
            value = json.loads(message.data)
            properties = json.loads(schema.data)["properties"]
            assert list(value) == list(properties)
            expected = frame[column_names(name)].iloc[row].tolist()
            for number, exact in zip(value.values(), expected, strict=True):
                if np.isnan(exact):
                    assert number is None
                else:
                    assert number == pytest.approx(exact, rel=1e-8)
    assert count == 50 * len(SIGNALS)
