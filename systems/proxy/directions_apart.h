// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace dual_proxy {

/** Projection onto the directions of `selection` that make an angle of more
than asin(sqrt(sine2)) with all of `other`.
@pre both are orthogonal projections. No heap, no throw. */
Eigen::Matrix3d DirectionsApart(const Eigen::Matrix3d& selection,
                                const Eigen::Matrix3d& other,
                                double sine2) noexcept;

}  // namespace dual_proxy
