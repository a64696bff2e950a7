// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/sides/haptic_side_system.h"

#include "dual_proxy/common/validate.h"
#include "dual_proxy/link/message_port.h"

namespace dual_proxy {

using drake::math::RigidTransformd;
using Memory = HapticSideMemory;

HapticSideSystem::HapticSideSystem(
    const HapticSideParams& params,
    const std::optional<HapticSideDevice>& device)
    : Face(Feedthrough::kNo), side_(params) {
  Memory start;
  start.side = side_.MakeState();
  const double period = params.controller.period;
  if (device) {
    if (device->params.period != period) {
      ThrowInvalidField("HapticSideSystem", "device.period",
                        "the side's own period", device->params.period);
    }
    device_.emplace(device->params);
    path_.emplace(device->path);
    start.device = device_->MakeState();
  }

  DeclareValueInput<Message>("robot_message");
  if (!device) {
    DeclareValueInput<RigidTransformd>("device_pose");
    DeclareVectorInputPort("device_velocity", 6);
  }
  DeclareMemory(start, period);
  DeclareVectorOutput("signals", SizeOf(side_.layout()),
                      [this](const Memory& memory, Vector signals) {
                        signals.setZero();
                        if (!memory.stepped) return;
                        SignalSink sink(&signals);
                        side_.VisitSignals(memory.side, &sink);
                      });
  DeclareVectorOutput("device_wrench", 6,
                      [](const Memory& memory, Vector wrench) {
                        wrench = memory.side.output.device_wrench;
                      });
  DeclareValueOutput<Message>("message",
                              [](const Memory& memory) -> const Message& {
                                return memory.side.half.output().message;
                              });
  if (device) {
    DeclareValueOutput<RigidTransformd>(
        "device_pose", [](const Memory& memory) {
          return ToRigidTransform(memory.device.read_pose);
        });
    DeclareVectorOutput(
        "device_bad_inputs", 1, [](const Memory& memory, Vector count) {
          count[0] = static_cast<double>(memory.device.bad_inputs);
        });
  }
}

void HapticSideSystem::Step(const Context& context, Memory* memory) const {
  const double time = context.get_time();
  HapticSideInput input;
  input.message = EvalMessage(get_robot_message_input_port(), context,
                              ToDeviceTag(side_.params().scheme));
  if (!device_) {
    input.X_DH = ToPose(get_input_port(1).Eval<RigidTransformd>(context));
    input.device_velocity = get_input_port(2).Eval(context);
    side_.Update(time, input, &memory->side);
  } else {
    // What the device was told in the step before acts on it now.
    const Eigen::Matrix<double, 6, 1> told = memory->side.output.device_wrench;
    input.X_DH = memory->device.read_pose;
    input.device_velocity = memory->device.read_velocity;
    side_.Update(time, input, &memory->side);
    const OperatorPathSample intended = path_->Calc(time);
    device_->Update({.p = intended.position, .R = intended.rotation},
                    intended.velocity, told, &memory->device);
  }
  memory->stepped = true;
}

}  // namespace dual_proxy
