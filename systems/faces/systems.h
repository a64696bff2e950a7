// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/faces/block_system.h"
#include "dual_proxy/faces/blocks.h"

namespace dual_proxy {

/** @file
The C++ LeafSystems: each is the BlockSystem of the block of its name, made from
the same arguments. What they do, and what they throw, is told in blocks.h. */

class RobotSideProxySystem final : public BlockSystem {
 public:
  explicit RobotSideProxySystem(const RobotSideProxyParams& params = {})
      : BlockSystem(MakeRobotSideProxyBlock(params)) {}
};

class HapticSideProxySystem final : public BlockSystem {
 public:
  explicit HapticSideProxySystem(const HapticSideProxyParams& params = {})
      : BlockSystem(MakeHapticSideProxyBlock(params)) {}
};

class PoseSenderSystem final : public BlockSystem {
 public:
  explicit PoseSenderSystem(const PoseSenderParams& params = {})
      : BlockSystem(MakePoseSenderBlock(params)) {}
};

class CommunicationChannelSystem final : public BlockSystem {
 public:
  explicit CommunicationChannelSystem(
      const CommunicationChannelParams& params = {}, std::uint64_t seed = 0,
      double rate = 50, double period = 0.001, bool counted = false,
      MessageTag tag = PoseMessage::kTag)
      : BlockSystem(MakeCommunicationChannelBlock(params, seed, rate, period,
                                                  counted, tag)) {}
};

class ForceSpaceParticleFilterSystem final : public BlockSystem {
 public:
  explicit ForceSpaceParticleFilterSystem(
      const ForceSpaceParticleFilterParams& params = {}, std::uint64_t seed = 0)
      : BlockSystem(MakeForceSpaceParticleFilterBlock(params, seed)) {}
};

class ContactHistorySystem final : public BlockSystem {
 public:
  explicit ContactHistorySystem(const ContactHistoryParams& params = {})
      : BlockSystem(MakeContactHistoryBlock(params)) {}
};

class WindowMeanSystem final : public BlockSystem {
 public:
  explicit WindowMeanSystem(double window = 1 / 15.0, double period = 0.001)
      : BlockSystem(MakeWindowMeanBlock(window, period)) {}
};

class ArmKinematicsSystem final : public BlockSystem {
 public:
  explicit ArmKinematicsSystem(const ArmModelParams<7>& arm)
      : BlockSystem(MakeArmKinematicsBlock(arm)) {}
};

class OperationalSpaceControllerSystem final : public BlockSystem {
 public:
  explicit OperationalSpaceControllerSystem(
      const OperationalSpaceControllerParams<7>& params,
      const ArmModelParams<7>& arm)
      : BlockSystem(MakeOperationalSpaceControllerBlock(params, arm)) {}
};

class HapticControllerSystem final : public BlockSystem {
 public:
  explicit HapticControllerSystem(const HapticControllerParams& params = {})
      : BlockSystem(MakeHapticControllerBlock(params)) {}
};

class ForceTorqueSensorSystem final : public BlockSystem {
 public:
  explicit ForceTorqueSensorSystem(
      const ForceTorqueSensorParams& params = {},
      const Eigen::Vector3d& p_SE = Eigen::Vector3d::Zero(),
      std::uint64_t seed = 0)
      : BlockSystem(MakeForceTorqueSensorBlock(params, p_SE, seed)) {}
};

class SimulatedHapticDeviceSystem final : public BlockSystem {
 public:
  explicit SimulatedHapticDeviceSystem(
      const OperatorPathParams& path,
      const SimulatedHapticDeviceParams& params = {})
      : BlockSystem(MakeSimulatedHapticDeviceBlock(path, params)) {}
};

class SensorReactionSystem final : public BlockSystem {
 public:
  explicit SensorReactionSystem(int joint)
      : BlockSystem(MakeSensorReactionBlock(joint)) {}
};

class RobotSideSystem final : public BlockSystem {
 public:
  explicit RobotSideSystem(const RobotSideParams<SerialArm<7>>& params,
                           const ArmModelParams<7>& arm,
                           const std::optional<Vector7>& q_start = {},
                           const std::optional<RobotSideSensor>& sensor = {},
                           const RobotSideSeeds& seeds = {})
      : BlockSystem(MakeRobotSideBlock(params, arm, q_start, sensor, seeds)) {}
};

class HapticSideSystem final : public BlockSystem {
 public:
  explicit HapticSideSystem(const HapticSideParams& params = {},
                            const std::optional<HapticSideDevice>& device = {})
      : BlockSystem(MakeHapticSideBlock(params, device)) {}
};

class TeleopLoopSystem final : public BlockSystem {
 public:
  explicit TeleopLoopSystem(const TeleopLoopParams<SerialArm<7>>& params,
                            int joint,
                            const std::optional<Vector7>& q_start = {})
      : BlockSystem(MakeTeleopLoopBlock(params, joint, q_start)) {}
};

}  // namespace dual_proxy
