# SPDX-License-Identifier: BSD-3-Clause
"""FrankaArm over a double of pylibfranka; what it does over the real protocol is
for `make hardware-test`."""

import enum
import math
import sys
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

import dual_proxy as dp
from dual_proxy.hardware.arms import ArmFault, FrankaArm
from dual_proxy.panda import Q_REST, PandaModel


class RobotMode(enum.Enum):
    Idle = 1
    Guiding = 3
    Reflex = 4


class FrankaError(Exception):
    pass


class Torques:
    def __init__(self, torque):
        self.torque = torque
        self.motion_finished = False


class Control:
    def __init__(self, robot):
        self._robot = robot

    def readOnce(self):
        if self._robot.reflex:
            raise RuntimeError("libfranka: motion aborted by reflex!\nsecond line")
        return self._robot.state, None

    def writeOnce(self, torques):
        self._robot.sent.append(torques)


class Robot:
    last = None

    def __init__(self, host, config):
        if host == "nowhere":
            raise FrankaError("libfranka: Connection error")
        Robot.last = self
        self.reflex = False
        self.sent = []
        self.calls = []
        model = PandaModel(1e-3).calc(np.array(Q_REST), np.zeros(7))
        turn = np.diag([0.0, 0.0, 1.0, 1.0])
        turn[:2, :2] = [[0.8, 0.6], [-0.6, 0.8]]  # The hand's EE is turned about z.
        O_T_EE = np.eye(4)
        O_T_EE[:3, :3] = model.R_BE @ turn[:3, :3]
        self.state = SimpleNamespace(
            q=list(Q_REST),
            dq=[0.01] * 7,
            tau_J_d=[0.5] * 7,
            robot_mode=RobotMode.Idle,
            current_errors="[]",
            O_T_EE=list(O_T_EE.T.ravel()),
            EE_T_K=list(np.eye(4).ravel()),
            F_T_EE=list(turn.T.ravel()),
            K_F_ext_hat_K=[0.0] * 6,
        )

    def set_collision_behavior(self, *thresholds):
        self.calls.append(("collision", thresholds))

    def set_load(self, *load):
        self.calls.append(("load", load))

    def read_once(self):
        return self.state

    def start_torque_control(self):
        return Control(self)

    def automatic_error_recovery(self):
        self.reflex = False

    def stop(self):
        self.calls.append(("stop",))


@pytest.fixture(autouse=True)
def franka(monkeypatch):
    module = ModuleType("pylibfranka")
    module.Robot = Robot
    module.Torques = Torques
    module.RobotMode = RobotMode
    module.FrankaException = FrankaError
    module.RealtimeConfig = SimpleNamespace(kEnforce=0, kIgnore=1)
    monkeypatch.setitem(sys.modules, "pylibfranka", module)
    return module


def make_arm(**fields):
    return FrankaArm(dp.FrankaRobotSideParams(**fields))


def test_says_why_an_arm_cannot_be_opened(monkeypatch):
    with pytest.raises(dp.DriverError, match="arm at nowhere: libfranka: Connection"):
        make_arm(host="nowhere").open()

    def reflex(self):
        self.state.robot_mode = RobotMode.Reflex
        self.state.current_errors = '["joint_reflex"]'
        return self.state

    monkeypatch.setattr(Robot, "read_once", reflex)
    with pytest.raises(dp.DriverError, match=r"mode Idle, got Reflex.*joint_reflex"):
        make_arm().open()


def test_an_arm_that_is_only_looked_at_is_guided_and_nothing_is_set(monkeypatch):
    def guided(self):
        self.state.robot_mode = RobotMode.Guiding
        return self.state

    monkeypatch.setattr(Robot, "read_once", guided)
    with pytest.raises(dp.DriverError, match="expected mode Idle, got Guiding"):
        make_arm().open()
    arm = FrankaArm(dp.FrankaRobotSideParams(), observe=True)
    arm.open()
    assert arm.look().q.tolist() == list(Q_REST)
    arm.close()
    assert Robot.last.calls == []


def test_opens_reads_writes_and_ends():
    arm = make_arm(
        load=dp.FrankaLoadParams(mass=0.7, com=[0, 0, 0.05]),
        collision=dp.FrankaCollisionParams(collision_torque=[30] * 7),
    )
    arm.open()
    robot = Robot.last
    assert robot.calls[0][0] == "collision"
    assert robot.calls[0][1][:2] == ([20] * 7, [30] * 7)
    assert robot.calls[1] == ("load", (0.7, [0, 0, 0.05], [0.0] * 9))
    assert not robot.sent
    reading = arm.look()
    assert reading.q.tolist() == robot.state.q
    arm.start()
    assert arm.read().received_torque.tolist() == [0.5] * 7
    arm.write(np.full(7, 0.25))
    arm.write(np.zeros(7), last=True)
    assert [t.motion_finished for t in robot.sent] == [False, True]
    assert robot.sent[0].torque == [0.25] * 7
    arm.close()
    assert ("stop",) not in robot.calls
    arm.close()


def test_what_is_not_finite_is_not_sent():
    arm = make_arm()
    arm.open()
    arm.start()
    with pytest.raises(ArmFault, match="not finite"):
        arm.write(np.full(7, math.nan))
    assert not Robot.last.sent
    arm.close()
    assert ("stop",) in Robot.last.calls


def test_a_reflex_is_a_fault_in_one_line_and_recovered_from():
    arm = make_arm()
    arm.open()
    arm.start()
    Robot.last.reflex = True
    with pytest.raises(ArmFault) as fault:
        arm.read()
    assert "reflex" in str(fault.value)
    assert "\n" not in str(fault.value)
    arm.recover()
    arm.start()
    arm.read()


def test_estimate_of_the_wrench_is_that_of_the_arm_on_what_it_touches():
    """5 N down onto a table, told in a hand's frame that is turned about z."""
    arm = make_arm()
    arm.open()
    arm.start()
    state = Robot.last.state
    R_BK = np.reshape(state.O_T_EE, (4, 4)).T[:3, :3]
    on_table = np.array([1.0, 0.0, -5.0])
    state.K_F_ext_hat_K = [*(R_BK.T @ on_table), 0.0, 0.0, 0.0]
    arm.read()
    wrench = arm.wrench()
    assert wrench.valid
    # The adapter of a sensor without a tool gives it back, in B.
    adapter = dp.ForceTorqueAdapter(dp.ForceTorqueAdapterParams())
    sensed = adapter.make_state()
    terms = PandaModel(1e-3).calc(np.array(Q_REST), np.zeros(7))
    adapter.update(wrench.value, terms.p_BE, terms.R_BE, np.zeros(3), sensed)
    np.testing.assert_allclose(sensed.wrench[:3], on_table, atol=1e-9)
    state.K_F_ext_hat_K[1] = math.nan
    arm.read()
    assert not arm.wrench().valid
