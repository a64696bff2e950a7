// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/vector_rate_limiter.h"

#include <cmath>

#include "dual_proxy/common/norm.h"

namespace dual_proxy {
Eigen::Vector3d RateLimit(const Eigen::Vector3d& previous,
                          const Eigen::Vector3d& target,
                          double max_step) noexcept {
  const Eigen::Vector3d step = target - previous;
  if (StableNorm(step) <= max_step) return target;
  return previous + Saturate(step, max_step);
}

Eigen::Vector3d Saturate(const Eigen::Vector3d& value,
                         double max_norm) noexcept {
  // The square of a far-off value can overflow.
  const double norm = StableNorm(value);
  if (!std::isfinite(norm)) return Eigen::Vector3d::Zero();
  if (norm <= max_norm) return value;
  return value / norm * max_norm;
}

Eigen::Vector3d SaturateUnlessZero(const Eigen::Vector3d& value,
                                   double max_norm) noexcept {
  return max_norm > 0 ? Saturate(value, max_norm) : value;
}

}  // namespace dual_proxy
