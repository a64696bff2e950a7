// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/possible.h"
#include "dual_proxy/common/validate.h"
#include "dual_proxy/faces/blocks.h"
#include "dual_proxy/faces/shared_ports.h"

namespace dual_proxy {

namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;

class ForceTorqueSensorBlock final
    : public BlockOf<ForceTorqueAdapterInput, ForceTorqueSensorState> {
 public:
  ForceTorqueSensorBlock(const ForceTorqueSensorParams& params,
                         const Eigen::Vector3d& p_SE, std::uint64_t seed)
      : BlockOf("ForceTorqueSensor", {.period = params.period}),
        sensor_(params),
        p_SE_(p_SE) {
    ThrowUnlessIn("ForceTorqueSensor", "p_SE", p_SE,
                  Between(-kMaxPosition, kMaxPosition));
    set_start(sensor_.MakeState(seed));
  }

 private:
  void ReadInputs(InputPorts* ports,
                  ForceTorqueAdapterInput* input) const override {
    input->p_SE = p_SE_;
    ports->GetVector(
        {"reaction", "[force; moment], N, N m, in S: of the arm on the tool"},
        &input->measured, Need::kAfterStart);
    ports->GetPose({"robot_pose", "X_BE"}, &input->X_BE);
    ports->GetFlag(
        {"tare",
         "asks for the bias to be learned anew when it comes to exceed "
         "0.5"},
        &input->tare);
    Vector6 v_BE;
    if (ports->GetVector(
            {"robot_velocity",
             "[linear; angular], m/s, rad/s: of the tool point. Needed where "
             "poses do not come at a whole multiple of the period: the tool's "
             "inertia can not be told from them"},
            &v_BE)) {
      input->v_BE = v_BE;
    }
  }

  void Update(double time, const ForceTorqueAdapterInput& input,
              ForceTorqueSensorState* state) const override {
    // Not by an event's offset: period + k period is not always the others'
    // (k + 1) period, and the sensor would step before or after them.
    if (time <= 0) return;
    sensor_.Update(input, state);
  }

  void WriteOutputs(double, const ForceTorqueSensorState& state, InputPorts*,
                    OutputPorts* ports) const override {
    ports->PutVector({"sensed_wrench",
                      "[force; moment], N, N m, at E: of the robot on its "
                      "environment; zero while the bias is being learned"},
                     state.adapter.wrench);
    ports->PutScalar({"ready", "1 if the bias is known, else 0"},
                     state.adapter.ready ? 1 : 0);
    ports->PutCounts(
        {"counters",
         "so far: samples refused, times at rest that gave no bias"},
        {state.adapter.bad_inputs, state.adapter.tares_refused});
  }

  ForceTorqueSensor sensor_;
  Eigen::Vector3d p_SE_;
};

class SimulatedHapticDeviceBlock final
    : public BlockOf<Vector6, SimulatedHapticDeviceState> {
 public:
  SimulatedHapticDeviceBlock(const OperatorPathParams& path,
                             const SimulatedHapticDeviceParams& params)
      : BlockOf("SimulatedHapticDevice", {.period = params.period}),
        path_(path),
        device_(params) {
    set_start(device_.MakeState());
  }

 private:
  void ReadInputs(InputPorts* ports, Vector6* wrench) const override {
    wrench->setZero();
    ports->GetVector({"device_wrench", "[force; moment], N, N m, on the hand"},
                     wrench);
  }

  void Update(double time, const Vector6& wrench,
              SimulatedHapticDeviceState* state) const override {
    const OperatorPathSample intended = path_.Calc(time);
    device_.Update({.p = intended.position, .R = intended.rotation},
                   intended.velocity, wrench, state, intended.home);
  }

  void WriteOutputs(double, const SimulatedHapticDeviceState& state,
                    InputPorts*, OutputPorts* ports) const override {
    ports->PutPose({"device_pose", "X_DH, as the driver reads it"},
                   [&] { return state.read_pose; });
    ports->PutVector(
        {"device_velocity", "[linear; angular], m/s, rad/s, as read"},
        state.read_velocity);
    ports->PutVector(
        {"hand_position", "m: where the operator wants the handle"},
        state.intended.p);
    ports->PutCounts(
        {"bad_inputs", "steps with an input that was refused so far"},
        {state.bad_inputs});
    ports->PutVector({"handle_force",
                      "N, of the handle on the hand, as a sensor there reads"},
                     state.handle_force);
  }

  OperatorPath path_;
  SimulatedHapticDevice device_;
};

class SensorReactionBlock final : public BlockOf<Nothing, Nothing> {
 public:
  explicit SensorReactionBlock(int joint)
      : BlockOf("SensorReaction", {}),
        joint_(CheckedSensorJoint("SensorReaction", joint)) {
    set_start(Nothing{});
  }

 private:
  Vector6 Read(InputPorts* ports) const {
    Vector6 reaction = Vector6::Zero();
    ports->GetReaction({"reaction_forces", "the plant's"}, joint_, &reaction);
    return reaction;
  }

  void ReadInputs(InputPorts* ports, Nothing*) const override { Read(ports); }

  void Update(double, const Nothing&, Nothing*) const override {}

  void WriteOutputs(double, const Nothing&, InputPorts* inputs,
                    OutputPorts* ports) const override {
    ports->PutVector(
        {"reaction", "[force; moment about S's origin], N, N m, in S"}, 6,
        [&](OutputPorts::VectorRef vector) { vector = Read(inputs); },
        {.inputs = {"reaction_forces"}});
  }

  int joint_;
};

}  // namespace

BlockPtr MakeForceTorqueSensorBlock(const ForceTorqueSensorParams& params,
                                    const Eigen::Vector3d& p_SE,
                                    std::uint64_t seed) {
  return std::make_shared<ForceTorqueSensorBlock>(params, p_SE, seed);
}

BlockPtr MakeSimulatedHapticDeviceBlock(
    const OperatorPathParams& path, const SimulatedHapticDeviceParams& params) {
  return std::make_shared<SimulatedHapticDeviceBlock>(path, params);
}

BlockPtr MakeSensorReactionBlock(int sensor_joint) {
  return std::make_shared<SensorReactionBlock>(sensor_joint);
}

}  // namespace dual_proxy
