// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/contact_truth.h"

#include <Eigen/Geometry>

#include "dual_proxy/common/elementary.h"

namespace dual_proxy {

using Eigen::Vector3d;

namespace {

const double kSinIndependent = CalcSinCos(ContactTruth::kIndependentAngle).sin;
// Points closer together than this count as one, m.
constexpr double kLeastLever = 1e-3;

}  // namespace

void ContactTruth::Add(const Vector3d& force, const Vector3d& normal,
                       const Vector3d& p) noexcept {
  const double normal_force = force.dot(normal);
  if (!(normal_force > 0)) return;
  force_ += force;
  push_ += normal_force * normal;
  if (count_++ == 0) origin_ = p;

  Vector3d rest = normal;
  Vector3d moment = (p - origin_).cross(normal);
  for (int i = 0; i < dimension_; ++i) {
    const double share = normals_.col(i).dot(rest);
    rest -= share * normals_.col(i);
    moment -= share * their_moments_.col(i);
  }
  const double size = rest.norm();
  if (size > kSinIndependent) {
    normals_.col(dimension_) = rest / size;
    their_moments_.col(dimension_++) = moment / size;
    return;
  }
  for (int i = 0; i < moment_dimension_; ++i) {
    moment -= moments_.col(i).dot(moment) * moments_.col(i);
  }
  const double lever = moment.norm();
  if (lever > kLeastLever) moments_.col(moment_dimension_++) = moment / lever;
}

Vector3d ContactTruth::CalcNormal() const noexcept {
  // The first direction is the first normal: with one contact it is exact.
  if (count_ == 1) return normals_.col(0);
  return push_.normalized();
}

Vector3d ContactTruth::CalcMotionAxis() const noexcept {
  if (dimension_ != 2) return Vector3d::Zero();
  return Vector3d(normals_.col(0)).cross(Vector3d(normals_.col(1)));
}

Vector3d ContactTruth::CalcFreeAxis() const noexcept {
  if (moment_dimension_ != 2) return Vector3d::Zero();
  const Vector3d axis = moments_.col(0).cross(moments_.col(1)).normalized();
  return axis.dot(normals_.col(0)) < 0 ? -axis : axis;
}

Eigen::Matrix<double, 14, 1> ContactTruth::ToVector() const noexcept {
  Eigen::Matrix<double, 14, 1> values;
  values << force_, CalcNormal(), dimension_, CalcMotionAxis(),
      moment_dimension_, CalcFreeAxis();
  return values;
}

}  // namespace dual_proxy
