// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "dual_proxy/common/random.h"
#include "dual_proxy/common/rotation.h"
#include "validation_error.h"

namespace dual_proxy {

/** Three independent normals times `scale`. */
inline Eigen::Vector3d RandomVector(double scale, RandomStream* random) {
  const double x = random->Normal();
  const double y = random->Normal();
  const double z = random->Normal();
  return scale * Eigen::Vector3d(x, y, z);
}

/** A rotation by a random vector; `scale` is its standard deviation, rad. */
inline Eigen::Matrix3d RandomRotation(double scale, RandomStream* random) {
  return ExpRotation(RandomVector(scale, random));
}

/** An orthogonal projection of rank 0 to 3 in a random direction. */
inline Eigen::Matrix3d RandomSelection(RandomStream* random) {
  const Eigen::Matrix3d R = RandomRotation(2.0, random);
  const int rank = static_cast<int>(4.0 * random->Uniform());
  return R.leftCols(rank) * R.leftCols(rank).transpose();
}

/** The projection onto one direction. */
inline Eigen::Matrix3d Direction(const Eigen::Vector3d& n) {
  return n.normalized() * n.normalized().transpose();
}

}  // namespace dual_proxy
