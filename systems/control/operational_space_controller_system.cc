// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/operational_space_controller_system.h"

namespace dual_proxy {

using Memory = OperationalSpaceControllerMemory;

OperationalSpaceControllerSystem::OperationalSpaceControllerSystem(
    const OperationalSpaceControllerParams<7>& params,
    const ArmModelParams<7>& arm)
    : Face(Feedthrough::kYes), controller_(params), arm_(arm) {
  DeclareVectorInputPort("robot_state", 14);
  for (const char* name : {"motion_error", "rotation_error", "reference_force",
                           "reference_moment"}) {
    DeclareVectorInputPort(name, 3);
  }
  DeclareVectorInputPort("force_selection", 9);
  DeclareVectorInputPort("moment_selection", 9);
  for (const char* name :
       {"sensed_wrench", "proxy_velocity", "proxy_acceleration"}) {
    DeclareVectorInputPort(name, 6);
  }
  DeclareVectorInputPort("sensor_ready", 1);
  DeclareMemory({.state = controller_.MakeState(), .output = {}},
                params.period);
  DeclareVectorOutput("torque", 7, [](const Memory& memory, Vector torque) {
    torque = memory.output.torque;
  });
  DeclareVectorOutput("motion_force", 3,
                      [](const Memory& memory, Vector force) {
                        force = memory.output.motion_force;
                      });
  DeclareVectorOutput("contact_force", 3,
                      [](const Memory& memory, Vector force) {
                        force = memory.output.contact_force;
                      });
  DeclareVectorOutput("observed_energy", 1,
                      [](const Memory& memory, Vector energy) {
                        energy[0] = memory.output.observed_energy;
                      });
  DeclareVectorOutput("injected_damping", 1,
                      [](const Memory& memory, Vector damping) {
                        damping[0] = memory.output.injected_damping;
                      });
}

void OperationalSpaceControllerSystem::Step(const Context& context,
                                            Memory* memory) const {
  const Eigen::VectorXd& x = get_robot_state_input_port().Eval(context);
  OperationalSpaceControllerInput<7> input;
  input.q = x.head<7>();
  input.v = x.tail<7>();
  Pose X_BE;
  arm_.Calc(input.q, input.v, &X_BE, &input.model);
  input.motion_error = EvalVector<3>(get_motion_error_input_port(), context);
  input.rotation_error =
      EvalVector<3>(get_rotation_error_input_port(), context);
  input.proxy_velocity =
      EvalVector<6>(get_proxy_velocity_input_port(), context);
  input.proxy_acceleration =
      EvalVector<6>(get_proxy_acceleration_input_port(), context);
  input.reference_force =
      EvalVector<3>(get_reference_force_input_port(), context);
  input.reference_moment =
      EvalVector<3>(get_reference_moment_input_port(), context);
  input.force_selection = EvalMatrix(get_force_selection_input_port(), context);
  input.moment_selection =
      EvalMatrix(get_moment_selection_input_port(), context);
  input.sensed_wrench = EvalVector<6>(get_sensed_wrench_input_port(), context);
  input.sensor_ready = EvalFlag(get_sensor_ready_input_port(), context, true);
  memory->output = controller_.Update(input, &memory->state);
}

}  // namespace dual_proxy
