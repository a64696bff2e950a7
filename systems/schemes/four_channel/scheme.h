// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <utility>

#include <Eigen/Core>

#include "dual_proxy/common/enum_strings.h"
#include "dual_proxy/common/low_pass.h"
#include "dual_proxy/common/pose.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/link/message.h"
#include "dual_proxy/link/sample_sender.h"
#include "dual_proxy/proxy/workspace_limits.h"
#include "dual_proxy/proxy/workspace_map.h"
#include "dual_proxy/schemes/half.h"
#include "dual_proxy/schemes/target_follower.h"

namespace dual_proxy {

/** Parameters of scheme `four_channel`; all in the robot's scale but for what
is of the device itself. */
struct FourChannelParams {
  /** Which of the two forces the hand's machine acts on. */
  enum class Variant {
    kFourChannel,   ///< C2 = 1, C6 = 0: the force that the robot feels.
    kThreeChannel,  ///< C2 = 0, C6 = -1: the force of the hand itself.
  };

  Variant variant{Variant::kFourChannel};
  double robot_stiffness{440};
  double robot_damping{88};
  double max_robot_force{60};
  double haptic_stiffness{440};
  double device_damping{27};
  double force_scale{1};
  double device_mass{0.25};
  double device_friction{1};
  double hand_force_cutoff{20};
  double release_rate{20};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const { ValidateFields("FourChannelParams", *this); }

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    VisitEnum(a, "FourChannelParams", "variant", &variant,
              "whether the device acts on the robot's force, or on the hand's, "
              "so that three quantities go over the link");
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
    a->Visit(Field("device_mass", &device_mass, AtLeast(0), "kg",
                   "m: of the device, without the hand"));
    a->Visit(Field("device_friction", &device_friction, AtLeast(0), "N s/m",
                   "b: of the device, viscous"));
    a->Visit(Field("hand_force_cutoff", &hand_force_cutoff, AtLeast(kMinCutoff),
                   "Hz", "low-pass of the estimated force of the hand"));
    a->Visit(Field("release_rate", &release_rate, Above(0), "N/s",
                   "at which the hand's force goes to zero without a link"));
  }
};

template <>
struct EnumStrings<FourChannelParams::Variant> {
  using Variant = FourChannelParams::Variant;
  static constexpr std::pair<Variant, const char*> kValues[] = {
      {Variant::kFourChannel, "four_channel"},
      {Variant::kThreeChannel, "three_channel"}};
};

/** Of both messages; their sizes tell them apart. */
inline constexpr MessageTag kFourChannelTag = MakeMessageTag("four_channel");

/** What the device sends, in B and in the robot's scale. */
struct FourChannelToRobot {
  static constexpr MessageTag kTag = kFourChannelTag;
  static constexpr int kSize = 18;

  std::int64_t sequence{-1};  ///< 0, 1, 2, ...; -1: nothing has come yet.
  double send_time{0};        ///< Sender's clock, s.
  Pose pose{};                ///< x_d, R_d.
  Eigen::Vector3d velocity{Eigen::Vector3d::Zero()};  ///< v_d, m/s.
  /** f_h, N: of the hand on the device, divided by kappa. */
  Eigen::Vector3d hand_force{Eigen::Vector3d::Zero()};

  /** Writes or reads the kSize numbers of the body. */
  void WriteBody(double* body) const noexcept;
  void ReadBody(const double* body) noexcept;
};

/** What the robot sends, in B. */
struct FourChannelToDevice {
  static constexpr MessageTag kTag = kFourChannelTag;
  static constexpr int kSize = 9;

  std::int64_t sequence{-1};  ///< 0, 1, 2, ...; -1: nothing has come yet.
  double send_time{0};        ///< Sender's clock, s.
  Eigen::Vector3d position{Eigen::Vector3d::Zero()};  ///< x_r, m.
  Eigen::Vector3d velocity{Eigen::Vector3d::Zero()};  ///< v_r, m/s.
  /** F_s, N: of the robot on its environment. */
  Eigen::Vector3d sensed_force{Eigen::Vector3d::Zero()};

  /** Writes or reads the kSize numbers of the body. */
  void WriteBody(double* body) const noexcept;
  void ReadBody(const double* body) noexcept;
};

/** True if the message may be acted on: finite, and its pose is a pose. */
bool IsValid(const FourChannelToRobot& message) noexcept;
/** True if the message may be acted on: finite. */
bool IsValid(const FourChannelToDevice& message) noexcept;

/** What FourChannelRobotHalf remembers. */
struct FourChannelRobotHalfState {
  LinkMonitorState link;
  /** x_d, R_d of the message in use, within the workspace; v_d and f_h, without
  what would lead out of it. */
  Pose goal{};
  Eigen::Vector3d velocity{Eigen::Vector3d::Zero()};
  Eigen::Vector3d hand_force{Eigen::Vector3d::Zero()};
  TargetFollowerState follower;
  SampleSenderState<FourChannelToDevice> sender;
  RobotHalfOutput output{};  ///< Of the last period.
};

/** The robot half of scheme `four_channel`:

    F_c = Ks (x_d - x) + Bs (v_d - v) + f_h

commanded as it is, without force feedback; the orientation follows R_d by
motion control. Before the first message, without a link and while the force
sensor is not ready the robot holds its place, from where it goes to x_d by a
TargetFollower; v_d and f_h are zero until it is there. A period whose time,
pose or velocity is not valid is refused and counted: F_c is zero. */
class FourChannelRobotHalf {
 public:
  using State = FourChannelRobotHalfState;

  /** @throws std::invalid_argument if a parameter is invalid. */
  FourChannelRobotHalf(const RobotHalfParams& shared,
                       const FourChannelParams& own);

  State MakeState() const;

  /** Advances by one period; the results are in state->output.
  @param time s, not decreasing. No heap, no throw. */
  void Update(double time, const RobotHalfInput& input,
              State* state) const noexcept;

 private:
  FourChannelParams params_;
  WorkspaceLimits workspace_;
  LinkMonitor monitor_;
  TargetFollower follower_;
  SampleSender<FourChannelToDevice> sender_;
};

/** Memory of the estimate of the hand's force on the device; in D. */
struct HandForceEstimate {
  bool started{false};
  Eigen::Vector3d position{Eigen::Vector3d::Zero()};  ///< m, a period ago.
  /** m/s, and F_dev, N: after a low-pass. */
  Eigen::Vector3d velocity{Eigen::Vector3d::Zero()};
  Eigen::Vector3d device_force{Eigen::Vector3d::Zero()};
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};  ///< N: the result.
};

/** What FourChannelHapticHalf remembers. */
struct FourChannelHapticHalfState {
  LinkMonitorState link;
  FourChannelToDevice robot{};  ///< The message in use.
  HandForceEstimate estimate{};
  SampleSenderState<FourChannelToRobot> sender;
  HapticHalfOutput output{};  ///< Of the last period.
};

/** The haptic half of scheme `four_channel`:

    f_d = Km (x_d - x^) + Bm (v_d - v^) + F_s^    F_h = -kappa R_DB f_d

and with `three_channel` f_h in place of F_s^, x_d, v_d in B and in the robot's
scale. Nothing measures f_h: it is what the device's motion under its own force
tells,

    kappa R_DB f_h = low-pass of m a_h + b v_h - F_dev,

with a_h and v_h from differences of the read positions, after a low-pass of the
same kind, which F_dev passes, too.

Before the first message the force is zero; when the link is lost it goes to
zero at release_rate. A period whose time, pose, velocity or wrench is not valid
is refused and counted: the force goes to zero likewise, and the estimate of f_h
starts anew. */
class FourChannelHapticHalf {
 public:
  using State = FourChannelHapticHalfState;

  /** @throws std::invalid_argument if a parameter is invalid. */
  FourChannelHapticHalf(const HapticHalfParams& shared,
                        const FourChannelParams& own);

  State MakeState() const;

  /** Advances by one period; the results are in state->output.
  @param time s, not decreasing. No heap, no throw. */
  void Update(double time, const HapticHalfInput& input,
              State* state) const noexcept;

 private:
  void EstimateHandForce(const HapticHalfInput& input,
                         HandForceEstimate* estimate) const noexcept;

  FourChannelParams params_;
  WorkspaceMap map_;
  LinkMonitor monitor_;
  SampleSender<FourChannelToRobot> sender_;
  double period_;
  double low_pass_gain_;  // Of the hand's force.
  double damping_;        // Bm, N s/m.
  double max_release_;    // N: in a period.
};

/** The four-channel architecture: positions and forces go both ways, so that
without delay robot and hand move as one and feel the same force (Lawrence,
"Stability and transparency in bilateral teleoperation", IEEE Trans. Robotics
and Automation 9, 1993):

    F_c = Ks (x_d^ - x) + Bs (v_d^ - v) + C3 f_h^ - C5 F_s
    f_d = Km (x_d - x^) + Bm (v_d - v^) + C2 F_s^ - C6 f_h

is transparent for C2 = 1 + C6, C3 = 1 + C5. Here C5 = 0, and C6 is 0 or, with
`three_channel`, -1, which needs no force sensor on the robot (Hashtrudi-Zaad
and Salcudean, "Analysis of control architectures for teleoperation systems with
impedance/admittance master and slave manipulators", Int. J. Robotics Research
20, 2001). Transparency leaves no margin: the first oscillates at a stiff wall
even without delay, the other with delay where the hand is soft or the robot
light. */
struct FourChannelScheme {
  static constexpr const char* kName = "four_channel";
  static constexpr bool kUsesSelections = false;
  static constexpr bool kReclutches = false;
  static constexpr MessageTag kToRobot = FourChannelToRobot::kTag;
  static constexpr MessageTag kToDevice = FourChannelToDevice::kTag;
  using Params = FourChannelParams;
  using RobotHalf = FourChannelRobotHalf;
  using HapticHalf = FourChannelHapticHalf;

  template <typename ControllerParams>
  static void ApplyPresets(RobotSideProxyParams*, ControllerParams*) {}
};

}  // namespace dual_proxy
