// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/station/teleop_loop_system.h"

#include "dual_proxy/common/validate.h"
#include "dual_proxy/station/sensor_reaction_system.h"

namespace dual_proxy {

using Memory = TeleopLoopMemory;

TeleopLoopSystem::TeleopLoopSystem(const TeleopLoopParams<SerialArm<7>>& params,
                                   drake::multibody::JointIndex sensor_joint,
                                   const std::optional<Vector7>& q_start)
    : Face(Feedthrough::kNo), loop_(params), sensor_joint_(sensor_joint) {
  Memory start{.loop = loop_.MakeState()};
  if (q_start) {
    ThrowUnlessIn("TeleopLoopSystem", "q_start", *q_start, Finite());
    start.torque = loop_.CalcHoldingTorque(*q_start);
  }
  DeclareVectorInputPort("robot_state", 14);
  DeclareValueInput<SpatialForces>("reaction_forces");
  DeclareMemory(start, loop_.period());
  DeclareVectorOutput("torque", 7, [](const Memory& memory, Vector torque) {
    torque = memory.torque;
  });
  DeclareVectorOutput("signals", SizeOf(loop_.layout()),
                      [this](const Memory& memory, Vector signals) {
                        loop_.WriteSignals(memory.loop, signals);
                      });
  DeclareVectorOutput("sensed_wrench", 6,
                      [](const Memory& memory, Vector wrench) {
                        wrench = memory.loop.sensor.adapter.wrench;
                      });
  DeclareValueOutput<drake::math::RigidTransformd>(
      "device_pose", [](const Memory& memory) {
        return ToRigidTransform(memory.loop.device.read_pose);
      });
  DeclareVectorOutput("device_wrench", 6,
                      [](const Memory& memory, Vector wrench) {
                        wrench = memory.loop.haptic.output.device_wrench;
                      });
  const auto declare_found =
      [this](const char* selection, const char* dimension,
             ScheduledFilterState ContactPerceptionState::* part) {
        DeclareVectorOutput(
            selection, 9, [part](const Memory& memory, Vector value) {
              const auto& filter = (memory.loop.robot.perception.*part).filter;
              WriteRows(filter.force_selection, value);
            });
        DeclareVectorOutput(
            dimension, 1, [part](const Memory& memory, Vector value) {
              const auto& filter = (memory.loop.robot.perception.*part).filter;
              value[0] = filter.dimension;
            });
      };
  declare_found("force_selection", "dimension", &ContactPerceptionState::force);
  declare_found("moment_selection", "moment_dimension",
                &ContactPerceptionState::moment);
}

void TeleopLoopSystem::Step(const Context& context, Memory* memory) const {
  const Eigen::VectorXd& x = get_robot_state_input_port().Eval(context);
  const double time = context.get_time();
  TeleopLoopInput<SerialArm<7>> input{.q = x.head<7>(), .v = x.tail<7>()};
  // A simulated plant has no reaction before its first step.
  input.has_reaction = time > 0;
  if (input.has_reaction) {
    input.reaction = ReadSensorReaction(
        get_reaction_forces_input_port().Eval<SpatialForces>(context),
        sensor_joint_);
  }
  loop_.Update(time, input, &memory->loop);
  memory->torque = memory->loop.command();
}

}  // namespace dual_proxy
