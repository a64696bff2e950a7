// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace dual_proxy {

/** A pose: of the tool point in the robot base frame (X_BE), or of the handle
in the device base frame (X_DH). The name of the variable says which. */
struct Pose {
  Eigen::Vector3d p{Eigen::Vector3d::Zero()};      ///< Position, m.
  Eigen::Matrix3d R{Eigen::Matrix3d::Identity()};  ///< Rotation matrix.
};

}  // namespace dual_proxy
