// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/haptic_fixtures.h"

#include <algorithm>
#include <cmath>

#include "dual_proxy/common/norm.h"
#include "dual_proxy/common/validate.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"

namespace dual_proxy {

using Eigen::Matrix3d;
using Eigen::Vector3d;

void WorkspaceWallParams::Validate() const {
  ValidateFields("WorkspaceWallParams", *this);
}

WorkspaceWall::WorkspaceWall(const WorkspaceWallParams& params)
    : params_((params.Validate(), params)) {}

Vector3d WorkspaceWall::Calc(const Vector3d& p,
                             const Vector3d& v) const noexcept {
  if (!p.allFinite() || !v.allFinite()) return Vector3d::Zero();
  const auto push = [&](double depth, const Vector3d& outward) -> Vector3d {
    if (depth <= 0) return Vector3d::Zero();
    const double spring = params_.stiffness * depth;
    const double damping =
        std::clamp(params_.damping * outward.dot(v), 0.0, spring);
    return -(spring + damping) * outward;
  };
  const Vector3d axial(std::copysign(1.0, p.x()), 0, 0);
  const double distance = p.tail<2>().norm();
  Vector3d radial = Vector3d::Zero();
  if (distance > 0) radial.tail<2>() = p.tail<2>() / distance;
  return Saturate(push(std::abs(p.x()) - params_.half_length, axial) +
                      push(distance - params_.radius, radial),
                  params_.max_force);
}

void GuidanceParams::Validate() const {
  const char* who = "GuidanceParams";
  ValidateFields(who, *this);
  ThrowUnlessIn(who, "direction", StableNorm(direction), Above(0));
}

Guidance::Guidance(const GuidanceParams& params, double period)
    : params_((params.Validate(), params)),
      max_step_(params.force_rate * period) {
  ThrowUnlessIn("Guidance", "period", period, Above(0));
  const Vector3d d = params_.direction / StableNorm(params_.direction);
  const Matrix3d along = d * d.transpose();
  if (params_.shape == GuidanceShape::kPlane) guided_ = along;
  if (params_.shape == GuidanceShape::kLine) {
    guided_ = Matrix3d::Identity() - along;
  }
}

const Vector3d& Guidance::Update(const Vector3d& p, bool active,
                                 GuidanceState* state) const noexcept {
  Vector3d force = Vector3d::Zero();
  if (active && p.allFinite()) {
    force = Saturate(-params_.stiffness * (guided_ * (p - params_.point)),
                     params_.max_force);
  }
  state->force = RateLimit(state->force, force, max_step_);
  return state->force;
}

void HomingParams::Validate() const { ValidateFields("HomingParams", *this); }

Homing::Homing(const HomingParams& params, double period)
    : params_((params.Validate(), params)),
      period_(period),
      leash_(params.max_force / params.stiffness) {
  ThrowUnlessIn("Homing", "period", period, Above(0));
}

void Homing::Update(bool requested, const Vector3d& p, const Vector3d& v,
                    HomingState* state) const noexcept {
  Vector3d force = Vector3d::Zero();
  if (!requested) {
    state->active = state->done = false;
  } else if (p.allFinite() && v.allFinite()) {
    if (!state->active) state->target = p;
    state->active = true;
    const Vector3d next =
        RateLimit(state->target, Vector3d::Zero(), params_.speed * period_);
    state->target = p + Saturate(next - p, leash_);
    if (p.norm() < params_.tolerance && v.norm() < params_.speed) {
      state->done = true;
    }
    force =
        Saturate(params_.stiffness * (state->target - p) - params_.damping * v,
                 params_.max_force);
  }
  state->force = RateLimit(state->force, force, params_.force_rate * period_);
}

}  // namespace dual_proxy
