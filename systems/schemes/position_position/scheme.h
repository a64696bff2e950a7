// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/common/serialize.h"
#include "dual_proxy/link/message.h"
#include "dual_proxy/link/sample_sender.h"
#include "dual_proxy/proxy/workspace_limits.h"
#include "dual_proxy/proxy/workspace_map.h"
#include "dual_proxy/schemes/half.h"
#include "dual_proxy/schemes/target_follower.h"

namespace dual_proxy {

/** Parameters of scheme `position_position`; all in the robot's scale. */
struct PositionPositionParams {
  double robot_stiffness{440};
  double robot_damping{88};
  double max_robot_force{60};
  double haptic_stiffness{440};
  double device_damping{27};
  double force_scale{1};
  double release_rate{20};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const { ValidateFields("PositionPositionParams", *this); }

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(
        Field("robot_stiffness", &robot_stiffness, AtLeast(0), "N/m", "Ks"));
    a->Visit(Field("robot_damping", &robot_damping, AtLeast(0), "N s/m", "Bs"));
    a->Visit(Field("max_robot_force", &max_robot_force, AtLeast(0), "N",
                   "bound on |F_c|"));
    a->Visit(Field("haptic_stiffness", &haptic_stiffness, AtLeast(0), "N/m",
                   "Km, in the robot's scale"));
    a->Visit(
        Field("device_damping", &device_damping, AtLeast(0), "N s/m",
              "of the device itself: Bm = this / (force_scale map.scale)"));
    a->Visit(Field("force_scale", &force_scale, Above(0), "",
                   "kappa: share of f_d that the hand feels"));
    a->Visit(Field("release_rate", &release_rate, Above(0), "N/s",
                   "at which the hand's force goes to zero without a link"));
  }
};

/** Of the poses that this scheme sends, both ways in B and in the robot's
scale: x_d and R_d from the device, x_r and R_r from the robot. */
inline constexpr MessageTag kPositionPositionTag =
    MakeMessageTag("position_position");

/** What PositionPositionRobotHalf remembers. */
struct PositionPositionRobotHalfState {
  LinkMonitorState link;
  Pose goal{};  ///< x_d, R_d of the message in use, within the workspace.
  TargetFollowerState follower;
  SampleSenderState<PoseMessage> sender;
  RobotHalfOutput output{};  ///< Of the last period.
};

/** The robot half of scheme `position_position`:

    F_c = Ks (x_d - x) - Bs v

commanded as it is, without force feedback; the orientation follows R_d by
motion control. Before the first message, without a link and while the force
sensor is not ready the robot holds its place, from where it goes to x_d by a
TargetFollower. A period whose time, pose or velocity is not valid is refused
and counted: F_c is zero. */
class PositionPositionRobotHalf {
 public:
  using State = PositionPositionRobotHalfState;

  /** @throws std::invalid_argument if a parameter is invalid. */
  PositionPositionRobotHalf(const RobotHalfParams& shared,
                            const PositionPositionParams& own);

  State MakeState() const;

  /** Advances by one period; the results are in state->output.
  @param time s, not decreasing. No heap, no throw. */
  void Update(double time, const RobotHalfInput& input,
              State* state) const noexcept;

 private:
  PositionPositionParams params_;
  WorkspaceLimits workspace_;
  LinkMonitor monitor_;
  TargetFollower follower_;
  SampleSender<PoseMessage> sender_;
};

/** What PositionPositionHapticHalf remembers. */
struct PositionPositionHapticHalfState {
  LinkMonitorState link;
  /** x^, m, in B: the robot's position of the message in use. */
  Eigen::Vector3d robot_position{Eigen::Vector3d::Zero()};
  SampleSenderState<PoseMessage> sender;
  HapticHalfOutput output{};  ///< Of the last period.
};

/** The haptic half of scheme `position_position`:

    f_d = Km (x_d - x^) + Bm v_d        F_h = -kappa R_DB f_d

with the device's position x_d and velocity v_d in B and in the robot's scale.
Before the first message the force is zero; when the link is lost it goes to
zero at release_rate. A period whose time, pose or velocity is not valid is
refused and counted: the force goes to zero likewise. */
class PositionPositionHapticHalf {
 public:
  using State = PositionPositionHapticHalfState;

  /** @throws std::invalid_argument if a parameter is invalid. */
  PositionPositionHapticHalf(const HapticHalfParams& shared,
                             const PositionPositionParams& own);

  State MakeState() const;

  /** Advances by one period; the results are in state->output.
  @param time s, not decreasing. No heap, no throw. */
  void Update(double time, const HapticHalfInput& input,
              State* state) const noexcept;

 private:
  PositionPositionParams params_;
  WorkspaceMap map_;
  LinkMonitor monitor_;
  SampleSender<PoseMessage> sender_;
  double max_release_;  // N: in a period.
};

/** The symmetric two-channel scheme: each side sends its position and pulls its
own machine to the other's by a spring and a damper (Nuno, Basanez, Ortega,
"Passivity-based control for bilateral teleoperation: A tutorial", Automatica
47, 2011). Delayed springs are stable with enough damping on both sides:

    4 Bm Bs > (T1 + T2)^2 Km Ks,

T1 and T2 the delays, each with a message's interval and a control period. */
struct PositionPositionScheme {
  static constexpr const char* kName = "position_position";
  static constexpr bool kUsesSelections = false;
  static constexpr bool kReclutches = false;
  static constexpr MessageTag kToRobot = kPositionPositionTag;
  static constexpr MessageTag kToDevice = kPositionPositionTag;
  using Params = PositionPositionParams;
  using RobotHalf = PositionPositionRobotHalf;
  using HapticHalf = PositionPositionHapticHalf;

  template <typename ControllerParams>
  static void ApplyPresets(RobotSideProxyParams*, ControllerParams*) {}
};

}  // namespace dual_proxy
