// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/sides/robot_side_system.h"

#include <string>

#include "dual_proxy/common/validate.h"
#include "dual_proxy/link/message_port.h"

namespace dual_proxy {

using Memory = RobotSideMemory;

RobotSideSystem::RobotSideSystem(const RobotSideParams<SerialArm<7>>& params,
                                 const ArmModelParams<7>& arm,
                                 const std::optional<Vector7>& q_start,
                                 const std::optional<RobotSideSensor>& sensor,
                                 const RobotSideSeeds& seeds)
    : Face(Feedthrough::kNo), side_(params), arm_(arm) {
  Memory start;
  start.side = side_.MakeState(seeds.filter, seeds.angular_filter);
  if (q_start) {
    ThrowUnlessIn("RobotSideSystem", "q_start", *q_start, Finite());
    Pose X_BE;
    ModelTerms<7> terms;
    arm_.Calc(*q_start, Vector7::Zero(), &X_BE, &terms);
    start.torque = -terms.gravity;
  }
  const double period = params.controller.period;
  if (sensor) {
    if (sensor->params.period != period) {
      ThrowInvalidField("RobotSideSystem", "sensor.period",
                        "the side's own period", sensor->params.period);
    }
    ThrowUnlessIn("RobotSideSystem", "p_SE", sensor->p_SE, Finite());
    sensor_.emplace(sensor->params);
    p_SE_ = sensor->p_SE;
    start.sensor = sensor_->MakeState(sensor->seed);
  }

  DeclareValueInput<Message>("haptic_message");
  DeclareVectorInputPort("robot_state", 14);
  DeclareVectorInputPort(sensor ? "reaction" : "sensed_wrench", 6);
  DeclareVectorInputPort("force_selection", 9);
  DeclareVectorInputPort("moment_selection", 9);
  DeclareVectorInputPort(sensor ? "tare" : "sensor_ready", 1);
  DeclareMemory(start, period);
  DeclareVectorOutput("signals", SizeOf(side_.layout()),
                      [this](const Memory& memory, Vector signals) {
                        signals.setZero();
                        if (!memory.stepped) return;
                        SignalSink sink(&signals);
                        side_.VisitSignals(memory.side, &sink);
                      });
  DeclareVectorOutput("torque", 7, [](const Memory& memory, Vector torque) {
    torque = memory.torque;
  });
  DeclareAbstractOutputPort("robot_pose", &RobotSideSystem::CalcRobotPose,
                            {get_robot_state_input_port().ticket()});
  DeclareValueOutput<Message>("message",
                              [](const Memory& memory) -> const Message& {
                                return memory.side.half.output().message;
                              });
  using Filter = ScheduledFilterState;
  const auto declare_mean = [this](const std::string& name,
                                   Filter ContactPerceptionState::* filter,
                                   Eigen::Vector3d FilterInput::* mean) {
    DeclareVectorOutput(
        "mean_" + name, 3, [filter, mean](const Memory& memory, Vector value) {
          value = (memory.side.perception.*filter).mean_input().*mean;
        });
  };
  const auto force = &ContactPerceptionState::force;
  declare_mean("sensed_force", force, &FilterInput::sensed);
  declare_mean("velocity", force, &FilterInput::velocity);
  declare_mean("motion_force", force, &FilterInput::motion);
  declare_mean("contact_force", force, &FilterInput::contact);
  const auto declare_found = [this](const std::string& selection,
                                    const std::string& dimension,
                                    Filter ContactPerceptionState::* filter) {
    DeclareVectorOutput(
        selection, 9, [filter](const Memory& memory, Vector value) {
          WriteRows((memory.side.perception.*filter).filter.force_selection,
                    value);
        });
    DeclareVectorOutput(
        dimension, 1, [filter](const Memory& memory, Vector value) {
          value[0] = (memory.side.perception.*filter).filter.dimension;
        });
  };
  declare_found("force_selection", "dimension", force);
  if (sensor) {
    DeclareVectorOutput("sensed_wrench", 6,
                        [](const Memory& memory, Vector wrench) {
                          wrench = memory.sensor.adapter.wrench;
                        });
    DeclareVectorOutput(
        "sensor_counters", 2, [](const Memory& memory, Vector counters) {
          const ForceTorqueSensorState& sensor = memory.sensor;
          counters << static_cast<double>(sensor.adapter.bad_inputs),
              static_cast<double>(sensor.adapter.tares_refused);
        });
  }
  if (params.perception.angular_filter.enabled) {
    const auto moment = &ContactPerceptionState::moment;
    declare_mean("sensed_moment", moment, &FilterInput::sensed);
    declare_mean("angular_velocity", moment, &FilterInput::velocity);
    declare_mean("motion_moment", moment, &FilterInput::motion);
    declare_mean("contact_moment", moment, &FilterInput::contact);
    declare_found("moment_selection", "moment_dimension", moment);
  }
}

void RobotSideSystem::CalcRobotPose(const Context& context,
                                    drake::math::RigidTransformd* X_BE) const {
  const Eigen::VectorXd& x = get_robot_state_input_port().Eval(context);
  Pose pose;
  ModelTerms<7> terms;
  arm_.Calc(x.head<7>(), x.tail<7>(), &pose, &terms);
  *X_BE = ToRigidTransform(pose);
}

void RobotSideSystem::Step(const Context& context, Memory* memory) const {
  const Eigen::VectorXd& x = get_robot_state_input_port().Eval(context);
  const double time = context.get_time();
  RobotSideInput<SerialArm<7>> input;
  input.message = EvalMessage(get_haptic_message_input_port(), context,
                              ToRobotTag(side_.params().scheme));
  input.q = x.head<7>();
  input.v = x.tail<7>();
  arm_.Calc(input.q, input.v, &input.X_BE, &input.model);
  if (get_force_selection_input_port().HasValue(context) ||
      get_moment_selection_input_port().HasValue(context)) {
    input.selections = ContactSelections{
        .force = EvalMatrix(get_force_selection_input_port(), context),
        .moment = EvalMatrix(get_moment_selection_input_port(), context)};
  }
  if (sensor_) {
    input.sensed_wrench = memory->sensor.adapter.wrench;
    input.sensor_ready = memory->sensor.adapter.ready;
  } else {
    input.sensed_wrench = EvalVector<6>(get_input_port(2), context);
    input.sensor_ready = EvalFlag(get_input_port(5), context, true);
  }
  side_.Update(time, input, &memory->side);
  memory->torque = memory->side.output.controller.torque;
  memory->stepped = true;
  // A simulated plant has no reaction before its first step.
  if (sensor_ && time > 0) {
    sensor_->Update({.measured = get_input_port(2).Eval(context),
                     .X_BE = input.X_BE,
                     .v_BE = memory->side.output.v_BE,
                     .p_SE = p_SE_,
                     .tare = EvalFlag(get_input_port(5), context, false)},
                    &memory->sensor);
  }
}

}  // namespace dual_proxy
