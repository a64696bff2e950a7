// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/haptic_side_proxy_system.h"

#include "dual_proxy/link/message_port.h"

namespace dual_proxy {

using drake::math::RigidTransformd;
using State = HapticSideProxyState;

HapticSideProxySystem::HapticSideProxySystem(
    const HapticSideProxyParams& params)
    : Face(Feedthrough::kYes), proxy_(params) {
  DeclareValueInput<Message>("robot_message");
  DeclareValueInput<RigidTransformd>("device_pose");
  DeclareMemory(proxy_.MakeState(), params.period);
  DeclareVectorOutput("reference_force", 3,
                      [](const State& state, Vector force) {
                        force = state.output.reference_force;
                      });
  DeclareVectorOutput("reference_moment", 3,
                      [](const State& state, Vector moment) {
                        moment = state.output.reference_moment;
                      });
  DeclareValueOutput<RigidTransformd>("proxy_pose", [](const State& state) {
    return ToRigidTransform(state.output.proxy_pose);
  });
  DeclareVectorOutput("force_selection", 9,
                      [](const State& state, Vector selection) {
                        WriteRows(state.output.force_selection, selection);
                      });
  DeclareVectorOutput("link_status", kLinkStatusSize,
                      [](const State& state, Vector status) {
                        status = LinkStatusVector(state.link);
                      });
}

void HapticSideProxySystem::Step(const Context& context, State* state) const {
  HapticSideProxyInput input;
  input.message = FromMessage<PoseMessage>(
      EvalMessage(get_robot_message_input_port(), context, PoseMessage::kTag));
  input.X_DH =
      ToPose(get_device_pose_input_port().Eval<RigidTransformd>(context));
  proxy_.Update(context.get_time(), input, state);
}

}  // namespace dual_proxy
