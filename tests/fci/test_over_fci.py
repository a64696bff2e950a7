# SPDX-License-Identifier: BSD-3-Clause
"""Teleoperated contact over the real protocols (fci_rig.py).

`make test` runs what is not marked `hardware`, on machines that may be busy: an arm
stops there more often than it was made to. `make hardware-test` runs the minute.
"""

import signal
import time

import numpy as np
import pytest
from fci_rig import CPP_SIDE, ac_rms, pressing_path

import dual_proxy as dp
from dual_proxy.hardware.replay import replay_side

# m: what counts as travelling by itself.
TRAVEL = 0.002


def size(force):
    return np.linalg.norm(force, axis=1)


def test_an_arm_that_was_stalled_goes_on(rig, sdk_folder):
    """50 ms without a torque are a reflex. It is taken back, the arm does not travel,
    and follows a hand that presses on."""
    sensor = rig.start_arm()
    hand = [(0, 0, 0, 0), (0.5, 0, 0, 0), (2, 0, 0, -0.022), (3.5, 0, 0, -0.044)]
    hand += [(6, 0, 0, -0.044), (12, 0, 0, -0.08), (30, 0.01, 0, -0.08)]
    rig.start_sides(sensor, sdk_folder, hand)
    time.sleep(5)
    stalled = time.monotonic()
    rig.robot.process.send_signal(signal.SIGSTOP)
    time.sleep(0.05)
    rig.robot.process.send_signal(signal.SIGCONT)
    rig.robot.wait_for("recovered")
    recovered = time.monotonic()
    time.sleep(max(0.0, 10 - (recovered - stalled)))
    end = time.monotonic()
    rig.finish()
    print(rig.robot.text())
    print(f"recovered {1e3 * (recovered - stalled):.0f} ms after the stall began")
    assert "reflex" in rig.robot.text()
    before = (rig.time > stalled - 1) & (rig.time < stalled)
    own = (rig.time >= stalled) & (rig.time < recovered + 0.1)
    after = (rig.time >= recovered) & (rig.time < end)
    pressed, again = size(rig.force[before]), size(rig.force[after])
    travelled = size(rig.place[own] - rig.place[own][0]).max()
    print(
        f"{pressed.mean():.2f} N before; {1e3 * travelled:.2f} mm by itself; "
        f"{again.max():.2f} N at most, {again[-500:].mean():.2f} N in the end"
    )
    assert pressed.min() > 1
    assert travelled < TRAVEL
    assert again[-500:].min() > 1
    assert again.max() < 1.5 * dp.load_scenario("plane").robot_proxy.max_force
    # Nothing that went in or out is lost, and the cycle does the same again.
    for log in (rig.log, rig.folder / "haptic.mcap"):
        replayed = replay_side(log)
        assert replayed.seconds > 10
        assert replayed.different == 0


@pytest.mark.hardware
def test_a_minute_of_contact(rig, sdk_folder):
    sensor = rig.start_arm()
    rig.start_sides(sensor, sdk_folder, pressing_path(70))
    begin = time.monotonic()
    time.sleep(67)
    end = time.monotonic()
    rig.finish()
    print(rig.robot.text(), rig.haptic.text(), sep="\n")
    check_contact(rig, begin, end)
    angles = []
    wall = time.time() - time.monotonic()
    touched = rig.time[size(rig.force) > 1][0]
    for stamp, state in rig.states():
        if touched + 1.15 < stamp - wall < end:
            assert state["dimension"] == 1
            normal = np.linalg.eigh(np.array(state["force_selection"]))[1][:, -1]
            angles.append(np.degrees(np.arccos(min(1.0, abs(normal[2])))))
    print(f"{rig.lost_messages():.0%} of the hand's messages lost")
    print(f"normal {np.mean(angles):.2f} deg off, {np.max(angles):.2f} at most")
    assert np.mean(angles) < 1
    assert "reflex" not in rig.robot.text()


@pytest.mark.hardware
def test_a_minute_of_contact_in_cpp(rig):
    """With the arm's own estimate of the force; libfranka's headers are needed."""
    if not CPP_SIDE.exists():
        pytest.skip(f"{CPP_SIDE} is not built: CMake finds no libfranka, or no Drake")
    rig.start_arm()
    begin = time.monotonic()
    rig.run_cpp_side(pressing_path(75), 72)
    end = time.monotonic()
    rig.finish()
    print(rig.robot.text())
    check_contact(rig, begin, end)
    assert " 0 reflexes" in rig.robot.text().splitlines()[-2]


def check_contact(rig, begin, end):
    """60 s of contact that is never lost, with less than 0.2 N of AC."""
    force = size(rig.force)
    touched = rig.time[(rig.time > begin) & (force > 1)][0]
    steady = (rig.time > touched + 1.15) & (rig.time < end)
    seconds = np.ptp(rig.time[steady])
    lost = int((force[steady] < 0.1).sum())
    print(
        f"{seconds:.1f} s of contact, {lost} ms of it lost; first touch "
        f"{force[rig.time < touched + 1.15].max():.1f} N at most, then "
        f"{force[steady].mean():.2f} N, AC {ac_rms(force[steady]):.3f} N"
    )
    assert seconds > 60
    assert lost == 0
    assert ac_rms(force[steady]) < 0.2
