// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/haptic_controller.h"

#include "dual_proxy/link/message.h"
#include "dual_proxy/proxy/unilateral.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"

namespace dual_proxy {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;

void HapticControllerParams::Validate() const {
  ValidateFields("HapticControllerParams", *this);
}

HapticController::HapticController(HapticControllerParams params)
    : params_((params.Validate(), params)),
      blend_({.blend_time = params.selection_blend_time,
              .period = params.period}) {}

Vector6d HapticController::Update(const Vector3d& reference_force,
                                  const Vector3d& reference_moment,
                                  const Vector6d& device_velocity,
                                  const Matrix3d& force_selection,
                                  const Matrix3d& contact_normals,
                                  HapticControllerState* state) const noexcept {
  if (!reference_force.allFinite() || !reference_moment.allFinite() ||
      !device_velocity.allFinite() || !force_selection.allFinite() ||
      !AreNormals(contact_normals)) {
    ++state->bad_inputs;
    return Vector6d::Zero();
  }
  const Matrix3d& Omega = blend_.Update(force_selection, &state->selection);
  if (!contact_normals.isZero(0) || state->selection.progress >= 1) {
    state->contact_normals = contact_normals;
  }
  const Vector3d damping =
      params_.force_damping * (Omega * device_velocity.head<3>());
  const Vector3d force =
      RemovePull(reference_force - damping, state->contact_normals);
  Vector6d wrench;
  wrench << Saturate(force, params_.max_force),
      Saturate(reference_moment, params_.max_moment);
  return wrench;
}

}  // namespace dual_proxy
