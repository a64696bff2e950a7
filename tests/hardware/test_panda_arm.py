# SPDX-License-Identifier: BSD-3-Clause
"""PandaArm over a double of panda-python's libfranka: nothing here speaks the protocol
of the original Panda, and no arm has been tried."""

import enum
import math
import sys
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

import dual_proxy as dp
from dual_proxy.hardware.arms import ArmFault, PandaArm, SimulatedPanda
from dual_proxy.hardware.events import Events
from dual_proxy.hardware.replay import replay_side
from dual_proxy.hardware.robot_side import RobotSideProcess
from dual_proxy.panda import Q_REST


class RobotMode(enum.Enum):
    kIdle = 1
    kReflex = 4


class Torques:
    def __init__(self, torques):
        assert len(torques) == 7
        assert all(isinstance(torque, float) for torque in torques)
        self.tau_J = torques
        self.motion_finished = False


class Robot:
    """Calls for torques as libfranka does, of a simulated arm or of one that stands."""

    last = None
    plant = None

    def __init__(self, host, realtime_config):
        if host == "nowhere":
            raise RuntimeError("libfranka: Connection timeout")
        Robot.last = self
        self.told = []
        self.reflex_in = math.inf
        self.sent = []
        self.cancelled = 0

    def set_collision_behavior(self, *thresholds):
        self.told.append(("collision", *thresholds))

    def set_load(self, *load):
        self.told.append(("load", *load))

    def automatic_error_recovery(self):
        self.told.append(("recovery",))
        self.reflex_in = math.inf
        if self.plant is not None:
            self.plant.recover()

    def read_once(self):
        return self._state()

    def _state(self):
        reading = SimpleNamespace(
            q=np.array(Q_REST), v=np.zeros(7), received_torque=np.full(7, 0.5)
        )
        if self.plant is not None:
            reading = self.plant.look()
        return SimpleNamespace(
            q=reading.q.tolist(),
            dq=reading.v.tolist(),
            tau_J_d=reading.received_torque.tolist(),
            robot_mode=RobotMode.kIdle,
            current_errors="[]",
            EE_T_K=np.eye(4).ravel().tolist(),
            F_T_EE=np.eye(4).ravel().tolist(),
            K_F_ext_hat_K=[0.0, 0.0, 1e-6, 0.0, 0.0, 0.0],
        )

    def control(self, control_callback, limit_rate, cutoff_frequency):
        self.told.append(("control", limit_rate, cutoff_frequency))
        if self.plant is not None:
            self.plant.start()
        while True:
            if self.plant is not None:
                self.plant.read()
            if len(self.sent) >= self.reflex_in:
                raise RuntimeError("libfranka: motion aborted by reflex!\n[x]")
            try:
                torques = control_callback(self._state(), None)
            except BaseException:
                self.cancelled += 1
                raise
            self.sent.append(torques)
            if self.plant is not None:
                self.plant.write(np.array(torques.tau_J), torques.motion_finished)
            if torques.motion_finished:
                return


@pytest.fixture(autouse=True)
def libfranka(monkeypatch):
    module = ModuleType("panda_py.libfranka")
    module.Robot = Robot
    module.Torques = Torques
    module.RobotMode = RobotMode
    module.RealtimeConfig = SimpleNamespace(kEnforce=1, kIgnore=0)
    package = ModuleType("panda_py")
    package.libfranka = module
    monkeypatch.setitem(sys.modules, "panda_py", package)
    monkeypatch.setitem(sys.modules, "panda_py.libfranka", module)
    monkeypatch.setattr(Robot, "plant", None)


def make_arm(**fields):
    return PandaArm(dp.FrankaRobotSideParams(**fields))


def cycles(done, torques, last=None):
    """For each torque a cycle; notes what it was sent, and what came after it."""
    for i, torque in enumerate(torques):
        reading = yield None
        done.append(reading.received_torque[0])
        yield np.full(7, torque), i == last
        done.append("after")
    return True


def test_says_why_an_arm_cannot_be_opened(monkeypatch):
    with pytest.raises(dp.DriverError, match="arm at nowhere: libfranka: Connection"):
        make_arm(host="nowhere").open()
    state = SimpleNamespace(robot_mode=RobotMode.kReflex, current_errors='["reflex"]')
    monkeypatch.setattr(Robot, "read_once", lambda self: state)
    with pytest.raises(dp.DriverError, match=r"mode Idle, got kReflex \(\"reflex\"\)"):
        make_arm().open()


def test_libfranka_calls_for_the_torques():
    arm = make_arm(load=dp.FrankaLoadParams(mass=0.7, com=[0, 0, 0.05]))
    arm.open()
    robot = Robot.last
    assert robot.told[0][:3] == ("collision", [20] * 7, [40] * 7)
    assert robot.told[1] == ("load", 0.7, [0, 0, 0.05], [0.0] * 9)
    assert arm.look().q.tolist() == list(Q_REST)
    done = []
    assert arm.run(cycles(done, [0.25, 0.5], last=1)) is True
    # Neither limited nor filtered: that is the controller's.
    assert robot.told[2] == ("control", False, 1000.0)
    assert [torques.tau_J for torques in robot.sent] == [[0.25] * 7, [0.5] * 7]
    assert [torques.motion_finished for torques in robot.sent] == [False, True]
    assert done == [0.5, "after", 0.5, "after"]
    assert arm.wrench().valid
    arm.close()


def test_a_reflex_is_a_fault_in_one_line_and_recovered_from():
    arm = make_arm()
    arm.open()
    Robot.last.reflex_in = 2
    with pytest.raises(ArmFault, match="aborted by reflex") as fault:
        arm.run(cycles([], [0.1] * 5))
    assert "\n" not in str(fault.value)
    assert len(Robot.last.sent) == 2
    arm.recover()
    assert arm.run(cycles([], [0.1, 0.2], last=1))


def test_what_goes_wrong_in_a_cycle_ends_the_motion_and_is_not_the_arms():
    arm = make_arm()
    arm.open()
    with pytest.raises(ArmFault, match="not finite"):
        arm.run(cycles([], [0.1, math.nan]))
    assert len(Robot.last.sent) == 1

    def broken():
        yield None
        raise ValueError("a mistake of ours")

    with pytest.raises(ValueError, match="a mistake of ours"):
        arm.run(broken())
    assert Robot.last.cancelled == 2


def test_a_robot_side_runs_on_it(tmp_path, monkeypatch):
    """With a reflex midway: it goes on from where it is, and what was logged is what
    is played back."""
    scenario = dp.load_scenario("plane")
    plant = SimulatedPanda(scenario, patience=0.4)
    monkeypatch.setattr(Robot, "plant", plant)
    arm = make_arm()
    log = tmp_path / "log.mcap"
    side = RobotSideProcess(
        scenario,
        arm,
        None,
        confirm=lambda _: True,
        events=Events("robot", tell=lambda _: None),
        log=log,
    )
    start = np.array(plant.state.pose.p)

    def on_cycle(*_):
        if side.work.count == 300:
            Robot.last.reflex_in = len(Robot.last.sent) + 1
        if side.work.count == 600:
            side.stop()

    side.on_cycle = on_cycle
    assert side.run(30)
    kinds = [event.kind for event in side.events.all]
    assert kinds.count("started") == 2
    assert kinds.count("fault") == kinds.count("recovered") == 1
    assert kinds[-1] == "ended"
    assert ("recovery",) in Robot.last.told
    assert np.linalg.norm(plant.state.pose.p - start) < 2e-3
    replayed = replay_side(log)
    assert replayed.cycles >= 600
    assert replayed.different == 0


def test_the_names_are_panda_pythons(monkeypatch):
    monkeypatch.delitem(sys.modules, "panda_py.libfranka")
    monkeypatch.delitem(sys.modules, "panda_py")
    reason = "panda-python is not installed"
    real = pytest.importorskip("panda_py.libfranka", reason=reason)
    for name in ("set_collision_behavior", "set_load", "read_once", "control"):
        assert hasattr(real.Robot, name)
    assert hasattr(real.Robot, "automatic_error_recovery")
    assert real.RobotMode.kIdle.name == "kIdle"
    torques = real.Torques([0.0] * 7)
    torques.motion_finished = True
    names = dir(real.RobotState)
    assert {"q", "dq", "tau_J_d", "robot_mode", "current_errors"} <= set(names)
    assert {"K_F_ext_hat_K", "F_T_EE", "EE_T_K"} <= set(names)
    assert {"move", "grasp", "read_once"} <= set(dir(real.Gripper))
    with pytest.raises(RuntimeError):
        real.Robot("127.0.0.250", real.RealtimeConfig.kIgnore)
