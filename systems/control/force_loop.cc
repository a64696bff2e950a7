// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/force_loop.h"

#include <cmath>

#include "dual_proxy/common/low_pass.h"
#include "dual_proxy/common/validate.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"

namespace dual_proxy {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

TimeDomainPassivityParams WithPeriod(TimeDomainPassivityParams params,
                                     double period) {
  params.period = period;
  return params;
}

}  // namespace

void ForceLoopParams::Validate() const {
  const char* who = "ForceLoopParams";
  ThrowUnlessNonNegative(who, "gain", gain);
  ThrowUnlessNonNegative(who, "integral_gain", integral_gain);
  ThrowUnlessNonNegative(who, "damping", damping);
  ThrowUnlessNonNegative(who, "max_integral_force", max_integral_force);
  ThrowUnlessNonNegative(who, "filter_cutoff", filter_cutoff);
  ThrowUnlessNonNegative(who, "release_time", release_time);
  ThrowUnlessPositive(who, "period", period);
  WithPeriod(passivity, period).Validate();
}

ForceLoop::ForceLoop(ForceLoopParams params)
    : params_((params.Validate(), params)),
      passivity_(WithPeriod(params.passivity, params.period)),
      filter_gain_(LowPassGain(params.filter_cutoff, params.period)) {
  // exp(-3) = 5 % remain after release_time.
  if (params_.release_time > 0) {
    release_factor_ = std::exp(-3 * params_.period / params_.release_time);
  }
}

ForceLoopState ForceLoop::MakeState() const noexcept {
  ForceLoopState state;
  state.passivity = passivity_.MakeState();
  return state;
}

Vector3d ForceLoop::Update(const Vector3d& reference, const Vector3d& sensed,
                           const Vector3d& velocity, const Matrix3d& selection,
                           const Matrix3d& blended,
                           ForceLoopState* state) const noexcept {
  if (!state->initialized) {
    state->initialized = true;
    state->sensed = sensed;
  }
  state->sensed += filter_gain_ * (sensed - state->sensed);
  const Vector3d error = state->sensed - reference;

  state->released *= release_factor_;
  if (selection != state->selection) {
    const Vector3d kept = selection * state->integral;
    if (release_factor_ > 0) {
      state->released -= params_.integral_gain * (state->integral - kept);
    }
    state->integral = kept;
    state->selection = selection;
  }
  if (params_.integral_gain > 0) {
    state->integral =
        Saturate(state->integral + params_.period * (selection * error),
                 params_.max_integral_force / params_.integral_gain);
  }

  const Vector3d feedback =
      -(blended * (params_.gain * error + params_.damping * velocity)) -
      params_.integral_gain * state->integral + state->released;
  return reference + feedback +
         passivity_.Update(feedback, velocity, blended, &state->passivity);
}

}  // namespace dual_proxy
