// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/schemes/position_position/scheme.h"

#include <cmath>

#include "dual_proxy/common/rotation.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"

namespace dual_proxy {

PositionPositionRobotHalf::PositionPositionRobotHalf(
    const RobotHalfParams& shared, const PositionPositionParams& own)
    : params_((own.Validate(), own)),
      workspace_(shared.proxy.workspace),
      monitor_(shared.proxy.link),
      sender_(NewestSamples(shared.sender)),
      max_step_(shared.proxy.limiter.max_velocity * shared.proxy.period),
      max_rotation_step_(shared.proxy.limiter.max_angular_velocity *
                         shared.proxy.period) {}

PositionPositionRobotHalfState PositionPositionRobotHalf::MakeState() const {
  return {.link = monitor_.MakeState(), .sender = sender_.MakeState()};
}

void PositionPositionRobotHalf::MoveTarget(const Pose& X_BE, bool connected,
                                           State* state) const noexcept {
  if (!state->started) {
    state->started = true;
    state->target = X_BE;
  }
  if (!connected) {
    if (state->following) state->target = X_BE;
    state->following = false;
    return;
  }
  Pose& target = state->target;
  if (state->following) {
    target = state->goal;
    return;
  }
  target.p = RateLimit(target.p, state->goal.p, max_step_);
  const Eigen::Vector3d turn =
      LogRotation(state->goal.R * target.R.transpose());
  const Eigen::Vector3d step = Saturate(turn, max_rotation_step_);
  target.R = step == turn ? state->goal.R : ExpRotation(step) * target.R;
  state->following = target.p == state->goal.p && step == turn;
}

void PositionPositionRobotHalf::Update(double time, const RobotHalfInput& input,
                                       State* state) const noexcept {
  const auto message =
      FromMessage<PoseMessage>(input.message, kPositionPositionTag);
  if (monitor_.Update(time, message, &state->link)) {
    state->goal = {.p = workspace_.Clamp(message.pose.p), .R = message.pose.R};
  }
  RobotHalfOutput& output = state->output;
  RobotSetpoint& setpoint = output.setpoint;
  setpoint = {};
  setpoint.force_selection.setIdentity();
  setpoint.force_feedback = false;
  if (std::isfinite(time) && IsValidPose(input.X_BE) &&
      input.v_BE.allFinite()) {
    const bool connected = state->link.status == LinkStatus::kConnected;
    MoveTarget(input.X_BE, connected && input.sensor_ready, state);
    setpoint.rotation_error =
        LogRotation(input.X_BE.R * state->target.R.transpose());
    setpoint.reference_force =
        Saturate(params_.robot_stiffness * (state->target.p - input.X_BE.p) -
                     params_.robot_damping * input.v_BE.head<3>(),
                 params_.max_robot_force);
  } else {
    ++output.bad_inputs;
  }
  output.proxy_pose = state->target;
  output.message =
      ToMessage(sender_.Update(time, input.X_BE, Eigen::Matrix3d::Zero(),
                               Eigen::Matrix3d::Zero(), &state->sender),
                kPositionPositionTag);
  output.link = state->link;
  output.sender_bad_inputs = state->sender.bad_inputs;
}

}  // namespace dual_proxy
