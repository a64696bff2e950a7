// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace dual_proxy {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Vector7 = Eigen::Matrix<double, 7, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Matrix7 = Eigen::Matrix<double, 7, 7>;
using Matrix67 = Eigen::Matrix<double, 6, 7>;

/** A number per joint. */
template <int kJoints>
using JointVector = Eigen::Matrix<double, kJoints, 1>;
template <int kJoints>
using JointMatrix = Eigen::Matrix<double, kJoints, kJoints>;
template <int kJoints>
using Jacobian = Eigen::Matrix<double, 6, kJoints>;

/** The model of an arm with kJoints joints at one configuration. Six-vectors
are [linear; angular] of the tool point E in B. */
template <int kJoints>
struct ModelTerms {
  Jacobian<kJoints> J_BE{Jacobian<kJoints>::Zero()};  ///< v_BE = J_BE v.
  /** A, kg m^2. */
  JointMatrix<kJoints> mass{JointMatrix<kJoints>::Identity()};
  /** C v, N m, without gravity. */
  JointVector<kJoints> bias{JointVector<kJoints>::Zero()};
  /** N m: generalized gravity force, as Drake's
  CalcGravityGeneralizedForces() gives it; the torque that holds the arm is its
  negative. */
  JointVector<kJoints> gravity{JointVector<kJoints>::Zero()};
  Vector6 Jdot_v{Vector6::Zero()};  ///< Bias acceleration, m/s^2, rad/s^2.
};

}  // namespace dual_proxy
