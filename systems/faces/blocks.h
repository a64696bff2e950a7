// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include <Eigen/Core>

#include "dual_proxy/control/arm_model.h"
#include "dual_proxy/control/haptic_controller.h"
#include "dual_proxy/control/operational_space_controller.h"
#include "dual_proxy/faces/block.h"
#include "dual_proxy/link/communication_channel.h"
#include "dual_proxy/link/pose_sender.h"
#include "dual_proxy/loop/teleop_loop.h"
#include "dual_proxy/perception/contact_history.h"
#include "dual_proxy/perception/force_space_particle_filter.h"
#include "dual_proxy/proxy/haptic_side_proxy.h"
#include "dual_proxy/proxy/robot_side_proxy.h"
#include "dual_proxy/sides/haptic_side.h"
#include "dual_proxy/sides/robot_side.h"
#include "dual_proxy/simulation/force_torque_sensor.h"
#include "dual_proxy/simulation/haptic_device.h"
#include "dual_proxy/simulation/operator.h"

namespace dual_proxy {

/** @file
Every algorithm that has a face, as a block. Their ports, with unit, frame and
meaning, are listed where they are visited, and in docs/reference.md.

Where a frame is not named, the robot's side is in the base frame B, the
device's in D. Inputs that are not connected are zero, if not said otherwise.
All of these functions throw std::invalid_argument if a parameter is invalid. */

using BlockPtr = std::shared_ptr<const Block>;

/** Turns the device's poses into motion errors and reference forces, eq. (4).
Steps every `params.period`, with feedthrough. */
BlockPtr MakeRobotSideProxyBlock(const RobotSideProxyParams& params = {});

/** Turns the robot's poses and selections into the force on the hand, eq. (5).
Steps every `params.period`, with feedthrough. */
BlockPtr MakeHapticSideProxyBlock(const HapticSideProxyParams& params = {});

/** Turns poses at the control rate into messages at the link's rate. Steps
every `params.period`; the message is that of the last step. */
BlockPtr MakePoseSenderBlock(const PoseSenderParams& params = {});

/** Carries messages one way, with delay, jitter and loss.

A message that the sender makes in a step at t is there for the receiver's first
step after t + delay: with the delay a multiple of the control period, always
one step later, as if the delay were zero and the two sides were neighbours. For
that the channel looks for a new message between two steps,
CommunicationChannel::kLook periods after each multiple of 1/`rate`: the sender,
which starts at time 0, has then taken its step nearest to it. What has arrived
is a function of time, so the output needs no step in between. Before the first
arrival it is the empty message (sequence -1).
@param seed  of jitter and loss.
@param rate  Hz, in (0, 1/period]: the sender's.
@param period  s, in (0, kMaxTime], of the two sides' steps.
@param counted  whether there is the port `counters`.
@param tag  of the only kind of message that is carried. */
BlockPtr MakeCommunicationChannelBlock(
    const CommunicationChannelParams& params = {}, std::uint64_t seed = 0,
    double rate = 50, double period = 0.001, bool counted = false,
    MessageTag tag = PoseMessage::kTag);

/** Finds the directions of contact, section IV of the paper. Steps every
`params.period`; the outputs are those of the last step, dimension 0 before the
first. WindowMean makes the means. The paper's angular filter is a second one,
fed with moments.
@param seed  of scatter and resampling. */
BlockPtr MakeForceSpaceParticleFilterBlock(
    const ForceSpaceParticleFilterParams& params = {}, std::uint64_t seed = 0);

/** Remembers what the filter believed where, and gives it as a prior (section
IV.C). Steps every `params.period`, which is the filter's; the output is that of
the last step, so that history and filter can be wired in a ring. */
BlockPtr MakeContactHistoryBlock(const ContactHistoryParams& params = {});

/** Mean of a 3-vector over the current window, what a slower system samples.

Steps every `period`; the mean is that of the last step, zero before the first.
Windows are [k window, (k + 1) window): a system that runs every `window` sees
the mean over the window that just ended. Samples that are not finite are left
out.
@param window  s, in (0, kMaxTime].
@param period  s, in (0, kMaxTime], between samples. */
BlockPtr MakeWindowMeanBlock(double window = 1 / 15.0, double period = 0.001);

/** Pose and twist of the tool point from the arm's state; no memory. */
BlockPtr MakeArmKinematicsBlock(const ArmModelParams<7>& arm);

/** Unified force and motion control of the arm, eq. (10) to (17). Steps every
`params.period`, with feedthrough.
@param arm  its model. */
BlockPtr MakeOperationalSpaceControllerBlock(
    const OperationalSpaceControllerParams<7>& params,
    const ArmModelParams<7>& arm);

/** The device's controller, eq. (18): the force on the hand, with damping.
Steps every `params.period`, with feedthrough. */
BlockPtr MakeHapticControllerBlock(const HapticControllerParams& params = {});

/** A wrist force/torque sensor: noise, bias, low-pass; and its adapter, which
learns the bias and removes the tool's weight and inertia. Steps every
`params.period`, for the first time after one period, as a simulated plant has
no reaction before its first step. The output is that of the last step, zero
before the first.
@param p_SE  m: tool point in the sensor's frame, whose axes are E's.
@param seed  of the noise. */
BlockPtr MakeForceTorqueSensorBlock(
    const ForceTorqueSensorParams& params = {},
    const Eigen::Vector3d& p_SE = Eigen::Vector3d::Zero(),
    std::uint64_t seed = 0);

/** A simulated Omega.7 in the hand of a simulated operator. Steps every
`params.period`; the outputs are those of the last step, the device at its home
before the first.
@param path  in D: where the operator wants the handle. */
BlockPtr MakeSimulatedHapticDeviceBlock(
    const OperatorPathParams& path,
    const SimulatedHapticDeviceParams& params = {});

/** What a simulated wrist sensor takes; no memory.

It has the project's sign already: pressing on a table, the arm pushes the tool
(and the tool the table) down. It still holds the tool's weight and inertia, as
a real sensor's reading does: in standstill it is the wrench of the tool on its
environment minus the tool's weight.
@param sensor_joint  index of the weld that stands for the sensor, >= 0; one
that the plant has not is found where the input is read. */
BlockPtr MakeSensorReactionBlock(int sensor_joint);

/** A simulated wrist sensor that is a part of a robot side's block. */
struct RobotSideSensor {
  ForceTorqueSensorParams params;
  /** m: tool point in the sensor's frame, whose axes are E's. */
  Eigen::Vector3d p_SE{Eigen::Vector3d::Zero()};
  std::uint64_t seed{0};  ///< Of the noise.
};

/** Of the filters of a robot side's block. */
struct RobotSideSeeds {
  std::uint64_t filter{0};
  std::uint64_t angular_filter{1};
};

/** The robot's side: the scheme's half, controller, perception, and the arm's
model. Steps every `params.controller.period`; all outputs but `robot_pose` are
those of the last step, zero before the first.

With a simulated sensor it does the work of that block, too, and gives the same
bits as with that in front of it.
@param arm  its model.
@param q_start  rad, within kMaxPosition: where the arm will be when the run
starts. Before the first step the torque holds it there.
@param sensor  the simulated sensor, if there is one. */
BlockPtr MakeRobotSideBlock(const RobotSideParams<SerialArm<7>>& params,
                            const ArmModelParams<7>& arm,
                            const std::optional<Vector7>& q_start = {},
                            const std::optional<RobotSideSensor>& sensor = {},
                            const RobotSideSeeds& seeds = {});

/** A simulated device in a simulated hand that is a part of a haptic side's
block. */
struct HapticSideDevice {
  SimulatedHapticDeviceParams params;
  /** Points in D: where the operator wants the handle. */
  OperatorPathParams path;
};

/** The device's side: the scheme's half and the device's controller. Steps
every `params.controller.period`; the outputs are those of the last step, zero
before the first.

With a simulated device it does the work of that block, too, and gives the same
bits as with that in front of it. */
BlockPtr MakeHapticSideBlock(
    const HapticSideParams& params = {},
    const std::optional<HapticSideDevice>& device = {});

/** Both sides, the link, the simulated sensor, device and operator, for a plant
to be connected to. Steps every control period; the outputs are those of the
last step, zero before the first. The same bits as the sides with their
simulated hardware and two channels.
@param sensor_joint  as for MakeSensorReactionBlock().
@param q_start  as for MakeRobotSideBlock(). */
BlockPtr MakeTeleopLoopBlock(const TeleopLoopParams<SerialArm<7>>& params,
                             int sensor_joint,
                             const std::optional<Vector7>& q_start = {});

}  // namespace dual_proxy
