// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/directions_apart.h"

#include <Eigen/Eigenvalues>

namespace dual_proxy {

// An eigenvalue of the matrix below is the squared sine of the angle between
// its eigenvector and `other`.
Eigen::Matrix3d DirectionsApart(const Eigen::Matrix3d& selection,
                                const Eigen::Matrix3d& other,
                                double sine2) noexcept {
  const Eigen::Matrix3d outside =
      selection * (Eigen::Matrix3d::Identity() - other) * selection;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(outside);
  Eigen::Matrix3d result = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 3; ++i) {
    if (eigen.eigenvalues()(i) > sine2) {
      const Eigen::Vector3d u = eigen.eigenvectors().col(i);
      result += u * u.transpose();
    }
  }
  return result;
}

}  // namespace dual_proxy
