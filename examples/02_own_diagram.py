# SPDX-License-Identifier: BSD-3-Clause
"""A Drake diagram of your own: a 1 kg point robot on a floor, steered by a hand.

    python examples/02_own_diagram.py [seconds]

For a link with delay put a CommunicationChannel behind each `message` port.
"""

import sys

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import Demultiplexer

import dual_proxy as dp
from dual_proxy import systems

START = np.array([0.45, 0.0, 0.18])  # m, in the robot's base frame.


class PointRobot(LeafSystem):
    """A mass over a floor at 0.1 m, controlled as by eq. (12) and (13)."""

    def __init__(self):
        super().__init__()
        floor = dp.ContactSurfaceParams(shape="half_space", position=[0.0, 0.0, 0.1])
        self.scene = dp.ContactScene(dp.ContactSceneParams(surfaces=[floor]))
        inputs = (("motion_error", 3), ("reference_force", 3), ("force_selection", 9))
        self.ports = [self.DeclareVectorInputPort(name, size) for name, size in inputs]
        self.DeclareDiscreteState([*START, 0.0, 0.0, 0.0])  # Position and velocity.
        self.DeclarePeriodicDiscreteUpdateEvent(0.001, 0.0, self._step)
        state = {self.xd_ticket()}
        self.DeclareAbstractOutputPort("pose", Value[RigidTransform], self._pose, state)
        self.DeclareVectorOutputPort("forces", 12, self._forces)

    def _pose(self, context, output):
        output.set_value(RigidTransform(context.get_discrete_state(0).value()[:3]))

    def _forces(self, context, output):  # Sensed force, velocity, F_m, F_f.
        p, v = np.split(context.get_discrete_state(0).value(), 2)
        error, reference, selection = (port.Eval(context) for port in self.ports)
        Omega, sensed = selection.reshape(3, 3), self.scene.calc(p, v).force
        motion = (np.eye(3) - Omega) @ (-500.0 * error - 40.0 * v)
        contact = Omega @ (reference - 1.3 * (sensed - reference) - 20.0 * v)
        output.SetFromVector([*sensed, *v, *motion, *contact])

    def _step(self, context, next_state):
        p, v = np.split(context.get_discrete_state(0).value(), 2)
        forces = self.GetOutputPort("forces").Eval(context)
        v = v + 0.001 * (forces[6:9] + forces[9:] - forces[:3])
        next_state.set_value([*(p + 0.001 * v), *v])


# The hand goes down 44 mm, so the robot is to go 30 mm below the floor.
path = dp.OperatorPath([0, 3], [[0, 0], [0, 0], [0, -0.044]], "minimum_jerk")
robot_params, hand_params = dp.RobotSideProxyParams(), dp.HapticSideParams()
robot_params.map.p_cw = hand_params.proxy.map.p_cw = START
builder = DiagramBuilder()
device = systems.SimulatedHapticDevice.add_to(builder, path)
hand = systems.HapticSide.add_to(builder, hand_params)
proxy = systems.RobotSideProxy.add_to(builder, robot_params)
robot, split = map(builder.AddSystem, (PointRobot(), Demultiplexer(12, 3)))
finder = systems.ForceSpaceParticleFilter.add_to(builder, seed=0)
sender = systems.PoseSender.add_to(builder)
for source, target, ports in (
    (device, hand, "device_pose device_velocity"),
    (hand, device, "device_wrench"),
    (hand, proxy, "message:haptic_message"),
    (proxy, robot, "motion_error reference_force force_selection"),
    (robot, proxy, "pose:robot_pose"),
    (robot, split, "forces:u0"),
    (split, finder, "y0:sensed_force y1:velocity y2:motion_force y3:contact_force"),
    *((finder, system, "force_selection") for system in (proxy, sender)),
    (robot, sender, "pose"),
    (sender, hand, "message:robot_message"),
):
    for port in ports.split():
        here, there = (port.split(":") * 2)[:2]
        builder.Connect(source.GetOutputPort(here), target.GetInputPort(there))
simulator = Simulator(builder.Build())
root = simulator.get_context()
show = ((robot, "pose"), (finder, "dimension"), (hand, "device_wrench"))
for time in np.arange(0.5, 0.1 + float(sys.argv[1] if sys.argv[1:] else 5), 0.5):
    simulator.AdvanceTo(time)
    pose, dimension, wrench = (
        system.GetOutputPort(port).Eval(system.GetMyContextFromRoot(root))
        for system, port in show
    )
    print(
        f"{time:4.1f} s   height {pose.translation()[2]:.3f} m   "
        f"dimension {dimension[0]:.0f}   force on the hand {wrench[2]:4.1f} N"
    )
