// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/sides/operator_aids.h"

#include <algorithm>
#include <cmath>

namespace dual_proxy {

void OperatorAidsParams::Validate() const {
  ValidateFields("OperatorAidsParams", *this);
}

OperatorAids::OperatorAids(const OperatorAidsParams& params)
    : buttons_((params.Validate(), params.buttons)),
      max_force_scale_(params.max_force_scale),
      max_scale_step_(params.force_scale_rate * params.period),
      clutch_(params.clutch, params.period),
      homing_(params.homing, params.period),
      wall_(params.workspace_wall),
      guidance_(params.guidance, params.period) {}

void OperatorAids::FilterInput(const OperatorButtons& buttons, Pose* X_DH,
                               Vector6* device_velocity,
                               OperatorAidsState* state) const noexcept {
  const Eigen::Vector3d v = device_velocity->head<3>();
  state->fixture_force.setZero();
  if (wall_.on()) state->fixture_force += wall_.Calc(X_DH->p, v);
  if (buttons_) {
    homing_.Update(buttons.home, X_DH->p, v, &state->homing);
    state->fixture_force += state->homing.force;
    clutch_.Update(buttons.clutch || buttons.home, *X_DH, &state->clutch);
    *X_DH = state->clutch.pose;
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

void OperatorAids::FilterSetpoint(const OperatorAidsState& state,
                                  HapticSetpoint* setpoint) const noexcept {
  setpoint->reference_force *= state.force_gain;
  setpoint->reference_moment *= state.force_gain;
  if (!state.clutch.clutched) return;
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
