// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/inverse_kinematics.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "dual_proxy/common/rotation.h"

namespace dual_proxy {
namespace {

constexpr int kMostSteps = 300;
constexpr double kLongestStep = 0.2;  // rad, of a joint.
constexpr double kTolerance = 1e-9;   // m, rad: of the pose.
constexpr double kSettled = 1e-12;    // rad: a step like this ends it.
// Of the Jacobian's squares: near a singularity steps stay finite.
constexpr double kDamping = 1e-13;

/** The least step to `target` (from q to q_near) with J step = error, joints
held at their limits. */
template <int kJoints>
JointVector<kJoints> CalcStep(const Jacobian<kJoints>& J, const Vector6& error,
                              const JointVector<kJoints>& target,
                              const JointVector<kJoints>& lower,
                              const JointVector<kJoints>& upper) {
  JointVector<kJoints> step = JointVector<kJoints>::Zero();
  JointVector<kJoints> is_free = JointVector<kJoints>::Ones();
  for (int held = 0; held < kJoints; ++held) {
    const Jacobian<kJoints> J_free = J * is_free.asDiagonal();
    const JointVector<kJoints> start =
        is_free.cwiseProduct(target) +
        (JointVector<kJoints>::Ones() - is_free).cwiseProduct(step);
    const Matrix6 gram =
        J_free * J_free.transpose() + kDamping * Matrix6::Identity();
    step = start +
           J_free.transpose() * gram.ldlt().solve(Vector6(error - J * start));
    const JointVector<kJoints> beyond =
        (step - upper).cwiseMax(lower - step).cwiseProduct(is_free);
    int worst = 0;
    if (!(beyond.maxCoeff(&worst) > 0)) break;
    is_free(worst) = 0;
    step(worst) = std::clamp(step(worst), lower(worst), upper(worst));
  }
  return step.cwiseMax(lower).cwiseMin(upper);
}

}  // namespace

template <int kJoints>
std::optional<JointVector<kJoints>> FindPosture(
    const ArmModel<kJoints>& arm, const Pose& X_BE,
    const JointVector<kJoints>& q_near, const JointVector<kJoints>& lower,
    const JointVector<kJoints>& upper) {
  const Eigen::Matrix3d R_BE = ProjectToRotation(X_BE.R);
  JointVector<kJoints> q = q_near.cwiseMax(lower).cwiseMin(upper);
  Vector6 error;
  const auto calc = [&](Jacobian<kJoints>* J) {
    Pose pose;
    ModelTerms<kJoints> terms;
    arm.Calc(q, JointVector<kJoints>::Zero(), &pose, &terms);
    *J = terms.J_BE;
    error << X_BE.p - pose.p, LogRotation(R_BE * pose.R.transpose());
  };
  Jacobian<kJoints> J;
  calc(&J);
  for (int i = 0; i < kMostSteps; ++i) {
    const JointVector<kJoints> step =
        CalcStep<kJoints>(J, error, q_near - q, lower - q, upper - q);
    const double longest = step.cwiseAbs().maxCoeff();
    q += step * std::min(1.0, kLongestStep / longest);
    calc(&J);
    if (longest < kSettled) break;
  }
  q = q.cwiseMax(lower).cwiseMin(upper);
  if (!(error.cwiseAbs().maxCoeff() <= kTolerance)) return std::nullopt;
  return q;
}

template std::optional<JointVector<6>> FindPosture(const ArmModel<6>&,
                                                   const Pose&,
                                                   const JointVector<6>&,
                                                   const JointVector<6>&,
                                                   const JointVector<6>&);
template std::optional<JointVector<7>> FindPosture(const ArmModel<7>&,
                                                   const Pose&,
                                                   const JointVector<7>&,
                                                   const JointVector<7>&,
                                                   const JointVector<7>&);

}  // namespace dual_proxy
