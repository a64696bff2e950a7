// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "dual_proxy/common/low_pass.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/link/message.h"
#include "dual_proxy/link/sample_sender.h"
#include "dual_proxy/proxy/workspace_limits.h"
#include "dual_proxy/proxy/workspace_map.h"
#include "dual_proxy/schemes/half.h"
#include "dual_proxy/schemes/target_follower.h"
#include "dual_proxy/schemes/wave_variables/wave_channel.h"

namespace dual_proxy {

/** Parameters of scheme `wave_variables`; all in the robot's scale. */
struct WaveVariablesParams {
  double wave_impedance{40};
  double robot_stiffness{440};
  double robot_damping{40};
  double max_robot_force{60};
  double force_scale{1};
  double wave_cutoff{20};
  double healing_time{0.5};
  double energy_reserve{0.05};
  double release_rate{20};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const { ValidateFields("WaveVariablesParams", *this); }

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("wave_impedance", &wave_impedance, Above(0), "N s/m",
                   "b: small for free motion, large for stiff contact"));
    a->Visit(
        Field("robot_stiffness", &robot_stiffness, AtLeast(0), "N/m", "Ks"));
    a->Visit(Field("robot_damping", &robot_damping, AtLeast(0), "N s/m",
                   "Bs; with that of wave_impedance no wave is thrown back "
                   "before it has moved the robot"));
    a->Visit(Field("max_robot_force", &max_robot_force, AtLeast(0), "N",
                   "bound on |F_c|"));
    a->Visit(Field("force_scale", &force_scale, Above(0), "",
                   "kappa: share of f_d that the hand feels"));
    a->Visit(
        Field("wave_cutoff", &wave_cutoff, CutoffOrNone(), "Hz",
              "low-pass of received waves against the ripple of their "
              "messages, which makes the link 1 / (2 pi this) longer; 0 is "
              "none: a touch then comes to the hand in steps of newtons"));
    a->Visit(Field("healing_time", &healing_time, AtLeast(0), "s",
                   "in which received waves make good what late and lost "
                   "messages did; less than a message's interval is that"));
    a->Visit(Field("energy_reserve", &energy_reserve, AtLeast(0), "J",
                   "E_res: what may be played of each wave before it has "
                   "come"));
    a->Visit(Field("release_rate", &release_rate, Above(0), "N/s",
                   "at which the hand's force goes to zero without a link"));
  }
};

/** Of both messages; their sizes tell them apart. */
inline constexpr MessageTag kWaveVariablesTag =
    MakeMessageTag("wave_variables");

/** What the device sends. */
struct WaveToRobot {
  static constexpr MessageTag kTag = kWaveVariablesTag;
  static constexpr int kSize = 13;

  std::int64_t sequence{-1};  ///< 0, 1, 2, ...; -1: nothing has come yet.
  double send_time{0};        ///< Sender's clock, s.
  WaveSums sums{};            ///< Of u.
  /** R_d, in B. */
  Eigen::Matrix3d orientation{Eigen::Matrix3d::Identity()};

  /** Writes or reads the kSize numbers of the body. */
  void WriteBody(double* body) const noexcept;
  void ReadBody(const double* body) noexcept;
};

/** What the robot sends. */
struct WaveToDevice {
  static constexpr MessageTag kTag = kWaveVariablesTag;
  static constexpr int kSize = 4;

  std::int64_t sequence{-1};  ///< 0, 1, 2, ...; -1: nothing has come yet.
  double send_time{0};        ///< Sender's clock, s.
  WaveSums sums{};            ///< Of w.

  /** Writes or reads the kSize numbers of the body. */
  void WriteBody(double* body) const noexcept;
  void ReadBody(const double* body) noexcept;
};

/** True if the message may be acted on: its sums are valid, its orientation is
a rotation. */
bool IsValid(const WaveToRobot& message) noexcept;
bool IsValid(const WaveToDevice& message) noexcept;

/** What WaveVariablesRobotHalf remembers. */
struct WaveVariablesRobotHalfState {
  enum class Mode {
    kNone,    ///< Nothing is known of the robot.
    kHold,    ///< x_sd stays where the robot was.
    kFollow,  ///< x_sd goes with the waves.
  };

  LinkMonitorState link;
  Mode mode{Mode::kNone};
  WavePlayerState player;  ///< Of u.
  WaveSums sent{};         ///< Of w.
  /** R_d of the message in use, in B. */
  Eigen::Matrix3d orientation{Eigen::Matrix3d::Identity()};
  /** x_sd, m, in B: where the robot's spring is fixed. */
  Eigen::Vector3d target{Eigen::Vector3d::Zero()};
  TargetFollowerState follower;  ///< Of the orientation alone.
  SampleSenderState<WaveToDevice> sender;
  RobotHalfOutput output{};  ///< Of the last period.
};

/** The robot half of scheme `wave_variables`: the received wave u moves the
place x_sd where the robot's spring is fixed, and what it does not move comes
back as w,

    v_sd = (sqrt(2b) u + Bs v - Ks (x_sd - x)) / (b + Bs + Ks h)
    F_c = Ks (x_sd - x) + Bs (v_sd - v)        w = (b v_sd - F_c) / sqrt(2b).

F_c is commanded as it is, without force feedback. Where it is bounded, x_sd
yields to the wave as to a force of that size; at the end of the workspace it
stops and the wave comes back as from a wall: neither makes energy. The
orientation follows R_d by motion control.

Waves tell of velocity: x_sd starts at the robot's own position, with the first
message and anew with the first after a loss of the link. Without a link and
while the force sensor is not ready the robot holds its place and sends no wave.
A period whose time, pose or velocity is not valid is refused and counted: F_c
is zero, and x_sd starts anew. */
class WaveVariablesRobotHalf {
 public:
  using State = WaveVariablesRobotHalfState;

  /** @throws std::invalid_argument if a parameter is invalid. */
  WaveVariablesRobotHalf(const RobotHalfParams& shared,
                         const WaveVariablesParams& own);

  State MakeState() const;

  /** Advances by one period; the results are in state->output.
  @param time s, not decreasing. No heap, no throw. */
  void Update(double time, const RobotHalfInput& input,
              State* state) const noexcept;

 private:
  Eigen::Vector3d Follow(const Eigen::Vector3d& x, const Eigen::Vector3d& v,
                         State* state) const noexcept;

  WaveVariablesParams params_;
  WorkspaceLimits workspace_;
  LinkMonitor monitor_;
  WavePlayer player_;
  TargetFollower follower_;
  SampleSender<WaveToDevice> sender_;
  double period_;
};

/** What WaveVariablesHapticHalf remembers. */
struct WaveVariablesHapticHalfState {
  LinkMonitorState link;
  WavePlayerState player;                                ///< Of w.
  WaveSums sent{};                                       ///< Of u.
  Eigen::Vector3d steady_wave{Eigen::Vector3d::Zero()};  ///< LowPass(w).
  SampleSenderState<WaveToRobot> sender;
  HapticHalfOutput output{};  ///< Of the last period.
};

/** The haptic half of scheme `wave_variables`:

    u = sqrt(2b) v_d - w    f_d = b v_d - sqrt(2b) w    F_h = -kappa R_DB f_d

with the device's velocity v_d in B and in the robot's scale. Before the first
message w is zero, so that the hand feels the damping of a link that is longer
still, and what it does meanwhile is on its way. While a clutch holds the device
u = -g w, with g in [0, 1] for which g w has no more than LowPass(w) has along
w: a device at rest would throw back every wave, and one under way would move
the robot to and fro for long. What holds a contact is steady and goes back.
When the link is lost the force goes to zero at release_rate, and no wave is
sent until one comes. A period whose time, pose or velocity is not valid is
refused and counted: the same happens. */
class WaveVariablesHapticHalf {
 public:
  using State = WaveVariablesHapticHalfState;

  /** Of that low-pass, Hz. */
  static constexpr double kSteadyCutoff = 0.3;

  /** @throws std::invalid_argument if a parameter is invalid. */
  WaveVariablesHapticHalf(const HapticHalfParams& shared,
                          const WaveVariablesParams& own);

  State MakeState() const;

  /** Advances by one period; the results are in state->output.
  @param time s, not decreasing. No heap, no throw. */
  void Update(double time, const HapticHalfInput& input,
              State* state) const noexcept;

 private:
  WaveVariablesParams params_;
  WorkspaceMap map_;
  LinkMonitor monitor_;
  WavePlayer player_;
  SampleSender<WaveToRobot> sender_;
  double period_;
  double steady_gain_;
  double max_release_;  // N: in a period.
};

/** Wave variables: what goes over the link are not velocity v and force f but

    u = (b v + f) / sqrt(2b)        w = (b v - f) / sqrt(2b),

whose powers |u|^2 / 2 and |w|^2 / 2 no delay can increase, so that the link is
passive however late it is (Niemeyer and Slotine, "Stable adaptive
teleoperation", IEEE J. Oceanic Engineering 16, 1991; "Telemanipulation with
time delays", Int. J. Robotics Research 23, 2004). The price: the link feels
like a mass of b T in free motion and like a spring of b / T in contact, T the
delay one way, a message's interval and 1 / (2 pi wave_cutoff). Sums of waves
and of their energy make it so with messages that are rare, late or lost, too
(WavePlayer).

The default wave_cutoff is not for stability: nothing swings without it. Without
it the hand gets a touch in steps of 3 N within a millisecond, one per message,
with it of 0.3 N; what it costs is 2.4 % of the force in contact at 50 ms, less
at longer delays, and 0.2 kg of felt mass
(tests/schemes/wave_variables_test.cc). */
struct WaveVariablesScheme {
  static constexpr const char* kName = "wave_variables";
  static constexpr bool kUsesSelections = false;
  static constexpr bool kReclutches = false;
  static constexpr MessageTag kToRobot = WaveToRobot::kTag;
  static constexpr MessageTag kToDevice = WaveToDevice::kTag;
  using Params = WaveVariablesParams;
  using RobotHalf = WaveVariablesRobotHalf;
  using HapticHalf = WaveVariablesHapticHalf;

  template <typename ControllerParams>
  static void ApplyPresets(RobotSideProxyParams*, ControllerParams*) {}
};

}  // namespace dual_proxy
