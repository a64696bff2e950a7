// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <utility>

#include <Eigen/Core>

#include "dual_proxy/common/enum_strings.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/link/sample_sender.h"
#include "dual_proxy/proxy/workspace_limits.h"
#include "dual_proxy/proxy/workspace_map.h"
#include "dual_proxy/schemes/half.h"
#include "dual_proxy/schemes/target_follower.h"
#include "dual_proxy/schemes/tdpa/device_passivity.h"

namespace dual_proxy {

/** Which energies scheme `tdpa` observes. */
enum class TdpaObserver {
  /** Sensed force and all of the far side's energy, at the device's port alone
  (Hannaford and Ryu 2002; Ryu, Kwon, Hannaford 2004). */
  kOnePort,
  /** Energy in and out at both ports of the link (Ryu, Artigas, Preusche 2010),
  with drift compensation (Coelho et al. 2019). */
  kTwoPort,
  /** The same, but what the robot's spring gives back is lent to the device
  (Panzirsch, Ryu, Ferre 2019). */
  kEnergyReflection,
};

template <>
struct EnumStrings<TdpaObserver> {
  static constexpr std::pair<TdpaObserver, const char*> kValues[] = {
      {TdpaObserver::kOnePort, "one_port"},
      {TdpaObserver::kTwoPort, "two_port"},
      {TdpaObserver::kEnergyReflection, "energy_reflection"}};
};

/** Parameters of scheme `tdpa`; in the robot's scale unless said. */
struct TdpaParams {
  TdpaObserver observer{TdpaObserver::kEnergyReflection};
  bool passivity_control{true};
  double initial_energy{0.05};
  double robot_stiffness{440};
  double coupling_damping{5};
  double robot_damping{88};
  double max_robot_force{60};
  /** With 1 the loop gain of force in contact, that times map.scale Ks / K of
  the hand, is 1.8 in a firm hand: more than the Omega.7 can damp. */
  double force_scale{0.6};
  double max_device_damping{27};
  int actuation_delay{1};
  double release_rate{20};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const { ValidateFields("TdpaParams", *this); }

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    VisitEnum(a, "TdpaParams", "observer", &observer,
              "which energies are observed, and who pays for a lack");
    a->Visit(Field("passivity_control", &passivity_control,
                   "false: the energies are observed, nothing is injected"));
    a->Visit(Field("initial_energy", &initial_energy, AtLeast(0), "J",
                   "E0, that each port may give away at first; none with "
                   "one_port"));
    a->Visit(
        Field("robot_stiffness", &robot_stiffness, AtLeast(0), "N/m", "Ks"));
    a->Visit(Field("coupling_damping", &coupling_damping, AtLeast(0), "N s/m",
                   "Bc, beside that spring; none with one_port"));
    a->Visit(Field("robot_damping", &robot_damping, AtLeast(0), "N s/m",
                   "Bl, of the robot to its base"));
    a->Visit(Field("max_robot_force", &max_robot_force, AtLeast(0), "N",
                   "bound on |F_c|"));
    a->Visit(Field("force_scale", &force_scale, Above(0), "",
                   "kappa: share of f_d that the hand feels"));
    a->Visit(Field("max_device_damping", &max_device_damping, AtLeast(0),
                   "N s/m",
                   "of the device itself, what it can inject; 27 is 90 % of "
                   "the Omega.7's"));
    a->Visit(Field("actuation_delay", &actuation_delay,
                   Between(0, DevicePassivityParams::kMaxActuationDelay),
                   "periods", "before a force sent to the device acts"));
    a->Visit(Field("release_rate", &release_rate, Above(0), "N/s",
                   "at which the hand's force goes to zero without a link"));
  }
};

/** What `tdpa` sends to the robot. */
struct TdpaMotionMessage {
  static constexpr MessageTag kTag = MakeMessageTag("tdpa_motion");
  static constexpr int kSize = 13;

  std::int64_t sequence{-1};
  double send_time{0};  ///< Sender's clock, s.
  Pose pose{};          ///< x_d, R_d, in B and in the robot's scale.
  double energy{0};     ///< EinL, J: all that came in from the hand.

  /** Writes or reads the kSize numbers of the body. */
  void WriteBody(double* body) const noexcept;
  void ReadBody(const double* body) noexcept;
};

/** What `tdpa` sends to the device. */
struct TdpaForceMessage {
  static constexpr MessageTag kTag = MakeMessageTag("tdpa_force");
  static constexpr int kSize = 4;

  std::int64_t sequence{-1};
  double send_time{0};  ///< Sender's clock, s.
  /** f_s, or F_s with one_port, N, in B. */
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};
  /** EinR, EdesL with energy_reflection, E_rob with one_port, J: what may leave
  at the device, all in all. */
  double energy{0};

  /** Writes or reads the kSize numbers of the body. */
  void WriteBody(double* body) const noexcept;
  void ReadBody(const double* body) noexcept;
};

/** True if the message may be acted on: finite, its pose is a pose. */
bool IsValid(const TdpaMotionMessage& message) noexcept;
/** True if the message may be acted on: finite. */
bool IsValid(const TdpaForceMessage& message) noexcept;

/** What TdpaRobotHalf remembers. */
struct TdpaRobotHalfState {
  LinkMonitorState link;
  Pose goal{};         ///< x_d^, R_d^, within the workspace.
  double received{0};  ///< J: EinL^.
  int steps{1};        ///< n: periods in which x_ref is to be at the goal.
  TargetFollowerState follower;
  bool observing{false};
  Eigen::Vector3d reference{Eigen::Vector3d::Zero()};  ///< x_ref, m.
  Eigen::Vector3d target{Eigen::Vector3d::Zero()};     ///< x_sd, m.
  /** J: W with two_port, Est with energy_reflection: what may still leave. */
  double balance{0};
  double counted{0};     ///< J: of `received`, in `balance` already.
  double granted{0};     ///< J: sent, see TdpaForceMessage::energy.
  double dissipated{0};  ///< J: EpcR, all that the controller took.
  /** Periods in which a bound kept the controller from making up for what had
  left. */
  std::int64_t saturated{0};
  /** Of the last period, with one_port: F_P, F_c, x. */
  Eigen::Vector3d spring_force{Eigen::Vector3d::Zero()};
  Eigen::Vector3d robot_force{Eigen::Vector3d::Zero()};
  Eigen::Vector3d position{Eigen::Vector3d::Zero()};
  SampleSenderState<TdpaForceMessage> sender;
  RobotHalfOutput output{};  ///< Of the last period.
};

/** The robot half of scheme `tdpa`. The robot hangs on x_sd by a spring:

    f_s = Ks (x_sd - x) + Bc (v_sd - v)         F_c = f_s - d v - Bl v

commanded as it is, without force feedback, f_s bounded so that F_c is. x_ref
goes to x_d in a message's interval, at v_in.

one_port: x_sd = x_ref, Bc = 0; f_s is F_P. Sends the sensed force and

    E_rob = sum F_P . dx_ref - F_c . dx

two_port: x_sd moves at v_sd, which is v_in and, if that costs less than half of
W, a part of the way back to x_ref. What leaves to the spring may not be more
than what came from the device:

    P = f_s . v_sd > 0: W -= h P;  else EinR -= h P;         W += dEinL^
    W < 0:  v_sd -= dv,  dv = -W f_s / (h |f_s|^2)

energy_reflection: x_sd = x_ref. What the spring gives back to the left is
granted to the device, what it gives to the robot passes, as far as there is
energy for both; the robot is damped for the rest, and what that can not take is
a debt:

    o3 = max(0, -f_s . v_in),  o4 = max(0, f_s . v)
    Est += dEinL^ + h max(0, -f_s . v),  g = min(1, Est / (h (o3 + o4)))
    EdesL += h g o3,  Est -= h g (o3 + o4),  d = (1 - g) o4 / |v|^2

The orientation follows R_d by motion control and is in no energy. Before the
first message, without a link and while the force sensor is not ready the robot
holds its place, from where it goes to x_d by a TargetFollower; the observers
start anew when it is there. A period whose time, pose or velocity is not valid
is refused and counted: F_c is zero. */
class TdpaRobotHalf {
 public:
  using State = TdpaRobotHalfState;

  /** dv is no more than this, m/s. */
  static constexpr double kMaxVelocityChange = 0.5;
  /** N: with less, dv would be noise. */
  static constexpr double kMinForce = 0.05;
  /** d is no more than this, N s/m: stable with a period's delay from 1 kg on.
   */
  static constexpr double kMaxDamping = 500;
  /** s, m/s: in which time a drift goes, and how fast at most. */
  static constexpr double kDriftTime = 0.1;
  static constexpr double kDriftSpeed = 0.1;

  /** @throws std::invalid_argument if a parameter is invalid. */
  TdpaRobotHalf(const RobotHalfParams& shared, const TdpaParams& own);

  State MakeState() const;

  /** Advances by one period; the results are in state->output.
  @param time s, not decreasing. No heap, no throw. */
  void Update(double time, const RobotHalfInput& input,
              State* state) const noexcept;

 private:
  // One period of a robot whose position and velocity are valid: F_c, and the
  // force that goes to the device.
  Eigen::Vector3d Control(const RobotHalfInput& input, State* state,
                          Eigen::Vector3d* sent_force) const noexcept;
  void Restart(State* state) const noexcept;
  // Returns v_in.
  Eigen::Vector3d MoveReference(State* state) const noexcept;
  // two_port: moves x_sd.
  void MoveTarget(const Eigen::Vector3d& f_s, const Eigen::Vector3d& v_in,
                  State* state) const noexcept;
  // energy_reflection: F_c with d, from that without.
  Eigen::Vector3d Reflect(const Eigen::Vector3d& f_s,
                          const Eigen::Vector3d& v_in, const Eigen::Vector3d& v,
                          const Eigen::Vector3d& F_c,
                          State* state) const noexcept;

  TdpaParams params_;
  double period_;
  int steps_;  // Of a message's interval.
  WorkspaceLimits workspace_;
  LinkMonitor monitor_;
  TargetFollower follower_;
  SampleSender<TdpaForceMessage> sender_;
};

/** What TdpaHapticHalf remembers. */
struct TdpaHapticHalfState {
  LinkMonitorState link;
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};  ///< f_s^, N, in B.
  double received{0};  ///< J: TdpaForceMessage::energy.
  DevicePassivityState passivity;
  SampleSenderState<TdpaMotionMessage> sender;
  HapticHalfOutput output{};  ///< Of the last period.
};

/** The haptic half of scheme `tdpa`:

    f_d = f_s^ + alpha v_d        F_h = -kappa R_DB f_d

with alpha of DevicePassivity at the port (f_d, v_d), bounded so that the
device's own damping is at most max_device_damping.

What acted there is what the device's controller says it sent,
HapticHalfInput::device_wrench. A command of period k is reported at k + 1; it
acts from k + actuation_delay on for one period, so at k it is paired with the
step from x(k - 1) to x(k) if it was given at k - 1 - actuation_delay.
TeleopLoop's device moves under the wrench of the period before: 1.

Before the first message the force is zero; when the link is lost it goes to
zero at release_rate. A period whose time, pose, velocity or wrench is not valid
is refused and counted: the force goes to zero likewise, and the period after is
observed together with it. */
class TdpaHapticHalf {
 public:
  using State = TdpaHapticHalfState;

  /** @throws std::invalid_argument if a parameter is invalid. */
  TdpaHapticHalf(const HapticHalfParams& shared, const TdpaParams& own);

  State MakeState() const;

  /** Advances by one period; the results are in state->output.
  @param time s, not decreasing. No heap, no throw. */
  void Update(double time, const HapticHalfInput& input,
              State* state) const noexcept;

 private:
  TdpaParams params_;
  WorkspaceMap map_;
  LinkMonitor monitor_;
  DevicePassivity passivity_;
  SampleSender<TdpaMotionMessage> sender_;
  double max_release_;  // N: in a period.
};

/** Time-domain passivity: a position goes to the robot, a force comes back, and
each side keeps what leaves its port below what the other side took in, by
damping. Energies are in the link's joules, in the robot's scale. */
struct TdpaScheme {
  static constexpr const char* kName = "tdpa";
  static constexpr bool kUsesSelections = false;
  static constexpr bool kReclutches = false;
  static constexpr MessageTag kToRobot = TdpaMotionMessage::kTag;
  static constexpr MessageTag kToDevice = TdpaForceMessage::kTag;
  using Params = TdpaParams;
  using RobotHalf = TdpaRobotHalf;
  using HapticHalf = TdpaHapticHalf;

  template <typename ControllerParams>
  static void ApplyPresets(RobotSideProxyParams*, ControllerParams*) {}
};

}  // namespace dual_proxy
