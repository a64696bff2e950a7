# SPDX-License-Identifier: BSD-3-Clause
"""Hardware in a Drake diagram at real time; what is simulated here is so in real time,
behind the interfaces of hardware."""

import math
import time
from types import SimpleNamespace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

import dual_proxy as dp
from dual_proxy import systems
from dual_proxy.hardware.arms import ArmFault, SimulatedPanda
from dual_proxy.hardware.devices import SimulatedHand
from dual_proxy.hardware.systems import ForceTorqueSensor, HapticDevice, PandaHardware
from dual_proxy.panda import PandaModel, p_SE_S
from dual_proxy.systems import CommunicationChannel, HapticSide, RobotSide

SECONDS = 3.0


class Rig:
    def __init__(self, patience=0.4):
        scenario = dp.load_scenario("plane")
        self.arm = SimulatedPanda(scenario, patience=patience)
        self.arm.start()
        self.hand = SimulatedHand(scenario)
        self.hand.open()
        adapter = dp.ForceTorqueSensorParams(
            tool_mass=scenario.sensor.tool_mass,
            tool_com=scenario.sensor.tool_com,
            force_noise_std=0,
            moment_noise_std=0,
            tare=True,
        )
        params = dp.make_hardware_defaults(scenario.robot_side_params())
        builder = DiagramBuilder()
        add = builder.AddSystem
        device = add(HapticDevice(self.hand))
        haptic = add(HapticSide(scenario.haptic_side_params()))
        to_robot = add(CommunicationChannel(scenario.link.channel))
        to_device = add(CommunicationChannel(scenario.link.channel))
        self.robot = add(RobotSide(params, PandaModel(scenario.scene.tool_mass)))
        arm = add(PandaHardware(self.arm))
        source = SimpleNamespace(read=self.arm.wrench)
        wrist = add(ForceTorqueSensor(source))
        self.sensor = add(systems.ForceTorqueSensor(adapter, p_SE_S))

        def connect(a, out, b, into):
            builder.Connect(a.GetOutputPort(out), b.GetInputPort(into))

        connect(device, "device_pose", haptic, "device_pose")
        connect(device, "device_velocity", haptic, "device_velocity")
        connect(device, "clutch", haptic, "clutch")
        connect(haptic, "device_wrench", device, "device_wrench")
        connect(haptic, "message", to_robot, "message")
        connect(to_robot, "message", self.robot, "haptic_message")
        connect(self.robot, "message", to_device, "message")
        connect(to_device, "message", haptic, "robot_message")
        connect(arm, "robot_state", self.robot, "robot_state")
        connect(wrist, "reaction", self.sensor, "reaction")
        connect(self.robot, "robot_pose", self.sensor, "robot_pose")
        connect(self.sensor, "sensed_wrench", self.robot, "sensed_wrench")
        connect(self.sensor, "ready", self.robot, "sensor_ready")
        connect(self.robot, "torque", arm, "torque")
        self.simulator = Simulator(builder.Build())
        self.simulator.set_target_realtime_rate(1)


def test_a_diagram_of_hardware_follows_the_hand():
    rig = Rig()
    start = np.array(rig.arm.state.pose.p)
    begin = time.monotonic()
    rig.simulator.AdvanceTo(0.4)
    held = rig.arm.state.pose.p
    assert np.linalg.norm(held - start) < 1e-3  # The sensor's bias is not known.
    rig.simulator.AdvanceTo(SECONDS)
    context = rig.sensor.GetMyContextFromRoot(rig.simulator.get_context())
    assert rig.sensor.GetOutputPort("ready").Eval(context)[0] == 1
    took = time.monotonic() - begin
    print(f"{SECONDS} s in {took:.1f} s")
    assert took > 0.9 * SECONDS
    moved = rig.arm.state.pose.p - start
    assert moved[2] < -0.01
    # Where the hand went, which is down; a busy machine shakes it.
    assert np.abs(moved[:2]).max() < 0.5 * abs(moved[2])


def test_an_arm_that_stops_ends_the_diagram():
    rig = Rig()
    rig.simulator.AdvanceTo(0.1)
    rig.arm.close()
    with pytest.raises(ArmFault, match="not started"):
        rig.simulator.AdvanceTo(0.2)


@pytest.mark.parametrize("bad", [0, -1, math.nan, math.inf])
def test_times_that_cannot_be(bad):
    source = SimpleNamespace(read=lambda: None)
    with pytest.raises(ValueError, match="ForceTorqueSensor: field `period` expected"):
        ForceTorqueSensor(source, period=bad)
    with pytest.raises(ValueError, match="ForceTorqueSensor: field `max_age` expected"):
        ForceTorqueSensor(source, max_age=bad)
