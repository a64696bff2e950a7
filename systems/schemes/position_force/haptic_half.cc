// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/schemes/position_force/scheme.h"

#include "dual_proxy/common/rotation.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"

namespace dual_proxy {

PositionForceHapticHalf::PositionForceHapticHalf(const HapticHalfParams& shared,
                                                 const PositionForceParams& own)
    : params_((own.Validate(), own)),
      map_(shared.proxy.map),
      monitor_(shared.proxy.link),
      sender_(shared.sender) {}

PositionForceHapticHalfState PositionForceHapticHalf::MakeState() const {
  return {.link = monitor_.MakeState(), .sender = sender_.MakeState()};
}

void PositionForceHapticHalf::Update(double time, const HapticHalfInput& input,
                                     State* state) const noexcept {
  const auto message = FromMessage<ForceMessage>(input.message);
  if (monitor_.Update(time, message, &state->link)) {
    state->sensed_force = message.force;
  }
  HapticHalfOutput& output = state->output;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  if (state->link.status == LinkStatus::kConnected) {
    force = Saturate(
        -params_.force_scale * (map_.params().R_DB * state->sensed_force),
        params_.max_force);
  }
  output.setpoint.reference_force = force;
  if (IsValidPose(input.X_DH)) output.proxy_pose = input.X_DH;
  output.message =
      ToMessage(sender_.Update(time, {.pose = input.X_DH}, &state->sender));
  output.link = state->link;
  output.sender_bad_inputs = state->sender.bad_inputs;
}

}  // namespace dual_proxy
