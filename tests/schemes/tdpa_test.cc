// SPDX-License-Identifier: BSD-3-Clause
// Energies at the ports of a delayed link: what is observed, what is held back.
#include "dual_proxy/schemes/tdpa/scheme.h"

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
constexpr double kPeriod = 0.001;
using Bench = TextbookBench<TdpaScheme>;

constexpr TdpaObserver kObservers[] = {TdpaObserver::kOnePort,
                                       TdpaObserver::kTwoPort,
                                       TdpaObserver::kEnergyReflection};

// --- The vertical path of scene `plane`, on the bench ------------------------

constexpr double kClearance = 0.07;  // m: at first.
constexpr double kLift = 16;         // s.
constexpr double kEnd = 18;

// Where the hand means the robot to be above the wall, m.
double IntendedHeight(double time) {
  struct Waypoint {
    double time, height;
  };
  constexpr Waypoint kPath[] = {
      {0, kClearance}, {1, kClearance}, {2.3, 0.015},      {4.3, -0.04},
      {kLift, -0.04},  {17, 0.03},      {kEnd, kClearance}};
  const Waypoint* to = kPath;
  while (to->time < time && to->time < kEnd) ++to;
  if (to == kPath || time >= kEnd) return kClearance;
  const Waypoint* from = to - 1;
  return from->height + (to->height - from->height) * (time - from->time) /
                            (to->time - from->time);
}

Bench::Params MakeParams(TdpaObserver observer, double delay) {
  Bench::Params params;
  params.scheme.observer = observer;
  params.scheme.force_scale = 0.6;
  params.scheme.actuation_delay = 0;  // The bench's device obeys at once.
  params.channel.delay = delay;
  params.wall_stiffness = 3e4;
  params.clearance = kClearance;
  params.hand.z() = kClearance / Bench::kScale;
  params.handle = params.hand;
  return params;
}

// What a run along the path shows.
struct PathResult {
  double force_mean{0};  // N: on the hand, in steady contact.
  double force_std{0};
  double offset{
      0};  // m: of the robot from where the hand means it, at the end.
  // J: the least that was left at the robot and at the device after periods in
  // which nothing saturated, and of all periods.
  double least_robot{0};
  double least_device{0};
  double least_of_all{0};
  std::int64_t saturated{0};  // Periods, of both sides.
  // J: injected in all, and from 5 s on until the hand is lifted.
  double dissipated{0};
  double dissipated_settled{0};
  // J: the least that hand and wall have put in on balance, by the forces that
  // act and the true positions.
  double least_input{0};
};

// From 8 s on, in contact, the operator asks for `scale` of the force.
PathResult Follow(const Bench::Params& params, double scale = 1) {
  Bench bench(params);
  PathResult result;
  result.least_robot = result.least_device = 1e3;
  double contact = kLift;
  double count = 0, sum = 0, sum_of_squares = 0, settled = 0, input = 0;
  while (bench.time() < kEnd + 2 + 3 * params.channel.delay) {
    const double time = bench.time();
    bench.set_hand({0, 0, IntendedHeight(time) / Bench::kScale});
    if (time > 8) bench.set_force_scale(scale);
    const std::int64_t robot_saturated = bench.robot().saturated;
    const std::int64_t device_saturated = bench.haptic().passivity.saturated;
    const Vector3d handle = bench.handle();
    const Vector3d position = bench.position();
    bench.Step();

    const double robot = bench.robot().balance;
    const double device = bench.haptic().passivity.balance;
    if (bench.robot().saturated == robot_saturated) {
      result.least_robot = std::min(result.least_robot, robot);
    }
    if (bench.haptic().passivity.saturated == device_saturated) {
      result.least_device = std::min(result.least_device, device);
    }
    result.least_of_all = std::min({result.least_of_all, robot, device});
    input -= bench.device_force().dot(bench.handle() - handle) * Bench::kScale /
             params.scheme.force_scale;
    input -= bench.robot().output.setpoint.reference_force.dot(
        bench.position() - position);
    result.least_input = std::min(result.least_input, input);

    const double dissipated =
        bench.robot().dissipated + bench.haptic().passivity.dissipated;
    if (time < 5) settled = dissipated;
    if (time < kLift) result.dissipated_settled = dissipated - settled;
    if (bench.wall_force() > 0.5) contact = std::min(contact, time);
    if (time > contact + 3 * params.channel.delay + 1 && time < kLift) {
      const double force = bench.device_force().z();
      ++count;
      sum += force;
      sum_of_squares += force * force;
    }
  }
  EXPECT_TRUE(bench.connected());
  result.force_mean = sum / count;
  result.force_std =
      std::sqrt(sum_of_squares / count - result.force_mean * result.force_mean);
  result.offset = bench.position().z() - Bench::Start().z() - kClearance;
  result.saturated =
      bench.robot().saturated + bench.haptic().passivity.saturated;
  result.dissipated =
      bench.robot().dissipated + bench.haptic().passivity.dissipated;
  return result;
}

std::string Describe(const PathResult& r) {
  return "force " + std::to_string(r.force_mean) + " +- " +
         std::to_string(r.force_std) + " N, offset " +
         std::to_string(1e3 * r.offset) + " mm, least W " +
         std::to_string(r.least_of_all) + " J, dissipated " +
         std::to_string(r.dissipated) + " J, saturated " +
         std::to_string(r.saturated) + ", least input " +
         std::to_string(r.least_input) + " J";
}

class ObserverTest : public ::testing::TestWithParam<TdpaObserver> {};

INSTANTIATE_TEST_SUITE_P(Tdpa, ObserverTest, ::testing::ValuesIn(kObservers),
                         [](const auto& info) {
                           return std::string(EnumToString(info.param));
                         });

// Without saturation what is left is never below zero, whatever the link does.
TEST_P(ObserverTest, NoMoreLeavesThanCameInUnlessAControllerSaturates) {
  for (const double delay : {0.0, 0.05, 0.15, 0.35, 1.5}) {
    for (const double force_scale : {0.6, 1.0}) {
      for (const double loss : {0.0, 0.3}) {
        Bench::Params params = MakeParams(GetParam(), delay);
        params.scheme.force_scale = force_scale;
        params.channel.loss = loss;
        params.channel.jitter = loss / 50;
        const PathResult result = Follow(params);
        const std::string what = std::to_string(delay) + " s, kappa " +
                                 std::to_string(force_scale) + ", loss " +
                                 std::to_string(loss) + ": " + Describe(result);
        EXPECT_GE(result.least_robot, -1e-9) << what;
        EXPECT_GE(result.least_device, -1e-9) << what;
      }
    }
  }
}

TEST_P(ObserverTest, WithoutDelayNothingIsInjectedInSettledContact) {
  const PathResult result = Follow(MakeParams(GetParam(), 0));
  EXPECT_EQ(result.dissipated_settled, 0) << Describe(result);
  EXPECT_LT(result.force_std, 0.1);
  // Two springs in a row: the hand's, as the link has it, and the robot's.
  const double hand = 600 / (0.6 * Bench::kScale);
  EXPECT_NEAR(result.force_mean, 0.6 * 0.04 / (1 / hand + 1. / 440), 0.05);
}

// Hand and wall never get out more than what each port may give at first and
// what saturation let through, counted by what really acts and moves: nothing
// of the scheme's own books is in it. one_port has no such bound, the robot's
// motion is paid by nobody there.
TEST_P(ObserverTest, WhatHandAndWallPutInIsNotLessThanTheBooksSay) {
  if (GetParam() == TdpaObserver::kOnePort) return;
  for (const double delay : {0.0, 0.05, 0.15, 0.35}) {
    const Bench::Params params = MakeParams(GetParam(), delay);
    const PathResult result = Follow(params);
    EXPECT_GE(result.least_input,
              -2 * (params.scheme.initial_energy - result.least_of_all))
        << delay << " s: " << Describe(result);
  }
}

// What acts on the hand is in the books, whatever its operator asks for: the
// same bounds hold, of the books and of what really happens.
TEST_P(ObserverTest, ForceScaleThatChangesInContactIsCounted) {
  for (const double delay : {0.0, 0.15}) {
    const PathResult plain = Follow(MakeParams(GetParam(), delay));
    for (const double scale : {2.0, 0.2}) {
      Bench::Params params = MakeParams(GetParam(), delay);
      params.aids.buttons = true;
      const PathResult result = Follow(params, scale);
      const std::string what = std::to_string(delay) + " s, scale " +
                               std::to_string(scale) + ": " + Describe(result);
      EXPECT_NE(result.force_mean, plain.force_mean);
      EXPECT_GE(result.least_robot, -1e-9) << what;
      EXPECT_GE(result.least_device, -1e-9) << what;
      if (GetParam() == TdpaObserver::kOnePort) continue;
      EXPECT_GE(result.least_input,
                -2 * (params.scheme.initial_energy - result.least_of_all))
          << what;
    }
  }
}

TEST_P(ObserverTest, DoesNotAllocate) {
  Bench bench(MakeParams(GetParam(), 0.05));
  ScopedNoAlloc guard;
  bench.set_hand({0, 0, -0.016});
  bench.AdvanceTo(2);
  EXPECT_EQ(guard.count(), 0);
}

// The link itself is active: with the force's loop gain in contact, kappa s Ks
// / K = 1.1, what disturbs it grows to a limit cycle that gives 0.5 W. How much
// energy that is by the end of the path depends on how large it was at first,
// on how far the robot starts from where the hand means it. 3 mm are enough for
// the -9.7 J of an independent trial of the law, which does not say where it
// starts; 70 mm give twice as much; from the very place it has hardly begun
// when the hand lifts. The law is the same with and without the controllers.
TEST(TdpaTest, WithoutControllersTheLinkMakesEnergy) {
  struct Case {
    double clearance, least, most;  // m, J.
  };
  for (const Case& c :
       {Case{0, -20, -18}, Case{kClearance - 0.003, -10.2, -9.2},
        Case{kClearance, -0.3, -0.1}}) {
    Bench::Params params = MakeParams(TdpaObserver::kTwoPort, 0.15);
    params.clearance = c.clearance;
    const PathResult controlled = Follow(params);
    EXPECT_GT(controlled.least_of_all, -0.5) << Describe(controlled);
    EXPECT_GT(controlled.least_input, -0.5) << Describe(controlled);
    params.scheme.passivity_control = false;
    const PathResult observed = Follow(params);
    EXPECT_GT(observed.least_robot, c.least) << Describe(observed);
    EXPECT_LT(observed.least_robot, c.most) << Describe(observed);
    // Nothing of the scheme's own books, which count the loan of 0.05 J.
    EXPECT_NEAR(observed.least_input, observed.least_robot,
                0.3 + 0.1 * std::abs(observed.least_robot))
        << Describe(observed);
    EXPECT_EQ(observed.dissipated, 0);
    EXPECT_EQ(observed.saturated, 0);
  }
}

// Sizes are those of an independent trial of the same laws on such a bench: std
// .68 and 1.75 N with one_port, .16 and .45 N with energy_reflection, which
// stays within 1 mm of the hand. With the force's loop gain in contact, kappa s
// Ks / K = 1.1, nothing but damping keeps the delayed force from growing.
TEST(TdpaTest, ReflectionIsSteadierThanOnePort) {
  struct Case {
    double delay;
    double one_port_least, one_port_most, reflection_most;
  };
  for (const Case& c : {Case{0.05, 0.3, 1.0, 0.3}, Case{0.15, 0.9, 2.2, 0.7}}) {
    const PathResult one_port =
        Follow(MakeParams(TdpaObserver::kOnePort, c.delay));
    const PathResult reflection =
        Follow(MakeParams(TdpaObserver::kEnergyReflection, c.delay));
    EXPECT_GT(one_port.force_std, c.one_port_least) << Describe(one_port);
    EXPECT_LT(one_port.force_std, c.one_port_most) << Describe(one_port);
    EXPECT_LT(reflection.force_std, c.reflection_most) << Describe(reflection);
    EXPECT_LT(reflection.force_std, one_port.force_std / 2);
    EXPECT_NEAR(reflection.force_mean, 4.99, 0.05);
    EXPECT_LT(std::abs(reflection.offset), 1e-3) << Describe(reflection);
  }
}

// N: the standard deviation of the force on the hand in the last 8 s of a
// minute of contact.
double StdAfterAMinute(const Bench::Params& params) {
  Bench bench(params);
  while (bench.time() < 52) {
    const double time = std::min(bench.time(), kLift);
    bench.set_hand({0, 0, IntendedHeight(time) / Bench::kScale});
    bench.Step();
  }
  return bench.MeanAndStd(8, [&] { return bench.device_force().z(); }).second;
}

// At 350 ms that trial has 3.84 N with one_port and .77 N with reflection. Here
// the path ends before either is steady, and reflection, which disturbs more at
// first, swings more then (1.8 and 1.1 N): with the loop gain of 1.1 both grow
// to the same limit cycle, as 27 N s/m are too little. With 100 N s/m, the
// other device of those laws, the order is the trial's, and both come to rest;
// and likewise, whatever the device can do, where the loop gain is below one.
TEST(TdpaTest, At350MsTheDevicesDampingDecides) {
  const auto params = [](TdpaObserver observer, double force_scale,
                         double damping) {
    Bench::Params result = MakeParams(observer, 0.35);
    result.scheme.force_scale = force_scale;
    result.scheme.max_device_damping = damping;
    return result;
  };
  for (const TdpaObserver observer :
       {TdpaObserver::kOnePort, TdpaObserver::kEnergyReflection}) {
    const double std = StdAfterAMinute(params(observer, 0.6, 27));
    EXPECT_GT(std, 3.5) << EnumToString(observer);
    EXPECT_LT(std, 5) << EnumToString(observer);
    EXPECT_LT(StdAfterAMinute(params(observer, 0.6, 100)), 0.2);
    EXPECT_LT(StdAfterAMinute(params(observer, 0.5, 27)), 0.05);
  }
  EXPECT_LT(Follow(params(TdpaObserver::kEnergyReflection, 0.6, 100)).force_std,
            Follow(params(TdpaObserver::kOnePort, 0.6, 100)).force_std);
}

// What the paper and others criticise in it: with delay the robot is held back,
// stays off when there is no energy to bring it back, and does not press.
TEST(TdpaTest, TwoPortIsConservative) {
  const PathResult little = Follow(MakeParams(TdpaObserver::kTwoPort, 0.05));
  EXPECT_LT(little.force_std, 0.2) << Describe(little);
  EXPECT_LT(little.offset, -0.01) << Describe(little);
  const PathResult much = Follow(MakeParams(TdpaObserver::kTwoPort, 0.35));
  EXPECT_LT(much.force_mean, 2.5) << Describe(much);
}

// --- The haptic half ---------------------------------------------------------

Message Force(std::int64_t sequence, double send_time, const Vector3d& force,
              double energy) {
  return ToMessage(TdpaForceMessage{.sequence = sequence,
                                    .send_time = send_time,
                                    .force = force,
                                    .energy = energy});
}

// A haptic half whose device moves as it is told, under whatever wrench it is
// said to have sent.
class HapticHalfTest : public ::testing::Test {
 protected:
  explicit HapticHalfTest(const TdpaParams& params = MakeParams())
      : dut_({}, params), scale_(WorkspaceMapParams().scale) {}

  static TdpaParams MakeParams() {
    return {.observer = TdpaObserver::kTwoPort,
            .initial_energy = 0.01,
            .force_scale = 0.5,
            .actuation_delay = 0};
  }

  // One period, with a message when there is one; then the device is said to
  // have sent `share` of the command.
  void Step(double share = 1) {
    const double time = kPeriod * tick_++;
    dut_.Update(time, input_, &state_);
    input_.device_wrench.head<3>() = share * force();
  }
  void Send(const Vector3d& force, double energy) {
    input_.message = Force(sequence_++, kPeriod * tick_, force, energy);
  }
  Vector3d force() const { return state_.output.setpoint.reference_force; }
  const DevicePassivityState& passivity() const { return state_.passivity; }

  TdpaHapticHalf dut_;
  double scale_;
  TdpaHapticHalfState state_{dut_.MakeState()};
  HapticHalfInput input_;
  int tick_{0};
  std::int64_t sequence_{0};
};

// What an observer has to count is what acted on the way that was gone, however
// the velocity is filtered and the force cut off.
TEST_F(HapticHalfTest, EnergyIsThatOfWhatActedOverWhatMoved) {
  Send({2, 0, 0}, 0);
  input_.device_velocity(0) = -0.3;  // Not so.
  Step(0.5);
  EXPECT_EQ(force(), Vector3d(-1, 0, 0));
  input_.X_DH.p = {0.002, 0.7, 0};
  Step();
  EXPECT_NEAR(passivity().input, 0.5 * 2 * scale_ * 0.002, 1e-15);
  EXPECT_NEAR(passivity().balance, 0.01, 1e-15);
  input_.X_DH.p.x() = 0.001;
  Step();
  EXPECT_NEAR(passivity().input, 0.5 * 2 * scale_ * 0.002, 1e-15);
  EXPECT_NEAR(passivity().balance, 0.01 - 2 * scale_ * 0.001, 1e-15);
}

TEST_F(HapticHalfTest, InjectsWhatIsMissingUpToWhatTheDeviceCan) {
  Send({2, 0, 0}, 0);
  Step();
  input_.X_DH.p.x() = -0.0021;  // 10.5 mJ: 0.5 mJ too much.
  input_.device_velocity(0) = -0.2;
  Step();
  const double v = scale_ * 0.2;
  const double alpha = 0.0005 / (kPeriod * v * v);
  EXPECT_NEAR(force().x(), -0.5 * (2 - alpha * v), 1e-12);
  EXPECT_NEAR(passivity().balance, 0, 1e-15);
  EXPECT_EQ(passivity().saturated, 0);
  // It moves on as that velocity says, so what was promised is taken. What
  // leaves meanwhile is not: slower than 2 mm/s nothing can be injected.
  input_.X_DH.p.x() -= 0.2 * kPeriod;
  input_.device_velocity(0) = -0.0007;
  Step();
  EXPECT_NEAR(passivity().dissipated, 0.0005, 1e-15);
  EXPECT_EQ(passivity().saturated, 1);
  EXPECT_NEAR(passivity().balance, -2 * v * kPeriod, 1e-15);
  EXPECT_NEAR(force().x(), -1, 1e-12);
  // Far more is missing than the device can damp in a period.
  input_.X_DH.p.x() = -0.02;
  input_.device_velocity(0) = -0.2;
  Step();
  EXPECT_EQ(passivity().saturated, 2);
  EXPECT_LT(passivity().balance, -0.01);
  EXPECT_NEAR(force().x(), -1 + 27 * 0.2, 1e-12);
}

TEST_F(HapticHalfTest, DampingThatDidNotActIsNotCounted) {
  Send({2, 0, 0}, 0);
  Step();
  input_.X_DH.p.x() = -0.0021;
  input_.device_velocity(0) = -0.2;
  Step(0.25);  // The device's limits cut off three quarters.
  EXPECT_NEAR(passivity().balance, 0, 1e-15);
  input_.X_DH.p.x() -= 0.2 * kPeriod;
  input_.device_velocity(0) = 0;
  Step();
  EXPECT_NEAR(passivity().dissipated, 0.25 * 0.0005, 1e-15);
  const double out = 0.25 * 2 * scale_ * 0.2 * kPeriod;
  EXPECT_NEAR(passivity().balance, -0.75 * 0.0005 - out, 1e-15);
}

// The energy that damping takes from the hand is not there for the robot.
TEST_F(HapticHalfTest, WhatDampingTakesDoesNotComeIn) {
  Send({2, 0, 0}, 0);
  Step();
  input_.X_DH.p.x() = -0.02;
  input_.device_velocity(0) = 0.2;
  Step();
  ASSERT_LT(force().x(), -1 - 27 * 0.19);
  const double before = passivity().input;
  input_.X_DH.p.x() += 0.2 * kPeriod;
  Step();
  EXPECT_NEAR(passivity().input - before, 2 * scale_ * 0.2 * kPeriod, 1e-12);
}

TEST_F(HapticHalfTest, StartsAnewWithoutALinkAndLetsGoAtItsRate) {
  Send({2, 0, 0}, 0.5);
  Step();
  input_.X_DH.p.x() = -0.01;
  Step();
  EXPECT_NEAR(passivity().balance, 0.01 - 2 * scale_ * 0.01, 1e-12);
  while (state_.link.status == LinkStatus::kConnected) Step();
  EXPECT_NEAR(passivity().balance, 0.01, 1e-12);
  EXPECT_NEAR(force().x(), -1 + 20 * kPeriod, 1e-12);
  for (int i = 0; i < 50; ++i) Step();
  EXPECT_LT(force().norm(), 1e-12);
  // What the other side granted before does not count, what it grants from now
  // on does.
  Send({2, 0, 0}, 0.7);
  Step();
  EXPECT_NEAR(passivity().balance, 0.01, 1e-12);
  Send({2, 0, 0}, 0.72);
  Step();
  EXPECT_NEAR(passivity().balance, 0.03, 1e-12);
}

TEST_F(HapticHalfTest, NotFiniteIsCountedAndTheForceGoes) {
  Send({2, 0, 0}, 0);
  Step();
  input_.device_velocity(1) = kNan;
  Step();
  EXPECT_EQ(state_.output.bad_inputs, 1);
  EXPECT_NEAR(force().x(), -1 + 20 * kPeriod, 1e-12);
  input_.device_velocity(1) = 0;
  input_.device_wrench(4) = kNan;
  Step();
  EXPECT_EQ(state_.output.bad_inputs, 2);
  EXPECT_NEAR(force().x(), -1 + 2 * 20 * kPeriod, 1e-12);
  input_.device_wrench(4) = 0;
  Step();
  EXPECT_EQ(force(), Vector3d(-1, 0, 0));
  EXPECT_NEAR(passivity().balance, 0.01, 1e-12);
}

class LateHapticHalfTest : public HapticHalfTest {
 protected:
  LateHapticHalfTest() : HapticHalfTest(MakeLate()) {}

  static TdpaParams MakeLate() {
    TdpaParams params = MakeParams();
    params.actuation_delay = 1;
    return params;
  }
};

TEST_F(LateHapticHalfTest, AForceCountsWhereItActs) {
  Send({2, 0, 0}, 0);
  Step();
  input_.X_DH.p.x() = 0.001;  // Before the 2 N begin.
  Step();
  EXPECT_EQ(passivity().input, 0);
  Send({6, 0, 0}, 0);
  input_.X_DH.p.x() = 0.002;  // Under 2 N.
  Step();
  EXPECT_NEAR(passivity().input, 2 * scale_ * 0.001, 1e-15);
  input_.X_DH.p.x() = 0.003;  // Still.
  Step();
  EXPECT_NEAR(passivity().input, 4 * scale_ * 0.001, 1e-15);
  input_.X_DH.p.x() = 0.004;  // Under 6 N.
  Step();
  EXPECT_NEAR(passivity().input, 10 * scale_ * 0.001, 1e-15);
}

// A lack that is being made up for is not made up for twice.
TEST_F(LateHapticHalfTest, InjectsOnceWhileTheDeviceIsLate) {
  Send({2, 0, 0}, 0);
  Step();
  Step();
  input_.X_DH.p.x() = -0.0021;
  input_.device_velocity(0) = -0.2;
  Step();
  EXPECT_GT(force().x(), -0.9);
  Step();
  EXPECT_NEAR(force().x(), -1, 1e-12);
}

// --- The robot half ----------------------------------------------------------

class RobotHalfTest : public ::testing::TestWithParam<TdpaObserver> {
 protected:
  RobotHalfTest() { input_.X_BE.p = kPlace; }

  void Step() { dut_.Update(kPeriod * tick_++, input_, &state_); }
  void Send(const Vector3d& p, double energy) {
    input_.message = ToMessage(TdpaMotionMessage{.sequence = sequence_++,
                                                 .send_time = kPeriod * tick_,
                                                 .pose = {.p = p},
                                                 .energy = energy});
  }
  TdpaForceMessage sent() const {
    return FromMessage<TdpaForceMessage>(state_.output.message);
  }
  const Vector3d& force() const {
    return state_.output.setpoint.reference_force;
  }

  const Vector3d kPlace{0.4, 0, 0.2};
  TdpaParams params_{.observer = GetParam()};
  TdpaRobotHalf dut_{{}, params_};
  TdpaRobotHalfState state_{dut_.MakeState()};
  RobotHalfInput input_;
  int tick_{0};
  std::int64_t sequence_{0};
};

INSTANTIATE_TEST_SUITE_P(Tdpa, RobotHalfTest, ::testing::ValuesIn(kObservers),
                         [](const auto& info) {
                           return std::string(EnumToString(info.param));
                         });

TEST_P(RobotHalfTest, HoldsItsPlaceThenGoesThereAndObservesFromThereOn) {
  input_.v_BE(1) = 0.1;
  Step();
  EXPECT_NEAR(force().y(), GetParam() == TdpaObserver::kOnePort ? -8.8 : -9.3,
              1e-12);
  EXPECT_EQ(state_.output.setpoint.force_selection, Matrix3d::Identity());
  EXPECT_FALSE(state_.output.setpoint.force_feedback);
  input_.v_BE.setZero();
  const Vector3d goal = kPlace + Vector3d(0.03, 0, 0);
  while (!state_.follower.following) {
    Send(goal, 0.1 * tick_);
    Step();
    EXPECT_EQ(state_.granted, 0);
  }
  EXPECT_NEAR(tick_ * kPeriod, 0.03 / 0.2, 0.003);
  EXPECT_NEAR(force().x(), 0.03 * params_.robot_stiffness, 0.01);
  if (GetParam() != TdpaObserver::kOnePort) {
    EXPECT_NEAR(state_.balance, params_.initial_energy, 1e-9);
  }
  // A sensor that is not ready holds it where it is, and it starts anew.
  input_.sensor_ready = false;
  Step();
  EXPECT_EQ(force(), Vector3d::Zero());
  EXPECT_EQ(state_.balance, params_.initial_energy);
  EXPECT_FALSE(state_.observing);
}

TEST_P(RobotHalfTest, NoForceIsLargerThanAllowed) {
  Send(kPlace, 0);
  Step();
  for (int i = 0; i < 100; ++i) {
    Send(kPlace + Vector3d(1, 0, 0), 100);
    input_.v_BE(0) = -2 + 0.04 * i;
    Step();
    EXPECT_LE(force().norm(), params_.max_robot_force + 1e-9);
  }
}

TEST_P(RobotHalfTest, NotFiniteGivesNoForceAndIsCounted) {
  input_.v_BE(0) = 0.1;
  Step();
  ASSERT_LT(force().x(), -1);
  input_.v_BE(0) = kNan;
  Step();
  EXPECT_EQ(force(), Vector3d::Zero());
  EXPECT_EQ(state_.output.bad_inputs, 1);
}

// The robot's spring is stretched no further than there is energy for.
TEST(TdpaRobotHalfTest, TwoPortHoldsThePlaceBackForLackOfEnergy) {
  const TdpaParams params{.observer = TdpaObserver::kTwoPort,
                          .initial_energy = 0.03,
                          .coupling_damping = 0};
  const TdpaRobotHalf dut({}, params);
  TdpaRobotHalfState state = dut.MakeState();
  RobotHalfInput input;
  input.X_BE.p = {0.4, 0, 0.2};
  for (int i = 0; i < 400; ++i) {
    const double x = 0.4 + 0.03 * std::min(1.0, i / 20 / 10.0);
    input.message =
        ToMessage(TdpaMotionMessage{.sequence = i / 20,
                                    .send_time = kPeriod * (i / 20 * 20),
                                    .pose = {.p = {x, 0, 0.2}}});
    dut.Update(kPeriod * i, input, &state);
  }
  const double stretch = state.target.x() - 0.4;
  EXPECT_NEAR(0.5 * params.robot_stiffness * stretch * stretch, 0.03, 0.002);
  EXPECT_NEAR(state.reference.x(), 0.43, 1e-12);
  EXPECT_NEAR(state.balance, 0, 1e-9);
  EXPECT_GT(state.dissipated, 0.05);
}

TEST(TdpaRobotHalfTest, ReflectionDampsWhatIsNotThereAndOwesTheRest) {
  const TdpaParams params{.observer = TdpaObserver::kEnergyReflection,
                          .initial_energy = 0,
                          .coupling_damping = 0};
  const TdpaRobotHalf dut({}, params);
  TdpaRobotHalfState state = dut.MakeState();
  RobotHalfInput input;
  input.X_BE.p = {0.4, 0, 0.2};
  input.message =
      ToMessage(TdpaMotionMessage{.sequence = 0, .pose = {.p = input.X_BE.p}});
  dut.Update(0, input, &state);
  ASSERT_TRUE(state.observing);
  // 8.8 N over 0.1 m/s: all of it is damped.
  input.X_BE.p.x() -= 0.02;
  input.v_BE(0) = 0.1;
  dut.Update(kPeriod, input, &state);
  const double force = 0.02 * params.robot_stiffness;
  EXPECT_NEAR(state.output.setpoint.reference_force.x(),
              -0.1 * params.robot_damping, 1e-12);
  EXPECT_NEAR(state.dissipated, force * 0.1 * kPeriod, 1e-15);
  EXPECT_NEAR(state.balance, 0, 1e-15);
  EXPECT_EQ(state.saturated, 0);
  // So slow that it would take more damping than is stable.
  input.v_BE(0) = 0.001;
  dut.Update(2 * kPeriod, input, &state);
  EXPECT_EQ(state.saturated, 1);
  EXPECT_NEAR(state.balance,
              -(force - TdpaRobotHalf::kMaxDamping * 0.001) * 0.001 * kPeriod,
              1e-15);
}

TEST(TdpaMessageTest, TakesTheSameNumbersBackAndRefusesWhatIsNotFinite) {
  TdpaMotionMessage motion{
      .sequence = 3, .send_time = 0.5, .pose = {.p = {1, 2, 3}}, .energy = 4};
  const auto read = FromMessage<TdpaMotionMessage>(ToMessage(motion));
  EXPECT_EQ(read.pose.p, motion.pose.p);
  EXPECT_EQ(read.pose.R, motion.pose.R);
  EXPECT_EQ(read.energy, 4);
  EXPECT_TRUE(IsValid(read));
  motion.energy = kNan;
  EXPECT_FALSE(IsValid(motion));
  const auto force = FromMessage<TdpaForceMessage>(Force(3, 0.5, {1, 2, 3}, 4));
  EXPECT_EQ(force.force, Vector3d(1, 2, 3));
  EXPECT_EQ(force.energy, 4);
  EXPECT_TRUE(IsValid(force));
  EXPECT_FALSE(IsValid(FromMessage<TdpaForceMessage>(ToMessage(motion))));
}

TEST(TdpaParamsTest, ErrorsNameFieldRangeAndValue) {
  TdpaParams params;
  params.actuation_delay = 8;
  EXPECT_EQ(ValidationError(params),
            "TdpaParams: field `actuation_delay` expected a number in [0, 7], "
            "got 8");
  EXPECT_THROW(TdpaRobotHalf({}, params), std::invalid_argument);
  params = {};
  params.force_scale = 0;
  EXPECT_THROW(TdpaHapticHalf({}, params), std::invalid_argument);
}

}  // namespace
}  // namespace dual_proxy
