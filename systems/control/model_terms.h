// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace dual_proxy {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Vector7 = Eigen::Matrix<double, 7, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Matrix7 = Eigen::Matrix<double, 7, 7>;
using Matrix67 = Eigen::Matrix<double, 6, 7>;

/** The arm's model at one configuration. Six-vectors are [linear; angular] of
the tool point E in B. */
struct ModelTerms {
  Matrix67 J_BE{Matrix67::Zero()};    ///< v_BE = J_BE v.
  Matrix7 mass{Matrix7::Identity()};  ///< A, kg m^2.
  Vector7 bias{Vector7::Zero()};      ///< C v, N m, without gravity.
  /** N m: generalized gravity force, as Drake's
  CalcGravityGeneralizedForces() gives it; the torque that holds the arm is its
  negative. */
  Vector7 gravity{Vector7::Zero()};
  Vector6 Jdot_v{Vector6::Zero()};  ///< Bias acceleration, m/s^2, rad/s^2.
};

}  // namespace dual_proxy
