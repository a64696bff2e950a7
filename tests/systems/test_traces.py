# SPDX-License-Identifier: BSD-3-Clause
"""The recorded traces, with which the C++ faces are compared, are current."""

import csv

import numpy as np
import pytest
import yaml
from face_table import FACES
from record_traces import ARM, NUM_ROWS, TRACES, arm_numbers, main, record

STALE = "run tests/systems/record_traces.py"


def load(name):
    with (TRACES / f"{name}.csv").open(newline="") as file:
        header, *rows = csv.reader(file)
    return header, np.array(rows, dtype=np.float64)


def assert_close(actual, expected, message):
    # Not the same bits: another compiler or C library may round differently.
    scale = np.maximum(1, np.abs(np.where(np.isfinite(expected), expected, 0)))
    np.testing.assert_allclose(
        actual / scale, expected / scale, rtol=0, atol=1e-12, err_msg=message
    )


@pytest.mark.parametrize("name", FACES)
def test_the_pydrake_face_gives_its_trace(name):
    header, rows = load(name)
    names, expected = record(name)
    assert header == names, STALE
    assert rows.shape == expected.shape, STALE
    for i, (recorded, now) in enumerate(zip(rows, expected, strict=True)):
        for column, a, b in zip(header, recorded, now, strict=True):
            assert_close(a, b, f"{column} in row {i}: {STALE}")


def columns(header, direction, port):
    """Indices of a port's columns."""
    return [
        i for i, name in enumerate(header) if name.split(".")[:2] == [direction, port]
    ]


@pytest.mark.parametrize("name", FACES)
def test_a_trace_has_something_to_compare(name):
    header, rows = load(name)
    assert len(rows) == NUM_ROWS
    for port in FACES[name].inputs:
        values = rows[:, columns(header, "in", port.name)]
        bad = ~np.isfinite(values).all(axis=1)
        assert np.count_nonzero(bad) == 1, port.name
    for port in FACES[name].outputs:
        values = rows[:, columns(header, "out", port.name)]
        assert values.size > 0, port.name
        if port.acting:
            assert np.all(np.isfinite(values)), port.name
    outputs = [i for i, column in enumerate(header) if column.startswith("out.")]
    assert len(np.unique(rows[:, outputs], axis=0)) > 5


def test_there_is_one_trace_per_face():
    assert {path.stem for path in TRACES.iterdir()} == set(FACES)
    assert sum(path.stat().st_size for path in TRACES.iterdir()) <= 410_000


def test_the_arm_is_current():
    recorded = yaml.safe_load(ARM.read_text())
    numbers = arm_numbers()
    assert list(recorded) == list(numbers), STALE
    for field, value in numbers.items():
        assert_close(np.array(recorded[field]), np.array(value), f"{field}: {STALE}")


def test_an_unknown_face_is_an_error():
    with pytest.raises(SystemExit, match="no face \\['NoFace'\\], there are"):
        main(["NoFace"])
