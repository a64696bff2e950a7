// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/haptic_controller.h"

#include <algorithm>

#include "dual_proxy/common/low_pass.h"
#include "dual_proxy/common/possible.h"
#include "dual_proxy/link/message.h"
#include "dual_proxy/proxy/unilateral.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"

namespace dual_proxy {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;

namespace {

// What of a force pulls into no surface, those before and those to come.
Vector3d LeaveOutPull(const Vector3d& force,
                      const HapticControllerState& state) {
  const Vector3d next = RemovePull(force, state.contact_normals);
  if (state.normals_progress >= 1) return next;
  const Vector3d last = RemovePull(force, state.last_normals);
  return last + state.normals_progress * (next - last);
}

}  // namespace

void HapticControllerParams::Validate() const {
  ValidateFields("HapticControllerParams", *this);
}

HapticController::HapticController(HapticControllerParams params)
    : params_((params.Validate(), params)),
      blend_(
          {.blend_time = params.selection_blend_time, .period = params.period}),
      normals_step_(params.selection_blend_time > params.period
                        ? params.period / params.selection_blend_time
                        : 1),
      sensed_gain_(LowPassGain(params.force_filter_cutoff, params.period)) {}

Vector6d HapticController::Update(const HapticControllerInput& input,
                                  HapticControllerState* state) const noexcept {
  if (!IsUsable(input)) {
    ++state->bad_inputs;
    return Vector6d::Zero();
  }
  const bool first = !state->selection.initialized;
  const Matrix3d& Omega =
      blend_.Update(input.force_selection, &state->selection);
  TakeNormals(input.contact_normals, first, state);
  Vector3d force;
  if (params_.method == HapticControlMethod::kPosition) {
    force = HoldProxy(input, Omega, state);
  } else {
    const Vector3d damping =
        params_.force_damping * (Omega * input.device_velocity.head<3>());
    force = input.reference_force - damping;
    if (!input.fixture_force.isZero(0)) force += input.fixture_force;
    force = LeaveOutPull(force, *state);
  }
  if (params_.method == HapticControlMethod::kForceFeedback) {
    force = CloseForceLoop(force, input.handle_force, state);
  }
  Vector6d wrench;
  wrench << Saturate(force, params_.max_force),
      Saturate(input.reference_moment, params_.max_moment);
  return wrench;
}

void HapticController::TakeNormals(
    const Matrix3d& normals, bool first,
    HapticControllerState* state) const noexcept {
  if (!normals.isZero(0) || state->selection.progress >= 1) {
    state->asked_normals = normals;
  }
  if (first) state->contact_normals = state->asked_normals;
  if (state->normals_progress >= 1 &&
      state->contact_normals != state->asked_normals) {
    state->last_normals = state->contact_normals;
    state->contact_normals = state->asked_normals;
    state->normals_progress = 0;
  }
  state->normals_progress =
      std::min(1.0, state->normals_progress + normals_step_);
}

bool HapticController::IsUsable(
    const HapticControllerInput& input) const noexcept {
  if (params_.method == HapticControlMethod::kForceFeedback &&
      !input.handle_force.allFinite()) {
    return false;
  }
  if (params_.method == HapticControlMethod::kPosition &&
      !input.proxy_displacement.allFinite()) {
    return false;
  }
  return input.reference_force.allFinite() && input.fixture_force.allFinite() &&
         input.reference_moment.allFinite() &&
         input.device_velocity.allFinite() &&
         input.force_selection.allFinite() && AreNormals(input.contact_normals);
}

Vector3d HapticController::CloseForceLoop(
    const Vector3d& force, const Vector3d& handle_force,
    HapticControllerState* state) const noexcept {
  StoreIfFinite(state->sensed + sensed_gain_ * (handle_force - state->sensed),
                &state->sensed);
  const Vector3d error = force - state->sensed;
  state->integral_force =
      Saturate(state->integral_force +
                   params_.force_integral_gain * params_.period * error,
               params_.max_integral_force);
  return force + params_.force_gain * error + state->integral_force;
}

Vector3d HapticController::HoldProxy(
    const HapticControllerInput& input, const Matrix3d& Omega,
    HapticControllerState* state) const noexcept {
  const Vector3d spring =
      -params_.position_stiffness * (Omega * input.proxy_displacement);
  state->position_force =
      RateLimit(state->position_force, Saturate(spring, params_.max_force),
                params_.position_force_rate * params_.period);
  const Vector3d outside =
      input.reference_force - Omega * input.reference_force;
  const Vector3d damping =
      params_.position_damping * (Omega * input.device_velocity.head<3>());
  return LeaveOutPull(
      outside + state->position_force - damping + input.fixture_force, *state);
}

}  // namespace dual_proxy
