// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/link/pose_sender_system.h"

namespace dual_proxy {

using drake::math::RigidTransformd;

PoseSenderSystem::PoseSenderSystem(const PoseSenderParams& params)
    : Face(Feedthrough::kNo), sender_(params) {
  DeclareValueInput<RigidTransformd>("pose");
  DeclareVectorInputPort("force_selection", 9);
  DeclareVectorInputPort("moment_selection", 9);
  DeclareMemory(sender_.MakeState(), params.period);
  DeclareValueOutput<Message>("message", [](const PoseSenderState& state) {
    return ToMessage(state.message);
  });
}

void PoseSenderSystem::Step(const Context& context,
                            PoseSenderState* state) const {
  sender_.Update(context.get_time(),
                 ToPose(get_pose_input_port().Eval<RigidTransformd>(context)),
                 EvalMatrix(get_force_selection_input_port(), context),
                 EvalMatrix(get_moment_selection_input_port(), context), state);
}

}  // namespace dual_proxy
