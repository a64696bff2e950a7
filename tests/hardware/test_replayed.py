# SPDX-License-Identifier: BSD-3-Clause
"""What a side's log has of device and sensor, again in real time."""

import math
import time

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

import dual_proxy as dp
from dual_proxy.cli import main
from dual_proxy.hardware.arms import SimulatedPanda
from dual_proxy.hardware.devices import SimulatedHand, is_reliable
from dual_proxy.hardware.events import Events
from dual_proxy.hardware.haptic_side import HAPTIC_COLUMNS, HapticSideProcess
from dual_proxy.hardware.replayed import ReplayedHand, ReplayedSensor
from dual_proxy.hardware.robot_side import ROBOT_COLUMNS, RobotSideProcess
from dual_proxy.hardware.side_log import SideLog, read_side_log
from dual_proxy.hardware.systems import HapticDevice

SECONDS = 1.0


def rows_of(path, side, columns):
    _, cycles = read_side_log(path, {side: columns})
    return np.array([cycle.values for cycle in cycles])


def quiet(side):
    return Events(side, tell=lambda _: None)


@pytest.fixture(scope="module")
def hand_log(tmp_path_factory):
    way = [{"time": i, "position": [0.45, 0.0, 0.48 - 0.05 * i]} for i in range(2)]
    scenario = dp.load_scenario("plane").with_overrides({"operator.waypoints": way})
    path = tmp_path_factory.mktemp("hand") / "hand.mcap"
    hand = SimulatedHand(scenario)
    side = HapticSideProcess(scenario, hand, None, events=quiet("haptic"), log=path)
    assert side.run(SECONDS)
    return path


@pytest.fixture(scope="module")
def arm_log(tmp_path_factory):
    scenario = dp.load_scenario("plane")
    path = tmp_path_factory.mktemp("arm") / "arm.mcap"
    side = RobotSideProcess(
        scenario,
        SimulatedPanda(scenario, patience=0.4),
        None,
        confirm=lambda _: True,
        events=quiet("robot"),
        log=path,
    )
    assert side.run(SECONDS)
    return path


X = HAPTIC_COLUMNS.index("x")
FX = ROBOT_COLUMNS.index("fx")


def find(logged, played):
    """Return of each row, in order, the next in the log with the same numbers."""
    rows = [np.array(row).tobytes() for row in logged]
    places = [0]
    for row in played:
        places.append(rows.index(np.array(row).tobytes(), places[-1]))
    return places[1:]


def test_a_replayed_hand_does_what_the_hand_did(hand_log):
    logged = rows_of(hand_log, "haptic", HAPTIC_COLUMNS)
    hand = ReplayedHand(hand_log)
    nothing = hand.read()
    assert not nothing.valid
    assert nothing.time == -math.inf
    hand.open()
    readings, late = [], []
    begin = time.monotonic()
    while hand.fault == "":
        readings.append(hand.read())
        late.append(time.monotonic() - readings[-1].time)
        hand.write(np.ones(6))
        time.sleep(0.002)
    assert time.monotonic() - begin > 0.9 * (logged[-1, 0] - logged[0, 0])
    print(f"{len(readings)} readings, age {1e3 * np.median(late):.1f} ms")
    places = find(
        logged[:, X : X + 12], [[*r.pose.p, *np.ravel(r.pose.R)] for r in readings]
    )
    assert len(set(places)) > 10
    times = np.array([reading.time for reading in readings])
    times += logged[0, 1] - times[0]
    assert np.abs(times[:, None] - logged[:, 1]).min(axis=1).max() < 1e-6
    moved = readings[-1].pose.p - readings[0].pose.p
    assert np.linalg.norm(moved) > 0.001
    # At the end it goes stale, and it is not begun anew.
    assert "hand.mcap: the log has ended" in hand.fault
    time.sleep(0.05)
    assert not is_reliable(hand.read(), time.monotonic())
    hand.close()
    with pytest.raises(dp.DriverError, match="the log has ended"):
        hand.open()


def test_a_replayed_hand_in_a_diagram(hand_log):
    logged = rows_of(hand_log, "haptic", HAPTIC_COLUMNS)
    hand = ReplayedHand(hand_log)
    hand.open()
    system = HapticDevice(hand)
    simulator = Simulator(system)
    simulator.set_target_realtime_rate(1)
    places = [0]
    for end in (0.3, 0.6):
        simulator.AdvanceTo(end)
        pose = system.GetOutputPort("device_pose").Eval(simulator.get_context())
        places += find(logged[:, X : X + 3], [pose.translation()])
    assert places[2] > places[1] > 10


def test_what_failed_in_the_log_fails_again_and_time_goes_on(tmp_path):
    """Unplugged for 0.1 s; the loop closes it and opens it again meanwhile."""
    path = tmp_path / "log.mcap"
    log = SideLog(path, "haptic", {}, HAPTIC_COLUMNS)
    for i in range(300):
        valid = not 100 <= i < 200
        head = [5 + 1e-3 * i, 5 + 1e-3 * (i if valid else 99), valid, valid, True]
        rest = [1e-5 * i, 0, 0, *np.eye(3).ravel(), *np.zeros(6), 0.01, i >= 250]
        log.cycle(head[0], ([*head, *rest], np.zeros(7)))
    log.close()
    hand = ReplayedHand(path)
    hand.open()
    seen = []
    while not hand.fault:
        reading = hand.read()
        seen.append((reading.valid, round(reading.pose.p[0] / 1e-5), reading.clutch))
        if not reading.valid:
            hand.close()
            hand.open()
        time.sleep(0.001)
    assert [valid for valid, _, _ in seen] == [not 100 <= i < 200 for _, i, _ in seen]
    assert [clutch for _, _, clutch in seen] == [i >= 250 for _, i, _ in seen]
    steps = [i for _, i, _ in seen]
    assert steps == sorted(steps)
    assert min(steps) < 50


def test_a_replayed_sensor_gives_what_was_logged(arm_log):
    logged = rows_of(arm_log, "robot", ROBOT_COLUMNS)
    sensor = ReplayedSensor(arm_log)
    assert not sensor.read().valid
    sensor.open()
    readings = []
    while not sensor.fault:
        readings.append(sensor.read())
        time.sleep(0.002)
    places = find(logged[:, FX : FX + 6], [reading.value for reading in readings])
    assert len(set(places)) > 10
    assert all(reading.valid for reading in readings)
    end = readings[-1].time - readings[0].time
    assert end == pytest.approx(logged[-1, 22] - logged[0, 22], abs=0.4)
    sensor.close()
    assert not sensor.read().valid


def test_another_log_is_refused(hand_log, arm_log, tmp_path):
    with pytest.raises(dp.DriverError, match="expected the log of a haptic side"):
        ReplayedHand(arm_log)
    with pytest.raises(dp.DriverError, match="expected the log of a robot side"):
        ReplayedSensor(hand_log)
    empty = tmp_path / "empty.mcap"
    SideLog(empty, "robot", {}, ROBOT_COLUMNS).close()
    with pytest.raises(dp.DriverError, match="expected a log with cycles"):
        ReplayedSensor(empty)


def test_on_the_command_line(hand_log, arm_log, port, tmp_path, capsys):
    pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")
    out = tmp_path / "out.mcap"
    end = ["--insecure", "--duration", "0.7", "--log", str(out)]
    haptic = ["haptic-side", "outer_corner", "--connect", f"127.0.0.1:{port}", *end]
    robot = ["robot-side", "outer_corner", "--listen", f"127.0.0.1:{port}", *end]

    assert main([*haptic, "--device", f"replay:{hand_log}"]) == 0
    logged = rows_of(hand_log, "haptic", HAPTIC_COLUMNS)
    played = rows_of(out, "haptic", HAPTIC_COLUMNS)
    places = find(logged[:, X : X + 18], played[:, X : X + 18])
    assert len(set(places)) > 10
    assert main(["run", "--replay", str(out)]) == 0
    out.unlink()

    robot += ["--arm", "simulated", "--yes"]
    assert main([*robot, "--sensor", f"replay:{arm_log}"]) in (0, 3)
    logged = rows_of(arm_log, "robot", ROBOT_COLUMNS)
    played = rows_of(out, "robot", ROBOT_COLUMNS)
    assert len(set(find(logged[:, FX : FX + 6], played[:, FX : FX + 6]))) > 10
    capsys.readouterr()

    for given, said in (
        ("x", "--device: expected omega, simulated or replay:LOG, got 'x'"),
        ("replay:", "--device: expected replay:LOG, got 'replay:'"),
        (f"replay:{arm_log}", "arm.mcap: expected the log of a haptic side"),
        (f"replay:{tmp_path / 'none'}", "none: No such file"),
    ):
        assert main([*haptic, "--device", given]) in (2, 3)
        assert said in capsys.readouterr().err
    robot[robot.index("simulated")] = "arm.lab"
    assert main([*robot, "--sensor", f"replay:{arm_log}"]) == 2
    assert "with --arm simulated only" in capsys.readouterr().err
