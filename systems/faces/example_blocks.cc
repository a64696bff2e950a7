// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/faces/example_blocks.h"

namespace dual_proxy {

std::vector<BlockPtr> MakeExampleBlocks() {
  ArmModelParams<7> arm;
  arm.mass.setOnes();
  arm.p_PJ.row(2).setConstant(0.2);
  for (int i = 0; i < 7; ++i) {
    if (i % 2 == 0) continue;
    arm.R_PJ[i] << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  }
  for (Eigen::Matrix3d& inertia : arm.inertia) inertia.setIdentity();
  RobotSideParams<SerialArm<7>> robot;
  robot.perception.angular_filter.enabled = true;
  robot.gripper.enabled = true;
  const OperatorPathParams path{.times = Eigen::VectorXd::Zero(1),
                                .points = Eigen::Matrix3Xd::Zero(3, 1)};
  TeleopLoopParams<SerialArm<7>> loop;
  loop.robot = robot;
  loop.model = arm;
  loop.path = path;
  return {MakeRobotSideProxyBlock(),
          MakeHapticSideProxyBlock(),
          MakePoseSenderBlock(),
          MakeCommunicationChannelBlock({}, 0, 50, 1e-3, true),
          MakeForceSpaceParticleFilterBlock(),
          MakeContactHistoryBlock(),
          MakeWindowMeanBlock(),
          MakeArmKinematicsBlock(arm),
          MakeOperationalSpaceControllerBlock({}, arm),
          MakeHapticControllerBlock(),
          MakeForceTorqueSensorBlock(),
          MakeSimulatedHapticDeviceBlock(path),
          MakeSensorReactionBlock(0),
          MakeRobotSideBlock(robot, arm),
          MakeRobotSideBlock(robot, arm, {}, RobotSideSensor{}),
          MakeHapticSideBlock(),
          MakeHapticSideBlock({}, HapticSideDevice{{}, path}),
          MakeTeleopLoopBlock(loop, 0)};
}

}  // namespace dual_proxy
