// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/sides/operator_aids.h"

#include <algorithm>
#include <cmath>

namespace dual_proxy {

using Eigen::Vector3d;

void OperatorAidsParams::Validate() const {
  ValidateFields("OperatorAidsParams", *this);
}

OperatorAids::OperatorAids(const OperatorAidsParams& params)
    : buttons_((params.Validate(), params.buttons)),
      max_force_scale_(params.max_force_scale),
      max_scale_step_(params.force_scale_rate * params.period),
      max_damping_(params.max_damping),
      period_(params.period),
      clutch_(params.clutch, params.period),
      homing_(params.homing, params.period),
      wall_(params.workspace_wall),
      guidance_(params.guidance, params.period) {}

Vector3d OperatorAids::CountEnergy(const Vector3d& handle, const Vector3d& p,
                                   const Vector3d& v,
                                   OperatorAidsState* state) const noexcept {
  constexpr double kMinSpeed = 0.002;  // m/s: less would be noise.
  if (!handle.allFinite() || !p.allFinite() || !v.allFinite()) {
    state->scheme_force.setZero();
    state->hand_force.setZero();
    return Vector3d::Zero();
  }
  state->scheme_energy -= state->scheme_force.dot(p - state->position);
  state->hand_energy -= state->hand_force.dot(handle - state->handle);
  state->handle = handle;
  state->position = p;
  if (state->scheme_energy <= 0) {
    // What is below zero is the scheme's own activity.
    state->hand_energy -= state->force_gain * state->scheme_energy;
    state->hand_energy = std::min(state->hand_energy, 0.0);
    state->scheme_energy = 0;
  }
  const double speed2 = v.squaredNorm();
  if (state->clutch.clutched || state->hand_energy >= 0 ||
      speed2 < kMinSpeed * kMinSpeed) {
    return Vector3d::Zero();
  }
  return -std::min(max_damping_, -state->hand_energy / (period_ * speed2)) * v;
}

void OperatorAids::FilterInput(const OperatorButtons& buttons, Pose* X_DH,
                               Vector6* device_velocity,
                               OperatorAidsState* state) const noexcept {
  const Eigen::Vector3d v = device_velocity->head<3>();
  state->fixture_force.setZero();
  if (wall_.on()) state->fixture_force += wall_.Calc(X_DH->p, v);
  if (buttons_) {
    const Vector3d handle = X_DH->p;
    homing_.Update(buttons.home, X_DH->p, v, &state->homing);
    state->fixture_force += state->homing.force;
    clutch_.Update(buttons.clutch || buttons.home, *X_DH, &state->clutch);
    *X_DH = state->clutch.pose;
    state->paying_force = CountEnergy(handle, X_DH->p, v, state);
    state->fixture_force += state->paying_force;
    if (state->clutch.clutched) device_velocity->setZero();
    if (std::isfinite(buttons.force_scale)) {
      const double change =
          std::clamp(buttons.force_scale, 0.0, max_force_scale_) -
          state->force_scale;
      state->force_scale +=
          std::clamp(change, -max_scale_step_, max_scale_step_);
    }
    state->force_gain = state->clutch.engagement * state->force_scale;
  }
  if (guidance_.on()) {
    state->fixture_force +=
        guidance_.Update(X_DH->p, !state->clutch.clutched, &state->guidance);
  }
}

void OperatorAids::FilterSetpoint(HapticSetpoint* setpoint,
                                  OperatorAidsState* state) const noexcept {
  const Vector3d scaled = setpoint->reference_force - setpoint->injected_force;
  state->scheme_force = scaled;
  state->hand_force = state->force_gain * scaled + state->paying_force;
  setpoint->reference_force += (state->force_gain - 1) * scaled;
  setpoint->reference_moment *= state->force_gain;
  if (!state->clutch.clutched) return;
  setpoint->force_selection.setZero();
  setpoint->moment_selection.setZero();
  setpoint->contact_normals.setZero();
}

void OperatorAids::VisitSignals(const OperatorAidsState& state,
                                const Pose& X_DH, SignalSink* sink) const {
  if (buttons_) {
    sink->Vector({"handle_position", "m", "D",
                  "of the handle, whose home no "
                  "clutch moves"},
                 X_DH.p);
    sink->Integer({"clutched", "", "",
                   "1 while the robot holds its place and the hand is free"},
                  state.clutch.clutched ? 1 : 0);
    sink->Scalar({"force_gain", "", "", "by which F_h is multiplied"},
                 state.force_gain);
  }
  if (on()) {
    sink->Vector({"fixture_force", "N", "D",
                  "of wall, guidance and homing, on the hand"},
                 state.fixture_force);
  }
}

}  // namespace dual_proxy
