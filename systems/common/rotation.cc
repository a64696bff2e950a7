// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/rotation.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>

#include "dual_proxy/common/elementary.h"
#include "dual_proxy/common/possible.h"

namespace dual_proxy {

Eigen::Matrix3d ExpRotation(const Eigen::Vector3d& rotation_vector) noexcept {
  if (rotation_vector.isZero(0)) return Eigen::Matrix3d::Identity();
  const double half_angle = 0.5 * rotation_vector.norm();
  const auto [sin, cos] = CalcSinCos(half_angle);
  // sin(x)/x to double precision: below 1e-4 the series' next term is 1e-18.
  const double half_sinc = half_angle > 1e-4
                               ? 0.5 * sin / half_angle
                               : 0.5 - half_angle * half_angle / 12.0;
  const Eigen::Vector3d xyz = half_sinc * rotation_vector;
  return Eigen::Quaterniond(cos, xyz.x(), xyz.y(), xyz.z())
      .normalized()
      .toRotationMatrix();
}

Eigen::Vector3d LogRotation(const Eigen::Matrix3d& R) noexcept {
  // The same bits as below, at once.
  if (R == Eigen::Matrix3d::Identity()) return Eigen::Vector3d::Zero();
  Eigen::Quaterniond q(R);
  q.normalize();
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double sin_half = q.vec().norm();
  const double angle_over_sin_half =
      sin_half > 1e-9 ? 2.0 * Atan2(sin_half, q.w()) / sin_half : 2.0;
  return angle_over_sin_half * q.vec();
}

Eigen::Matrix3d ProjectToRotation(const Eigen::Matrix3d& M) noexcept {
  if (!M.allFinite()) return Eigen::Matrix3d::Identity();
  if (M(0, 0) > 0 && M == M(0, 0) * Eigen::Matrix3d::Identity()) {
    return Eigen::Matrix3d::Identity();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(
      M, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d U = svd.matrixU();
  if ((U * svd.matrixV().transpose()).determinant() < 0) U.col(2) *= -1.0;
  return U * svd.matrixV().transpose();
}

bool IsValidPose(const Pose& pose) noexcept {
  constexpr double kTolerance = 1e-3;
  if (!IsWithin(pose.p, kMaxPosition)) return false;
  if (pose.R == Eigen::Matrix3d::Identity()) return true;
  return pose.R.allFinite() &&
         (pose.R * pose.R.transpose() - Eigen::Matrix3d::Identity())
                 .cwiseAbs()
                 .maxCoeff() <= kTolerance &&
         pose.R.determinant() > 0;
}

}  // namespace dual_proxy
