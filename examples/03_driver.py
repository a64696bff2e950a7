# SPDX-License-Identifier: BSD-3-Clause
"""Both sides as drivers call them, each in a loop of its own: no Drake diagram.

    python examples/03_driver.py [seconds]

What a driver reads is made up here: the arm stands still, and is pushed from
below after a while; the hand sinks. What it would send is printed.
"""

import sys

import numpy as np

import dual_proxy as dp
from dual_proxy.panda import Q_REST, PandaModel, p_SE_S

PERIOD = 0.001
TOOL_MASS = 0.2  # kg


def main(seconds: float) -> None:
    """Runs both sides, with a link of 50 ms between them."""
    arm = dp.ArmModel(PandaModel(TOOL_MASS).arm_params)
    q, v = np.array(Q_REST), np.zeros(7)  # From the arm.
    p_BE, R_BE, *_ = arm.calc(q, v)

    robot_params, haptic_params = dp.RobotSideParams(), dp.HapticSideParams()
    for proxy in (robot_params.proxy, haptic_params.proxy):
        proxy.map.p_cw, proxy.map.R_cw = p_BE, R_BE  # The device's home is here.
    robot, haptic = dp.RobotSide(robot_params), dp.HapticSide(haptic_params)
    robot_state, haptic_state = robot.make_state(), haptic.make_state()
    adapter = dp.ForceTorqueAdapter(
        dp.ForceTorqueAdapterParams(tare=True, tool_mass=TOOL_MASS)
    )
    sensor = adapter.make_state()
    link = dp.CommunicationChannel(dp.CommunicationChannelParams(delay=0.05))
    to_robot, to_haptic = link.make_state(seed=0), link.make_state(seed=1)

    for step in range(round(seconds / PERIOD)):
        time = step * PERIOD
        # The robot's side. `measured`, in the sensor's frame S, is from the sensor.
        held = np.array([0.0, 0.0, TOOL_MASS * 9.81 - 8.0 * (time > 1.5)])
        measured = np.concatenate([R_BE.T @ held, np.zeros(3)])
        p_BE, R_BE, J, mass, bias, gravity, Jdot_v = arm.calc(q, v)
        adapter.update(measured, p_BE, R_BE, p_SE_S, sensor)
        robot.update(
            time,
            link.receive(time, to_robot),
            *(p_BE, R_BE, J, mass, bias, gravity, Jdot_v, q, v),
            force_selection=None,  # The side's own filter finds the contact.
            moment_selection=None,
            sensed_wrench=sensor.wrench,
            state=robot_state,
            sensor_ready=sensor.ready,
        )
        link.send(time, robot_state.message, to_haptic)
        # The device's side. The handle's pose, from home, is from the device.
        x_h = np.array([0.0, 0.0, -0.02 * np.clip(time - 1.0, 0.0, 1.0)])
        haptic.update(
            time,
            link.receive(time, to_haptic),
            x_h,
            np.eye(3),
            np.zeros(6),
            haptic_state,
        )
        link.send(time, haptic_state.message, to_robot)
        if step % 500 == 0:
            print(
                f"{time:.1f} s: torque {np.round(robot_state.torque, 1)} N m, "
                f"on the hand {np.round(haptic_state.device_wrench[:3], 2)} N"
            )


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 3.0)
