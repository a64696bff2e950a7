// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace dual_proxy {

/** Which rotations the true contacts of the tool block: the counterpart of the
angular filter.

Contacts i at p_i with normals n_i can resist any wrench
sum of f_i [n_i; p_i x n_i]. Those without a force are moments, and their
directions are blocked: with three points on a plane that do not lie on a line
the two directions in that plane, with two points on a plane the one across
their line, with a single point none. Friction, which resists rotation about the
normal until it slips, does not count.

No heap, no throw. */
class RotationTruth {
 public:
  /** Takes one more contact.
  @param p       m, in B.
  @param normal  unit vector in B. */
  void Add(const Eigen::Vector3d& p, const Eigen::Vector3d& normal) noexcept;

  /** Number of directions that are blocked, 0 to 3. Points less than a
  millimetre apart count as one, normals within 10 deg as parallel. */
  int dimension() const { return dimension_; }

  /** Unit vector in B: the axis of free rotation if there is just one, that is
  at dimension 2, on the side of the first normal; zero otherwise. */
  Eigen::Vector3d CalcFreeAxis() const noexcept;

 private:
  // An orthonormal basis of the normals, the moment about the first contact
  // that comes with each, and one of the moments that come without a force.
  Eigen::Matrix3d normals_;
  Eigen::Matrix3d their_moments_;
  Eigen::Matrix3d moments_;
  int num_normals_{0};
  int dimension_{0};
  Eigen::Vector3d origin_;
};

}  // namespace dual_proxy
