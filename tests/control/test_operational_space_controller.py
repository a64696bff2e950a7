# SPDX-License-Identifier: BSD-3-Clause
"""The operational-space controller on the Panda's model, against NumPy."""

import copy
import pickle

import numpy as np
import pytest

import dual_proxy as dp
from dual_proxy.panda import PandaModel

ZERO3 = np.zeros(3)
ZERO6 = np.zeros(6)
ZERO33 = np.zeros((3, 3))
Q_HOME = np.array([0.0, -0.785398, 0.0, -2.356194, 0.0, 1.570796, 0.785398])


@pytest.fixture(scope="module")
def model():
    return PandaModel()


def unlimited(**kwargs):
    return dp.OperationalSpaceControllerParams(
        torque_limit=np.full(7, 1e6), torque_rate_limit=1e12, **kwargs
    )


def arguments(terms, q, v, **kwargs):
    """Keyword arguments of `update`, but for the state."""
    values = {
        "jacobian": terms.J_BE,
        "mass": terms.mass,
        "bias": terms.bias,
        "gravity": terms.gravity,
        "jdot_v": terms.Jdot_v,
        "q": q,
        "v": v,
        "motion_error": ZERO3,
        "rotation_error": ZERO3,
        "proxy_velocity": ZERO6,
        "proxy_acceleration": ZERO6,
        "reference_force": ZERO3,
        "reference_moment": ZERO3,
        "force_selection": ZERO33,
        "moment_selection": ZERO33,
        "sensed_wrench": ZERO6,
    }
    assert set(kwargs) <= set(values)
    return values | kwargs


def configurations(count, seed):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield (
            Q_HOME + rng.uniform(-0.4, 0.4, 7),
            rng.uniform(-0.5, 0.5, 7),
            rng,
        )


def tip_acceleration(terms, torque, wrench=ZERO6):
    """[linear; angular], of the arm alone, while its tool exerts `wrench`."""
    vdot = np.linalg.solve(
        terms.mass, torque + terms.gravity - terms.bias - terms.J_BE.T @ wrench
    )
    return terms.J_BE @ vdot + terms.Jdot_v


def test_inertia_is_that_of_numpy(model):
    for q, v, _ in configurations(20, 1):
        terms = model.calc(q, v)
        inertia, singular = dp.calc_operational_space_inertia(
            terms.J_BE, terms.mass, max_mass=1e6
        )
        expected = np.linalg.inv(terms.J_BE @ np.linalg.inv(terms.mass) @ terms.J_BE.T)
        assert not singular
        np.testing.assert_allclose(inertia, expected, rtol=1e-7, atol=1e-9)


def test_inertia_near_the_home_posture_is_not_bounded(model):
    for q, v, _ in configurations(20, 2):
        terms = model.calc(q, v)
        assert not dp.calc_operational_space_inertia(terms.J_BE, terms.mass)[1]


def test_inertia_of_a_stretched_arm_is_bounded(model):
    terms = model.calc(np.zeros(7), np.zeros(7))
    inertia, singular = dp.calc_operational_space_inertia(
        terms.J_BE, terms.mass, max_mass=50.0, length=0.2
    )
    assert singular
    scale = np.diag([1, 1, 1, 5, 5, 5.0])
    masses = np.linalg.eigvalsh(scale @ inertia @ scale)
    assert masses.max() <= 1.125 * 50 * (1 + 1e-9)
    assert masses.min() >= -1e-9


def test_mass_matrix_must_be_positive_definite(model):
    terms = model.calc(Q_HOME, np.zeros(7))
    with pytest.raises(ValueError, match="positive definite"):
        dp.calc_operational_space_inertia(terms.J_BE, -terms.mass)


def test_commanded_acceleration_is_what_the_arm_does(model):
    dut = dp.OperationalSpaceController(unlimited())
    for q, v, rng in configurations(30, 3):
        terms = model.calc(q, v)
        error = 0.005 * rng.standard_normal(6)
        velocity = 0.1 * rng.standard_normal(6)
        feed = rng.standard_normal(6)
        out = dut.update(
            **arguments(
                terms,
                q,
                v,
                motion_error=error[:3],
                rotation_error=error[3:],
                proxy_velocity=velocity,
                proxy_acceleration=feed,
            ),
            state=dut.make_state(),
        )
        stiffness = np.repeat([500.0, 600.0], 3)
        damping = np.repeat([40.0, 38.0], 3)
        twist = terms.J_BE @ v
        expected = feed - stiffness * error - damping * (twist - velocity)
        np.testing.assert_allclose(
            tip_acceleration(terms, out.torque), expected, atol=1e-6
        )
        np.testing.assert_allclose(out.motion_force, expected[:3], atol=1e-9)


def test_posture_torque_gives_no_task_acceleration(model):
    with_posture = dp.OperationalSpaceController(unlimited())
    without = dp.OperationalSpaceController(
        unlimited(posture_stiffness=0.0, posture_damping=0.0)
    )
    for q, v, _ in configurations(20, 4):
        terms = model.calc(q, v)
        torque = [
            dut.update(**arguments(terms, q, v), state=dut.make_state()).torque
            for dut in (with_posture, without)
        ]
        null_torque = torque[0] - torque[1]
        jacobian, mass = terms.J_BE, terms.mass
        inverse = np.linalg.inv(mass)
        inertia = np.linalg.inv(jacobian @ inverse @ jacobian.T)
        null = np.eye(7) - inverse @ jacobian.T @ inertia @ jacobian
        posture = mass @ (25 * (with_posture.params.q_rest - q) - 10 * v)
        np.testing.assert_allclose(null_torque, null.T @ posture, atol=1e-6)
        assert np.linalg.norm(null_torque) > 1e-3
        np.testing.assert_allclose(jacobian @ inverse @ null_torque, ZERO6, atol=1e-6)


def test_printed_motion_force_carries_lambda(model):
    terms = model.calc(Q_HOME, np.zeros(7))
    dut = dp.OperationalSpaceController(unlimited(unit_mass_motion_force=False))
    error = np.array([0.0, 0.0, -0.01])
    out = dut.update(
        **arguments(terms, Q_HOME, np.zeros(7), motion_error=error),
        state=dut.make_state(),
    )
    inertia, _ = dp.calc_operational_space_inertia(terms.J_BE, terms.mass)
    np.testing.assert_allclose(
        out.motion_force, inertia[:3, :3] @ (-500 * error), rtol=1e-9
    )


def test_force_is_commanded_in_static_contact(model):
    terms = model.calc(Q_HOME, np.zeros(7))
    wrench = np.array([0, 0, -8.0, 0, 0, 0])
    dut = dp.OperationalSpaceController(unlimited())
    out = dut.update(
        **arguments(
            terms,
            Q_HOME,
            np.zeros(7),
            reference_force=wrench[:3],
            sensed_wrench=wrench,
            force_selection=np.diag([0.0, 0.0, 1.0]),
        ),
        state=dut.make_state(),
    )
    np.testing.assert_allclose(out.contact_force, wrench[:3], atol=1e-12)
    np.testing.assert_allclose(
        tip_acceleration(terms, out.torque, wrench), ZERO6, atol=1e-7
    )


def test_starts_at_gravity_compensation_within_the_rate_limit(model):
    terms = model.calc(Q_HOME, np.zeros(7))
    dut = dp.OperationalSpaceController()
    state = dut.make_state()
    last = -terms.gravity
    for _ in range(100):
        out = dut.update(
            **arguments(
                terms, Q_HOME, np.zeros(7), motion_error=np.array([0.0, 0.0, -0.5])
            ),
            state=state,
        )
        assert np.abs(out.torque - last).max() <= 1 + 1e-9
        assert np.all(np.abs(out.torque) <= dut.params.torque_limit)
        last = out.torque
    assert state.rate_limited > 0


def test_bad_shapes_are_named(model):
    terms = model.calc(Q_HOME, np.zeros(7))
    dut = dp.OperationalSpaceController()
    values = arguments(terms, Q_HOME, np.zeros(7))
    with pytest.raises(ValueError, match=r"jacobian: expected shape \(6, 7\)"):
        dut.update(**values | {"jacobian": np.eye(6)}, state=dut.make_state())
    with pytest.raises(ValueError, match=r"q: expected shape \(7,\)"):
        dut.update(**values | {"q": np.zeros(6)}, state=dut.make_state())


def test_not_finite_is_refused_and_counted(model):
    terms = model.calc(Q_HOME, np.zeros(7))
    dut = dp.OperationalSpaceController()
    state = dut.make_state()
    values = arguments(terms, Q_HOME, np.full(7, np.nan))
    out = dut.update(**values, state=state)
    np.testing.assert_array_equal(out.torque, -terms.gravity)
    assert state.bad_inputs == 1


def test_params_are_values():
    params = dp.OperationalSpaceControllerParams(force_gain=1.0)
    params.force_passivity.max_damping = 300.0
    assert pickle.loads(pickle.dumps(params)) == params
    assert copy.deepcopy(params) == params
    assert params != dp.OperationalSpaceControllerParams()
    with pytest.raises(TypeError, match="no_such_field"):
        dp.OperationalSpaceControllerParams(no_such_field=1)
    with pytest.raises(ValueError, match="`max_mass` expected a finite value > 0"):
        dp.OperationalSpaceControllerParams(max_mass=0.0)


def test_state_is_copied_by_value(model):
    terms = model.calc(Q_HOME, np.zeros(7))
    dut = dp.OperationalSpaceController()
    state = dut.make_state()
    values = arguments(
        terms, Q_HOME, np.zeros(7), motion_error=np.array([0.0, 0.0, -0.01])
    )
    dut.update(**values, state=state)
    fork = copy.deepcopy(state)
    first = dut.update(**values, state=state).torque
    np.testing.assert_array_equal(dut.update(**values, state=fork).torque, first)
