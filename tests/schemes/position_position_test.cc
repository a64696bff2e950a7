// SPDX-License-Identifier: BSD-3-Clause
// What the textbook says of two delayed springs, and what a hand and a mass do.
#include "dual_proxy/schemes/position_position/scheme.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "dual_proxy/link/communication_channel.h"
#include "dual_proxy/simulation/haptic_device.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kPeriod = 0.001;
constexpr double kInterval = 0.02;
constexpr double kScale = 2.5;
constexpr double kHandStiffness = 600;
const Vector3d kStart(0.45, 0, 0.18);

// A hand with its device and a mass of 4.4 kg over a wall, with the two halves
// and a link between them: the scheme, and nothing of an arm.
class Bench {
 public:
  struct Params {
    double delay{0};
    double stiffness{440};              // Ks = Km.
    double wall_stiffness{0};           // N/m: below kStart.
    Vector3d hand{Vector3d::Zero()};    // Where it means the handle to be.
    Vector3d handle{Vector3d::Zero()};  // Where the handle is at the start.
  };

  explicit Bench(const Params& params)
      : params_(params),
        robot_(MakeRobot(), MakeScheme(params)),
        haptic_(MakeHaptic(), MakeScheme(params)),
        channel_({.delay = params.delay}),
        device_(MakeDevice()),
        device_state_(device_.MakeState({.p = params.handle})) {}

  void Step() {
    const double time = kPeriod * tick_;
    RobotHalfInput robot;
    robot.message = channel_.Receive(time, to_robot_);
    robot.X_BE.p = position_;
    robot.v_BE.head<3>() = velocity_;
    HapticHalfInput haptic{.message = channel_.Receive(time, to_device_),
                           .X_DH = device_state_.read_pose,
                           .device_velocity = device_state_.read_velocity};
    robot_.Update(time, robot, &robot_state_);
    haptic_.Update(time, haptic, &haptic_state_);
    channel_.Send(time, robot_state_.output.message, &to_device_);
    channel_.Send(time, haptic_state_.output.message, &to_robot_);

    Vector6 wrench = Vector6::Zero();
    wrench.head<3>() = haptic_state_.output.setpoint.reference_force;
    device_.Update({.p = params_.hand}, Vector3d::Zero(), wrench,
                   &device_state_);
    MoveMass(robot_state_.output.setpoint.reference_force);
    ++tick_;
  }

  void AdvanceTo(double time) {
    while (kPeriod * tick_ < time - kPeriod / 2) Step();
  }

  const Vector3d& position() const { return position_; }
  const Vector3d& handle() const { return device_state_.pose.p; }
  // N: of the wall on the mass.
  double wall_force() const {
    return params_.wall_stiffness * std::max(0.0, kStart.z() - position_.z());
  }
  bool connected() const {
    return robot_state_.output.link.status == LinkStatus::kConnected &&
           haptic_state_.output.link.status == LinkStatus::kConnected;
  }

 private:
  static WorkspaceMapParams MakeMap() {
    WorkspaceMapParams map;
    map.p_cw = kStart;
    map.scale = kScale;
    return map;
  }
  static RobotHalfParams MakeRobot() {
    RobotHalfParams params;
    params.proxy.map = MakeMap();
    return params;
  }
  static HapticHalfParams MakeHaptic() {
    HapticHalfParams params;
    params.proxy.map = MakeMap();
    return params;
  }
  static PositionPositionParams MakeScheme(const Params& params) {
    PositionPositionParams scheme;
    scheme.robot_stiffness = params.stiffness;
    scheme.haptic_stiffness = params.stiffness;
    return scheme;
  }
  // 0.75 kg in all, seen without the steps and the lag of its encoders.
  static SimulatedHapticDeviceParams MakeDevice() {
    SimulatedHapticDeviceParams params;
    params.hand_stiffness = kHandStiffness;
    params.hand_damping = 30;
    params.resolution = 0;
    params.velocity_cutoff = 0;
    return params;
  }

  // In steps that are short against the wall's 12 ms.
  void MoveMass(const Vector3d& force) {
    constexpr int kSteps = 10;
    for (int i = 0; i < kSteps; ++i) {
      Vector3d total = force;
      total.z() += wall_force();
      velocity_ += kPeriod / kSteps / 4.4 * total;
      position_ += kPeriod / kSteps * velocity_;
    }
  }

  Params params_;
  PositionPositionRobotHalf robot_;
  PositionPositionHapticHalf haptic_;
  CommunicationChannel channel_;
  SimulatedHapticDevice device_;
  PositionPositionRobotHalfState robot_state_{robot_.MakeState()};
  PositionPositionHapticHalfState haptic_state_{haptic_.MakeState()};
  CommunicationChannelState to_robot_{channel_.MakeState(0)};
  CommunicationChannelState to_device_{channel_.MakeState(1)};
  SimulatedHapticDeviceState device_state_;
  Vector3d position_{kStart};
  Vector3d velocity_{Vector3d::Zero()};
  int tick_{0};
};

class DelayTest : public ::testing::TestWithParam<double> {};

INSTANTIATE_TEST_SUITE_P(PositionPosition, DelayTest,
                         ::testing::Values(0.0, 0.05, 0.15, 0.35));

// The hand means to be 40 mm below the surface in the robot's scale. Its 600
// N/m are 600 / scale N/m there, as the hand feels the robot's force as it is;
// in a row with the robot's spring. The wall is as good as rigid.
TEST_P(DelayTest, SteadyContactIsTwoSpringsInARow) {
  constexpr double kDepth = 0.04;
  constexpr double kStiffness = 440;
  Bench bench({.delay = GetParam(),
               .stiffness = kStiffness,
               .wall_stiffness = 3e4,
               .hand = {0, 0, -kDepth / kScale}});
  bench.AdvanceTo(30);
  const double expected = kDepth / (kScale / kHandStiffness + 1 / kStiffness);
  ASSERT_NEAR(expected, 6.21, 0.005);
  EXPECT_TRUE(bench.connected());
  double lowest = bench.wall_force();
  double highest = lowest;
  for (double time = 30; time < 31; time += kPeriod) {
    bench.Step();
    lowest = std::min(lowest, bench.wall_force());
    highest = std::max(highest, bench.wall_force());
  }
  EXPECT_NEAR(lowest, expected, 0.01 * expected);
  EXPECT_NEAR(highest, expected, 0.01 * expected);
}

// The stability rule of PositionPositionScheme, with the delay of a message's
// interval and a period.
TEST_P(DelayTest, ComesToRestWithinTheStabilityRule) {
  const PositionPositionParams defaults;
  const double both_ways = 2 * (GetParam() + kInterval + kPeriod);
  const double bound =
      std::sqrt(4 * defaults.device_damping / (defaults.force_scale * kScale) *
                defaults.robot_damping) /
      both_ways;
  // As far as it goes at 0.35 s.
  ASSERT_GT(bound, 83);
  Bench bench({.delay = GetParam(),
               .stiffness = std::min(bound, defaults.robot_stiffness),
               .handle = {0.02, 0, 0}});
  bench.AdvanceTo(10);
  EXPECT_TRUE(bench.connected());
  double lowest = bench.handle().x();
  double highest = lowest;
  for (double time = 10; time < 12; time += kPeriod) {
    bench.Step();
    lowest = std::min(lowest, bench.handle().x());
    highest = std::max(highest, bench.handle().x());
  }
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
  while (!state.following && periods < 1000) {
    input.message = At(periods / 20, 0.001 * periods, {0.43, 0, 0.2});
    dut.Update(0.001 * periods, input, &state);
    ++periods;
    EXPECT_LE(state.target.p.x(), 0.4 + step * periods + 1e-12);
  }
  EXPECT_NEAR(periods, 0.03 / step, 2);
  EXPECT_NEAR(force.x(), 0.03 * own.robot_stiffness, 1e-9);
  EXPECT_FALSE(state.output.setpoint.force_feedback);
  EXPECT_EQ(state.output.setpoint.force_selection, Matrix3d::Identity());
  // From there it follows at once, up to the force that is allowed.
  input.message = At(99, 0.001 * periods, {0.9, 0, 0.2});
  dut.Update(0.001 * periods, input, &state);
  EXPECT_EQ(state.target.p.x(), 0.9);
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
  Bench bench({.delay = 0.05, .wall_stiffness = 3e4, .hand = {0, 0, -0.016}});
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
