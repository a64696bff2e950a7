# SPDX-License-Identifier: BSD-3-Clause
"""What a station logs: when forces act, and what was counted."""

import numpy as np
import pytest

from dual_proxy import _core
from dual_proxy.log import SIGNALS, counts, signal, signals
from dual_proxy.scenario import SCHEMES, load_scenario
from dual_proxy.station import build_station

# The table is touched at once, so that the hand soon feels something.
SOON = {
    "scene.start_position": [0.45, 0.0, 0.415],
    "operator.waypoints": [
        {"time": 0.0, "position": [0.45, 0.0, 0.415]},
        {"time": 0.3, "position": [0.45, 0.0, 0.39]},
    ],
}


# What changes with a message only; position_position's force goes with the hand.
USED = {
    "dual_proxy": "haptic_proxy_position",
    "position_force": "haptic_reference_force",
}


def run(scheme, duration, **changes):
    scenario = load_scenario("plane").with_overrides({"scheme": scheme, **changes})
    station = build_station(scenario)
    station.advance_to(duration)
    return station, station.log_frame()


def device_positions(station, log, latency):
    """Where the handle is read in each step if what the device is told in a step
    acts on it `latency` steps later."""
    device = _core.SimulatedHapticDevice(station.scenario.device)
    state = device.make_state()
    told = signal(log, "device_force")
    positions = []
    for row in range(len(log)):
        positions.append(np.array(state.read_pose.p))
        # A row shows the step a period earlier.
        time = row * station.scenario.control_period
        position, velocity = station._path.calc(time)
        force = told[row - latency] if row >= latency else np.zeros(3)
        device.update(
            position,
            station._path.calc_rotation(time),
            velocity,
            np.concatenate([force, np.zeros(3)]),
            state,
        )
    return np.array(positions)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_force_on_the_hand_acts_one_step_after_its_message(scheme):
    station, log = run(scheme, 1.0, **{**SOON, "sensor.tare": False})
    # The message is used in the step in which it comes.
    came = np.diff(log.haptic_link_age, prepend=0.0) < 0
    assert 20 < np.sum(came) < 60
    if used := USED.get(scheme):
        change = np.any(np.diff(signal(log, used), axis=0, prepend=np.nan) != 0, axis=1)
        connected = log.haptic_link_status.to_numpy() == 1
        first = np.flatnonzero(connected)[0]
        np.testing.assert_array_equal(change[first + 1 :], came[first + 1 :])
    # What it commands acts on the device in the next.
    assert np.abs(log.device_force_z).max() > 0.5
    measured = signal(log, "device_position")
    np.testing.assert_array_equal(device_positions(station, log, 1), measured)
    for other in (0, 2):
        assert np.any(device_positions(station, log, other) != measured)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_all_that_is_counted_is_logged(scheme):
    station, log = run(scheme, 0.6, **{"link.loss": 0.3})
    counters = [name for name in signals(log.columns) if SIGNALS[name].counter]
    of_filter = {name for name in counters if name.startswith("filter_")}
    assert len(of_filter) == (3 if station.scenario.uses_selections else 0)
    assert len(counters) - len(of_filter) == 28
    for name in counters:
        assert np.issubdtype(log[name].dtype, np.integer)
        assert np.all(np.diff(log[name]) >= 0), name
    totals = counts(log)
    assert set(totals) >= {
        "to_robot_lost",
        "to_device_lost",
        "robot_link_gaps",
        "haptic_link_gaps",
    }
    assert totals["to_robot_lost"] >= totals["robot_link_gaps"] > 3
    assert 0 not in totals.values()


def test_refused_cycle_counts_once_and_is_seen_in_the_log():
    station = build_station(load_scenario("plane"), wiring="systems")
    station.advance_to(0.05)
    context = station.simulator.get_mutable_context()
    side = station.diagram.GetSubsystemByName("robot_side")
    # Proxy and controller refuse it both.
    side.GetInputPort("force_selection").FixValue(
        side.GetMyMutableContextFromRoot(context), np.full(9, np.nan)
    )
    station.advance_to(0.06)
    log = station.log_frame()
    bad = log.robot_bad_inputs.to_numpy()
    assert bad[48] == 0
    assert bad[-1] == counts(log)["robot_bad_inputs"] == 10
    np.testing.assert_array_equal(np.diff(bad[-10:]), 1)


def test_log_has_the_control_period_whatever_the_plants_step():
    for control_period, time_step in ((1e-3, 1 / 240), (2e-3, 1e-3)):
        _, log = run(
            "dual_proxy",
            0.1,
            **{"control_period": control_period, "scene.time_step": time_step},
        )
        rows = round(0.1 / control_period)
        np.testing.assert_allclose(
            log.index, np.arange(1, rows + 1) * control_period, atol=1e-12
        )
        assert np.all(np.isfinite(log.to_numpy()))
