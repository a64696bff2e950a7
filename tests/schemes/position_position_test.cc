// SPDX-License-Identifier: BSD-3-Clause
// What the textbook says of two delayed springs, and what a hand and a mass do.
#include "dual_proxy/schemes/position_position/scheme.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "no_alloc.h"
#include "textbook_bench.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kHandStiffness = 600;
using Bench = TextbookBench<PositionPositionScheme>;

Bench::Params MakeBenchParams(double delay, double stiffness = 440) {
  Bench::Params params;
  params.scheme.robot_stiffness = stiffness;
  params.scheme.haptic_stiffness = stiffness;
  params.channel.delay = delay;
  params.hand_stiffness = kHandStiffness;
  return params;
}

class DelayTest : public ::testing::TestWithParam<double> {};

INSTANTIATE_TEST_SUITE_P(PositionPosition, DelayTest,
                         ::testing::Values(0.0, 0.05, 0.15, 0.35));

// The hand means to be 40 mm below the surface in the robot's scale. Its 600
// N/m are 600 / scale N/m there, as the hand feels the robot's force as it is;
// in a row with the robot's spring. The wall is as good as rigid.
TEST_P(DelayTest, SteadyContactIsTwoSpringsInARow) {
  constexpr double kDepth = 0.04;
  constexpr double kStiffness = 440;
  Bench::Params params = MakeBenchParams(GetParam(), kStiffness);
  params.wall_stiffness = 3e4;
  params.hand.z() = -kDepth / Bench::kScale;
  Bench bench(params);
  bench.AdvanceTo(30);
  const double expected =
      kDepth / (Bench::kScale / kHandStiffness + 1 / kStiffness);
  ASSERT_NEAR(expected, 6.21, 0.005);
  EXPECT_TRUE(bench.connected());
  const auto [lowest, highest] =
      bench.Range(1, [&] { return bench.wall_force(); });
  EXPECT_NEAR(lowest, expected, 0.01 * expected);
  EXPECT_NEAR(highest, expected, 0.01 * expected);
}

// The stability rule of PositionPositionScheme, with the delay of a message's
// interval and a period.
TEST_P(DelayTest, ComesToRestWithinTheStabilityRule) {
  const PositionPositionParams defaults;
  const double both_ways = 2 * (GetParam() + Bench::kInterval + Bench::kPeriod);
  const double bound = std::sqrt(4 * defaults.device_damping /
                                 (defaults.force_scale * Bench::kScale) *
                                 defaults.robot_damping) /
                       both_ways;
  // As far as it goes at 0.35 s.
  ASSERT_GT(bound, 83);
  Bench::Params params =
      MakeBenchParams(GetParam(), std::min(bound, defaults.robot_stiffness));
  params.handle.x() = 0.02;
  Bench bench(params);
  bench.AdvanceTo(10);
  EXPECT_TRUE(bench.connected());
  const auto [lowest, highest] =
      bench.Range(2, [&] { return bench.handle().x(); });
  EXPECT_LT(highest - lowest, 1e-6);
}

// --- The halves --------------------------------------------------------------

PoseMessage PoseAt(std::int64_t sequence, double send_time, const Vector3d& p) {
  return {.sequence = sequence, .send_time = send_time, .pose = {.p = p}};
}

Message At(std::int64_t sequence, double send_time, const Vector3d& p) {
  return ToMessage(PoseAt(sequence, send_time, p), kPositionPositionTag);
}

TEST(PositionPositionHapticHalfTest, WithoutALinkTheForceGoesAtItsRate) {
  const PositionPositionHapticHalf dut({}, {});
  PositionPositionHapticHalfState state = dut.MakeState();
  const Vector3d& force = state.output.setpoint.reference_force;
  dut.Update(0, {}, &state);
  EXPECT_EQ(force, Vector3d::Zero());
  HapticHalfInput input;
  input.message = At(0, 0, {0.01, 0, 0});
  dut.Update(0.001, input, &state);
  EXPECT_NEAR(force.x(), 4.4, 1e-12);
  input.X_DH.p.x() = kNan;  // Refused, and the force goes likewise.
  dut.Update(0.002, input, &state);
  EXPECT_NEAR(force.x(), 4.38, 1e-12);
  EXPECT_EQ(state.output.bad_inputs, 1);
  input.X_DH.p.x() = 0;
  dut.Update(0.8, input, &state);
  EXPECT_EQ(state.output.link.status, LinkStatus::kLost);
  EXPECT_NEAR(force.x(), 4.36, 1e-12);
  for (int i = 1; i <= 218; ++i) dut.Update(0.8 + 0.001 * i, input, &state);
  EXPECT_LT(force.norm(), 1e-12);
}

TEST(PositionPositionRobotHalfTest, HoldsItsPlaceThenGoesThereAtTheLimitSpeed) {
  const RobotHalfParams shared;
  const PositionPositionParams own;
  const PositionPositionRobotHalf dut(shared, own);
  PositionPositionRobotHalfState state = dut.MakeState();
  const Vector3d& force = state.output.setpoint.reference_force;
  RobotHalfInput input;
  input.X_BE.p = {0.4, 0, 0.2};
  input.v_BE(1) = 0.1;
  dut.Update(0, input, &state);
  EXPECT_LT((force - Vector3d(0, -8.8, 0)).norm(), 1e-12);
  input.v_BE.setZero();
  const double step = shared.proxy.limiter.max_velocity * shared.proxy.period;
  int periods = 0;
  while (!state.follower.following && periods < 1000) {
    input.message = At(periods / 20, 0.001 * periods, {0.43, 0, 0.2});
    dut.Update(0.001 * periods, input, &state);
    ++periods;
    EXPECT_LE(state.follower.target.p.x(), 0.4 + step * periods + 1e-12);
  }
  EXPECT_NEAR(periods, 0.03 / step, 2);
  EXPECT_NEAR(force.x(), 0.03 * own.robot_stiffness, 1e-9);
  EXPECT_FALSE(state.output.setpoint.force_feedback);
  EXPECT_EQ(state.output.setpoint.force_selection, Matrix3d::Identity());
  // From there it follows at once, up to the force that is allowed.
  input.message = At(99, 0.001 * periods, {0.9, 0, 0.2});
  dut.Update(0.001 * periods, input, &state);
  EXPECT_EQ(state.follower.target.p.x(), 0.9);
  EXPECT_NEAR(force.norm(), own.max_robot_force, 1e-9);
  // A sensor that is not ready holds it where it is.
  input.sensor_ready = false;
  dut.Update(0.001 * (periods + 1), input, &state);
  EXPECT_EQ(force, Vector3d::Zero());
}

TEST(PositionPositionRobotHalfTest, NotFiniteGivesNoForceAndIsCounted) {
  const PositionPositionRobotHalf dut({}, {});
  PositionPositionRobotHalfState state = dut.MakeState();
  RobotHalfInput input;
  input.v_BE(0) = 0.1;
  dut.Update(0, input, &state);
  ASSERT_LT(state.output.setpoint.reference_force.x(), -1);
  input.v_BE(0) = kNan;
  dut.Update(0.001, input, &state);
  EXPECT_EQ(state.output.setpoint.reference_force, Vector3d::Zero());
  EXPECT_EQ(state.output.bad_inputs, 1);
}

TEST(PositionPositionTest, DoesNotAllocate) {
  Bench::Params params = MakeBenchParams(0.05);
  params.wall_stiffness = 3e4;
  params.hand.z() = -0.016;
  Bench bench(params);
  ScopedNoAlloc guard;
  bench.AdvanceTo(0.5);
  EXPECT_EQ(guard.count(), 0);
}

TEST(PositionPositionParamsTest, ErrorsNameFieldRangeAndValue) {
  PositionPositionParams params;
  params.robot_damping = -1;
  EXPECT_EQ(ValidationError(params),
            "PositionPositionParams: field `robot_damping` expected a finite "
            "value >= 0, got -1");
  EXPECT_THROW(PositionPositionRobotHalf({}, params), std::invalid_argument);
  params = {};
  params.force_scale = 0;
  EXPECT_THROW(PositionPositionHapticHalf({}, params), std::invalid_argument);
}

}  // namespace
}  // namespace dual_proxy
