// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/baselines/position_force.h"

#include "dual_proxy/common/validate.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"

namespace dual_proxy {

void PositionForceHapticSideParams::Validate() const {
  ValidateFields("PositionForceHapticSideParams", *this);
}

PositionForceHapticSide::PositionForceHapticSide(const Params& params)
    : params_(params), monitor_(params.link) {
  params_.Validate();
}

void PositionForceHapticSide::Update(double time, const ForceMessage& message,
                                     State* state) const noexcept {
  if (monitor_.Update(time, message, &state->link)) {
    state->sensed_force = message.force;
  }
  if (state->link.status == LinkStatus::kConnected) {
    const Eigen::Vector3d force =
        -params_.force_scale * (params_.map.R_DB * state->sensed_force);
    state->reference_force = Saturate(force, params_.max_force);
  } else {
    state->reference_force.setZero();
  }
}

}  // namespace dual_proxy
