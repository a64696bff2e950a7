// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/perception/contact_history_system.h"

namespace dual_proxy {

using drake::math::RigidTransformd;
using Memory = ContactHistoryMemory;

ContactHistorySystem::ContactHistorySystem(const ContactHistoryParams& params)
    : Face(Feedthrough::kNo), history_(params) {
  DeclareValueInput<RigidTransformd>("robot_pose");
  DeclareVectorInputPort("force_selection", 9);
  DeclareVectorInputPort("force_direction", 3);
  Memory start;
  start.state = history_.MakeState();
  DeclareMemory(start, params.period);
  DeclareValueOutput<Eigen::Matrix3Xd>(
      "prior", [](const Memory& memory) { return memory.prior.normals; });
}

void ContactHistorySystem::Step(const Context& context, Memory* memory) const {
  const Eigen::Vector3d p_BE =
      get_robot_pose_input_port().Eval<RigidTransformd>(context).translation();
  history_.UpdateFromSelection(
      p_BE, EvalMatrix(get_force_selection_input_port(), context),
      EvalVector<3>(get_force_direction_input_port(), context), &memory->state);
  memory->prior = history_.Lookup(p_BE, memory->state);
}

}  // namespace dual_proxy
