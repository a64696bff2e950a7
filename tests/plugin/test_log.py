# SPDX-License-Identifier: BSD-3-Clause
import json

import numpy as np
import pandas as pd
import pytest

from dual_proxy.log import (
    ANGULAR_SIGNALS,
    SIGNALS,
    column_names,
    load_log,
    make_frame,
    save_log,
    signal,
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


def test_matrices_and_scalars_come_in_their_natural_shape():
    values = random_values()
    values["force_selection"] = values["force_selection"].reshape(-1, 3, 3)
    values["observed_energy"] = values["observed_energy"][:, 0]
    frame = make_frame(np.arange(50), values)
    assert frame["force_selection_zy"].iloc[3] == values["force_selection"][3, 2, 1]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda v: v.pop("torque"), "missing.*torque"),
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


def test_signals_of_the_angular_filter_are_there_together_or_not_at_all():
    values = random_values()
    angular = {
        name: np.ones((50, len(entry.components)))
        for name, entry in ANGULAR_SIGNALS.items()
    }
    frame = make_frame(np.arange(50), values | angular)
    expected = [*SIGNALS, *ANGULAR_SIGNALS]
    assert list(frame.columns) == [c for name in expected for c in column_names(name)]
    assert frame["moment_dimension"].dtype == np.int32
    assert signal(frame, "moment_selection").shape == (50, 9)
    del angular["reference_moment"]
    with pytest.raises(ValueError, match=r"missing.*reference_moment"):
        make_frame(np.arange(50), values | angular)
    del angular["moment_dimension"]
    with pytest.raises(ValueError, match=r"unknown.*moment_selection"):
        make_frame(np.arange(50), values | angular)


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


def test_what_is_no_log_is_refused(tmp_path):
    path = tmp_path / "log.npz"
    path.write_bytes(b"PK not really")
    with pytest.raises(ValueError, match="expected a log"):
        load_log(path)
    np.savez(path, a=1)
    with pytest.raises(ValueError, match="no array 'time'"):
        load_log(path)


def test_mcap_holds_every_signal(frame, tmp_path):
    from mcap.reader import make_reader

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
