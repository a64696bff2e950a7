// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/haptic_controller.h"

#include "dual_proxy/proxy/vector_rate_limiter.h"

namespace dual_proxy {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;

void HapticControllerParams::Validate() const {
  ValidateFields("HapticControllerParams", *this);
}

HapticController::HapticController(HapticControllerParams params)
    : params_(params) {
  params_.Validate();
}

Vector6d HapticController::Update(const Vector3d& reference_force,
                                  const Vector3d& reference_moment,
                                  const Vector6d& device_velocity,
                                  const Matrix3d& force_selection,
                                  HapticControllerState* state) const noexcept {
  if (!reference_force.allFinite() || !reference_moment.allFinite() ||
      !device_velocity.allFinite() || !force_selection.allFinite()) {
    ++state->bad_inputs;
    return Vector6d::Zero();
  }
  const Vector3d force =
      reference_force -
      params_.force_damping * (force_selection * device_velocity.head<3>());
  Vector6d wrench;
  wrench << Saturate(force, params_.max_force),
      Saturate(reference_moment, params_.max_moment);
  return wrench;
}

}  // namespace dual_proxy
