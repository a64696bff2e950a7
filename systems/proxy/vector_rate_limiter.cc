// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/vector_rate_limiter.h"

#include <cmath>

namespace dual_proxy {
namespace {

// Whether a vector is clearly no longer than max_norm: what the stable norm, by
// far the slower, would say as well. False says nothing.
bool IsClearlyWithin(const Eigen::Vector3d& value, double max_norm) noexcept {
  constexpr double kMargin = 1 - 1e-12;
  // Below, squares lose digits.
  constexpr double kLeastNorm = 1e-140;
  return max_norm > kLeastNorm &&
         value.squaredNorm() < kMargin * max_norm * max_norm;
}

}  // namespace

Eigen::Vector3d RateLimit(const Eigen::Vector3d& previous,
                          const Eigen::Vector3d& target,
                          double max_step) noexcept {
  const Eigen::Vector3d step = target - previous;
  if (IsClearlyWithin(step, max_step) || step.stableNorm() <= max_step) {
    return target;
  }
  return previous + Saturate(step, max_step);
}

Eigen::Vector3d Saturate(const Eigen::Vector3d& value,
                         double max_norm) noexcept {
  if (IsClearlyWithin(value, max_norm)) return value;
  // The stable norm, because the square of a far-off value can overflow.
  const double norm = value.stableNorm();
  if (!std::isfinite(norm)) return Eigen::Vector3d::Zero();
  if (norm <= max_norm) return value;
  return value / norm * max_norm;
}

Eigen::Vector3d SaturateUnlessZero(const Eigen::Vector3d& value,
                                   double max_norm) noexcept {
  return max_norm > 0 ? Saturate(value, max_norm) : value;
}

}  // namespace dual_proxy
