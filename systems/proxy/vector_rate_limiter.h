// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace dual_proxy {

/** The vector nearest to `target` whose distance from `previous` is at most
max_step; `target` itself, to the bit, if it is within reach. The limit is on
the norm, so that the direction of approach is kept. A target that is not finite
is not approached: `previous` comes back.
@pre `previous` is finite, max_step >= 0. */
Eigen::Vector3d RateLimit(const Eigen::Vector3d& previous,
                          const Eigen::Vector3d& target,
                          double max_step) noexcept;

/** `value` shortened to max_norm if it is longer; its direction is kept. Zero
if `value` is not finite.
@pre max_norm >= 0. */
Eigen::Vector3d Saturate(const Eigen::Vector3d& value,
                         double max_norm) noexcept;

/** The same, but a max_norm of 0 is no bound. */
Eigen::Vector3d SaturateUnlessZero(const Eigen::Vector3d& value,
                                   double max_norm) noexcept;

}  // namespace dual_proxy
