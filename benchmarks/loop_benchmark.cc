// SPDX-License-Identifier: BSD-3-Clause

// What the parts of a control period take, each on its own, while the tool
// presses on a table and slides: counters of each case as in timing.h.

#include <benchmark/benchmark.h>

#include <Eigen/Core>

#include "dual_proxy/control/operational_space_controller.h"
#include "dual_proxy/loop/teleop_loop.h"
#include "dual_proxy/simulation/simulated_arm.h"
#include "test_arm.h"
#include "timing.h"

namespace dual_proxy {
namespace {

constexpr double kPeriod = 0.001;

/** A loop with an arm that presses on a table. */
class Scene {
 public:
  Scene()
      : loop_(MakeParams()),
        arm_({}, MakeTestArm(), MakeTable()),
        state_(loop_.MakeState()),
        arm_state_(arm_.MakeState(kTestArmAtRest)) {
    while (time() < 2) Step();
  }

  double time() const { return kPeriod * static_cast<double>(tick_); }
  const TeleopLoop<SerialArm<7>>& loop() const { return loop_; }
  const SimulatedArm<7>& arm() const { return arm_; }
  TeleopLoopState<SerialArm<7>>& state() { return state_; }
  SimulatedArmState<7>& arm_state() { return arm_state_; }

  void Step() {
    UpdateLoop();
    UpdateArm();
  }

  void UpdateLoop() {
    loop_.Update(time(),
                 {.q = arm_state_.q,
                  .v = arm_state_.v,
                  .reaction = arm_state_.reaction,
                  .has_reaction = tick_ > 0},
                 &state_);
    ++tick_;
  }

  void UpdateArm() { arm_.Update(state_.command(), &arm_state_); }

 private:
  static Pose StartPose() {
    return SimulatedArm<7>({}, MakeTestArm()).MakeState(kTestArmAtRest).X_BE;
  }

  static TeleopLoopParams<SerialArm<7>> MakeParams() {
    const Pose X_BE = StartPose();
    TeleopLoopParams<SerialArm<7>> params;
    params.robot.proxy.map.p_cw = X_BE.p;
    params.robot.proxy.map.R_cw = X_BE.R;
    params.haptic.proxy.map = params.robot.proxy.map;
    params.robot.perception.filter.period = 0.01;
    params.model = MakeTestArm();
    params.sensor.force_noise_std = 0.2;
    // Down for a second, then to and fro for a very long time.
    constexpr int kTurns = 400;
    params.path.times = Eigen::VectorXd::LinSpaced(kTurns, 0, kTurns - 1);
    params.path.points = Eigen::Matrix3Xd::Zero(3, kTurns);
    for (int i = 1; i < kTurns; ++i) {
      params.path.points.col(i) << 0, i % 2 == 0 ? 0.02 : -0.02, -0.025;
    }
    return params;
  }

  static ContactSceneParams MakeTable() {
    ContactSurfaceParams table;
    table.position.z() = StartPose().p.z() - 0.03;
    table.stiffness = 3e4;
    table.dissipation = 10;
    table.friction = 0.3;
    return {.surfaces = {table}, .tool_radius = 0.01};
  }

  TeleopLoop<SerialArm<7>> loop_;
  SimulatedArm<7> arm_;
  TeleopLoopState<SerialArm<7>> state_;
  SimulatedArmState<7> arm_state_;
  int tick_{0};
};

void Period(benchmark::State& state) {
  Scene scene;
  MeasureCalls(
      1, [&] { scene.UpdateArm(); }, [&] { scene.UpdateLoop(); }, &state);
}

void ArmPlant(benchmark::State& state) {
  Scene scene;
  MeasureCalls(
      1, [&] { scene.UpdateLoop(); }, [&] { scene.UpdateArm(); }, &state);
}

void ModelTermsOfArm(benchmark::State& state) {
  Scene scene;
  const ArmModel<7> model(MakeTestArm());
  Pose X_BE;
  ModelTerms<7> terms;
  MeasureCalls(
      10, [&] { scene.Step(); },
      [&] {
        model.Calc(scene.arm_state().q, scene.arm_state().v, &X_BE, &terms);
        benchmark::DoNotOptimize(terms);
      },
      &state);
}

void Controller(benchmark::State& state) {
  Scene scene;
  const OperationalSpaceController<7> controller(
      scene.loop().params().robot.controller);
  OperationalSpaceControllerState<7> memory = controller.MakeState();
  OperationalSpaceControllerInput<7> input;
  MeasureCalls(
      1,
      [&] {
        scene.Step();
        const RobotSideOutput<SerialArm<7>>& side = scene.state().robot.output;
        const RobotSetpoint& setpoint =
            scene.state().robot.half.output().setpoint;
        input.model = scene.arm_state().terms;
        input.q = scene.arm_state().q;
        input.v = scene.arm_state().v;
        input.motion_error = setpoint.motion_error;
        input.rotation_error = setpoint.rotation_error;
        input.proxy_velocity = setpoint.velocity;
        input.proxy_acceleration = setpoint.acceleration;
        input.reference_force = setpoint.reference_force;
        input.force_selection = setpoint.force_selection;
        input.sensed_wrench = side.sensed_wrench;
      },
      [&] { benchmark::DoNotOptimize(controller.Update(input, &memory)); },
      &state);
}

void WholeRobotSide(benchmark::State& state) {
  Scene scene;
  const RobotSide<SerialArm<7>> side(scene.loop().params().robot);
  RobotSideState<SerialArm<7>> memory = scene.state().robot;
  RobotSideInput<SerialArm<7>> input;
  MeasureCalls(
      1,
      [&] {
        scene.Step();
        input.message = scene.state().haptic.half.output().message;
        input.X_BE = scene.arm_state().X_BE;
        input.model = scene.arm_state().terms;
        input.q = scene.arm_state().q;
        input.v = scene.arm_state().v;
        input.sensed_wrench = scene.state().robot.output.sensed_wrench;
      },
      [&] { side.Update(scene.time(), input, &memory); }, &state);
}

void WholeHapticSide(benchmark::State& state) {
  Scene scene;
  const HapticSide side(scene.loop().params().haptic);
  HapticSideState memory = scene.state().haptic;
  HapticSideInput input;
  MeasureCalls(
      1,
      [&] {
        scene.Step();
        input.message = scene.state().robot.half.output().message;
        input.X_DH = scene.state().device.read_pose;
        input.device_velocity = scene.state().device.read_velocity;
      },
      [&] { side.Update(scene.time(), input, &memory); }, &state);
}

BENCHMARK(ModelTermsOfArm)->UseManualTime()->Unit(benchmark::kMicrosecond);
BENCHMARK(Controller)->UseManualTime()->Unit(benchmark::kMicrosecond);
BENCHMARK(WholeRobotSide)->UseManualTime()->Unit(benchmark::kMicrosecond);
BENCHMARK(WholeHapticSide)->UseManualTime()->Unit(benchmark::kMicrosecond);
BENCHMARK(Period)->UseManualTime()->Unit(benchmark::kMicrosecond);
BENCHMARK(ArmPlant)->UseManualTime()->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace dual_proxy

BENCHMARK_MAIN();
