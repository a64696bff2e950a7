// SPDX-License-Identifier: BSD-3-Clause

// A point mass that presses on a table and slides: a run of the bare engine
// with its log, and each part of a period on its own. Every case's time is of
// one simulated millisecond.

#include <benchmark/benchmark.h>

#include <Eigen/Core>

#include "dual_proxy/experiment/bare_engine.h"
#include "dual_proxy/experiment/teleop_loop_params.h"

namespace dual_proxy {
namespace {

constexpr double kPeriod = 0.001;
constexpr double kDuration = 20;  // s

Scenario MakeScenario(int num_particles = 1000) {
  Scenario scenario;
  scenario.name = "point_mass";
  scenario.robot = RobotKind::kPointMass;
  scenario.filter.num_particles = num_particles;
  scenario.sensor.tare = false;
  scenario.scene.table_height = 0.4;
  scenario.scene.friction = 0;
  scenario.scene.contact_stiffness = 1e4;
  scenario.scene.contact_dissipation = 30;
  scenario.scene.start_position = {0.45, 0, 0.42};
  scenario.operator_params.waypoints = {Waypoint{0, {0.45, 0, 0.42}},
                                        Waypoint{1, {0.45, 0, 0.38}},
                                        Waypoint{kDuration, {0.55, 0, 0.38}}};
  scenario.Validate();
  return scenario;
}

/** The parts of an engine, two seconds on: the tool slides. */
class Scene {
 public:
  Scene()
      : loop_(MakeTeleopLoopParams<PointMass>(scenario_, PointModelParams{})),
        plant_(scenario_.point_mass, MakeContactSceneParams(scenario_)),
        state_(loop_.MakeState()),
        plant_state_(plant_.MakeState(scenario_.scene.start_position)) {
    while (time() < 2) Step();
  }

  double time() const { return kPeriod * static_cast<double>(tick_); }
  const TeleopLoop<PointMass>& loop() const { return loop_; }
  const PointRobot& plant() const { return plant_; }
  TeleopLoopState<PointMass>& state() { return state_; }
  PointRobotState& plant_state() { return plant_state_; }

  void Step() {
    TeleopLoopInput<PointMass> input{.q = plant_state_.position,
                                     .v = plant_state_.velocity,
                                     .has_reaction = tick_ > 0};
    input.reaction.head<3>() = plant_state_.contact.force;
    loop_.Update(time(), input, &state_);
    plant_.Update(state_.command(), &plant_state_);
    ++tick_;
  }

 private:
  Scenario scenario_{MakeScenario()};
  TeleopLoop<PointMass> loop_;
  PointRobot plant_;
  TeleopLoopState<PointMass> state_;
  PointRobotState plant_state_;
  int tick_{0};
};

void WholeRun(benchmark::State& state) {
  const Scenario scenario = MakeScenario(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    auto engine = MakePointMassEngine(scenario, kDuration);
    engine.AdvanceTo(kDuration);
    benchmark::DoNotOptimize(engine.log()->num_rows());
  }
  state.counters["x_real_time"] =
      benchmark::Counter(kDuration * static_cast<double>(state.iterations()),
                         benchmark::Counter::kIsRate);
}

void LoopAndPlant(benchmark::State& state) {
  Scene scene;
  for (auto _ : state) scene.Step();
}

void Plant(benchmark::State& state) {
  Scene scene;
  PointRobotState memory = scene.plant_state();
  const Eigen::Vector3d force = scene.state().command();
  for (auto _ : state) scene.plant().Update(force, &memory);
}

// With the filter, or with selections from outside.
void Robot(benchmark::State& state) {
  Scene scene;
  const RobotSide<PointMass> side(scene.loop().params().robot);
  RobotSideState<PointMass> memory = scene.state().robot;
  RobotSideInput<PointMass> input;
  input.message = scene.state().haptic.half.output().message;
  input.X_BE = memory.output.X_BE;
  input.q = input.X_BE.p;
  input.sensed_wrench = memory.output.sensed_wrench;
  if (state.range(0) == 0) input.selections = memory.output.selections;
  double time = scene.time();
  int tick = 0;
  for (auto _ : state) {
    if (tick++ % 20 == 0) {
      input.message.send_time = time;
      ++input.message.sequence;
    }
    side.Update(time += kPeriod, input, &memory);
  }
}

void Haptic(benchmark::State& state) {
  Scene scene;
  const HapticSide side(scene.loop().params().haptic, false);
  HapticSideState memory = scene.state().haptic;
  HapticSideInput input;
  input.message = scene.state().robot.half.output().message;
  input.X_DH = scene.state().device.read_pose;
  double time = scene.time();
  for (auto _ : state) side.Update(time += kPeriod, input, &memory);
}

void Device(benchmark::State& state) {
  Scene scene;
  const SimulatedHapticDevice device(scene.loop().params().device);
  SimulatedHapticDeviceState memory = scene.state().device;
  const Pose intended = memory.intended;
  const Vector6 wrench = scene.state().haptic.output.device_wrench;
  for (auto _ : state) {
    device.Update(intended, Eigen::Vector3d::Zero(), wrench, &memory);
  }
}

void Sensor(benchmark::State& state) {
  Scene scene;
  const ForceTorqueSensor sensor(scene.loop().params().sensor);
  ForceTorqueSensorState memory = scene.state().sensor;
  ForceTorqueAdapterInput input;
  input.X_BE = scene.state().robot.output.X_BE;
  input.v_BE = scene.state().robot.output.v_BE;
  for (auto _ : state) sensor.Update(input, &memory);
}

void Signals(benchmark::State& state) {
  Scene scene;
  Eigen::VectorXd signals(SizeOf(scene.loop().layout()));
  for (auto _ : state) {
    scene.loop().WriteSignals(scene.state(), signals);
    benchmark::DoNotOptimize(signals.data());
  }
}

void Path(benchmark::State& state) {
  Scene scene;
  const OperatorPath path(scene.loop().params().path);
  double time = scene.time();
  for (auto _ : state) benchmark::DoNotOptimize(path.Calc(time += 1e-6));
}

BENCHMARK(WholeRun)->Arg(1000)->Arg(100)->Unit(benchmark::kMillisecond);
BENCHMARK(LoopAndPlant);
BENCHMARK(Robot)->ArgName("filter")->Arg(1)->Arg(0);
BENCHMARK(Haptic);
BENCHMARK(Device);
BENCHMARK(Sensor);
BENCHMARK(Plant);
BENCHMARK(Signals);
BENCHMARK(Path);

}  // namespace
}  // namespace dual_proxy

BENCHMARK_MAIN();
