// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/unilateral.h"

#include <Eigen/Dense>

namespace dual_proxy {
namespace {

constexpr double kTolerance = 1e-12;  // Of the size of the force.

bool Pulls(const Eigen::Vector3d& force, const Eigen::Matrix3d& normals,
           double tolerance) {
  return (normals.transpose() * force).maxCoeff() > tolerance;
}

}  // namespace

Eigen::Vector3d RemovePull(const Eigen::Vector3d& force,
                           const Eigen::Matrix3d& normals) noexcept {
  const double tolerance = kTolerance * force.norm();
  if (!Pulls(force, normals, tolerance)) return force;
  // What is removed pushes along some of the normals: of all subsets it is the
  // one with which nothing pulls, and nothing negative is removed.
  Eigen::Vector3d nearest = Eigen::Vector3d::Zero();
  double distance = force.norm();
  for (int subset = 1; subset < 8; ++subset) {
    Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 3> active(3, 0);
    for (int i = 0; i < 3; ++i) {
      if ((subset & (1 << i)) == 0 || normals.col(i).isZero(0)) continue;
      active.conservativeResize(Eigen::NoChange, active.cols() + 1);
      active.rightCols<1>() = normals.col(i);
    }
    if (active.cols() == 0) continue;
    const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 3> gram =
        active.transpose() * active;
    const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1> push =
        gram.ldlt().solve(active.transpose() * force);
    if (!(push.minCoeff() >= 0)) continue;
    const Eigen::Vector3d rest = force - active * push;
    if (Pulls(rest, normals, 1e3 * tolerance)) continue;
    if ((force - rest).norm() < distance) {
      distance = (force - rest).norm();
      nearest = rest;
    }
  }
  return nearest;
}

}  // namespace dual_proxy
