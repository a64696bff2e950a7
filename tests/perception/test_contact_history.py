# SPDX-License-Identifier: BSD-3-Clause
"""The contact history: places, visits, arguments."""

import copy
import math
import pickle

import numpy as np
import pytest

import dual_proxy as dp

DOWN = np.array([0.0, 0.0, -1.0])
HERE = np.array([0.4, 0.1, 0.01])
AWAY = np.array([0.0, 0.0, 0.5])
NOTHING = np.zeros((3, 0))


def angle_deg(a, b):
    return math.degrees(math.atan2(np.linalg.norm(np.cross(a, b)), a @ b))


def leave(dut, state, updates=40):
    for _ in range(updates):
        assert dut.update(AWAY, NOTHING, state) == "ok"


@pytest.fixture
def dut():
    return dp.ContactHistory()


@pytest.fixture
def state(dut):
    return dut.make_state()


def test_second_visit_of_a_table_finds_its_normal(dut, state):
    rng = np.random.default_rng(2)
    tilt = np.array([0.1, 0.0, -math.sqrt(0.99)])
    along = np.array([0.0, 1.0, 0.0])
    path = [HERE + 0.004 * i * along for i in range(50)]
    for position in path:
        # As the filter is: wrong by about 3 deg.
        dut.update(position, (tilt + rng.normal(0, 0.05, 3))[:, None], state)
        normals, _std = dut.lookup(position, state)
        assert normals.shape == (3, 0)
    leave(dut, state)
    for position in path:
        normals, std = dut.lookup(position, state)
        assert normals.shape[1] >= 1
        assert angle_deg(normals[:, 0], tilt) < 4
        # A memory of this cell: half its diagonal is the furthest.
        assert 0.1 <= std <= 0.1 + 10 * 0.02
    for far in (path[0] - 0.04 * along, path[25] - 0.03 * DOWN):
        normals, std = dut.lookup(far, state)
        assert normals.shape == (3, 0)
        assert std == 0.1


def test_selection_of_the_filter_says_the_normals(dut, state):
    edge = np.diag([1.0, 0.0, 1.0])
    assert dut.update_from_selection(HERE, edge, DOWN, state) == "ok"
    leave(dut, state)
    normals, _std = dut.lookup(HERE, state)
    np.testing.assert_array_equal(normals[:, 0], DOWN)
    np.testing.assert_array_equal(np.abs(normals[:, 1:]), [[1, 1], [0, 0], [0, 0]])
    np.testing.assert_array_equal(normals[:, 1], -normals[:, 2])


def test_bad_values_are_counted_not_raised(dut, state):
    for bad in (np.nan, np.inf):
        wrong = np.full(3, bad)
        assert dut.update(wrong, DOWN[:, None], state) == "bad_input"
        assert dut.update(HERE, wrong[:, None], state) == "bad_input"
        assert dut.update_from_selection(HERE, np.eye(3), wrong, state) == "bad_input"
        assert dut.lookup(wrong, state)[0].shape == (3, 0)
    assert state.bad_inputs == 6
    assert state.updates == 0


def test_wrong_arguments_name_what_is_wrong(dut, state):
    for wrong in (np.zeros(3), np.zeros((2, 1)), np.zeros((3, 9))):
        with pytest.raises(ValueError, match=r"normals: .*\(3, d\) with d <= 8"):
            dut.update(HERE, wrong, state)
    with pytest.raises(ValueError, match=r"position: .*\(3,\)"):
        dut.lookup(np.zeros(2), state)
    other = dp.ContactHistory(dp.ContactHistoryParams(capacity=5))
    for call in (
        lambda: other.update(HERE, NOTHING, state),
        lambda: other.update_from_selection(HERE, np.eye(3), DOWN, state),
        lambda: other.lookup(HERE, state),
    ):
        with pytest.raises(ValueError, match="capacity=5, got one with capacity=1024"):
            call()
    with pytest.raises(TypeError):
        dut.lookup(HERE, None)


def test_state_is_a_value(dut, state):
    dut.update(HERE, DOWN[:, None], state)
    leave(dut, state)
    for twin in (copy.copy(state), copy.deepcopy(state)):
        dut.update(HERE, NOTHING, twin)
        assert twin.updates == state.updates + 1
        assert dut.lookup(HERE, twin)[0].shape == (3, 1)


def test_params():
    params = dp.ContactHistoryParams(radius=0.03, capacity=9)
    assert pickle.loads(pickle.dumps(params)) == params
    assert dp.ContactHistory(params).params == params
    with pytest.raises(ValueError, match=r"radius.*2 cell_size = 0.04\], got 0.05"):
        dp.ContactHistoryParams(radius=0.05)
