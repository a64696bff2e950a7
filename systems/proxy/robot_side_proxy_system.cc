// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/robot_side_proxy_system.h"

#include <string>

#include "dual_proxy/link/message_port.h"

namespace dual_proxy {

using drake::math::RigidTransformd;
using State = RobotSideProxyState;
using Output = RobotSideProxyOutput;

RobotSideProxySystem::RobotSideProxySystem(const RobotSideProxyParams& params)
    : Face(Feedthrough::kYes), proxy_(params) {
  DeclareValueInput<Message>("haptic_message");
  DeclareValueInput<RigidTransformd>("robot_pose");
  DeclareVectorInputPort("force_selection", 9);
  DeclareVectorInputPort("moment_selection", 9);
  DeclareVectorInputPort("sensed_wrench", 6);
  DeclareVectorInputPort("sensor_ready", 1);
  DeclareMemory(proxy_.MakeState(), params.period);
  const auto declare = [this](const std::string& name, auto Output::* member) {
    DeclareVectorOutput(name, static_cast<int>((Output{}.*member).size()),
                        [member](const State& state, Vector value) {
                          value = state.output.*member;
                        });
  };
  declare("motion_error", &Output::motion_error);
  declare("rotation_error", &Output::rotation_error);
  declare("reference_force", &Output::reference_force);
  declare("reference_moment", &Output::reference_moment);
  DeclareValueOutput<RigidTransformd>("proxy_pose", [](const State& state) {
    return ToRigidTransform(state.output.proxy_pose);
  });
  DeclareVectorOutput("link_status", kLinkStatusSize,
                      [](const State& state, Vector status) {
                        status = LinkStatusVector(state.link);
                      });
  declare("proxy_velocity", &Output::proxy_velocity);
  declare("proxy_acceleration", &Output::proxy_acceleration);
}

void RobotSideProxySystem::Step(const Context& context, State* state) const {
  RobotSideProxyInput input;
  input.message = FromMessage<PoseMessage>(
      EvalMessage(get_haptic_message_input_port(), context, PoseMessage::kTag));
  input.X_BE =
      ToPose(get_robot_pose_input_port().Eval<RigidTransformd>(context));
  input.force_selection = EvalMatrix(get_force_selection_input_port(), context);
  input.moment_selection =
      EvalMatrix(get_moment_selection_input_port(), context);
  input.has_sensed = get_sensed_wrench_input_port().HasValue(context);
  const Eigen::Matrix<double, 6, 1> sensed =
      EvalVector<6>(get_sensed_wrench_input_port(), context);
  input.sensed_force = sensed.head<3>();
  input.sensed_moment = sensed.tail<3>();
  input.sensor_ready = EvalFlag(get_sensor_ready_input_port(), context, true);
  proxy_.Update(context.get_time(), input, state);
}

}  // namespace dual_proxy
