# SPDX-License-Identifier: BSD-3-Clause
import json
import math

import numpy as np
import pytest

from dual_proxy import _core
from dual_proxy.metrics import (
    METRICS,
    compute_metrics,
    describe_broken_limits,
    metrics_out_of_limits,
    normal_error_deg,
)
from dual_proxy.scenario import load_scenario

# From the contact to the loss of it, s.
CONTACT = 13.2


@pytest.fixture
def scenario():
    return load_scenario("plane")


@pytest.fixture
def measure(scenario, make_log):
    def measure(change=None, **overrides):
        dut = scenario.with_overrides(overrides)
        return compute_metrics(make_log(dut, change), dut, wall_s=4.0)

    return measure


def touching(log):
    return log.contact_dimension[:, 0] > 0


def test_keys_are_all_of_the_table_and_json_is_valid(measure):
    values = measure()
    assert list(values) == list(METRICS)
    assert json.loads(json.dumps(values, allow_nan=False)) == values


def test_json_of_a_native_run_is_the_same_text(measure):
    """As `Run.save` and its `json.dumps` write it."""
    numbers = np.random.default_rng(1).integers(0, 2**64, 5000, np.uint64)
    numbers = numbers.view(np.float64)
    numbers = [*numbers[np.isfinite(numbers)].tolist(), 1e-4, 1e16, 0.1, 5.0, -0.0]
    for values in (measure(), {f"number_{i}": x for i, x in enumerate(numbers)}, {}):
        text = _core._metrics_json(list(values.items()))
        assert text == json.dumps(values, indent=2, allow_nan=False) + "\n"


def test_perfect_run(measure):
    values = measure()
    for key in (
        "position_rms_free_m",
        "position_rms_free_delay_compensated_m",
        "position_rms_contact_m",
        "haptic_force_rms_free_N",
        "normal_error_mean_deg",
        "normal_error_p95_deg",
        "detection_latency_ms",
        "contact_losses",
        "haptic_force_ac_N",
        "contact_force_ac_N",
        "link_messages_dropped",
    ):
        # arccos near 1 turns rounding of 1e-16 into 1e-6 deg.
        assert values[key] == pytest.approx(0.0, abs=1e-6), key
    assert values["dimension_accuracy"] == 1.0
    assert values["dimension_accuracy_total"] == 1.0
    assert values["false_contact_share"] == 0.0
    assert values["limits_broken"] == []
    assert metrics_out_of_limits(values) == []
    assert values["contact_force_max_N"] == 6.5
    assert values["finite"] is True
    assert values["sim_s"] == pytest.approx(20.0)
    assert values["wall_s"] == 4.0
    assert values["real_time_factor"] == pytest.approx(5.0)


def test_position_error_is_split_by_the_true_normal(measure):
    def change(log):
        log.robot_position += [0.003, -0.001, 0.012]
        # Free motion is no part of it.
        log.robot_position[~touching(log)] += 0.5

    values = measure(change)
    # RMS of x and of y, then their mean; z is the contact.
    assert values["position_rms_free_m"] == pytest.approx(0.002)
    assert values["position_rms_contact_m"] == pytest.approx(0.012)


def test_delay_compensation_removes_exactly_the_delay(measure):
    def change(log):
        x = 0.02 * np.sin(log.time)
        log.device_position[:, 0] = x / 2.5
        log.robot_position[:, 0] = 0.45 + 0.02 * np.sin(log.time - 0.15)

    values = measure(change, **{"link.delay": 0.15})
    assert values["position_rms_free_delay_compensated_m"] < 1e-6
    # 0.02 * 0.15 * cos(t), RMS over whole periods 0.0021, halved by axis y.
    assert values["position_rms_free_m"] == pytest.approx(0.00106, rel=0.05)


def test_rotated_device_frame_changes_nothing(measure, scenario):
    def change(log):
        log.robot_position += [0.003, -0.001, 0.012]
        log.device_force[:] = [1.0, -2.0, 3.0] @ R_DB.T

    R_DB = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    values = measure(change, **{"map.R_DB": R_DB})
    assert values["position_rms_contact_m"] == pytest.approx(0.012)
    assert values["haptic_force_rms_free_N"] == pytest.approx(math.sqrt(5.0))


def test_force_tracking_looks_at_force_space_only(measure):
    def change(log):
        log.sensed_force[:] = [5.0, 5.0, -7.0]
        log.reference_force[:, 2] = -6.5

    assert measure(change)["force_tracking_rms_N"] == pytest.approx(0.5)


def test_haptic_force(measure):
    def change(log):
        log.device_force[:] = [0.6, 0.8, 6.0]
        log.device_force[0] = [0.0, 11.0, 0.0]  # Before contact.
        square = np.where(np.arange(len(log.time)) % 100 < 50, 1.0, -1.0)
        log.device_force[:, 2] += 0.3 * square

    values = measure(change)
    assert values["haptic_force_rms_free_N"] == pytest.approx(1.0)
    assert values["haptic_force_std_contact_N"] == pytest.approx(0.3, rel=1e-3)
    # Each window of 0.5 s holds whole periods of 0.1 s.
    assert values["haptic_force_ac_N"] == pytest.approx(0.3, rel=0.02)
    assert values["haptic_force_max_N"] == pytest.approx(11.0, abs=0.01)


def test_ac_removes_a_slow_ramp(measure):
    def change(log):
        log.device_force[:, 2] = log.time

    values = measure(change)
    assert values["haptic_force_ac_N"] < 0.03
    assert values["haptic_force_std_contact_N"] > 3.0


@pytest.mark.parametrize(("delay", "start"), [(0.0, 4.0), (1.5, 8.5)])
def test_steady_contact_begins_and_ends_where_it_should(measure, delay, start):
    def disturb(at):
        def change(log):
            near = np.abs(log.time - at) < 0.02
            log.device_force[near, 0] = 5.0

        return measure(change, **{"link.delay": delay})["haptic_force_ac_N"]

    assert disturb(start - 0.1) < 1e-6
    assert disturb(start + 0.1) > 0.1
    assert disturb(15.9) > 0.1
    assert disturb(16.1) < 1e-6


def test_normal_error_has_no_sign_and_counts_only_real_contact(measure):
    def change(log):
        angle = math.radians(10.0)
        log.force_direction[:] = [math.sin(angle), 0.0, math.cos(angle)]
        log.dimension[:] = 1

    values = measure(change)
    assert values["normal_error_mean_deg"] == pytest.approx(10.0)
    assert values["normal_error_p95_deg"] == pytest.approx(10.0)


def test_two_true_normals_are_compared_with_the_force_space(measure):
    def change(log):
        on = touching(log)
        log.contact_dimension[on] = 2
        log.dimension[on] = 2
        log.contact_normal[on] = [0.6, 0.0, -0.8]
        selection = np.diag([1.0, 0.0, 1.0])
        log.force_selection[on] = selection.reshape(9)

    values = measure(change)
    assert values["normal_error_mean_deg"] == pytest.approx(0.0, abs=1e-5)
    assert values["dimension_accuracy"] == 1.0


def test_late_detection_costs_accuracy(measure):
    def change(log):
        late = touching(log) & (log.time < 3.132 - 1e-9)
        log.dimension[late] = 0

    values = measure(change)
    assert values["detection_latency_ms"] == pytest.approx(132.0)
    assert values["dimension_accuracy"] == pytest.approx(1.0 - 0.132 / CONTACT)


def test_latency_is_not_flattered_by_a_bouncing_onset(measure):
    def change(log):
        bounce = (log.time > 3.005) & (log.time < 3.02)
        log.contact_force[bounce] = 0.0
        log.dimension[log.time < 3.1 - 1e-9] = 0

    assert measure(change)["detection_latency_ms"] == pytest.approx(100.0)


def test_contact_losses_count_while_the_hand_presses(measure):
    def change(log):
        for at in (5.0, 7.0):
            log.contact_force[np.abs(log.time - at) < 0.01] = 0.0
        # Not lost, only light.
        log.contact_force[np.abs(log.time - 9.0) < 0.01, 2] = -0.3
        # The hand has begun to lift.
        log.contact_force[np.abs(log.time - 16.1) < 0.01] = 0.0

    assert measure(change)["contact_losses"] == 2


def test_energy_and_dropped_messages(measure):
    def change(log):
        log.observed_energy[7000] = -0.25
        log.robot_link_dropped[9000:] = 3
        log.haptic_link_dropped[12000:] = 4

    values = measure(change)
    assert values["observed_energy_min_J"] == -0.25
    assert values["link_messages_dropped"] == 7


def test_no_contact_gives_none_where_there_is_nothing_to_measure(measure):
    def change(log):
        for name in ("contact_force", "contact_normal", "dimension"):
            getattr(log, name)[:] = 0.0

    values = measure(change)
    assert values["contact_force_max_N"] == 0.0
    assert values["contact_losses"] == 0
    for key in (
        "position_rms_free_m",
        "force_tracking_rms_N",
        "haptic_force_std_contact_N",
        "normal_error_mean_deg",
        "dimension_accuracy",
        "detection_latency_ms",
        "haptic_force_ac_N",
    ):
        assert values[key] is None, key


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_not_finite_is_reported_and_stays_out_of_json(measure, bad):
    def change(log):
        log.device_force[5000, 0] = bad

    values = measure(change)
    assert values["finite"] is False
    assert values["haptic_force_max_N"] is None
    assert values["contact_force_max_N"] == 6.5
    json.dumps(values, allow_nan=False)


def test_broken_limits_are_named_and_said_where(scenario, make_log):
    def change(log):
        log.joint_velocity[5000, 3] = -4.35
        log.torque[7000:, 6] = 12.5

    log = make_log(scenario, change)
    values = compute_metrics(log, scenario)
    assert values["joint_speed_share_max"] == pytest.approx(2.0)
    assert values["limits_broken"] == ["joint_speed", "torque", "torque_rate"]
    assert json.loads(json.dumps(values)) == values
    assert describe_broken_limits(log, scenario) == [
        "joint 4 speed 4.35 rad/s at 5 s (limit 2.175)",
        "joint 7 torque 12.5 N m at 7 s (limit 12)",
        "joint 7 torque rate 12500 N m/s at 7 s (limit 1000)",
    ]
    out = metrics_out_of_limits(values)
    assert [key for key in out if METRICS[key].limit] == [
        *("joint_speed_share_max", "torque_share_max", "torque_rate_max_Nm_s")
    ]


def test_a_thinned_log_has_no_torque_rate(scenario, make_log):
    def change(log):
        log.torque[:, 1] = np.cumsum(np.full(len(log.time), 0.9e-3))

    log = make_log(scenario, change)
    rate = compute_metrics(log, scenario)["torque_rate_max_Nm_s"]
    assert rate == pytest.approx(0.9)
    assert compute_metrics(log.iloc[::2], scenario)["torque_rate_max_Nm_s"] is None
    # The plant may be stepped, and logged, more often than torques change.
    scenario.controller.period = 2e-3
    rate = compute_metrics(log, scenario)["torque_rate_max_Nm_s"]
    assert rate == pytest.approx(0.45)


def test_a_log_cut_short_is_measured(scenario, make_log):
    log = make_log(scenario)
    for rows in (0, 1, 2, 3500):
        values = compute_metrics(log.iloc[:rows], scenario)
        assert values["finite"] is True
        assert values["wall_s"] is None
    assert values["contact_force_max_N"] == 6.5
    assert values["haptic_force_ac_N"] is None  # Not steady yet.


def test_normal_error_needs_its_signals_only(scenario, make_log):
    log = make_log(scenario)
    needed = ["contact_force", "contact_normal", "force_direction", "force_selection"]
    columns = [c for c in log if c.startswith(tuple(needed)) or "dimension" in c]
    error = normal_error_deg(log[columns])
    np.testing.assert_array_equal(error, normal_error_deg(log))
    assert np.isfinite(error).any()
    assert np.isnan(normal_error_deg(log.drop(columns="contact_force_x"))).all()


def test_what_the_log_has_not_is_none(scenario, make_log):
    """As of a scheme without a filter, and with nothing but the truth."""
    log = make_log(scenario)
    of_filter = ["dimension", "force_direction_x", "force_direction_y"]
    whole = compute_metrics(log, scenario)
    without = compute_metrics(
        log.drop(columns=[*of_filter, "force_direction_z"]), scenario
    )
    assert list(without) == list(METRICS)
    gone = {key for key, value in without.items() if value != whole[key]}
    assert gone == {
        "normal_error_mean_deg",
        "normal_error_p95_deg",
        "dimension_accuracy",
        "dimension_accuracy_total",
        "false_contact_share",
        "detection_latency_ms",
        "force_tracking_rms_N",
    }
    assert all(without[key] is None for key in gone)
    # Without a contact's truth there is nothing to compare with.
    columns = [c for c in log if not c.startswith("contact_")]
    few = compute_metrics(log[columns], scenario)
    assert list(few) == list(METRICS)
    assert few["contact_force_max_N"] is None
    assert few["position_rms_free_m"] is None
    assert few["joint_speed_share_max"] == whole["joint_speed_share_max"]
    assert few["finite"] is True
    json.dumps(few, allow_nan=False)
