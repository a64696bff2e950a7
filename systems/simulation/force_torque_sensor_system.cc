// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/force_torque_sensor_system.h"

#include "dual_proxy/common/validate.h"

namespace dual_proxy {

using drake::math::RigidTransformd;
using State = ForceTorqueSensorState;

ForceTorqueSensorSystem::ForceTorqueSensorSystem(
    const ForceTorqueSensorParams& params, const Eigen::Vector3d& p_SE,
    std::uint64_t seed)
    : Face(Feedthrough::kNo), sensor_(params), p_SE_(p_SE) {
  ThrowUnlessFinite("ForceTorqueSensorSystem", "p_SE", p_SE);
  DeclareVectorInputPort("reaction", 6);
  DeclareValueInput<RigidTransformd>("robot_pose");
  DeclareMemory(sensor_.MakeState(seed), params.period);
  DeclareVectorOutput(
      "sensed_wrench", 6,
      [](const State& state, Vector wrench) { wrench = state.wrench; });
  DeclareVectorOutput("bad_inputs", 1, [](const State& state, Vector count) {
    count[0] = static_cast<double>(state.bad_inputs);
  });
}

void ForceTorqueSensorSystem::Step(const Context& context, State* state) const {
  // Not by an event's offset: period + k period is not always the others'
  // (k + 1) period, and the sensor would step before or after them.
  if (context.get_time() <= 0) return;
  const Eigen::Matrix3d R_BE =
      ToPose(get_robot_pose_input_port().Eval<RigidTransformd>(context)).R;
  sensor_.Update(get_reaction_input_port().Eval(context), R_BE, R_BE * p_SE_,
                 state);
}

}  // namespace dual_proxy
