// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/point_controller.h"

#include <cmath>

#include "dual_proxy/link/message.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"

namespace dual_proxy {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

bool IsValid(const PointControllerInput& input) {
  return std::isfinite(input.model.mass) && input.v.allFinite() &&
         input.motion_error.allFinite() && input.proxy_velocity.allFinite() &&
         input.proxy_acceleration.allFinite() &&
         input.reference_force.allFinite() && input.sensed_force.allFinite() &&
         IsSelection(input.force_selection);
}

}  // namespace

void PointModelParams::Validate() const {
  ThrowUnlessIn("PointModelParams", "mass", mass, Above(0));
}

Vector6 CalcTwist(const PointTerms& /* terms */, const Vector3d& v) noexcept {
  Vector6 twist;
  twist << v, Vector3d::Zero();
  return twist;
}

PointModel::PointModel(Params params) : params_(params) { params_.Validate(); }

void PointModel::Calc(const Vector3d& q, const Vector3d& /* v */, Pose* X_BE,
                      Terms* terms) const noexcept {
  X_BE->p = q;
  X_BE->R.setIdentity();
  terms->mass = params_.mass;
}

void PointControllerParams::Validate() const {
  ValidateFields("PointControllerParams", *this);
}

ForceLoopParams MakeForceLoopParams(const PointControllerParams& params) {
  ForceLoopParams loop = params.force;
  loop.period = params.period;
  return loop;
}

PointController::PointController(Params params)
    : params_((params.Validate(), params)),
      loop_(MakeForceLoopParams(params)),
      blend_({.blend_time = params.selection_blend_time,
              .period = params.period}) {}

PointControllerState PointController::MakeState() const noexcept {
  return {.force_selection = blend_.MakeState(), .loop = loop_.MakeState()};
}

Vector3d PointController::Send(const Vector3d& force,
                               State* state) const noexcept {
  const Vector3d limited = Saturate(force, params_.force_limit);
  if (limited != force) ++state->force_limited;
  const Vector3d sent = RateLimit(state->force, limited,
                                  params_.force_rate_limit * params_.period);
  if (sent != limited) ++state->rate_limited;
  state->force = sent;
  return sent;
}

PointControllerOutput PointController::Update(const Input& input,
                                              State* state) const noexcept {
  const auto refuse = [this, state] {
    ++state->bad_inputs;
    Output output;
    output.force = Send(Vector3d::Zero(), state);
    output.observed_energy = state->loop.passivity.energy;
    return output;
  };
  if (!IsValid(input)) return refuse();
  Output output;
  // Without a sensor that is ready no loop is closed: there is no force space,
  // and no error of force.
  const bool ready = input.sensor_ready || !input.force_feedback;
  const Matrix3d none = Matrix3d::Zero();
  const Matrix3d& asked = ready ? input.force_selection : none;
  const Vector3d& sensed =
      input.sensor_ready ? input.sensed_force : input.reference_force;
  const Matrix3d& Omega_f = blend_.Update(asked, &state->force_selection);

  // Motion: eq. (12) for a unit mass, with feed-forward.
  Vector3d velocity_error = input.v;
  Vector3d acceleration = Vector3d::Zero();
  if (params_.feed_forward) {
    velocity_error -= input.proxy_velocity;
    acceleration = input.proxy_acceleration;
  }
  acceleration -= SaturateUnlessZero(
                      params_.position_stiffness * input.motion_error,
                      params_.position_damping * params_.motion_speed_limit) +
                  params_.position_damping * velocity_error;
  acceleration -= Omega_f * acceleration.eval();

  // Force: eq. (13).
  output.contact_force =
      input.force_feedback ? loop_.Update(input.reference_force, sensed,
                                          input.v, asked, Omega_f, &state->loop)
                           : Vector3d(Omega_f * input.reference_force);

  const Vector3d motion_force = input.model.mass * acceleration;
  const Vector3d force = motion_force + output.contact_force;
  if (!force.allFinite()) return refuse();
  output.force = Send(force, state);
  output.motion_force =
      params_.unit_mass_motion_force ? acceleration : motion_force;
  output.observed_energy = state->loop.passivity.energy;
  output.injected_damping = state->loop.passivity.damping;
  return output;
}

}  // namespace dual_proxy
