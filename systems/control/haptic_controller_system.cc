// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/haptic_controller_system.h"

namespace dual_proxy {

using Memory = HapticControllerMemory;

HapticControllerSystem::HapticControllerSystem(
    const HapticControllerParams& params)
    : Face(Feedthrough::kYes), controller_(params) {
  DeclareVectorInputPort("reference_force", 3);
  DeclareVectorInputPort("reference_moment", 3);
  DeclareVectorInputPort("device_velocity", 6);
  DeclareVectorInputPort("force_selection", 9);
  Memory start;
  start.state = controller_.MakeState();
  DeclareMemory(start, params.period);
  DeclareVectorOutput("device_wrench", 6,
                      [](const Memory& memory, Vector wrench) {
                        wrench = memory.device_wrench;
                      });
}

void HapticControllerSystem::Step(const Context& context,
                                  Memory* memory) const {
  memory->device_wrench = controller_.Update(
      EvalVector<3>(get_reference_force_input_port(), context),
      EvalVector<3>(get_reference_moment_input_port(), context),
      EvalVector<6>(get_device_velocity_input_port(), context),
      EvalMatrix(get_force_selection_input_port(), context), &memory->state);
}

}  // namespace dual_proxy
