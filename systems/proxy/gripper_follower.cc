// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/gripper_follower.h"

#include <algorithm>
#include <cmath>

namespace dual_proxy {

void GripperParams::Validate() const { ValidateFields("GripperParams", *this); }

GripperFollower::GripperFollower(const GripperParams& params)
    : params_((params.Validate(), params)) {}

double GripperFollower::Update(bool connected, double opening,
                               GripperState* state) const noexcept {
  if (!connected) return state->width;
  if (std::isfinite(opening)) {
    state->target = std::clamp(params_.scale * opening, 0.0, params_.max_width);
  }
  const double step = params_.max_speed * params_.period;
  state->width += std::clamp(state->target - state->width, -step, step);
  return state->width;
}

}  // namespace dual_proxy
