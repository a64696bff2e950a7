// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/clutch.h"

#include <algorithm>

#include "dual_proxy/common/rotation.h"
#include "dual_proxy/common/validate.h"

namespace dual_proxy {

void ClutchParams::Validate() const { ValidateFields("ClutchParams", *this); }

Clutch::Clutch(const ClutchParams& params, double period) {
  params.Validate();
  ThrowUnlessIn("Clutch", "period", period, Above(0));
  release_step_ = period / params.release_time;
  engage_step_ = period / params.engage_time;
}

void Clutch::Update(bool pressed, const Pose& X_DH,
                    ClutchState* state) const noexcept {
  const bool valid = IsValidPose(X_DH);
  if (state->clutched && !pressed && valid) {
    state->offset = {state->held.p - X_DH.p,
                     state->held.R * X_DH.R.transpose()};
    state->moved = true;
    state->clutched = false;
    state->pose = state->held;
  } else if (state->clutched || pressed) {
    state->clutched = true;
    state->pose = state->held;
  } else {
    state->pose = X_DH;
    if (state->moved) {
      state->pose = {X_DH.p + state->offset.p, state->offset.R * X_DH.R};
    }
    if (valid) state->held = state->pose;
  }
  state->engagement = state->clutched
                          ? std::max(0.0, state->engagement - release_step_)
                          : std::min(1.0, state->engagement + engage_step_);
}

}  // namespace dual_proxy
