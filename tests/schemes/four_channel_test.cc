// SPDX-License-Identifier: BSD-3-Clause
// Transparent where the theory says so, and a limit cycle where it is known
// for.
#include "dual_proxy/schemes/four_channel/scheme.h"

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
using Variant = FourChannelParams::Variant;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kDepth = 0.04;  // m: of where the hand means to be.
constexpr double kHandStiffness = 600;
constexpr double kStiffWall = 3e4;  // N/m.
using Bench = TextbookBench<FourChannelScheme>;

Bench::Params MakeBenchParams(Variant variant, double delay,
                              double wall_stiffness) {
  Bench::Params params;
  params.scheme.variant = variant;
  params.channel.delay = delay;
  params.hand_stiffness = kHandStiffness;
  params.wall_stiffness = wall_stiffness;
  params.hand.z() = -kDepth / Bench::kScale;
  return params;
}

// The hand presses as if the wall were at the handle: its 600 N/m are 600 /
// scale N/m in the robot's scale, in a row with the wall's.
double ExpectedForce(double wall_stiffness) {
  return kDepth / (Bench::kScale / kHandStiffness + 1 / wall_stiffness);
}

class FourChannelDelayTest : public ::testing::TestWithParam<double> {};

INSTANTIATE_TEST_SUITE_P(FourChannel, FourChannelDelayTest,
                         ::testing::Values(0.0, 0.05, 0.15));

TEST_P(FourChannelDelayTest, HandFeelsASoftWallAsItIs) {
  constexpr double kWall = 500;
  Bench bench(MakeBenchParams(Variant::kFourChannel, GetParam(), kWall));
  bench.AdvanceTo(20);
  const double expected = ExpectedForce(kWall);
  ASSERT_NEAR(expected, 6.49, 0.005);
  EXPECT_TRUE(bench.connected());
  for (const bool at_wall : {true, false}) {
    const auto [lowest, highest] = bench.Range(1, [&] {
      return at_wall ? bench.wall_force() : bench.device_force().z();
    });
    EXPECT_NEAR(lowest, expected, 0.01 * expected);
    EXPECT_NEAR(highest, expected, 0.01 * expected);
  }
  const auto [lowest, highest] = bench.Range(1, [&] {
    return Bench::Start().z() + Bench::kScale * bench.handle().z() -
           bench.position().z();
  });
  EXPECT_GT(lowest, -1e-4);
  EXPECT_LT(highest, 1e-4);
}

class ThreeChannelDelayTest : public ::testing::TestWithParam<double> {};

INSTANTIATE_TEST_SUITE_P(FourChannel, ThreeChannelDelayTest,
                         ::testing::Values(0.0, 0.05, 0.15, 0.35));

TEST_P(ThreeChannelDelayTest, RestsAtAStiffWall) {
  Bench::Params params =
      MakeBenchParams(Variant::kThreeChannel, GetParam(), kStiffWall);
  params.encoders = true;
  Bench bench(params);
  bench.AdvanceTo(20);
  const double expected = ExpectedForce(kStiffWall);
  ASSERT_NEAR(expected, 9.52, 0.005);
  const auto [mean, std] =
      bench.MeanAndStd(5, [&] { return bench.device_force().z(); });
  EXPECT_NEAR(mean, expected, 0.01 * expected);
  EXPECT_LT(std, 0.05);
  // The encoders' steps shake the mass on its wall, which damps nothing.
  const auto [wall_mean, wall_std] =
      bench.MeanAndStd(5, [&] { return bench.wall_force(); });
  EXPECT_NEAR(wall_mean, expected, 0.01 * expected);
  EXPECT_LT(wall_std, 0.3);
}

// What transparency costs. A scheme that did not do so would not be this one.
TEST(FourChannelTest, StiffWallIsALimitCycleWithoutDelay) {
  Bench bench(MakeBenchParams(Variant::kFourChannel, 0, kStiffWall));
  bench.AdvanceTo(20);
  const auto [mean, std] =
      bench.MeanAndStd(10, [&] { return bench.device_force().z(); });
  EXPECT_GT(std, 2);
  EXPECT_LT(std, 5);
}

TEST(FourChannelTest, ThreeChannelsChatterInASoftHand) {
  Bench::Params params =
      MakeBenchParams(Variant::kThreeChannel, 0.15, kStiffWall);
  params.encoders = true;
  params.hand_stiffness = 300;
  params.hand_damping = 10;
  Bench bench(params);
  bench.AdvanceTo(10);
  const auto [mean, std] =
      bench.MeanAndStd(10, [&] { return bench.device_force().z(); });
  EXPECT_GT(std, 1);
  EXPECT_LT(std, 3);
}

// --- The halves --------------------------------------------------------------

Message ToRobot(std::int64_t sequence, double send_time,
                const FourChannelToRobot& content) {
  FourChannelToRobot message = content;
  message.sequence = sequence;
  message.send_time = send_time;
  return ToMessage(message);
}

Message ToDevice(std::int64_t sequence, double send_time,
                 const FourChannelToDevice& content) {
  FourChannelToDevice message = content;
  message.sequence = sequence;
  message.send_time = send_time;
  return ToMessage(message);
}

// A mass that is not the device's moves with it, and a motor pulls.
TEST(FourChannelHapticHalfTest, EstimatesTheHandsForceFromMotionAndCommand) {
  constexpr double kPeriod = Bench::kPeriod;
  HapticHalfParams shared;
  shared.proxy.map.R_DB << 0, 1, 0, -1, 0, 0, 0, 0, 1;
  FourChannelParams own;
  own.force_scale = 0.5;
  const FourChannelHapticHalf dut(shared, own);
  FourChannelHapticHalfState state = dut.MakeState();
  const Vector3d acceleration(0.3, -0.2, 0.1);  // m/s^2.
  const Vector3d motor(1, 2, -3);               // N.
  HapticHalfInput input;
  input.device_wrench.head<3>() = motor;
  Vector3d v = Vector3d::Zero();
  for (int i = 0; i < 300; ++i) {
    const double time = kPeriod * i;
    v = acceleration * time;
    input.X_DH.p = acceleration * time * time / 2;
    input.device_velocity.head<3>() = v;
    dut.Update(time, input, &state);
  }
  const Vector3d expected =
      own.device_mass * acceleration + own.device_friction * v - motor;
  // The friction's part lags by two low-passes.
  EXPECT_LT((state.estimate.force - expected).norm(), 0.01);
  const auto message = FromMessage<FourChannelToRobot>(state.output.message);
  const Vector3d sent = shared.proxy.map.R_DB * message.hand_force;
  EXPECT_LT((own.force_scale * sent - expected).norm(), 0.02);
  // It starts anew after what is not valid, from the motion that there is.
  input.device_wrench(0) = kNan;
  dut.Update(0.3, input, &state);
  EXPECT_EQ(state.estimate.force, Vector3d::Zero());
  input.device_wrench.setZero();
  for (int i = 0; i < 3; ++i) {
    input.X_DH.p += kPeriod * v;
    dut.Update(0.301 + kPeriod * i, input, &state);
  }
  EXPECT_LT(state.estimate.force.norm(), own.device_friction * v.norm());
}

TEST(FourChannelHapticHalfTest, IsTheLawOfItsVariant) {
  HapticHalfParams shared;
  shared.proxy.map.R_DB << 0, 1, 0, -1, 0, 0, 0, 0, 1;
  const Matrix3d& R_DB = shared.proxy.map.R_DB;
  const double scale = shared.proxy.map.scale;
  for (const Variant variant :
       {Variant::kFourChannel, Variant::kThreeChannel}) {
    FourChannelParams own;
    own.variant = variant;
    own.force_scale = 0.5;
    const FourChannelHapticHalf dut(shared, own);
    FourChannelHapticHalfState state = dut.MakeState();
    FourChannelToDevice robot{.position = {0.01, 0, 0},
                              .velocity = {0, 0.02, 0},
                              .sensed_force = {0, 0, 3}};
    HapticHalfInput input;
    input.message = ToDevice(0, 0, robot);
    input.X_DH.p = {0.002, 0, 0};
    input.device_velocity(1) = 0.01;
    for (int i = 0; i < 10; ++i) {
      input.device_wrench(2) = 0.1 * i;
      dut.Update(0.001 * i, input, &state);
    }
    const Vector3d x_d = scale * R_DB.transpose() * input.X_DH.p;
    const Vector3d v_d =
        scale * R_DB.transpose() * input.device_velocity.head<3>();
    const Vector3d f_h =
        R_DB.transpose() * state.estimate.force / own.force_scale;
    ASSERT_GT(f_h.norm(), 0.01);
    const Vector3d f_d =
        own.haptic_stiffness * (x_d - robot.position) +
        own.device_damping / (own.force_scale * scale) *
            (v_d - robot.velocity) +
        (variant == Variant::kFourChannel ? robot.sensed_force : f_h);
    EXPECT_LT(
        (state.output.setpoint.reference_force + own.force_scale * (R_DB * f_d))
            .norm(),
        1e-12);
    EXPECT_LT(
        (state.output.proxy_pose.p - R_DB * robot.position / scale).norm(),
        1e-12);
  }
}

TEST(FourChannelHapticHalfTest, WithoutALinkTheForceGoesAtItsRate) {
  const FourChannelHapticHalf dut({}, {});
  FourChannelHapticHalfState state = dut.MakeState();
  const Vector3d& force = state.output.setpoint.reference_force;
  dut.Update(0, {}, &state);
  EXPECT_EQ(force, Vector3d::Zero());
  HapticHalfInput input;
  input.message = ToDevice(0, 0, {.sensed_force = {-4.4, 0, 0}});
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

TEST(FourChannelRobotHalfTest, VelocityAndForceCountWhenItIsThere) {
  const RobotHalfParams shared;
  const FourChannelParams own;
  const FourChannelRobotHalf dut(shared, own);
  FourChannelRobotHalfState state = dut.MakeState();
  const Vector3d& force = state.output.setpoint.reference_force;
  RobotHalfInput input;
  input.X_BE.p = {0.4, 0, 0.2};
  input.v_BE(1) = 0.1;
  input.sensed_wrench(2) = -3;
  dut.Update(0, input, &state);
  EXPECT_LT((force - Vector3d(0, -8.8, 0)).norm(), 1e-12);
  const auto sent = FromMessage<FourChannelToDevice>(state.output.message);
  EXPECT_EQ(sent.position, input.X_BE.p);
  EXPECT_EQ(sent.velocity, Vector3d(0, 0.1, 0));
  EXPECT_EQ(sent.sensed_force, Vector3d(0, 0, -3));
  input.v_BE.setZero();
  const double step = shared.proxy.limiter.max_velocity * shared.proxy.period;
  FourChannelToRobot device{.pose = {.p = {0.43, 0, 0.2}},
                            .velocity = {0, 0.05, 0},
                            .hand_force = {0, 0, -2}};
  int periods = 0;
  for (; !state.follower.following && periods < 1000; ++periods) {
    // On the way there it is the spring alone.
    EXPECT_EQ(force.z(), 0);
    input.message = ToRobot(periods / 20, 0.001 * periods, device);
    dut.Update(0.001 * periods, input, &state);
    EXPECT_LE(state.follower.target.p.x(), 0.4 + step * (periods + 1) + 1e-12);
  }
  EXPECT_NEAR(periods, 0.03 / step, 2);
  const Vector3d expected(0.03 * own.robot_stiffness, 0.05 * own.robot_damping,
                          -2);
  EXPECT_LT((force - expected).norm(), 1e-9);
  EXPECT_FALSE(state.output.setpoint.force_feedback);
  EXPECT_EQ(state.output.setpoint.force_selection, Matrix3d::Identity());
  device.pose.p.x() = 0.9;
  input.message = ToRobot(99, 0.001 * periods, device);
  dut.Update(0.001 * periods, input, &state);
  EXPECT_NEAR(force.norm(), own.max_robot_force, 1e-9);
  // A sensor that is not ready holds it where it is.
  input.sensor_ready = false;
  dut.Update(0.001 * (periods + 1), input, &state);
  EXPECT_EQ(force, Vector3d::Zero());
}

TEST(FourChannelRobotHalfTest, NothingLeadsOutOfTheWorkspace) {
  RobotHalfParams shared;
  shared.proxy.workspace.shape = WorkspaceLimitsParams::Shape::kBox;
  shared.proxy.workspace.half_size.setConstant(0.1);
  const FourChannelRobotHalf dut(shared, {});
  FourChannelRobotHalfState state = dut.MakeState();
  RobotHalfInput input;
  input.X_BE.p = {0.1, 0, 0};
  input.message = ToRobot(0, 0, {.pose = {.p = {0.1, 0, 0}}});
  dut.Update(0, input, &state);
  ASSERT_TRUE(state.follower.following);
  FourChannelToRobot device{.pose = {.p = {0.2, 0, 0}},
                            .velocity = {1, 0.1, 0},
                            .hand_force = {5, 2, 0}};
  input.message = ToRobot(1, 0.001, device);
  dut.Update(0.001, input, &state);
  const Vector3d& force = state.output.setpoint.reference_force;
  EXPECT_LT((force - Vector3d(0, 10.8, 0)).norm(), 1e-12);
  device.hand_force.x() = -5;  // But it may lead back in.
  input.message = ToRobot(2, 0.002, device);
  dut.Update(0.002, input, &state);
  EXPECT_LT((force - Vector3d(-5, 10.8, 0)).norm(), 1e-12);
}

TEST(FourChannelRobotHalfTest, NotFiniteGivesNoForceAndIsCounted) {
  const FourChannelRobotHalf dut({}, {});
  FourChannelRobotHalfState state = dut.MakeState();
  RobotHalfInput input;
  input.v_BE(0) = 0.1;
  dut.Update(0, input, &state);
  ASSERT_LT(state.output.setpoint.reference_force.x(), -1);
  input.v_BE(0) = kNan;
  dut.Update(0.001, input, &state);
  EXPECT_EQ(state.output.setpoint.reference_force, Vector3d::Zero());
  EXPECT_EQ(state.output.bad_inputs, 1);
  input.v_BE(0) = 0;
  input.message = ToRobot(0, 0.002, {.hand_force = {kNan, 0, 0}});
  dut.Update(0.002, input, &state);
  EXPECT_EQ(state.output.link.bad_inputs, 1);
  EXPECT_EQ(state.output.link.status, LinkStatus::kWaiting);
}

TEST(FourChannelTest, DoesNotAllocate) {
  Bench bench(MakeBenchParams(Variant::kFourChannel, 0.05, kStiffWall));
  ScopedNoAlloc guard;
  bench.AdvanceTo(0.5);
  EXPECT_EQ(guard.count(), 0);
}

TEST(FourChannelParamsTest, ErrorsNameFieldRangeAndValue) {
  FourChannelParams params;
  params.device_mass = -1;
  EXPECT_EQ(ValidationError(params),
            "FourChannelParams: field `device_mass` expected a finite value >= "
            "0, got -1");
  EXPECT_THROW(FourChannelRobotHalf({}, params), std::invalid_argument);
  params = {};
  params.hand_force_cutoff = 0;
  EXPECT_THROW(FourChannelHapticHalf({}, params), std::invalid_argument);
}

}  // namespace
}  // namespace dual_proxy
