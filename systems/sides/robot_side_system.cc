// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/sides/robot_side_system.h"

#include <string>

#include "dual_proxy/common/validate.h"

namespace dual_proxy {

using Memory = RobotSideMemory;

RobotSideSystem::RobotSideSystem(const RobotSideParams& params,
                                 const ArmModelParams& arm,
                                 const std::optional<Vector7>& q_start,
                                 const std::optional<RobotSideSensor>& sensor)
    : Face(Feedthrough::kNo), side_(params), arm_(arm) {
  Memory start;
  start.side = side_.MakeState();
  if (q_start) {
    ThrowUnlessIn("RobotSideSystem", "q_start", *q_start, Finite());
    Pose X_BE;
    ModelTerms terms;
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

  DeclareValueInput<PoseMessage>("haptic_message");
  DeclareVectorInputPort("robot_state", 14);
  DeclareVectorInputPort(sensor ? "reaction" : "sensed_wrench", 6);
  DeclareVectorInputPort("force_selection", 9);
  DeclareVectorInputPort("moment_selection", 9);
  DeclareVectorInputPort(sensor ? "tare" : "sensor_ready", 1);
  DeclareMemory(start, period);
  DeclareVectorOutput("signals", RobotSide::OutputSize(),
                      [](const Memory& memory, Vector signals) {
                        signals.setZero();
                        if (memory.stepped) {
                          RobotSide::WriteVector(memory.side.output, signals);
                        }
                      });
  DeclareVectorOutput("torque", 7, [](const Memory& memory, Vector torque) {
    torque = memory.torque;
  });
  DeclareAbstractOutputPort("robot_pose", &RobotSideSystem::CalcRobotPose,
                            {get_robot_state_input_port().ticket()});
  DeclareValueOutput<PoseMessage>(
      "message", [](const Memory& memory) -> const PoseMessage& {
        return memory.side.output.message;
      });
  DeclareValueOutput<ForceMessage>(
      "force_message", [](const Memory& memory) -> const ForceMessage& {
        return memory.side.output.force_message;
      });
  const auto declare_mean = [this](const std::string& name,
                                   Eigen::Vector3d FilterMeans::* mean) {
    DeclareVectorOutput("mean_" + name, 3,
                        [mean](const Memory& memory, Vector value) {
                          value = memory.side.output.filter_means.*mean;
                        });
  };
  declare_mean("sensed_force", &FilterMeans::sensed_force);
  declare_mean("velocity", &FilterMeans::velocity);
  declare_mean("motion_force", &FilterMeans::motion_force);
  declare_mean("contact_force", &FilterMeans::contact_force);
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
  if (params.angular_filter_period > 0) {
    using Means = AngularFilterMeans;
    const auto declare_angular = [this](const std::string& name,
                                        Eigen::Vector3d Means::* mean) {
      DeclareVectorOutput(
          "mean_" + name, 3, [mean](const Memory& memory, Vector value) {
            value = memory.side.output.angular_filter_means.*mean;
          });
    };
    declare_angular("sensed_moment", &Means::sensed_moment);
    declare_angular("angular_velocity", &Means::angular_velocity);
    declare_angular("motion_moment", &Means::motion_moment);
    declare_angular("contact_moment", &Means::contact_moment);
  }
}

void RobotSideSystem::CalcRobotPose(const Context& context,
                                    drake::math::RigidTransformd* X_BE) const {
  const Eigen::VectorXd& x = get_robot_state_input_port().Eval(context);
  Pose pose;
  ModelTerms terms;
  arm_.Calc(x.head<7>(), x.tail<7>(), &pose, &terms);
  *X_BE = ToRigidTransform(pose);
}

void RobotSideSystem::Step(const Context& context, Memory* memory) const {
  const Eigen::VectorXd& x = get_robot_state_input_port().Eval(context);
  const double time = context.get_time();
  RobotSideInput input;
  input.message =
      EvalMessage<PoseMessage>(get_haptic_message_input_port(), context);
  input.q = x.head<7>();
  input.v = x.tail<7>();
  arm_.Calc(input.q, input.v, &input.X_BE, &input.model);
  input.force_selection = EvalMatrix(get_force_selection_input_port(), context);
  input.moment_selection =
      EvalMatrix(get_moment_selection_input_port(), context);
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
