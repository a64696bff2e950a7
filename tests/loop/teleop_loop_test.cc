// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/loop/teleop_loop.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Core>

#include "dual_proxy/simulation/simulated_arm.h"
#include "no_alloc.h"
#include "test_arm.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kPeriod = 0.001;

// The hand goes 25 mm down in half a second, over a link that is not kind.
TeleopLoopParams<SerialArm<7>> MakeParams(Scheme scheme) {
  TeleopLoopParams<SerialArm<7>> params;
  const SimulatedArm<7> arm(SimulatedArmParams{}, MakeTestArm());
  const Pose X_BE = arm.MakeState(kTestArmAtRest).X_BE;
  WorkspaceMapParams map;
  map.p_cw = X_BE.p;
  map.R_cw = X_BE.R;
  params.robot.proxy.map = map;
  params.haptic.proxy.map = map;
  params.robot.scheme = scheme;
  params.haptic.scheme = scheme;
  Schemes::ForEach([&]<typename S>() {
    if (scheme != SchemeOf<S>) return;
    S::ApplyPresets(&params.robot.proxy, &params.robot.controller);
  });
  params.robot.perception.filter.num_particles = 60;
  params.robot.perception.angular_filter.enabled = true;
  params.robot.perception.angular_filter.filter.num_particles = 60;
  params.channel = {.delay = 0.01, .jitter = 0.01, .loss = 0.1};
  params.model = MakeTestArm();
  params.path.times = Eigen::Vector2d(0, 0.5);
  params.path.points = Eigen::Matrix3Xd::Zero(3, 2);
  params.path.points(2, 1) = -0.025;
  return params;
}

// The loop with an arm over a table 30 mm below the tool.
class Bench {
 public:
  explicit Bench(const TeleopLoopParams<SerialArm<7>>& params)
      : loop_(params),
        arm_({}, MakeTestArm(), MakeTable(params)),
        state_(loop_.MakeState()),
        arm_state_(arm_.MakeState(kTestArmAtRest)) {}

  TeleopLoopInput<SerialArm<7>> input() const {
    return {.q = arm_state_.q,
            .v = arm_state_.v,
            .reaction = arm_state_.reaction,
            .has_reaction = tick_ > 0};
  }

  void Step() { Step(input()); }

  void Step(const TeleopLoopInput<SerialArm<7>>& input) {
    loop_.Update(kPeriod * tick_++, input, &state_);
    arm_.Update(state_.command(), &arm_state_);
  }

  VectorXd signals() const {
    VectorXd vector(SizeOf(loop_.layout()));
    loop_.WriteSignals(state_, vector);
    return vector;
  }

  const TeleopLoop<SerialArm<7>>& loop() const { return loop_; }
  const TeleopLoopState<SerialArm<7>>& state() const { return state_; }

 private:
  static ContactSceneParams MakeTable(
      const TeleopLoopParams<SerialArm<7>>& params) {
    ContactSurfaceParams table;
    table.position = params.robot.proxy.map.p_cw - Vector3d(0, 0, 0.04);
    table.stiffness = 1e4;
    table.dissipation = 2;
    ContactSceneParams scene;
    scene.tool_radius = 0.01;
    scene.surfaces = {table};
    return scene;
  }

  TeleopLoop<SerialArm<7>> loop_;
  SimulatedArm<7> arm_;
  TeleopLoopState<SerialArm<7>> state_;
  SimulatedArmState<7> arm_state_;
  int tick_{0};
};

class TeleopLoopTest : public ::testing::TestWithParam<Scheme> {
 protected:
  const TeleopLoopParams<SerialArm<7>> params_{MakeParams(GetParam())};
};

INSTANTIATE_TEST_SUITE_P(
    Schemes, TeleopLoopTest, ::testing::ValuesIn([] {
      std::vector<Scheme> schemes;
      for (const auto& [scheme, name] : EnumStrings<Scheme>::kValues) {
        schemes.push_back(scheme);
      }
      return schemes;
    }()),
    [](const auto& info) {
      return EnumStrings<Scheme>::kValues[static_cast<int>(info.param)].second;
    });

TEST_P(TeleopLoopTest, ToolComesDownAndTheHandFeelsIt) {
  Bench bench(params_);
  EXPECT_EQ(bench.signals(), VectorXd::Zero(bench.signals().size()));
  for (int i = 0; i < 1000; ++i) bench.Step();
  const TeleopLoopState<SerialArm<7>>& state = bench.state();
  // Not at the end, as some schemes bounce.
  double depth = 0;
  double pressed = 0;
  double felt = 0;
  for (int i = 0; i < 500; ++i) {
    bench.Step();
    depth = std::max(depth, params_.robot.proxy.map.p_cw.z() -
                                state.robot.output.X_BE.p.z());
    pressed = std::max(pressed, -state.robot.output.sensed_wrench(2));
    felt = std::max(felt, state.haptic.output.device_wrench(2));
  }
  EXPECT_GT(depth, 0.025);
  EXPECT_GT(pressed, 1);
  EXPECT_GT(felt, 0.5);
  EXPECT_GT(state.to_robot.lost, 0);
  EXPECT_EQ(state.robot.output.bad_inputs, 0);
  EXPECT_EQ(state.haptic.output.bad_inputs, 0);
  EXPECT_TRUE(bench.signals().allFinite());
}

TEST_P(TeleopLoopTest, NoHeap) {
  Bench bench(params_);
  VectorXd signals(SizeOf(bench.loop().layout()));
  for (int i = 0; i < 600; ++i) {
    const TeleopLoopInput<SerialArm<7>> input = bench.input();
    TeleopLoopState<SerialArm<7>> state = bench.state();
    ScopedNoAlloc guard;
    bench.loop().Update(kPeriod * i, input, &state);
    bench.loop().WriteSignals(state, signals);
    ASSERT_EQ(guard.count(), 0) << i;
    bench.Step();
  }
}

TEST_P(TeleopLoopTest, TwoRunsAreTheSameBits) {
  Bench one(params_);
  Bench two(params_);
  for (int i = 0; i < 1000; ++i) {
    one.Step();
    two.Step();
    ASSERT_EQ(one.signals(), two.signals()) << i;
  }
  TeleopLoopParams<SerialArm<7>> params = params_;
  params.seeds.to_robot = 77;
  Bench other(params);
  for (int i = 0; i < 1000; ++i) other.Step();
  EXPECT_NE(other.signals(), one.signals());
}

TEST_P(TeleopLoopTest, WhatIsNotFiniteGivesNoTorqueThatIsNotFinite) {
  for (const double bad : {kNan, std::numeric_limits<double>::infinity()}) {
    for (int number = 0; number < 20; ++number) {
      Bench bench(params_);
      for (int i = 0; i < 100; ++i) {
        TeleopLoopInput<SerialArm<7>> input = bench.input();
        if (i >= 50 && i < 60) {
          if (number < 7) {
            input.q(number) = bad;
          } else if (number < 14) {
            input.v(number - 7) = bad;
          } else {
            input.reaction(number - 14) = bad;
          }
        }
        bench.Step(input);
        ASSERT_TRUE(bench.state().command().allFinite()) << number;
        ASSERT_TRUE(bench.state().haptic.output.device_wrench.allFinite());
      }
      const TeleopLoopState<SerialArm<7>>& state = bench.state();
      EXPECT_EQ(state.robot.output.bad_inputs, number < 14 ? 10 : 0) << number;
      EXPECT_EQ(state.sensor.adapter.bad_inputs, 10) << number;
    }
  }
}

TEST_P(TeleopLoopTest, LayoutNamesEveryNumberOnce) {
  const TeleopLoop<SerialArm<7>> dut(params_);
  std::set<std::string> names;
  int start = 0;
  for (const SignalSlice& signal : dut.layout()) {
    EXPECT_TRUE(names.insert(signal.name).second) << signal.name;
    EXPECT_FALSE(signal.meaning.empty()) << signal.name;
    EXPECT_EQ(signal.start, start) << signal.name;
    start += signal.size;
  }
  EXPECT_EQ(start, SizeOf(dut.layout()));
  for (const char* name : {"dimension", "moment_dimension"}) {
    EXPECT_EQ(names.count(name), UsesSelections(GetParam()) ? 1u : 0u) << name;
  }
}

TEST(TeleopLoopParamsTest, PartsAreCheckedTogether) {
  TeleopLoopParams<SerialArm<7>> params = MakeParams(SchemeOf<DualProxyScheme>);
  EXPECT_EQ(ValidationError(params), "no exception");
  params.haptic.scheme = SchemeOf<PositionForceScheme>;
  EXPECT_EQ(ValidationError(params),
            "TeleopLoopParams: field `haptic.scheme` expected the robot's "
            "scheme, got 1");
  params = MakeParams(SchemeOf<DualProxyScheme>);
  params.device.period = 0.002;
  EXPECT_EQ(ValidationError(params),
            "TeleopLoopParams: field `device.period` expected "
            "robot.controller.period, got 0.002");
  EXPECT_THROW(TeleopLoop<SerialArm<7>>{params}, std::invalid_argument);
}

// Until the first period the arm is held where it is.
TEST(TeleopLoopTest, HoldingTorqueCarriesTheArm) {
  const TeleopLoop<SerialArm<7>> dut(MakeParams(SchemeOf<DualProxyScheme>));
  SimulatedArm<7> arm({}, MakeTestArm());
  SimulatedArmState<7> state = arm.MakeState(kTestArmAtRest);
  for (int i = 0; i < 100; ++i) {
    arm.Update(dut.CalcHoldingTorque(state.q), &state);
  }
  EXPECT_LT((state.q - kTestArmAtRest).norm(), 1e-9);
  EXPECT_GT(dut.CalcHoldingTorque(kTestArmAtRest).norm(), 5);
}

}  // namespace
}  // namespace dual_proxy
