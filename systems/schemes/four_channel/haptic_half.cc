// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/schemes/four_channel/scheme.h"

#include <cmath>

#include "dual_proxy/common/low_pass.h"
#include "dual_proxy/common/possible.h"
#include "dual_proxy/common/rotation.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"

namespace dual_proxy {

using Eigen::Matrix3d;
using Eigen::Vector3d;

void FourChannelToRobot::WriteBody(double* body) const noexcept {
  Eigen::Map<Vector3d>{body} = pose.p;
  Eigen::Map<Matrix3d>{body + 3} = pose.R;
  Eigen::Map<Vector3d>{body + 12} = velocity;
  Eigen::Map<Vector3d>{body + 15} = hand_force;
}

void FourChannelToRobot::ReadBody(const double* body) noexcept {
  pose.p = Eigen::Map<const Vector3d>{body};
  pose.R = Eigen::Map<const Matrix3d>{body + 3};
  velocity = Eigen::Map<const Vector3d>{body + 12};
  hand_force = Eigen::Map<const Vector3d>{body + 15};
}

bool IsValid(const FourChannelToRobot& message) noexcept {
  return std::isfinite(message.send_time) && IsValidPose(message.pose) &&
         IsWithin(message.velocity, kMaxSpeed) &&
         IsWithin(message.hand_force, kMaxForce);
}

FourChannelHapticHalf::FourChannelHapticHalf(const HapticHalfParams& shared,
                                             const FourChannelParams& own)
    : params_((own.Validate(), own)),
      map_(shared.proxy.map),
      monitor_(shared.proxy.link),
      sender_(shared.sender),
      period_(shared.proxy.period),
      low_pass_gain_(LowPassGain(own.hand_force_cutoff, period_)),
      damping_(own.device_damping / (own.force_scale * shared.proxy.map.scale)),
      max_release_(own.release_rate * period_) {}

FourChannelHapticHalfState FourChannelHapticHalf::MakeState() const {
  return {.link = monitor_.MakeState(), .sender = sender_.MakeState()};
}

void FourChannelHapticHalf::EstimateHandForce(
    const HapticHalfInput& input, HandForceEstimate* estimate) const noexcept {
  const Vector3d& p = input.X_DH.p;
  const Vector3d F_dev = input.device_wrench.head<3>();
  if (!estimate->started) {
    *estimate = {.started = true,
                 .position = p,
                 .velocity = input.device_velocity.head<3>(),
                 .device_force = F_dev};
    return;
  }
  // Motion and force equally late: what one of them lags makes a force of its
  // own, on which three channels chatter. Hence no velocity of a driver's, of
  // which nobody knows how late it is.
  const Vector3d v_before = estimate->velocity;
  const auto low_pass = [this](const Vector3d& value, Vector3d* memory) {
    StoreIfFinite(*memory + low_pass_gain_ * (value - *memory), memory);
  };
  low_pass((p - estimate->position) / period_, &estimate->velocity);
  low_pass(F_dev, &estimate->device_force);
  estimate->position = p;
  const Vector3d force =
      params_.device_mass / period_ * (estimate->velocity - v_before) +
      params_.device_friction * estimate->velocity - estimate->device_force;
  low_pass(force, &estimate->force);
}

void FourChannelHapticHalf::Update(double time, const HapticHalfInput& input,
                                   State* state) const noexcept {
  const auto message = FromMessage<FourChannelToDevice>(input.message);
  const Pose X_d = map_.RobotProxy(input.X_DH.p, input.X_DH.R);
  HapticHalfOutput& output = state->output;
  if (monitor_.Update(time, message, &state->link)) state->robot = message;
  const Matrix3d& R_DB = map_.params().R_DB;
  const Vector3d v_d = map_.params().scale *
                       (R_DB.transpose() * input.device_velocity.head<3>());
  const bool valid = std::isfinite(time) && IsValidPose(input.X_DH) &&
                     input.device_velocity.allFinite() &&
                     input.device_wrench.allFinite();
  if (valid) {
    EstimateHandForce(input, &state->estimate);
  } else {
    ++output.bad_inputs;
    state->estimate = {};
  }
  const Vector3d f_h =
      R_DB.transpose() * state->estimate.force / params_.force_scale;

  Vector3d& force = output.setpoint.reference_force;
  if (valid && state->link.status == LinkStatus::kConnected) {
    const FourChannelToDevice& robot = state->robot;
    const bool is_local =
        params_.variant == FourChannelParams::Variant::kThreeChannel;
    const Vector3d f_d = params_.haptic_stiffness * (X_d.p - robot.position) +
                         damping_ * (v_d - robot.velocity) +
                         (is_local ? f_h : robot.sensed_force);
    force = -params_.force_scale * (R_DB * f_d);
  } else {
    force = RateLimit(force, Vector3d::Zero(), max_release_);
  }
  if (valid) {
    output.proxy_pose = input.X_DH;
    if (state->link.status != LinkStatus::kWaiting) {
      output.proxy_pose.p = map_.HapticProxy(state->robot.position, X_d.R).p;
    }
  }
  output.message = ToMessage(sender_.Update(
      time, {.pose = X_d, .velocity = v_d, .hand_force = f_h}, &state->sender));
  output.link = state->link;
  output.sender_bad_inputs = state->sender.bad_inputs;
}

}  // namespace dual_proxy
