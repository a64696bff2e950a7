// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/schemes/model_mediated/surface_estimator.h"

#include <algorithm>

#include "dual_proxy/common/elementary.h"
#include "dual_proxy/common/low_pass.h"

namespace dual_proxy {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

/** Hz: a force is no contact for a shorter time than a message's interval. */
constexpr double kForceCutoff = 10;
/** s: how far back the stiffness is looked for. */
constexpr double kMemory = 0.5;
/** Share of the force's variance that has to be explained by the stiffness. */
constexpr double kExplained = 0.9;
/** A force space that holds less of the normal is that of another surface. */
constexpr double kSameSurface = 0.5;

}  // namespace

SurfaceEstimator::SurfaceEstimator(const Params& params)
    : params_(params),
      force_gain_(LowPassGain(kForceCutoff, params.period)),
      surface_gain_(1 - Exp(-params.period / params.surface_time)),
      memory_(Exp(-params.period / kMemory)) {}

void SurfaceEstimator::ObserveStiffness(const Vector2d& change,
                                        State* state) const noexcept {
  state->excursion = memory_ * state->excursion + change;
  state->covariance +=
      (1 - memory_) *
      (state->excursion * state->excursion.transpose() - state->covariance);
  const double xx = state->covariance(0, 0);
  const double xf = state->covariance(0, 1);
  const double ff = state->covariance(1, 1);
  const bool excited = xx > params_.min_excursion * params_.min_excursion;
  if (excited && xf > 0 && xf * xf > kExplained * xx * ff) {
    state->stiffness =
        std::clamp(xf / xx, params_.min_stiffness, params_.max_stiffness);
  }
}

void SurfaceEstimator::Update(const Vector3d& position, const Vector3d& force,
                              const Matrix3d& force_selection,
                              State* state) const noexcept {
  if (!state->initialized) {
    state->initialized = true;
    state->position = position;
    state->force = force;
  }
  const Vector3d moved = position - state->position;
  const Vector3d changed = force - state->force;
  state->position = position;
  state->force = force;
  state->smooth += force_gain_ * (force - state->smooth);

  const Vector3d kept = force_selection * state->normal;
  const Vector3d pressed = force_selection * state->smooth;
  if (state->contact && kept.norm() > kSameSurface) {
    state->normal = kept.normalized();
  } else if (pressed.norm() > params_.contact_force) {
    *state = {.contact = true,
              .normal = pressed.normalized(),
              .initialized = true,
              .position = position,
              .force = force,
              .smooth = state->smooth};
    return;
  } else {
    state->contact = false;
  }

  const Vector3d& n = state->normal;
  state->depth += n.dot(moved);
  const double felt = n.dot(state->smooth);
  if (state->contact && felt > params_.contact_force) {
    ObserveStiffness({n.dot(moved), n.dot(changed)}, state);
    const double sunk = state->stiffness > 0 ? felt / state->stiffness : 0.0;
    state->depth += surface_gain_ * (sunk - state->depth);
  } else if (!state->contact && state->smooth.norm() < params_.contact_force) {
    state->depth = std::min(state->depth, 0.0);
  }
}

}  // namespace dual_proxy
