// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "dual_proxy/common/pose.h"

namespace dual_proxy {

/** Rotation matrix of a rotation vector (axis times angle, rad). */
Eigen::Matrix3d ExpRotation(const Eigen::Vector3d& rotation_vector) noexcept;

/** Rotation vector (axis times angle in [0, pi], rad) of a rotation matrix.
Exact inverse of ExpRotation() below pi; well conditioned at 0 and near pi. */
Eigen::Vector3d LogRotation(const Eigen::Matrix3d& R) noexcept;

/** The rotation matrix nearest to M in the Frobenius (chordal) norm. With M a
sum of rotations this is their chordal mean. Identity if M is not finite. */
Eigen::Matrix3d ProjectToRotation(const Eigen::Matrix3d& M) noexcept;

/** True if |p_i| <= kMaxPosition (possible.h) and R is orthonormal to 1e-3 with
determinant +1: what is accepted as a pose at run time. */
bool IsValidPose(const Pose& pose) noexcept;

}  // namespace dual_proxy
