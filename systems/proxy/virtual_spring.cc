// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/virtual_spring.h"

#include <algorithm>
#include <cmath>

#include "dual_proxy/common/elementary.h"
#include "dual_proxy/proxy/directions_apart.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"

namespace dual_proxy {

void VirtualSpringParams::Validate() const {
  ValidateFields("VirtualSpringParams", *this);
}

VirtualSpring::VirtualSpring(VirtualSpringParams params) : params_(params) {
  params_.Validate();
  const double sine = CalcSinCos(params_.new_direction_angle).sin;
  new_direction_sine2_ = sine * sine;
}

void VirtualSpring::Update(const Eigen::Vector3d& displacement,
                           const Eigen::Matrix3d& selection,
                           const Eigen::Vector3d* sensed, bool active,
                           VirtualSpringState* state) const noexcept {
  const double max_force = params_.max_force;
  const bool handover = params_.handover == Handover::kBumpless && active &&
                        sensed != nullptr && selection != state->selection;
  if (handover) {
    const Eigen::Matrix3d P =
        DirectionsApart(selection, state->selection, new_direction_sine2_);
    const Eigen::Vector3d kept = state->reference - P * state->reference;
    const double room2 = max_force * max_force - kept.squaredNorm();
    const double room = std::sqrt(std::max(room2, 0.0));
    state->reference = kept + Saturate(P * *sensed, room);
  }
  state->selection = selection;

  Eigen::Vector3d stretch = selection * displacement;
  if (!stretch.allFinite()) stretch.setZero();
  const Eigen::Vector3d leashed =
      params_.leash > 0 ? Saturate(stretch, params_.leash) : stretch;
  Eigen::Vector3d target = -params_.stiffness * (stretch - leashed);
  if (active) target += Saturate(-params_.stiffness * leashed, max_force);
  state->reference =
      RateLimit(state->reference, target, params_.rate * params_.period);
}

}  // namespace dual_proxy
