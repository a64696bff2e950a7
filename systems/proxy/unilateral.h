// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace dual_proxy {

/** The force nearest to `force` that pulls into no surface: f with n_i . f <= 0
for each normal n_i.

@param force  N: on a hand that is in contact by its robot.
@param normals  unit vectors INTO the surfaces as columns, in the same frame;
  one that is zero is none.
@returns `force` itself where it pulls nowhere. No heap, no throw. */
Eigen::Vector3d RemovePull(const Eigen::Vector3d& force,
                           const Eigen::Matrix3d& normals) noexcept;

}  // namespace dual_proxy
