// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Core>

#include "dual_proxy/control/haptic_controller.h"
#include "dual_proxy/control/point_controller.h"
#include "dual_proxy/link/communication_channel.h"
#include "dual_proxy/schemes/half.h"
#include "dual_proxy/sides/operator_aids.h"
#include "dual_proxy/simulation/haptic_device.h"

namespace dual_proxy {

/** What the textbooks of bilateral teleoperation argue with: a hand with its
device and a mass of 4.4 kg over a wall, with the two halves of a scheme and a
link between them; the scheme, and nothing of an arm. What a scheme commands
without force feedback pushes the mass as it is; otherwise PointController
drives it, and the wall's normal is selected from 1 N of its force on, until the
mass is 1 mm above it. */
template <typename Scheme>
class TextbookBench {
 public:
  static constexpr double kPeriod = 0.001;
  static constexpr double kInterval = 0.02;  ///< s: between two messages.
  static constexpr double kScale = 2.5;      ///< Of the map.
  static constexpr double kMass = 4.4;       ///< kg.
  static constexpr double kFelt = 1;         ///< N: shows a contact.
  static constexpr double kLeft = 1e-3;      ///< m: ends it.

  struct Params {
    typename Scheme::Params scheme;
    CommunicationChannelParams channel;
    double hand_stiffness{600};
    double hand_damping{30};
    /** Whether the device is read with the steps and the lag of its encoders.
     */
    bool encoders{false};
    double wall_stiffness{0};  ///< N/m: below Start().
    double clearance{0};       ///< m: of the mass above Start(), at first.
    OperatorAidsParams aids;
    /** m, in D: where the hand means the handle to be, and where it starts. */
    Eigen::Vector3d hand{Eigen::Vector3d::Zero()};
    Eigen::Vector3d handle{Eigen::Vector3d::Zero()};
  };

  /** m, in B: where the mass starts, on the wall. */
  static Eigen::Vector3d Start() { return {0.45, 0, 0.18}; }

  static RobotHalfParams MakeRobotHalfParams() {
    RobotHalfParams params;
    params.proxy.map = MakeMap();
    return params;
  }
  static HapticHalfParams MakeHapticHalfParams() {
    HapticHalfParams params;
    params.proxy.map = MakeMap();
    return params;
  }

  explicit TextbookBench(const Params& params)
      : params_(params),
        robot_(MakeRobotHalfParams(), params.scheme),
        haptic_(MakeHapticHalfParams(), params.scheme),
        channel_(params.channel),
        aids_(params.aids),
        device_(MakeDevice(params)),
        device_state_(device_.MakeState({.p = params.handle})) {
    position_.z() += params.clearance;
  }

  void Step() {
    const double time = kPeriod * tick_;
    RobotHalfInput robot;
    robot.message = channel_.Receive(time, to_robot_);
    robot.X_BE.p = position_;
    robot.v_BE.template head<3>() = velocity_;
    robot.sensed_wrench(2) = -wall_force();
    in_contact_ = wall_force() > kFelt ||
                  (in_contact_ && position_.z() < Start().z() + kLeft);
    if (in_contact_) robot.force_selection(2, 2) = 1;
    HapticHalfInput haptic{.message = channel_.Receive(time, to_device_),
                           .X_DH = device_state_.read_pose,
                           .device_velocity = device_state_.read_velocity,
                           .device_wrench = device_wrench_};
    const Vector6 device_velocity = haptic.device_velocity;
    if (aids_.on()) {
      aids_.FilterInput({.force_scale = force_scale_}, &haptic.X_DH,
                        &haptic.device_velocity, &aids_state_);
    }
    robot_.Update(time, robot, &robot_state_);
    haptic_.Update(time, haptic, &haptic_state_);
    channel_.Send(time, robot_state_.output.message, &to_device_);
    channel_.Send(time, haptic_state_.output.message, &to_robot_);

    HapticSetpoint setpoint = haptic_state_.output.setpoint;
    if (aids_.on()) aids_.FilterSetpoint(&setpoint, &aids_state_);
    device_wrench_ = device_controller_.Update(
        {.reference_force = setpoint.reference_force,
         .reference_moment = setpoint.reference_moment,
         .device_velocity = device_velocity,
         .force_selection = setpoint.force_selection,
         .contact_normals = setpoint.contact_normals,
         .fixture_force = aids_state_.fixture_force},
        &device_controller_state_);
    device_.Update({.p = params_.hand}, Eigen::Vector3d::Zero(), device_wrench_,
                   &device_state_);
    MoveMass(CalcRobotForce(robot));
    ++tick_;
  }

  void AdvanceTo(double time) {
    while (kPeriod * tick_ < time - kPeriod / 2) Step();
  }

  /** Advances by `duration`, s, and gives the least and the largest value of
  `function` in it. */
  template <typename Function>
  std::pair<double, double> Range(double duration, const Function& function) {
    const double end = time() + duration;
    double lowest = function();
    double highest = lowest;
    while (time() < end - kPeriod / 2) {
      Step();
      lowest = std::min(lowest, function());
      highest = std::max(highest, function());
    }
    return {lowest, highest};
  }

  /** Advances by `duration`, s, and gives mean and standard deviation of
  `function` in it. */
  template <typename Function>
  std::pair<double, double> MeanAndStd(double duration,
                                       const Function& function) {
    const double end = time() + duration;
    double sum = 0;
    double sum_of_squares = 0;
    int count = 0;
    for (; time() < end - kPeriod / 2; ++count) {
      Step();
      const double value = function();
      sum += value;
      sum_of_squares += value * value;
    }
    const double mean = sum / count;
    return {mean,
            std::sqrt(std::max(0.0, sum_of_squares / count - mean * mean))};
  }

  /** From now on the hand means the handle to be at p, m, in D. */
  void set_hand(const Eigen::Vector3d& p) { params_.hand = p; }

  /** From now on the operator asks for this scale of the force; for
  Params::aids.buttons. */
  void set_force_scale(double scale) { force_scale_ = scale; }

  double time() const { return kPeriod * tick_; }
  const OperatorAidsState& aids() const { return aids_state_; }
  const Eigen::Vector3d& position() const { return position_; }
  const Eigen::Vector3d& handle() const { return device_state_.pose.p; }
  const typename Scheme::RobotHalf::State& robot() const {
    return robot_state_;
  }
  const typename Scheme::HapticHalf::State& haptic() const {
    return haptic_state_;
  }
  /** N, in D: on the hand, after the limits of the device's controller. */
  Eigen::Vector3d device_force() const {
    return device_wrench_.template head<3>();
  }
  /** N: of the wall on the mass. */
  double wall_force() const {
    return params_.wall_stiffness * std::max(0.0, Start().z() - position_.z());
  }
  bool connected() const {
    return robot_state_.output.link.status == LinkStatus::kConnected &&
           haptic_state_.output.link.status == LinkStatus::kConnected;
  }

 private:
  static WorkspaceMapParams MakeMap() {
    WorkspaceMapParams map;
    map.p_cw = Start();
    map.scale = kScale;
    return map;
  }
  // 0.75 kg in all.
  static SimulatedHapticDeviceParams MakeDevice(const Params& params) {
    SimulatedHapticDeviceParams device;
    device.hand_stiffness = params.hand_stiffness;
    device.hand_damping = params.hand_damping;
    if (!params.encoders) {
      device.resolution = 0;
      device.velocity_cutoff = 0;
    }
    return device;
  }

  Eigen::Vector3d CalcRobotForce(const RobotHalfInput& input) {
    const RobotSetpoint& setpoint = robot_state_.output.setpoint;
    if (!setpoint.force_feedback) return setpoint.reference_force;
    return controller_
        .Update({.model = {.mass = kMass},
                 .v = input.v_BE.template head<3>(),
                 .motion_error = setpoint.motion_error,
                 .proxy_velocity = setpoint.velocity.template head<3>(),
                 .proxy_acceleration = setpoint.acceleration.template head<3>(),
                 .reference_force = setpoint.reference_force,
                 .force_selection = setpoint.force_selection,
                 .sensed_force = input.sensed_wrench.template head<3>()},
                &controller_state_)
        .force;
  }

  // In steps that are short against the wall's 12 ms.
  void MoveMass(const Eigen::Vector3d& force) {
    constexpr int kSteps = 10;
    for (int i = 0; i < kSteps; ++i) {
      Eigen::Vector3d total = force;
      total.z() += wall_force();
      velocity_ += kPeriod / kSteps / kMass * total;
      position_ += kPeriod / kSteps * velocity_;
    }
  }

  Params params_;
  typename Scheme::RobotHalf robot_;
  typename Scheme::HapticHalf haptic_;
  CommunicationChannel channel_;
  OperatorAids aids_;
  PointController controller_;
  HapticController device_controller_;
  SimulatedHapticDevice device_;
  typename Scheme::RobotHalf::State robot_state_{robot_.MakeState()};
  typename Scheme::HapticHalf::State haptic_state_{haptic_.MakeState()};
  PointControllerState controller_state_{controller_.MakeState()};
  HapticControllerState device_controller_state_;
  CommunicationChannelState to_robot_{channel_.MakeState(0)};
  CommunicationChannelState to_device_{channel_.MakeState(1)};
  SimulatedHapticDeviceState device_state_;
  Vector6 device_wrench_{Vector6::Zero()};
  Eigen::Vector3d position_{Start()};
  Eigen::Vector3d velocity_{Eigen::Vector3d::Zero()};
  OperatorAidsState aids_state_;
  double force_scale_{1};
  bool in_contact_{false};
  int tick_{0};
};

}  // namespace dual_proxy
