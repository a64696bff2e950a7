# SPDX-License-Identifier: BSD-3-Clause
"""The arm's model from Python: names, shapes and values."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from dual_proxy import ArmModel, ArmModelParams

SHAPES = {
    "p_PJ": (3, 7),
    "R_PJ": (7, 3, 3),
    "mass": (7,),
    "com": (3, 7),
    "inertia": (7, 3, 3),
    "p_LE": (3,),
    "R_LE": (3, 3),
    "gravity": (3,),
}


def make_params() -> ArmModelParams:
    """A chain whose second joint is turned: its axis is B's -y."""
    R_PJ = np.tile(np.eye(3), (7, 1, 1))
    R_PJ[1] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    p_PJ = np.zeros((3, 7))
    p_PJ[2, 0] = 0.3
    p_PJ[0, 1:] = 0.1
    return ArmModelParams(
        p_PJ=p_PJ,
        R_PJ=R_PJ,
        mass=np.arange(1.0, 8.0),
        com=np.full((3, 7), 0.01),
        inertia=[np.diag([0.01, 0.02, 0.025 - 0.001 * i]) for i in range(7)],
        p_LE=[0.2, 0.0, 0.0],
    )


def test_params_keep_what_they_are_given():
    params = make_params()
    assert tuple(params.fields) == tuple(SHAPES)
    for name, shape in SHAPES.items():
        value = getattr(params, name)
        assert value.shape == shape
        with pytest.raises(ValueError, match="read-only"):
            value[:] = 0.0
    np.testing.assert_array_equal(params.R_PJ[1] @ [0, 0, 1], [0, -1, 0])
    assert params.inertia[3, 2, 2] == 0.025 - 0.003
    np.testing.assert_array_equal(params.gravity, [0, 0, -9.81])


def test_params_compare_copy_and_pickle():
    params = make_params()
    other = pickle.loads(pickle.dumps(params))
    assert other == params
    inertia = np.array(params.inertia)
    inertia[6, 0, 0] += 1e-3
    other.inertia = inertia
    assert other != params
    assert "R_PJ=[[[1.0, 0.0, 0.0]" in repr(params)


@pytest.mark.parametrize("name", SHAPES)
def test_wrong_shapes_name_the_field(name):
    params = make_params()
    with pytest.raises(ValueError, match=rf"{name}.*got.*\(2, 5\)"):
        setattr(params, name, np.zeros((2, 5)))
    assert params == make_params()


def test_invalid_params_name_the_field():
    with pytest.raises(ValueError, match=r"`mass\[0\]` expected a finite value > 0"):
        ArmModel(ArmModelParams())
    params = make_params()
    params.R_PJ = np.zeros((7, 3, 3))
    with pytest.raises(ValueError, match=r"`R_PJ\[0\]`"):
        ArmModel(params)
    with pytest.raises(TypeError, match="inertias"):
        ArmModelParams(inertias=np.zeros((7, 3, 3)))


def test_terms_of_the_straight_arm():
    dut = ArmModel(make_params())
    assert dut.params == make_params()
    v = np.zeros(7)
    v[1] = 2.0
    terms = dut.calc(np.zeros(7), v)
    p_BE, R_BE, J_BE, mass, bias, gravity, Jdot_v = terms
    assert [term.shape for term in terms] == [
        (3,),
        (3, 3),
        (6, 7),
        (7, 7),
        (7,),
        (7,),
        (6,),
    ]
    # Joint 2 at (0.1, 0, 0.3) turns about -y; E is 0.7 m beyond it along x.
    np.testing.assert_allclose(p_BE, [0.8, 0.0, 0.3], atol=1e-15)
    np.testing.assert_allclose(R_BE, make_params().R_PJ[1], atol=1e-15)
    np.testing.assert_allclose(J_BE[:, 0], [0, 0.8, 0, 0, 0, 1], atol=1e-15)
    np.testing.assert_allclose(J_BE[:, 1], [0, 0, 0.7, 0, -1, 0], atol=1e-15)
    np.testing.assert_allclose(Jdot_v, [-0.7 * 4.0, 0, 0, 0, 0, 0], atol=1e-14)
    assert np.array_equal(mass, mass.T)
    # The last link alone: about its z, 0.01 m off in x and y.
    np.testing.assert_allclose(mass[6, 6], 0.019 + 7 * 2e-4, rtol=1e-12)
    # About -y, weights pull down: links 2 to 7, 0.1 m apart.
    arm = sum(m * (0.1 * (m - 2) + 0.01) for m in range(2, 8))
    np.testing.assert_allclose(gravity[1], -9.81 * arm, rtol=1e-12)
    assert gravity[0] == pytest.approx(0.0, abs=1e-12)
    # The first joint's axis crosses the turning links' off-centre masses.
    assert np.abs(bias).max() > 1e-3


def test_calc_refuses_wrong_shapes_and_shows_nan():
    dut = ArmModel(make_params())
    with pytest.raises(ValueError, match=r"q: expected .*\(7,\).*\(6,\)"):
        dut.calc(np.zeros(6), np.zeros(7))
    with pytest.raises(ValueError, match=r"v: expected .*\(7,\).*\(7, 1\)"):
        dut.calc(np.zeros(7), np.zeros((7, 1)))
    for term in dut.calc(np.zeros(7), [0, 0, np.nan, 0, 0, 0, 0]):
        assert np.isnan(term).all()
