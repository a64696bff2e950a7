// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/possible.h"
#include "dual_proxy/common/validate.h"
#include "dual_proxy/faces/blocks.h"
#include "dual_proxy/faces/shared_ports.h"

namespace dual_proxy {

namespace {

struct LoopMemory {
  TeleopLoopState<SerialArm<7>> loop;
  Vector7 torque{Vector7::Zero()};  // N m, of the last step.
};

class TeleopLoopBlock final
    : public BlockOf<TeleopLoopInput<SerialArm<7>>, LoopMemory> {
 public:
  TeleopLoopBlock(const TeleopLoopParams<SerialArm<7>>& params, int joint,
                  const std::optional<Vector7>& q_start)
      : BlockOf("TeleopLoop", {.period = params.robot.controller.period}),
        loop_(params),
        joint_(CheckedSensorJoint("TeleopLoop", joint)) {
    LoopMemory start{.loop = loop_.MakeState()};
    if (q_start) {
      ThrowUnlessIn("TeleopLoop", "q_start", *q_start,
                    Between(-kMaxPosition, kMaxPosition));
      start.torque = loop_.CalcHoldingTorque(*q_start);
    }
    set_start(std::move(start));
  }

  const std::vector<SignalSlice>& layout() const override {
    return loop_.layout();
  }

 private:
  void ReadInputs(InputPorts* ports,
                  TeleopLoopInput<SerialArm<7>>* input) const override {
    Eigen::Matrix<double, 14, 1> x = Eigen::Matrix<double, 14, 1>::Zero();
    ports->GetVector(kRobotState, &x, Need::kRequired);
    input->q = x.head<7>();
    input->v = x.tail<7>();
    input->has_reaction = ports->GetReaction({"reaction_forces", "the plant's"},
                                             joint_, &input->reaction);
  }

  void Update(double time, const TeleopLoopInput<SerialArm<7>>& input,
              LoopMemory* memory) const override {
    loop_.Update(time, input, &memory->loop);
    memory->torque = memory->loop.command();
  }

  void WriteOutputs(double, const LoopMemory& memory, InputPorts*,
                    OutputPorts* ports) const override {
    const TeleopLoopState<SerialArm<7>>& loop = memory.loop;
    ports->PutVector({"torque", "N m, with gravity compensation"},
                     memory.torque);
    ports->PutVector({"signals", "all results, see `layout`"},
                     SizeOf(loop_.layout()),
                     [&](OutputPorts::VectorRef signals) {
                       loop_.WriteSignals(loop, signals);
                     });
    ports->PutVector({"sensed_wrench", "[force; moment] at E, N, N m"},
                     loop.sensor.adapter.wrench);
    ports->PutPose({"device_pose", "X_DH, in D, as the driver reads it"},
                   [&] { return loop.device.read_pose; });
    ports->PutVector(
        {"device_wrench",
         "[force; moment], N, N m, of the device on the hand, in D"},
        loop.haptic.output.device_wrench);
    if (loop_.params().robot.gripper.enabled) {
      WriteGripper(loop.robot.gripper, ports);
    }
    WriteFound(loop.robot.perception, ports);
    WriteFoundMoments(loop.robot.perception, ports);
  }

  TeleopLoop<SerialArm<7>> loop_;
  int joint_;
};

}  // namespace

BlockPtr MakeTeleopLoopBlock(const TeleopLoopParams<SerialArm<7>>& params,
                             int sensor_joint,
                             const std::optional<Vector7>& q_start) {
  return std::make_shared<TeleopLoopBlock>(params, sensor_joint, q_start);
}

}  // namespace dual_proxy
