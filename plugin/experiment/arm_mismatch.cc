// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/arm_mismatch.h"

#include "dual_proxy/common/validate.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Of a point mass about a point that is `p` from it.
Matrix3d PointInertia(double mass, const Vector3d& p) {
  return mass * (p.squaredNorm() * Matrix3d::Identity() - p * p.transpose());
}

// Adds a point mass at `p` to a body; inertia is about the centre of mass.
void AddPoint(double point_mass, const Vector3d& p, double* mass, Vector3d* com,
              Matrix3d* inertia) {
  const double whole = *mass + point_mass;
  if (whole == 0) return;
  const Vector3d centre = (*mass * *com + point_mass * p) / whole;
  *inertia +=
      PointInertia(*mass, *com - centre) + PointInertia(point_mass, p - centre);
  *com = centre;
  *mass = whole;
}

}  // namespace

bool ArmMismatchParams::is_none() const {
  return mass_scale == 1 && payload == 0 && tool_offset.isZero(0) &&
         joint_friction == 0 && torque_step == 0 && torque_delay == 0;
}

void ArmMismatchParams::Validate() const {
  ValidateFields("ArmMismatchParams", *this);
}

void ApplyMismatch(const ArmMismatchParams& mismatch, ArmModelParams<7>* arm,
                   SimulatedArmParams* params) {
  mismatch.Validate();
  constexpr int kLast = 6;
  for (int i = 0; i < 7; ++i) {
    // The tool, a part of the last link, is what the sensor knows.
    const double own = arm->mass(i) - (i == kLast ? params->tool_mass : 0);
    const double scale =
        (arm->mass(i) + (mismatch.mass_scale - 1) * own) / arm->mass(i);
    arm->mass(i) *= scale;
    arm->inertia[i] *= scale;
  }
  Vector3d com = arm->com.col(kLast);
  AddPoint(mismatch.payload, arm->p_LE, &arm->mass(kLast), &com,
           &arm->inertia[kLast]);
  arm->com.col(kLast) = com;
  AddPoint(mismatch.payload, params->p_SE, &params->tool_mass,
           &params->tool_com, &params->tool_inertia);
  params->p_EBall.colwise() += mismatch.tool_offset;
  params->joint_friction = mismatch.joint_friction;
  params->torque_step = mismatch.torque_step;
  params->torque_delay = mismatch.torque_delay;
}

}  // namespace dual_proxy
