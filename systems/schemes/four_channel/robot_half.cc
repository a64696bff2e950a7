// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/schemes/four_channel/scheme.h"

#include <algorithm>
#include <cmath>

#include "dual_proxy/common/possible.h"
#include "dual_proxy/common/rotation.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"

namespace dual_proxy {

using Eigen::Vector3d;

namespace {

// `value` without what of it points along `outward`.
Vector3d NotAlong(const Vector3d& outward, const Vector3d& value) {
  const double square = outward.squaredNorm();
  if (!(square > 0)) return value;
  return value - std::max(0.0, value.dot(outward)) / square * outward;
}

}  // namespace

void FourChannelToDevice::WriteBody(double* body) const noexcept {
  Eigen::Map<Vector3d>{body} = position;
  Eigen::Map<Vector3d>{body + 3} = velocity;
  Eigen::Map<Vector3d>{body + 6} = sensed_force;
}

void FourChannelToDevice::ReadBody(const double* body) noexcept {
  position = Eigen::Map<const Vector3d>{body};
  velocity = Eigen::Map<const Vector3d>{body + 3};
  sensed_force = Eigen::Map<const Vector3d>{body + 6};
}

bool IsValid(const FourChannelToDevice& message) noexcept {
  return std::isfinite(message.send_time) &&
         IsWithin(message.position, kMaxPosition) &&
         IsWithin(message.velocity, kMaxSpeed) &&
         IsWithin(message.sensed_force, kMaxForce);
}

FourChannelRobotHalf::FourChannelRobotHalf(const RobotHalfParams& shared,
                                           const FourChannelParams& own)
    : params_((own.Validate(), own)),
      workspace_(shared.proxy.workspace),
      monitor_(shared.proxy.link),
      follower_(shared.proxy),
      sender_(shared.sender) {}

FourChannelRobotHalfState FourChannelRobotHalf::MakeState() const {
  return {.link = monitor_.MakeState(),
          .follower = follower_.MakeState(),
          .sender = sender_.MakeState()};
}

void FourChannelRobotHalf::Update(double time, const RobotHalfInput& input,
                                  State* state) const noexcept {
  const auto message = FromMessage<FourChannelToRobot>(input.message);
  if (monitor_.Update(time, message, &state->link)) {
    state->goal = {.p = workspace_.Clamp(message.pose.p), .R = message.pose.R};
    const Vector3d outward = message.pose.p - state->goal.p;
    state->velocity = NotAlong(outward, message.velocity);
    state->hand_force = NotAlong(outward, message.hand_force);
  }
  RobotHalfOutput& output = state->output;
  RobotSetpoint& setpoint = output.setpoint;
  const Pose& target = state->follower.target;
  const Vector3d v = input.v_BE.head<3>();
  setpoint = {};
  setpoint.force_selection.setIdentity();
  setpoint.force_feedback = false;
  if (std::isfinite(time) && IsValidPose(input.X_BE) &&
      input.v_BE.allFinite()) {
    const bool connected = state->link.status == LinkStatus::kConnected;
    follower_.Update(state->goal, input.X_BE, connected && input.MayFollow(),
                     &state->follower);
    Vector3d force = params_.robot_stiffness * (target.p - input.X_BE.p) -
                     params_.robot_damping * v;
    if (state->follower.following) {
      force += params_.robot_damping * state->velocity + state->hand_force;
    }
    setpoint.reference_force = Saturate(force, params_.max_robot_force);
    setpoint.rotation_error = LogRotation(input.X_BE.R * target.R.transpose());
  } else {
    ++output.bad_inputs;
  }
  output.proxy_pose = target;
  output.message =
      ToMessage(sender_.Update(time,
                               {.position = input.X_BE.p,
                                .velocity = v,
                                .sensed_force = input.sensed_wrench.head<3>()},
                               &state->sender));
  output.link = state->link;
  output.sender_bad_inputs = state->sender.bad_inputs;
}

}  // namespace dual_proxy
