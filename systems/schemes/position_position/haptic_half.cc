// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/schemes/position_position/scheme.h"

#include <cmath>

#include "dual_proxy/common/rotation.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"

namespace dual_proxy {

PositionPositionHapticHalf::PositionPositionHapticHalf(
    const HapticHalfParams& shared, const PositionPositionParams& own)
    : params_((own.Validate(), own)),
      map_(shared.proxy.map),
      monitor_(shared.proxy.link),
      sender_(shared.sender),
      max_release_(own.release_rate * shared.proxy.period) {}

PositionPositionHapticHalfState PositionPositionHapticHalf::MakeState() const {
  return {.link = monitor_.MakeState(), .sender = sender_.MakeState()};
}

void PositionPositionHapticHalf::Update(double time,
                                        const HapticHalfInput& input,
                                        State* state) const noexcept {
  const auto message =
      FromMessage<PoseMessage>(input.message, kPositionPositionTag);
  HapticHalfOutput& output = state->output;
  if (monitor_.Update(time, message, &state->link)) {
    state->robot_position = message.pose.p;
    output.proxy_pose = map_.HapticProxy(message.pose.p, message.pose.R);
  }
  const Pose X_d = map_.RobotProxy(input.X_DH.p, input.X_DH.R);
  const bool valid = std::isfinite(time) && IsValidPose(input.X_DH) &&
                     input.device_velocity.allFinite();
  if (!valid) ++output.bad_inputs;
  Eigen::Vector3d& force = output.setpoint.reference_force;
  if (valid && state->link.status == LinkStatus::kConnected) {
    // Bm v_d of the device's damping in its own scale, through F_h.
    const Eigen::Vector3d spring =
        params_.haptic_stiffness * (X_d.p - state->robot_position);
    force = -params_.force_scale * (map_.params().R_DB * spring) -
            params_.device_damping * input.device_velocity.head<3>();
  } else {
    force = RateLimit(force, Eigen::Vector3d::Zero(), max_release_);
  }
  if (valid && state->link.status == LinkStatus::kWaiting) {
    output.proxy_pose = input.X_DH;
  }
  output.message =
      ToMessage(sender_.Update(time, {.pose = X_d}, &state->sender),
                kPositionPositionTag);
  output.link = state->link;
  output.sender_bad_inputs = state->sender.bad_inputs;
}

}  // namespace dual_proxy
