// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/point_robot.h"

namespace dual_proxy {

void PointRobotParams::Validate() const {
  ValidateFields("PointRobotParams", *this);
}

PointRobot::PointRobot(const Params& params, const ContactSceneParams& scene)
    : params_(params), scene_(scene) {
  params_.Validate();
}

PointRobotState PointRobot::MakeState(const Eigen::Vector3d& position) const {
  State state;
  state.position = position;
  state.contact = scene_.Calc(state.position, state.velocity);
  return state;
}

void PointRobot::Update(const Eigen::Vector3d& control_force,
                        State* state) const noexcept {
  Eigen::Vector3d force = control_force;
  if (!force.allFinite()) {
    ++state->bad_inputs;
    force.setZero();
  }
  const double step = params_.period / params_.substeps;
  for (int i = 0; i < params_.substeps; ++i) {
    state->velocity += step / params_.mass * (force - state->contact.force);
    state->position += step * state->velocity;
    state->contact = scene_.Calc(state->position, state->velocity);
  }
}

}  // namespace dual_proxy
