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
      follower_(shared.proxy),
      sender_(shared.sender) {}

PositionPositionRobotHalfState PositionPositionRobotHalf::MakeState() const {
  return {.link = monitor_.MakeState(),
          .follower = follower_.MakeState(),
          .sender = sender_.MakeState()};
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
  const Pose& target = state->follower.target;
  setpoint = {};
  setpoint.force_selection.setIdentity();
  setpoint.force_feedback = false;
  if (std::isfinite(time) && IsValidPose(input.X_BE) &&
      input.v_BE.allFinite()) {
    const bool connected = state->link.status == LinkStatus::kConnected;
    follower_.Update(state->goal, input.X_BE, connected && input.MayFollow(),
                     &state->follower);
    setpoint.rotation_error = LogRotation(input.X_BE.R * target.R.transpose());
    setpoint.reference_force =
        Saturate(params_.robot_stiffness * (target.p - input.X_BE.p) -
                     params_.robot_damping * input.v_BE.head<3>(),
                 params_.max_robot_force);
  } else {
    ++output.bad_inputs;
  }
  output.proxy_pose = target;
  output.message =
      ToMessage(sender_.Update(time, {.pose = input.X_BE}, &state->sender),
                kPositionPositionTag);
  output.link = state->link;
  output.sender_bad_inputs = state->sender.bad_inputs;
}

}  // namespace dual_proxy
