// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/rotation_truth.h"

#include <Eigen/Geometry>

namespace dual_proxy {

using Eigen::Vector3d;

namespace {

// Normals closer together than this count as one direction: sin(10 deg).
constexpr double kSinIndependent = 0.17364817766693033;
// Points closer together than this count as one, m.
constexpr double kLeastLever = 1e-3;

}  // namespace

void RotationTruth::Add(const Vector3d& p, const Vector3d& normal) noexcept {
  if (num_normals_ == 0) origin_ = p;
  Vector3d force = normal;
  Vector3d moment = (p - origin_).cross(normal);
  for (int i = 0; i < num_normals_; ++i) {
    const double share = normals_.col(i).dot(force);
    force -= share * normals_.col(i);
    moment -= share * their_moments_.col(i);
  }
  const double size = force.norm();
  if (size > kSinIndependent) {
    normals_.col(num_normals_) = force / size;
    their_moments_.col(num_normals_++) = moment / size;
    return;
  }
  for (int i = 0; i < dimension_; ++i) {
    moment -= moments_.col(i).dot(moment) * moments_.col(i);
  }
  const double lever = moment.norm();
  if (lever > kLeastLever) moments_.col(dimension_++) = moment / lever;
}

Vector3d RotationTruth::CalcFreeAxis() const noexcept {
  if (dimension_ != 2) return Vector3d::Zero();
  const Vector3d axis = moments_.col(0).cross(moments_.col(1)).normalized();
  return axis.dot(normals_.col(0)) < 0 ? -axis : axis;
}

}  // namespace dual_proxy
