// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/arm_model.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "dual_proxy/common/elementary.h"
#include "dual_proxy/common/validate.h"

namespace dual_proxy {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

// Of the largest principal moment: rounding of printed inertias.
constexpr double kInertiaTolerance = 1e-6;

std::string Indexed(const char* field, int index) {
  std::string name(field);
  name += '[';
  name += std::to_string(index);
  name += ']';
  return name;
}

// A 6-vector about B's origin: of a motion, the angular part and the velocity
// or acceleration of the point at the origin; of a force, moment and force.
struct Spatial {
  Vector3d angular;
  Vector3d linear;
};

// Rigid body in B, about B's origin.
struct Inertia {
  double mass;
  Vector3d first_moment;  // mass times centre of mass.
  Matrix3d rotational;

  Spatial operator*(const Spatial& motion) const {
    return {rotational * motion.angular + first_moment.cross(motion.linear),
            mass * motion.linear - first_moment.cross(motion.angular)};
  }
};

}  // namespace

template <int kJoints>
Vector6 CalcTwist(const ModelTerms<kJoints>& terms,
                  const JointVector<kJoints>& v) noexcept {
  return terms.J_BE * v;
}

void ThrowUnlessInertia(const char* who, const char* field,
                        const Matrix3d& value) {
  ThrowUnlessIn(who, field, value, Finite());
  const double tolerance = kInertiaTolerance * value.cwiseAbs().maxCoeff();
  const double asymmetry = (value - value.transpose()).cwiseAbs().maxCoeff();
  if (asymmetry > tolerance) {
    ThrowInvalidField(who, field, "a symmetric matrix: asymmetry 0", asymmetry);
  }
  const Vector3d moments =
      Eigen::SelfAdjointEigenSolver<Matrix3d>(value, Eigen::EigenvaluesOnly)
          .eigenvalues();  // In increasing order.
  if (moments(0) < -tolerance) {
    ThrowInvalidField(who, field, "principal moments >= 0", moments(0));
  }
  if (moments(2) > moments(0) + moments(1) + tolerance) {
    ThrowInvalidField(who, field,
                      "no principal moment above the sum of the others",
                      moments(2));
  }
}

template <int kJoints>
void ArmModelParams<kJoints>::Validate() const {
  const char* who = "ArmModelParams";
  ThrowUnlessIn(who, "p_PJ", p_PJ, Finite());
  for (int i = 0; i < kJoints; ++i) {
    ThrowUnlessIn(who, Indexed("R_PJ", i).c_str(), R_PJ[i], Rotation());
    ThrowUnlessIn(who, Indexed("mass", i).c_str(), mass(i), Above(0));
    ThrowUnlessInertia(who, Indexed("inertia", i).c_str(), inertia[i]);
  }
  ThrowUnlessIn(who, "com", com, Finite());
  ThrowUnlessIn(who, "p_LE", p_LE, Finite());
  ThrowUnlessIn(who, "R_LE", R_LE, Rotation());
  ThrowUnlessIn(who, "gravity", gravity, Finite());
}

template <int kJoints>
ArmModel<kJoints>::ArmModel(Params params) : params_(std::move(params)) {
  params_.Validate();
}

template <int kJoints>
void ArmModel<kJoints>::Calc(const JointVector<kJoints>& q,
                             const JointVector<kJoints>& v, Pose* X_BE,
                             Terms* terms) const noexcept {
  if (!std::isfinite(q.squaredNorm() + v.squaredNorm())) {
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    X_BE->p.setConstant(kNan);
    X_BE->R.setConstant(kNan);
    terms->J_BE.setConstant(kNan);
    terms->mass.setConstant(kNan);
    terms->bias.setConstant(kNan);
    terms->gravity.setConstant(kNan);
    terms->Jdot_v.setConstant(kNan);
    return;
  }
  // From the base to the tool. Per joint: its unit motion, its link's inertia,
  // and the force its link takes at zero joint accelerations.
  std::array<Spatial, kJoints> axes;
  std::array<Inertia, kJoints> inertias;
  std::array<Spatial, kJoints> forces;
  Vector3d p_BJ = Vector3d::Zero();
  Matrix3d R_BJ = Matrix3d::Identity();
  Spatial velocity{Vector3d::Zero(), Vector3d::Zero()};
  Spatial acceleration{Vector3d::Zero(), Vector3d::Zero()};
  for (int i = 0; i < kJoints; ++i) {
    p_BJ += R_BJ * params_.p_PJ.col(i);
    const Matrix3d R_B0 = R_BJ * params_.R_PJ[i];
    const auto [sin, cos] = CalcSinCos(q(i));
    R_BJ.col(0) = cos * R_B0.col(0) + sin * R_B0.col(1);
    R_BJ.col(1) = cos * R_B0.col(1) - sin * R_B0.col(0);
    R_BJ.col(2) = R_B0.col(2);

    const Vector3d z = R_B0.col(2);
    Spatial& axis = axes[i];
    axis = {z, p_BJ.cross(z)};

    const double mass = params_.mass(i);
    const Vector3d com = p_BJ + R_BJ * params_.com.col(i);
    Inertia& inertia = inertias[i];
    inertia.mass = mass;
    inertia.first_moment = mass * com;
    inertia.rotational = R_BJ * params_.inertia[i] * R_BJ.transpose();
    inertia.rotational -= inertia.first_moment * com.transpose();
    inertia.rotational.diagonal().array() += inertia.first_moment.dot(com);

    // The axis is carried along by the links in front of it.
    acceleration.angular += v(i) * velocity.angular.cross(axis.angular);
    acceleration.linear += v(i) * (velocity.angular.cross(axis.linear) +
                                   velocity.linear.cross(axis.angular));
    velocity.angular += v(i) * axis.angular;
    velocity.linear += v(i) * axis.linear;

    const Spatial momentum = inertia * velocity;
    Spatial& force = forces[i];
    force = inertia * acceleration;
    force.angular += velocity.angular.cross(momentum.angular) +
                     velocity.linear.cross(momentum.linear);
    force.linear += velocity.angular.cross(momentum.linear);
  }

  const Vector3d p_BE = p_BJ + R_BJ * params_.p_LE;
  X_BE->p = p_BE;
  X_BE->R = R_BJ * params_.R_LE;
  const Vector3d velocity_E = velocity.linear + velocity.angular.cross(p_BE);
  terms->Jdot_v.template head<3>() = acceleration.linear +
                                     acceleration.angular.cross(p_BE) +
                                     velocity.angular.cross(velocity_E);
  terms->Jdot_v.template tail<3>() = acceleration.angular;

  // From the tool to the base: `inertia` and `force` are of all links from i
  // on.
  Inertia inertia{0, Vector3d::Zero(), Matrix3d::Zero()};
  Spatial force{Vector3d::Zero(), Vector3d::Zero()};
  for (int i = kJoints - 1; i >= 0; --i) {
    const Spatial& axis = axes[i];
    inertia.mass += inertias[i].mass;
    inertia.first_moment += inertias[i].first_moment;
    inertia.rotational += inertias[i].rotational;
    force.angular += forces[i].angular;
    force.linear += forces[i].linear;

    terms->J_BE.col(i).template head<3>() =
        axis.linear + axis.angular.cross(p_BE);
    terms->J_BE.col(i).template tail<3>() = axis.angular;
    terms->bias(i) =
        axis.angular.dot(force.angular) + axis.linear.dot(force.linear);
    terms->gravity(i) =
        axis.angular.dot(inertia.first_moment.cross(params_.gravity)) +
        axis.linear.dot(inertia.mass * params_.gravity);
    const Spatial momentum = inertia * axis;
    for (int j = 0; j <= i; ++j) {
      const double element = axes[j].angular.dot(momentum.angular) +
                             axes[j].linear.dot(momentum.linear);
      terms->mass(i, j) = element;
      terms->mass(j, i) = element;
    }
  }
}

template struct ArmModelParams<6>;
template struct ArmModelParams<7>;
template class ArmModel<6>;
template class ArmModel<7>;
template Vector6 CalcTwist(const ModelTerms<6>&,
                           const JointVector<6>&) noexcept;
template Vector6 CalcTwist(const ModelTerms<7>&,
                           const JointVector<7>&) noexcept;

}  // namespace dual_proxy
