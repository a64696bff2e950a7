// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/passivity_controller.h"

#include <algorithm>

#include "dual_proxy/common/possible.h"

namespace dual_proxy {

using Eigen::Matrix3d;
using Eigen::Vector3d;

void TimeDomainPassivityParams::Validate() const {
  ValidateFields("TimeDomainPassivityParams", *this);
}

TimeDomainPassivity::TimeDomainPassivity(TimeDomainPassivityParams params)
    : params_(params) {
  params_.Validate();
}

TimeDomainPassivityState TimeDomainPassivity::MakeState() const noexcept {
  TimeDomainPassivityState state;
  state.energy = params_.initial_energy;
  state.commands.fill(Vector3d::Zero());
  return state;
}

Vector3d TimeDomainPassivity::Update(
    const Vector3d& feedback_force, const Vector3d& velocity,
    const Matrix3d& force_selection,
    TimeDomainPassivityState* state) const noexcept {
  // Observer: the work done over the period that ends now.
  const Vector3d mean_velocity = 0.5 * (state->velocity + velocity);
  const Vector3d& acted = state->commands[params_.actuation_delay];
  const double power =
      acted.dot(mean_velocity) +
      params_.damping_margin * (force_selection * mean_velocity).squaredNorm();
  StoreIfFinite(std::clamp(state->energy - power * params_.period,
                           -params_.max_energy, params_.max_energy),
                &state->energy);
  StoreIfFinite(velocity, &state->velocity);

  // Controller.
  const Vector3d selected_velocity = force_selection * velocity;
  state->damping =
      params_.enabled
          ? params_.max_damping *
                std::clamp(1 - state->energy / params_.max_energy, 0.0, 1.0)
          : 0.0;
  const Vector3d injected = -state->damping * selected_velocity;
  StoreIfFinite(state->dissipated + state->damping *
                                        selected_velocity.squaredNorm() *
                                        params_.period,
                &state->dissipated);

  std::copy_backward(state->commands.begin(), state->commands.end() - 1,
                     state->commands.end());
  StoreIfFinite(feedback_force + injected, &state->commands[0]);
  return injected;
}

}  // namespace dual_proxy
