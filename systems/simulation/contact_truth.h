// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <numbers>

#include <Eigen/Core>

namespace dual_proxy {

/** What the tool really touches, from a simulator's contacts: the truth that
the filters are measured against, whatever simulator it is.

Contacts i at p_i with normals n_i can resist any wrench
sum of f_i [n_i; p_i x n_i]. The number of independent normals is the true
dimension of the force space. Those wrenches without a force are moments, and
their directions are blocked: with three points on a plane that do not lie on a
line the two directions in that plane, with two points on a plane the one across
their line, with a single point none. Friction, which resists rotation about the
normal until it slips, does not count.

Normals within kIndependentAngle of the span of those before them are not
counted again. No heap, no throw. */
class ContactTruth {
 public:
  /** Normals closer together than this are one direction, rad. */
  static constexpr double kIndependentAngle = 10 * std::numbers::pi / 180;

  /** Takes one more contact. Touching without a force is no contact: where
  `force` does not push along `normal`, nothing changes.
  @param force   N, in B: of the tool on its environment, friction included.
  @param normal  unit vector in B, INTO the surface.
  @param p       m, in B: the place. Only moments depend on it. */
  void Add(const Eigen::Vector3d& force, const Eigen::Vector3d& normal,
           const Eigen::Vector3d& p = Eigen::Vector3d::Zero()) noexcept;

  /** N, in B: of the tool on its environment, over all contacts. */
  const Eigen::Vector3d& force() const { return force_; }

  /** Unit vector in B, INTO the surface: with several contacts the direction of
  the normal forces' sum; zero without contact. */
  Eigen::Vector3d CalcNormal() const noexcept;

  /** Number of independent normals, 0 to 3. */
  int dimension() const { return dimension_; }

  /** Unit vector in B: the axis of free motion if there is just one, that is at
  dimension 2, either way along it; zero otherwise. */
  Eigen::Vector3d CalcMotionAxis() const noexcept;

  /** Number of moments' directions that are blocked, 0 to 3. Points less than a
  millimetre apart count as one. */
  int moment_dimension() const { return moment_dimension_; }

  /** Unit vector in B: the axis of free rotation if there is just one, that is
  at moment dimension 2, on the side of the first normal; zero otherwise. */
  Eigen::Vector3d CalcFreeAxis() const noexcept;

  /** All of it as a simulation's ports and logs carry it: force 3, normal 3,
  dimension 1, axis of free motion 3; moment dimension 1, axis of free rotation
  3. */
  Eigen::Matrix<double, 14, 1> ToVector() const noexcept;

 private:
  Eigen::Vector3d force_{Eigen::Vector3d::Zero()};
  // The normal forces' sum.
  Eigen::Vector3d push_{Eigen::Vector3d::Zero()};
  // An orthonormal basis of the normals, the moment about the first contact
  // that comes with each, and one of the moments that come without a force.
  Eigen::Matrix3d normals_{Eigen::Matrix3d::Zero()};
  Eigen::Matrix3d their_moments_{Eigen::Matrix3d::Zero()};
  Eigen::Matrix3d moments_{Eigen::Matrix3d::Zero()};
  int count_{0};
  int dimension_{0};
  int moment_dimension_{0};
  Eigen::Vector3d origin_{Eigen::Vector3d::Zero()};
};

}  // namespace dual_proxy
