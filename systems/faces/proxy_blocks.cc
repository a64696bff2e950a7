// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/faces/blocks.h"
#include "dual_proxy/faces/shared_ports.h"

namespace dual_proxy {

namespace {

class RobotSideProxyBlock final
    : public BlockOf<RobotSideProxyInput, RobotSideProxyState> {
 public:
  explicit RobotSideProxyBlock(const RobotSideProxyParams& params)
      : BlockOf("RobotSideProxy",
                {.period = params.period, .feedthrough = true}),
        proxy_(params) {
    set_start(proxy_.MakeState());
  }

 private:
  void ReadInputs(InputPorts* ports,
                  RobotSideProxyInput* input) const override {
    ports->GetMessageOf({"haptic_message", "in D; without it the robot waits"},
                        &input->message);
    ports->GetPose({"robot_pose", "X_BE"}, &input->X_BE);
    ports->GetVector({"force_selection", "Omega_f"}, &input->force_selection);
    ports->GetVector({"moment_selection", "Omega_tau"},
                     &input->moment_selection);
    Eigen::Matrix<double, 6, 1> sensed = Eigen::Matrix<double, 6, 1>::Zero();
    input->has_sensed = ports->GetVector(
        {"sensed_wrench",
         "[force; moment] at E, N, N m; without it there is no bumpless "
         "hand-over"},
        &sensed);
    input->sensed_force = sensed.head<3>();
    input->sensed_moment = sensed.tail<3>();
    ports->GetFlag({"sensor_ready",
                    "> 0.5 if the force sensor can be relied on, as without a "
                    "connection; otherwise the robot holds its place"},
                   &input->sensor_ready);
  }

  void Update(double time, const RobotSideProxyInput& input,
              RobotSideProxyState* state) const override {
    proxy_.Update(time, input, state);
  }

  void WriteOutputs(double, const RobotSideProxyState& state, InputPorts*,
                    OutputPorts* ports) const override {
    const RobotSideProxyOutput& output = state.output;
    ports->PutVector({"motion_error", "dx_m, m"}, output.motion_error);
    ports->PutVector({"rotation_error", "dphi_m, rad"}, output.rotation_error);
    ports->PutVector({"reference_force", "F_r, N"}, output.reference_force);
    ports->PutVector({"reference_moment", "M_r, N m"}, output.reference_moment);
    ports->PutPose({"proxy_pose", "the limited robot proxy"},
                   [&] { return output.proxy_pose; });
    ports->PutVector({"link_status", "see LinkStatusVector()"},
                     LinkStatusVector(state.link));
    ports->PutVector({"proxy_velocity", "[linear; angular], m/s, rad/s"},
                     output.proxy_velocity);
    ports->PutVector(
        {"proxy_acceleration", "[linear; angular], m/s^2, rad/s^2"},
        output.proxy_acceleration);
    ports->PutMatrix({"force_selection",
                      "of the input's, what to go by: for the controller"},
                     output.force_selection);
    ports->PutMatrix({"moment_selection", "likewise"}, output.moment_selection);
  }

  RobotSideProxy proxy_;
};

class HapticSideProxyBlock final
    : public BlockOf<HapticSideProxyInput, HapticSideProxyState> {
 public:
  explicit HapticSideProxyBlock(const HapticSideProxyParams& params)
      : BlockOf("HapticSideProxy",
                {.period = params.period, .feedthrough = true}),
        proxy_(params) {
    set_start(proxy_.MakeState());
  }

 private:
  void ReadInputs(InputPorts* ports,
                  HapticSideProxyInput* input) const override {
    ports->GetMessageOf({"robot_message", "in B; without it there is no force"},
                        &input->message);
    ports->GetPose({"device_pose", "X_DH, from the device's home"},
                   &input->X_DH);
  }

  void Update(double time, const HapticSideProxyInput& input,
              HapticSideProxyState* state) const override {
    proxy_.Update(time, input, state);
  }

  void WriteOutputs(double, const HapticSideProxyState& state, InputPorts*,
                    OutputPorts* ports) const override {
    const HapticSideProxyOutput& output = state.output;
    ports->PutVector({"reference_force", "F_h, N, on the hand"},
                     output.reference_force);
    ports->PutVector({"reference_moment", "N m, on the hand"},
                     output.reference_moment);
    ports->PutPose({"proxy_pose", "the haptic proxy"},
                   [&] { return output.proxy_pose; });
    ports->PutMatrix({"force_selection", "Omega_fh"}, output.force_selection);
    ports->PutVector({"link_status", "see LinkStatusVector()"},
                     LinkStatusVector(state.link));
    ports->PutMatrix(kContactNormals, output.contact_normals);
  }

  HapticSideProxy proxy_;
};

}  // namespace

BlockPtr MakeRobotSideProxyBlock(const RobotSideProxyParams& params) {
  return std::make_shared<RobotSideProxyBlock>(params);
}

BlockPtr MakeHapticSideProxyBlock(const HapticSideProxyParams& params) {
  return std::make_shared<HapticSideProxyBlock>(params);
}

}  // namespace dual_proxy
