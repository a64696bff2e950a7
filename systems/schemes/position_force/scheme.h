// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/common/serialize.h"
#include "dual_proxy/proxy/workspace_map.h"
#include "dual_proxy/schemes/half.h"

namespace dual_proxy {

/** Parameters of scheme `position_force`. */
struct PositionForceParams {
  double force_scale{0.4};
  double max_force{12};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const { ValidateFields("PositionForceParams", *this); }

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(
        Field("force_scale", &force_scale, AtLeast(0), "",
              "share of the robot's force that the hand feels; 1/map.scale "
              "keeps stiffness per metre of hand, at 1 a soft hand "
              "oscillates without delay"));
    a->Visit(Field("max_force", &max_force, AtLeast(0), "N",
                   "bound on the force on the hand"));
  }
};

/** What PositionForceRobotHalf remembers. */
struct PositionForceRobotHalfState {
  RobotSideProxyState proxy;
  ForceSenderState sender;
  RobotHalfOutput output{};  ///< Of the last period.
};

/** The robot half of the two-channel scheme: the robot follows the handle's
poses in all directions, with the limits of RobotSideProxy, and what its force
sensor feels goes back. */
class PositionForceRobotHalf {
 public:
  using State = PositionForceRobotHalfState;

  /** @throws std::invalid_argument if a parameter is invalid. */
  PositionForceRobotHalf(const RobotHalfParams& shared,
                         const PositionForceParams& own);

  State MakeState() const;

  /** Advances by one period; the results are in state->output.
  @param time s, not decreasing. No heap, no throw. */
  void Update(double time, const RobotHalfInput& input,
              State* state) const noexcept;

 private:
  RobotSideProxy proxy_;
  ForceSender sender_;
};

/** What PositionForceHapticHalf remembers. */
struct PositionForceHapticHalfState {
  LinkMonitorState link;
  /** F_s of the message in use, N, in B: robot on environment. */
  Eigen::Vector3d sensed_force{Eigen::Vector3d::Zero()};
  PoseSenderState sender;
  HapticHalfOutput output{};  ///< Of the last period.
};

/** The haptic half of the two-channel scheme:

    F_h = -force_scale R_DB F_s,

bounded by max_force; the hand feels the reaction of what the robot exerts. No
rate limit, no selection, no damping: it closes the loop over the link, and is
here to be compared with. Without a link, before the first message or when it is
lost, the force is zero. The handle's pose goes to the robot. */
class PositionForceHapticHalf {
 public:
  using State = PositionForceHapticHalfState;

  /** @throws std::invalid_argument if a parameter is invalid. */
  PositionForceHapticHalf(const HapticHalfParams& shared,
                          const PositionForceParams& own);

  State MakeState() const;

  /** Advances by one period; the results are in state->output.
  @param time s, not decreasing. No heap, no throw. */
  void Update(double time, const HapticHalfInput& input,
              State* state) const noexcept;

 private:
  PositionForceParams params_;
  WorkspaceMap map_;
  LinkMonitor monitor_;
  PoseSender sender_;
};

/** The classic two-channel scheme, with which the paper compares: position goes
to the robot, the force sensed there comes straight back. */
struct PositionForceScheme {
  static constexpr const char* kName = "position_force";
  static constexpr bool kUsesSelections = false;
  static constexpr bool kReclutches = true;
  static constexpr MessageTag kToRobot = PoseMessage::kTag;
  static constexpr MessageTag kToDevice = ForceMessage::kTag;
  using Params = PositionForceParams;
  using RobotHalf = PositionForceRobotHalf;
  using HapticHalf = PositionForceHapticHalf;

  /** The paper's gains for its two-channel controller; none of what the dual
  proxy's adds. */
  template <typename ControllerParams>
  static void ApplyPresets(RobotSideProxyParams* proxy,
                           ControllerParams* controller) {
    controller->position_stiffness = 100;
    controller->position_damping = 20;
    controller->feed_forward = false;
    proxy->max_motion_error = 0;
    // No acceleration is fed forward: a limit of the jerk would only be a lag.
    proxy->limiter.max_jerk = 0;
    proxy->limiter.max_angular_jerk = 0;
  }
};

}  // namespace dual_proxy
