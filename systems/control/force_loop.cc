// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/force_loop.h"

#include <algorithm>

#include "dual_proxy/common/elementary.h"
#include "dual_proxy/common/low_pass.h"
#include "dual_proxy/common/possible.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"

namespace dual_proxy {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

/** N s/m [N m s/rad] per unit of damping: what brakes at the speed limit, as a
multiple of the loop's own damping. */
constexpr double kBraking = 5;
constexpr double kForesight = 0.01;  // s: of the speed that is limited.

TimeDomainPassivityParams WithPeriod(TimeDomainPassivityParams params,
                                     double period) {
  params.period = period;
  return params;
}

}  // namespace

void ForceLoopParams::Validate() const {
  ValidateFields("ForceLoopParams", *this);
}

ForceLoop::ForceLoop(ForceLoopParams params)
    : params_((params.Validate(), params)),
      passivity_(WithPeriod(params.passivity, params.period)),
      filter_gain_(LowPassGain(params.filter_cutoff, params.period)) {
  // exp(-3) = 5 % remain after release_time.
  if (params_.release_time > 0) {
    release_factor_ = Exp(-3 * params_.period / params_.release_time);
  }
}

ForceLoopState ForceLoop::MakeState() const noexcept {
  ForceLoopState state;
  state.passivity = passivity_.MakeState();
  return state;
}

Vector3d ForceLoop::CalcBraking(const Vector3d& force, const Vector3d& velocity,
                                const Vector3d& last) const noexcept {
  const double speed = velocity.norm();
  const double gain = std::max(0.0, speed - last.norm()) / params_.period;
  const double share = std::clamp(
      2 * (speed + kForesight * gain) / params_.speed_limit - 1, 0.0, 1.0);
  if (!(share > 0 && speed > 0)) return Vector3d::Zero();
  const double smooth = share * share * (3 - 2 * share);
  const Vector3d direction = velocity / speed;
  const double driving = std::max(0.0, force.dot(direction));
  return -smooth * (driving + kBraking * params_.damping * speed) * direction;
}

Vector3d ForceLoop::Update(const Vector3d& reference, const Vector3d& sensed,
                           const Vector3d& velocity, const Matrix3d& selection,
                           const Matrix3d& blended,
                           ForceLoopState* state) const noexcept {
  if (!state->initialized) {
    state->initialized = true;
    state->sensed = sensed;
    state->passivity.velocity = velocity;
  }
  StoreIfFinite(state->sensed + filter_gain_ * (sensed - state->sensed),
                &state->sensed);
  const Vector3d error = state->sensed - reference;

  state->released *= release_factor_;
  if (selection != state->selection) {
    const Vector3d kept = selection * state->integral;
    if (release_factor_ > 0) {
      state->released -= params_.integral_gain * (state->integral - kept);
    }
    state->integral = kept;
    if (selection.trace() > state->selection.trace() + 0.5) state->settled = 0;
    state->selection = selection;
    // What was saved up in one contact is not for the next one's first touch.
    if (selection.isZero(0)) {
      state->passivity.energy = params_.passivity.initial_energy;
    }
  }
  state->settled += params_.period;
  if (params_.integral_gain > 0 && state->settled > params_.integral_delay) {
    state->integral =
        Saturate(state->integral + params_.period * (selection * error),
                 params_.max_integral_force / params_.integral_gain);
  }

  const Vector3d proportional =
      SaturateUnlessZero(params_.gain * error, params_.max_proportional_force);
  Vector3d feedback = -(blended * (proportional + params_.damping * velocity)) -
                      params_.integral_gain * state->integral + state->released;
  feedback += CalcBraking(reference + feedback, blended * velocity,
                          blended * state->passivity.velocity);
  return reference + feedback +
         passivity_.Update(feedback, velocity, blended, &state->passivity);
}

}  // namespace dual_proxy
