// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/friction_feedback.h"

#include <algorithm>

#include "dual_proxy/common/low_pass.h"
#include "dual_proxy/common/possible.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"

namespace dual_proxy {

FrictionFeedback::FrictionFeedback(const Params& params, double period)
    : params_((params.Validate(), params)),
      low_pass_gain_(LowPassGain(params.cutoff, period)),
      period_(period) {}

Eigen::Vector3d FrictionFeedback::Update(const Eigen::Vector3d& sensed,
                                         const Eigen::Vector3d& v,
                                         const Eigen::Matrix3d& Omega_f,
                                         State* state) const noexcept {
  if (params_.gain == 0) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d pressing = Omega_f * sensed;
  state->contact_time = Omega_f.isZero(0) ? 0 : state->contact_time + period_;
  const double most = state->contact_time > params_.settling_time
                          ? params_.max_friction * pressing.norm()
                          : 0;
  const Eigen::Vector3d friction = Saturate(sensed - pressing, most);
  state->friction += low_pass_gain_ * (friction - state->friction);
  state->friction = Saturate(state->friction, most);
  Eigen::Vector3d force = params_.gain * state->friction;
  force -= Omega_f * force;

  const double dissipated = period_ * friction.dot(v);
  double spent = period_ * force.dot(v);
  const double available = std::max(0.0, state->energy + dissipated);
  if (spent > available) {
    force -= (spent - available) / period_ / v.squaredNorm() * v;
    spent = available;
  }
  const double left = state->energy + dissipated - spent;
  StoreIfFinite(most > 0 ? std::clamp(left, 0.0, params_.max_energy) : 0,
                &state->energy);
  return force;
}

}  // namespace dual_proxy
