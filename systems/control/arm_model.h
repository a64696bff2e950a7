// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>

#include "dual_proxy/common/pose.h"
#include "dual_proxy/control/model_terms.h"

namespace dual_proxy {

/** Parameters of ArmModel: a base and kJoints links in series, each behind a
revolute joint. Index i (from 0) counts joints and the links behind them from
the base on; P is the link in front of joint i (the base B for i = 0), J the
frame that joint i moves and its link is fixed in. J's z is the joint's axis.

There is no default arm: masses are zero until they are set, and refused. */
template <int kJoints>
struct ArmModelParams {
  using PerJoint = Eigen::Matrix<double, 3, kJoints>;

  /** m, finite: column i is the position of J in P. */
  PerJoint p_PJ{PerJoint::Zero()};
  /** Orientation of J in P at q_i = 0, rotation matrices. */
  std::array<Eigen::Matrix3d, kJoints> R_PJ{
      MakeArray(Eigen::Matrix3d::Identity())};
  JointVector<kJoints> mass{JointVector<kJoints>::Zero()};  ///< kg, > 0.
  /** m, finite: column i is the centre of mass of link i, in J. */
  PerJoint com{PerJoint::Zero()};
  /** kg m^2, of link i about its centre of mass, in J: symmetric, principal
  moments >= 0 and none above the sum of the others (1e-6 of the largest is
  forgiven). */
  std::array<Eigen::Matrix3d, kJoints> inertia{
      MakeArray(Eigen::Matrix3d::Zero())};
  /** m, finite: tool point E in the last J. */
  Eigen::Vector3d p_LE{Eigen::Vector3d::Zero()};
  /** Orientation of E in the last J, a rotation matrix. */
  Eigen::Matrix3d R_LE{Eigen::Matrix3d::Identity()};
  /** m/s^2, finite: acceleration of gravity, in B. */
  Eigen::Vector3d gravity{0, 0, -9.81};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

 private:
  static std::array<Eigen::Matrix3d, kJoints> MakeArray(
      const Eigen::Matrix3d& m) {
    std::array<Eigen::Matrix3d, kJoints> result;
    result.fill(m);
    return result;
  }
};

/** A check of the kind in common/validate.h: of an inertia as ArmModelParams
has them. */
void ThrowUnlessInertia(const char* who, const char* field,
                        const Eigen::Matrix3d& value);

/** Twist of E in B, [linear; angular], m/s, rad/s: J_BE v. One function, so
that whoever needs it gets the same bits. */
template <int kJoints>
Vector6 CalcTwist(const ModelTerms<kJoints>& terms,
                  const JointVector<kJoints>& v) noexcept;

/** Kinematics and rigid-body dynamics of a serial arm with revolute joints: all
that the operational-space controller asks of a model.

Everything is in B, about B's origin (Featherstone, "Rigid Body Dynamics
Algorithms", 2008): the mass matrix by the composite-rigid-body method, the bias
by recursive Newton-Euler, gravity from the composite bodies' first moments. */
template <int kJoints>
class ArmModel {
 public:
  using Params = ArmModelParams<kJoints>;
  using Terms = ModelTerms<kJoints>;

  /** @throws std::invalid_argument if params are not valid. */
  explicit ArmModel(Params params);

  const Params& params() const { return params_; }

  /** Computes pose and model terms. If anything in q or v is not finite (or its
  square overflows), every result is NaN: where a velocity is no number, the
  pose is not to be trusted either. Neither allocates nor throws.
  @param q  rad.
  @param v  rad/s.
  @param[out] X_BE   pose of the tool point.
  @param[out] terms  every field is set; the mass matrix is exactly symmetric,
                     and positive definite if the arm's inertias are (a point
                     mass on an axis is not). */
  void Calc(const JointVector<kJoints>& q, const JointVector<kJoints>& v,
            Pose* X_BE, Terms* terms) const noexcept;

 private:
  Params params_;
};

}  // namespace dual_proxy
