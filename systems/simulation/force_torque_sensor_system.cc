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
  ThrowUnlessIn("ForceTorqueSensorSystem", "p_SE", p_SE, Finite());
  DeclareVectorInputPort("reaction", 6);
  DeclareValueInput<RigidTransformd>("robot_pose");
  DeclareVectorInputPort("tare", 1);
  DeclareVectorInputPort("robot_velocity", 6);
  DeclareMemory(sensor_.MakeState(seed), params.period);
  DeclareVectorOutput(
      "sensed_wrench", 6,
      [](const State& state, Vector wrench) { wrench = state.adapter.wrench; });
  DeclareVectorOutput("ready", 1, [](const State& state, Vector ready) {
    ready(0) = state.adapter.ready;
  });
  DeclareVectorOutput("counters", 2, [](const State& state, Vector counters) {
    counters << static_cast<double>(state.adapter.bad_inputs),
        static_cast<double>(state.adapter.tares_refused);
  });
}

void ForceTorqueSensorSystem::Step(const Context& context, State* state) const {
  // Not by an event's offset: period + k period is not always the others'
  // (k + 1) period, and the sensor would step before or after them.
  if (context.get_time() <= 0) return;
  const InputPort& velocity = get_robot_velocity_input_port();
  std::optional<Eigen::Matrix<double, 6, 1>> v_BE;
  if (velocity.HasValue(context)) v_BE = velocity.Eval(context);
  sensor_.Update(
      {.measured = get_reaction_input_port().Eval(context),
       .X_BE =
           ToPose(get_robot_pose_input_port().Eval<RigidTransformd>(context)),
       .v_BE = v_BE,
       .p_SE = p_SE_,
       .tare = EvalFlag(get_tare_input_port(), context, false)},
      state);
}

}  // namespace dual_proxy
