// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/simulated_haptic_device_system.h"

namespace dual_proxy {

using drake::math::RigidTransformd;
using State = SimulatedHapticDeviceState;

SimulatedHapticDeviceSystem::SimulatedHapticDeviceSystem(
    const OperatorPathParams& path, const SimulatedHapticDeviceParams& params)
    : Face(Feedthrough::kNo), path_(path), device_(params) {
  DeclareVectorInputPort("device_wrench", 6);
  DeclareMemory(device_.MakeState(), params.period);
  DeclareValueOutput<RigidTransformd>("device_pose", [](const State& state) {
    return ToRigidTransform(state.read_pose);
  });
  DeclareVectorOutput("device_velocity", 6,
                      [](const State& state, Vector velocity) {
                        velocity = state.read_velocity;
                      });
  DeclareVectorOutput(
      "hand_position", 3,
      [](const State& state, Vector position) { position = state.intended.p; });
  DeclareVectorOutput("bad_inputs", 1, [](const State& state, Vector count) {
    count[0] = static_cast<double>(state.bad_inputs);
  });
}

void SimulatedHapticDeviceSystem::Step(const Context& context,
                                       State* state) const {
  const OperatorPathSample intended = path_.Calc(context.get_time());
  device_.Update({.p = intended.position, .R = intended.rotation},
                 intended.velocity,
                 EvalVector<6>(get_device_wrench_input_port(), context), state);
}

}  // namespace dual_proxy
