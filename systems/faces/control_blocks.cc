// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/faces/blocks.h"
#include "dual_proxy/faces/shared_ports.h"

namespace dual_proxy {

namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Vector14 = Eigen::Matrix<double, 14, 1>;

class ArmKinematicsBlock final : public BlockOf<Nothing, Nothing> {
 public:
  explicit ArmKinematicsBlock(const ArmModelParams<7>& arm)
      : BlockOf("ArmKinematics", {}), arm_(arm) {
    set_start(Nothing{});
  }

 private:
  struct Kinematics {
    Pose X_BE;
    Vector6 v_BE;
  };

  void ReadInputs(InputPorts* ports, Nothing*) const override {
    Vector14 x;
    ports->GetVector(kRobotState, &x, Need::kRequired);
  }

  void Update(double, const Nothing&, Nothing*) const override {}

  Kinematics Calc(InputPorts* inputs) const {
    Vector14 x = Vector14::Zero();
    inputs->GetVector(kRobotState, &x, Need::kRequired);
    Kinematics result;
    ModelTerms<7> terms;
    arm_.Calc(x.head<7>(), x.tail<7>(), &result.X_BE, &terms);
    result.v_BE = CalcTwist<7>(terms, x.tail<7>());
    return result;
  }

  void WriteOutputs(double, const Nothing&, InputPorts* inputs,
                    OutputPorts* ports) const override {
    const Direct direct{.inputs = {"robot_state"}};
    ports->PutPose(
        {"robot_pose", "X_BE"}, [&] { return Calc(inputs).X_BE; }, direct);
    ports->PutVector(
        {"robot_velocity", "[linear; angular] of E, m/s, rad/s"}, 6,
        [&](OutputPorts::VectorRef vector) { vector = Calc(inputs).v_BE; },
        direct);
  }

  ArmModel<7> arm_;
};

struct ControllerInput {
  Vector14 x{Vector14::Zero()};
  OperationalSpaceControllerInput<7> rest;
};

struct ControllerMemory {
  OperationalSpaceControllerState<7> state;
  OperationalSpaceControllerOutput<7> output;
};

class OperationalSpaceControllerBlock final
    : public BlockOf<ControllerInput, ControllerMemory> {
 public:
  OperationalSpaceControllerBlock(
      const OperationalSpaceControllerParams<7>& params,
      const ArmModelParams<7>& arm)
      : BlockOf("OperationalSpaceController",
                {.period = params.period, .feedthrough = true}),
        controller_(params),
        arm_(arm) {
    set_start({.state = controller_.MakeState(), .output = {}});
  }

 private:
  void ReadInputs(InputPorts* ports, ControllerInput* input) const override {
    OperationalSpaceControllerInput<7>& in = input->rest;
    ports->GetVector(kRobotState, &input->x, Need::kRequired);
    ports->GetVector({"motion_error", "dx_m, m"}, &in.motion_error);
    ports->GetVector({"rotation_error", "dphi_m, rad"}, &in.rotation_error);
    ports->GetVector({"reference_force", "F_r, N"}, &in.reference_force);
    ports->GetVector({"reference_moment", "M_r, N m"}, &in.reference_moment);
    ports->GetVector({"force_selection", "Omega_f"}, &in.force_selection);
    ports->GetVector({"moment_selection", "Omega_tau"}, &in.moment_selection);
    ports->GetVector({"sensed_wrench", "[force; moment] at E, N, N m"},
                     &in.sensed_wrench);
    ports->GetVector({"proxy_velocity", "[linear; angular], m/s, rad/s"},
                     &in.proxy_velocity);
    ports->GetVector(
        {"proxy_acceleration", "[linear; angular], m/s^2, rad/s^2"},
        &in.proxy_acceleration);
    ports->GetFlag({"sensor_ready",
                    "> 0.5 if the force sensor can be relied on, as without a "
                    "connection; otherwise nothing is force-controlled"},
                   &in.sensor_ready);
  }

  void Update(double, const ControllerInput& input,
              ControllerMemory* memory) const override {
    OperationalSpaceControllerInput<7> in = input.rest;
    in.q = input.x.head<7>();
    in.v = input.x.tail<7>();
    Pose X_BE;
    arm_.Calc(in.q, in.v, &X_BE, &in.model);
    memory->output = controller_.Update(in, &memory->state);
  }

  void WriteOutputs(double, const ControllerMemory& memory, InputPorts*,
                    OutputPorts* ports) const override {
    const OperationalSpaceControllerOutput<7>& output = memory.output;
    ports->PutVector({"torque", "N m, with gravity compensation"},
                     output.torque);
    ports->PutVector(
        {"motion_force", "F_m, N, or of a unit mass: see the params"},
        output.motion_force);
    ports->PutVector({"contact_force", "F_f, N"}, output.contact_force);
    ports->PutScalar({"observed_energy", "J, of the force loop"},
                     output.observed_energy);
    ports->PutScalar({"injected_damping", "N s/m, of the force loop"},
                     output.injected_damping);
  }

  OperationalSpaceController<7> controller_;
  ArmModel<7> arm_;
};

struct HapticControllerMemory {
  HapticControllerState state;
  Vector6 device_wrench{Vector6::Zero()};
};

class HapticControllerBlock final
    : public BlockOf<HapticControllerInput, HapticControllerMemory> {
 public:
  explicit HapticControllerBlock(const HapticControllerParams& params)
      : BlockOf("HapticController",
                {.period = params.period, .feedthrough = true}),
        controller_(params) {
    set_start({.state = controller_.MakeState()});
  }

 private:
  void ReadInputs(InputPorts* ports,
                  HapticControllerInput* input) const override {
    ports->GetVector({"reference_force", "F_h, N"}, &input->reference_force);
    ports->GetVector({"reference_moment", "N m"}, &input->reference_moment);
    ports->GetVector({"device_velocity", "[linear; angular], m/s, rad/s"},
                     &input->device_velocity);
    ports->GetVector({"force_selection", "Omega_fh"}, &input->force_selection);
    ports->GetVector(kContactNormals, &input->contact_normals);
    ports->GetVector(
        {"proxy_displacement",
         "x_h - x_ph, m: handle minus haptic proxy (used by method "
         "`position`)"},
        &input->proxy_displacement);
    ports->GetVector({"fixture_force", "N, of walls and guidance"},
                     &input->fixture_force);
    ports->GetVector(kHandleForce, &input->handle_force);
  }

  void Update(double, const HapticControllerInput& input,
              HapticControllerMemory* memory) const override {
    memory->device_wrench = controller_.Update(input, &memory->state);
  }

  void WriteOutputs(double, const HapticControllerMemory& memory, InputPorts*,
                    OutputPorts* ports) const override {
    ports->PutVector(
        {"device_wrench", "[force; moment], N, N m, of the device on the hand"},
        memory.device_wrench);
  }

  HapticController controller_;
};

}  // namespace

BlockPtr MakeArmKinematicsBlock(const ArmModelParams<7>& arm) {
  return std::make_shared<ArmKinematicsBlock>(arm);
}

BlockPtr MakeOperationalSpaceControllerBlock(
    const OperationalSpaceControllerParams<7>& params,
    const ArmModelParams<7>& arm) {
  return std::make_shared<OperationalSpaceControllerBlock>(params, arm);
}

BlockPtr MakeHapticControllerBlock(const HapticControllerParams& params) {
  return std::make_shared<HapticControllerBlock>(params);
}

}  // namespace dual_proxy
