// SPDX-License-Identifier: BSD-3-Clause
// What a line of waves is: passive, a spring in contact, a mass in free motion.
#include "dual_proxy/schemes/wave_variables/scheme.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>

#include <gtest/gtest.h>

#include "no_alloc.h"
#include "textbook_bench.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kDepth = 0.04;  // m: of where the hand means to be.
constexpr double kHandStiffness = 600;
using Bench = TextbookBench<WaveVariablesScheme>;

Bench::Params MakeBenchParams(double delay) {
  Bench::Params params;
  params.channel.delay = delay;
  params.hand_stiffness = kHandStiffness;
  return params;
}

Bench::Params MakeContactParams(double delay) {
  Bench::Params params = MakeBenchParams(delay);
  params.wall_stiffness = 3e4;
  params.hand.z() = -kDepth / Bench::kScale;
  return params;
}

// s: a message's interval, and how late the low-pass is.
double Lag(const WaveVariablesParams& scheme) {
  const double low_pass = scheme.wave_cutoff > 0
                              ? 1 / (2 * std::numbers::pi * scheme.wave_cutoff)
                              : 0;
  return Bench::kInterval + low_pass;
}

// A line that is as long as the delay is a spring of b / delay, in a row with
// that of the hand, 600 / scale N/m in the robot's scale, and with the robot's.
double ExpectedForce(const Bench::Params& params) {
  const WaveVariablesParams& scheme = params.scheme;
  return kDepth /
         (Bench::kScale / kHandStiffness + 1 / scheme.robot_stiffness +
          (params.channel.delay + Lag(scheme)) / scheme.wave_impedance);
}

struct DelayAndForce {
  double delay;  // s.
  double force;  // N.
};

class ContactTest : public ::testing::TestWithParam<DelayAndForce> {};

INSTANTIATE_TEST_SUITE_P(WaveVariables, ContactTest,
                         ::testing::Values(DelayAndForce{0.05, 4.88},
                                           DelayAndForce{0.15, 3.74},
                                           DelayAndForce{0.35, 2.55}));

TEST_P(ContactTest, IsASpring) {
  for (const double cutoff : {0.0, 20.0}) {
    Bench::Params params = MakeContactParams(GetParam().delay);
    params.scheme.wave_cutoff = cutoff;
    const double expected = ExpectedForce(params);
    if (cutoff == 0) {
      ASSERT_NEAR(expected, GetParam().force, 0.005);
    }
    Bench bench(params);
    bench.AdvanceTo(30);
    EXPECT_TRUE(bench.connected());
    for (const bool at_wall : {true, false}) {
      const auto [mean, std] = bench.MeanAndStd(2, [&] {
        return at_wall ? bench.wall_force() : bench.device_force().z();
      });
      EXPECT_NEAR(mean, expected, 0.01 * expected);
      EXPECT_LT(std, 0.01);
    }
  }
}

// Why there is a low-pass by default, and what it costs of the force that the
// line would give without it.
TEST_P(ContactTest, LowPassSparesTheHandStepsForALittleForce) {
  // N: the largest step at the hand in 1 ms, as it brings the robot down at 30
  // mm/s.
  const auto largest_step = [](Bench::Params params) {
    params.clearance = 0.02;
    params.hand.z() = params.handle.z() = params.clearance / Bench::kScale;
    Bench bench(params);
    double largest = 0;
    while (bench.time() < 6) {
      const double way = 0.03 * std::clamp(bench.time() - 1, 0.0, 2.0);
      bench.set_hand({0, 0, (params.clearance - way) / Bench::kScale});
      const double before = bench.device_force().z();
      bench.Step();
      largest = std::max(largest, std::abs(bench.device_force().z() - before));
    }
    EXPECT_TRUE(bench.connected());
    return largest;
  };
  Bench::Params params = MakeContactParams(GetParam().delay);
  EXPECT_LT(largest_step(params), 0.4);
  Bench bench(params);
  bench.AdvanceTo(30);
  EXPECT_NEAR(bench.wall_force(), GetParam().force, 0.025 * GetParam().force);
  params.scheme.wave_cutoff = 0;
  EXPECT_GT(largest_step(params), 2);
}

// Late and lost messages cost next to nothing.
TEST_P(ContactTest, RemainsOverABadLink) {
  for (const auto& [loss, jitter, tolerance] :
       {std::tuple{0.1, 0.0, 0.01}, std::tuple{0.2, 0.005, 0.03}}) {
    Bench::Params params = MakeContactParams(GetParam().delay);
    params.channel.loss = loss;
    params.channel.jitter = jitter;
    Bench bench(params);
    bench.AdvanceTo(40);
    const double expected = ExpectedForce(params);
    const auto [mean, std] =
        bench.MeanAndStd(2, [&] { return bench.wall_force(); });
    EXPECT_NEAR(mean, expected, tolerance * expected) << loss;
  }
}

// Why they are not made good at once.
TEST(WaveVariablesTest, HealingAtOnceWastesTheEnergyOfASteadyForce) {
  Bench::Params params = MakeContactParams(0.05);
  params.channel.loss = 0.2;
  params.scheme.healing_time = 0;
  Bench bench(params);
  bench.AdvanceTo(40);
  EXPECT_LT(bench.wall_force(), 0.1 * ExpectedForce(params));
}

// J: the least, over a run in which the hand goes to and fro and to the wall,
// of what was sent and not yet played of both waves.
double LeastEnergyUnderWay(const Bench::Params& params) {
  Bench bench(params);
  double least = 0;
  while (bench.time() < 30) {
    const double phase = 2 * std::numbers::pi * bench.time();
    bench.set_hand(
        {0.02 * std::sin(0.3 * phase), 0, 0.016 * std::sin(0.17 * phase)});
    bench.Step();
    const WavePlayerState& u = bench.robot().player;
    const WavePlayerState& w = bench.haptic().player;
    least = std::min({least, bench.haptic().sent.energy - u.played.energy,
                      bench.robot().sent.energy - w.played.energy});
  }
  EXPECT_GT(bench.haptic().sent.energy, 1);
  return least;
}

TEST(WaveVariablesTest, PlaysNoMoreEnergyThanWasSent) {
  for (const double delay : {0.0, 0.05, 0.35}) {
    Bench::Params params = MakeContactParams(delay);
    EXPECT_GE(LeastEnergyUnderWay(params), -1e-12) << delay;
    params.channel.loss = 0.5;
    for (const double healing_time : {0.0, 0.5}) {
      params.scheme.healing_time = healing_time;
      const double least = LeastEnergyUnderWay(params);
      EXPECT_GE(least, -params.scheme.energy_reserve) << delay;
    }
  }
}

// J: of the hand, which pushes, lets the force's scale change while it rests on
// the wall, and goes back.
struct HandEnergy {
  double put_in{0};   // By the force that acts.
  double counted{0};  // The same in the aids' books.
};

HandEnergy ChangeScaleInContact(double scale, double max_damping) {
  Bench::Params params = MakeContactParams(0);
  params.hand.setZero();
  params.aids.buttons = true;
  params.aids.max_damping = max_damping;
  Bench bench(params);
  HandEnergy result;
  while (bench.time() < 10.5) {
    const double time = bench.time();
    const double in = std::clamp(time / 5, 0.0, 1.0);
    const double out = std::clamp((time - 10) / 0.2, 0.0, 1.0);
    bench.set_hand({0, 0, -kDepth / Bench::kScale * (in - out)});
    if (time > 7) bench.set_force_scale(scale);
    const Vector3d handle = bench.handle();
    bench.Step();
    result.counted = bench.aids().hand_energy;
    result.put_in -= bench.device_force().dot(bench.handle() - handle);
  }
  return result;
}

// Of what it gets back by a force that has grown meanwhile, as far as damping
// can take it on the way.
TEST(WaveVariablesTest, HandPaysForAForceScaleThatGrowsInContact) {
  const HandEnergy free = ChangeScaleInContact(2, 0);
  const HandEnergy paid = ChangeScaleInContact(2, 27);
  EXPECT_LT(free.put_in, -3e-3);
  EXPECT_NEAR(free.counted, free.put_in, 1e-5);
  EXPECT_GT(paid.put_in, 0.85 * free.put_in);
  EXPECT_NEAR(paid.counted, paid.put_in, 1e-5);
  for (const double scale : {1.0, 0.2}) {
    EXPECT_GT(ChangeScaleInContact(scale, 0).put_in, 0);
  }
}

// kg: what the hand feels of a mass of 4.4 kg in slow motion.
double FeltMass(double delay, double cutoff, bool encoders, double rate) {
  Bench::Params params = MakeBenchParams(delay);
  params.scheme.wave_impedance = 20;
  params.scheme.robot_damping = 88;
  params.scheme.wave_cutoff = cutoff;
  params.encoders = encoders;
  Bench bench(params);
  double force_times_position = 0;
  double position_squared = 0;
  while (bench.time() < 30) {
    const Vector3d& x_h = bench.handle();
    const double x = Bench::kScale * x_h.x();
    bench.set_hand({0.02 * std::sin(rate * bench.time()), 0, 0});
    bench.Step();
    if (bench.time() < 10) continue;
    force_times_position -= bench.device_force().x() * x;
    position_squared += x * x;
  }
  return -force_times_position / position_squared / (rate * rate);
}

// A line with a mass at its end; for slow motion that is m + b T.
double ExpectedMass(double lag, double rate) {
  constexpr double b = 20;
  const double inertia = rate * Bench::kMass;
  const double tangent = b * std::tan(rate * lag);
  return b * (inertia + tangent) / (b - inertia * tangent / b) / rate;
}

TEST(WaveVariablesTest, FreeMotionIsAMass) {
  const double rate = 2 * std::numbers::pi * 0.2;
  for (const auto& [delay, slow] :
       {std::pair{0.0, 4.8}, std::pair{0.05, 5.8}, std::pair{0.15, 7.8}}) {
    WaveVariablesParams scheme;
    for (const double cutoff : {0.0, 20.0}) {
      scheme.wave_cutoff = cutoff;
      const double lag = delay + Lag(scheme);
      const double expected = ExpectedMass(lag, rate);
      for (const bool encoders : {false, true}) {
        const double mass = FeltMass(delay, cutoff, encoders, rate);
        EXPECT_NEAR(mass, expected, 0.02 * expected);
        if (cutoff == 0) {
          EXPECT_NEAR(mass, slow, 0.08 * slow);
        }
      }
    }
  }
}

// --- The player --------------------------------------------------------------

constexpr double kPeriod = 0.001;
constexpr double kReserve = 0.05;  // J.

WavePlayer MakePlayer(double healing_time = 0.5) {
  return WavePlayer({.interval = 0.02,
                     .period = kPeriod,
                     .reserve = kReserve,
                     .healing_time = healing_time,
                     .cutoff = 0});
}

// sqrt(W): what is played in each of `count` periods.
std::pair<Vector3d, Vector3d> PlayFirstAndLast(const WavePlayer& dut, int count,
                                               WavePlayerState* state) {
  const Vector3d first = dut.Play(state);
  for (int i = 2; i < count; ++i) dut.Play(state);
  return {first, dut.Play(state)};
}

TEST(WavePlayerTest, PlaysTheMeanOfWhatCameSinceItsFirstMessage) {
  const WavePlayer dut = MakePlayer();
  WavePlayerState state = dut.MakeState();
  EXPECT_EQ(dut.Play(&state), Vector3d::Zero());
  WaveSums sums{.wave = {100, -50, 3}, .energy = 1000};
  dut.Receive(sums, 7, &state);
  EXPECT_EQ(dut.Play(&state), Vector3d::Zero());
  state = dut.MakeState();
  dut.Receive(sums, 7, &state);
  for (int i = 0; i < 20; ++i) sums.Add({i < 10 ? 2.0 : 4.0, 0, -1}, kPeriod);
  dut.Receive(sums, 7.02, &state);
  const auto [first, last] = PlayFirstAndLast(dut, 20, &state);
  EXPECT_LT((first - Vector3d(3, 0, -1)).norm(), 1e-9);
  EXPECT_LT((last - Vector3d(3, 0, -1)).norm(), 1e-9);
  EXPECT_LT((state.played.wave - sums.wave).norm(), 1e-9);
  EXPECT_LT(state.played.energy, sums.energy);
}

TEST(WavePlayerTest, MakesGoodWhatWasLostInItsTime) {
  for (const double healing_time : {0.02, 0.2}) {
    const WavePlayer dut = MakePlayer(healing_time);
    WavePlayerState state = dut.MakeState();
    WaveSums sums;
    dut.Receive(sums, 0, &state);
    PlayFirstAndLast(dut, 20, &state);
    // Two messages are lost, and the energy of a wave that is no more remains.
    for (int i = 0; i < 40; ++i) sums.Add({2, 0, 0}, kPeriod);
    for (int i = 0; i < 20; ++i) sums.Add({-1, 0, 0}, kPeriod);
    PlayFirstAndLast(dut, 40, &state);
    dut.Receive(sums, 0.06, &state);
    const double mean = 0.06 / 0.06;
    const double missing = 0.06 - 0.02 * mean;
    EXPECT_NEAR(dut.Play(&state).x(), mean + missing / healing_time, 1e-9);
    PlayFirstAndLast(dut, 19, &state);
    double time = 0.06;
    for (int i = 0; i < 3 * healing_time / 0.02; ++i) {
      time += 0.02;
      dut.Receive(sums, time, &state);
      PlayFirstAndLast(dut, 20, &state);
    }
    EXPECT_NEAR(state.played.wave.x(), sums.wave.x(), 0.06 * missing);
  }
}

TEST(WavePlayerTest, HoldsALateWaveWhileThereIsEnergy) {
  const WavePlayer dut = MakePlayer();
  WavePlayerState state = dut.MakeState();
  WaveSums sums;
  dut.Receive(sums, 0, &state);
  for (int i = 0; i < 20; ++i) sums.Add({2, 0, 0}, kPeriod);
  dut.Receive(sums, 0.02, &state);
  // At 2 W the reserve lasts for 25 periods more than the 20.
  const auto [first, last] = PlayFirstAndLast(dut, 44, &state);
  EXPECT_NEAR(first.x(), 2, 1e-9);
  EXPECT_NEAR(last.x(), 2, 1e-9);
  EXPECT_EQ(PlayFirstAndLast(dut, 3, &state).second, Vector3d::Zero());
  EXPECT_LE(state.played.energy, sums.energy + kReserve);
}

TEST(WavePlayerTest, WaveIsNoLargerThanItsEnergy) {
  const WavePlayer dut = MakePlayer();
  WavePlayerState state = dut.MakeState();
  dut.Receive({}, 0, &state);
  dut.Receive({.wave = {1e6, 0, 0}, .energy = 0.01}, 0.02, &state);
  const double most = std::sqrt(2 * (0.01 + kReserve) / 0.02);
  EXPECT_NEAR(dut.Play(&state).x(), most, 1e-9);
  // A sender that says that it has taken energy back.
  dut.Receive({.wave = {0, 0, 0}, .energy = 0}, 0.04, &state);
  for (int i = 0; i < 100; ++i) dut.Play(&state);
  EXPECT_LE(state.played.energy, 0.01 + kReserve + 1e-12);
}

// --- The halves --------------------------------------------------------------

template <typename Content>
Message At(std::int64_t sequence, double send_time, Content message) {
  message.sequence = sequence;
  message.send_time = send_time;
  return ToMessage(message);
}

TEST(WaveVariablesHapticHalfTest, IsTheLaw) {
  HapticHalfParams shared;
  shared.proxy.map.R_DB << 0, 1, 0, -1, 0, 0, 0, 0, 1;
  const Matrix3d& R_DB = shared.proxy.map.R_DB;
  WaveVariablesParams own;
  own.force_scale = 0.5;
  own.wave_cutoff = 0;
  const WaveVariablesHapticHalf dut(shared, own);
  WaveVariablesHapticHalfState state = dut.MakeState();
  HapticHalfInput input;
  input.X_DH.R = R_DB;
  input.device_velocity.head<3>() << 0.01, 0.02, -0.03;
  const double b = own.wave_impedance;
  const Vector3d v_d = shared.proxy.map.scale * R_DB.transpose() *
                       input.device_velocity.head<3>();
  // Before the first message there is no wave from the robot.
  dut.Update(0, input, &state);
  const Vector3d& force = state.output.setpoint.reference_force;
  EXPECT_LT((force + own.force_scale * b * (R_DB * v_d)).norm(), 1e-12);
  const auto sent = FromMessage<WaveToRobot>(state.output.message);
  EXPECT_LT((sent.sums.wave - std::sqrt(2 * b) * v_d * kPeriod).norm(), 1e-12);
  EXPECT_NEAR(sent.sums.energy, b * v_d.squaredNorm() * kPeriod, 1e-12);
  EXPECT_EQ(sent.orientation, R_DB.transpose() * R_DB * R_DB);
  const Vector3d w(0.1, -0.2, 0.3);
  WaveToDevice message;
  input.message = At(0, 0.001, message);
  dut.Update(0.001, input, &state);
  for (int i = 0; i < 20; ++i) message.sums.Add(w, kPeriod);
  input.message = At(1, 0.021, message);
  const WaveSums before = state.sent;
  dut.Update(0.021, input, &state);
  const Vector3d f_d = b * v_d - std::sqrt(2 * b) * w;
  EXPECT_LT((force + own.force_scale * (R_DB * f_d)).norm(), 1e-9);
  const Vector3d u = std::sqrt(2 * b) * v_d - w;
  EXPECT_LT((state.sent.wave - before.wave - kPeriod * u).norm(), 1e-12);
}

TEST(WaveVariablesHapticHalfTest, WithoutALinkTheForceGoesAtItsRate) {
  WaveVariablesParams own;
  own.wave_cutoff = 0;
  const WaveVariablesHapticHalf dut({}, own);
  WaveVariablesHapticHalfState state = dut.MakeState();
  const Vector3d& force = state.output.setpoint.reference_force;
  HapticHalfInput input;
  WaveToDevice message;
  input.message = At(0, 0, message);
  dut.Update(0, input, &state);
  for (int i = 0; i < 20; ++i) message.sums.Add({0.5, 0, 0}, kPeriod);
  input.message = At(1, 0.02, message);
  dut.Update(0.02, input, &state);
  const double start = force.x();
  EXPECT_NEAR(start, 0.5 * std::sqrt(80), 1e-9);
  input.X_DH.p.x() = kNan;  // Refused, and the force goes likewise.
  dut.Update(0.021, input, &state);
  EXPECT_NEAR(force.x(), start - 0.02, 1e-12);
  EXPECT_EQ(state.output.bad_inputs, 1);
  input.X_DH.p.x() = 0;
  input.device_velocity(0) = 0.1;
  const WaveSums sent = state.sent;
  for (int i = 0; i < 223; ++i) dut.Update(0.8 + 0.001 * i, input, &state);
  EXPECT_EQ(state.output.link.status, LinkStatus::kLost);
  EXPECT_LT(force.norm(), 1e-12);
  EXPECT_EQ(state.sent.wave, sent.wave);
  // What it missed is not played when the link is back.
  for (int i = 0; i < 1000; ++i) message.sums.Add({0.5, 0, 0}, kPeriod);
  input.device_velocity.setZero();
  input.message = At(2, 1.1, message);
  dut.Update(1.1, input, &state);
  EXPECT_EQ(state.output.link.status, LinkStatus::kConnected);
  EXPECT_LT(force.norm(), 1e-12);
}

TEST(WaveVariablesRobotHalfTest, IsTheLawWithinItsBounds) {
  RobotHalfParams shared;
  shared.proxy.workspace.shape = WorkspaceLimitsParams::Shape::kBox;
  shared.proxy.workspace.half_size.setConstant(0.1);
  WaveVariablesParams own;
  own.wave_cutoff = 0;
  own.max_robot_force = 15;
  const double b = own.wave_impedance;
  const double root = std::sqrt(2 * b);
  const WaveVariablesRobotHalf dut(shared, own);
  WaveVariablesRobotHalfState state = dut.MakeState();
  RobotHalfInput input;
  input.X_BE.p = {0.06, 0, 0.02};
  WaveToRobot message;
  input.message = At(0, 0, message);
  dut.Update(0, input, &state);
  const Vector3d u(3, -0.2, 0.1);
  double supplied = 0;  // J: by the line, and what of it the robot has.
  double absorbed = 0;
  bool bounded = false;
  for (int i = 1; i < 4000; ++i) {
    if (i % 20 == 0) {
      for (int j = 0; j < 20; ++j) message.sums.Add(u, kPeriod);
      input.message = At(i / 20, kPeriod * i, message);
    }
    const WaveSums before = state.sent;
    const Vector3d x_before = state.target;
    dut.Update(kPeriod * i, input, &state);
    const Vector3d w = (state.sent.wave - before.wave) / kPeriod;
    const Vector3d v_sd = (state.target - x_before) / kPeriod;
    const Vector3d played = state.player.output;
    // Of a line, whatever is at its end.
    EXPECT_LT((root * v_sd - played - w).norm(), 1e-9);
    const Vector3d force = state.output.setpoint.reference_force;
    const Vector3d line_force = (root * played - b * v_sd);
    if (force.norm() < own.max_robot_force - 1e-6 && state.target.x() < 0.1) {
      EXPECT_LT((line_force - force).norm(), 1e-9);
      EXPECT_LT((w - (b * v_sd - force) / root).norm(), 1e-9);
    } else {
      bounded = true;
    }
    EXPECT_LE(force.norm(), own.max_robot_force + 1e-9);
    EXPECT_LE(state.target.x(), 0.1 + 1e-12);
    supplied += kPeriod * (played.squaredNorm() - w.squaredNorm()) / 2;
    absorbed += kPeriod * force.x() * input.v_BE(0);
    EXPECT_GE(supplied, absorbed - 1e-3);
    // It stands, is pushed back against the wave, and goes with it.
    input.v_BE(0) = i < 400 ? 0 : i < 2200 ? -0.1 : 0.1;
    input.X_BE.p.x() += kPeriod * input.v_BE(0);
  }
  EXPECT_TRUE(bounded);
}

TEST(WaveVariablesRobotHalfTest, HoldsItsPlaceAndStartsThereAnew) {
  const WaveVariablesParams own;
  const WaveVariablesRobotHalf dut({}, own);
  WaveVariablesRobotHalfState state = dut.MakeState();
  const Vector3d& force = state.output.setpoint.reference_force;
  RobotHalfInput input;
  input.X_BE.p = {0.4, 0, 0.2};
  dut.Update(0, input, &state);
  input.X_BE.p.x() = 0.41;
  input.v_BE(1) = 0.1;
  dut.Update(0.001, input, &state);
  EXPECT_LT((force - Vector3d(-4.4, -4, 0)).norm(), 1e-12);
  EXPECT_EQ(state.sent.energy, 0);
  // Of what the device did before the first message nothing counts.
  WaveToRobot message;
  message.sums = {.wave = {5, 0, 0}, .energy = 100};
  input.message = At(0, 0.002, message);
  input.v_BE.setZero();
  dut.Update(0.002, input, &state);
  EXPECT_EQ(state.mode, WaveVariablesRobotHalfState::Mode::kFollow);
  EXPECT_LT((state.target - input.X_BE.p).norm(), 1e-12);
  EXPECT_LT(force.norm(), 1e-12);
  EXPECT_FALSE(state.output.setpoint.force_feedback);
  EXPECT_EQ(state.output.setpoint.force_selection, Matrix3d::Identity());
  for (int i = 0; i < 20; ++i) message.sums.Add({1, 0, 0}, kPeriod);
  input.message = At(1, 0.022, message);
  for (int i = 0; i < 40; ++i) dut.Update(0.022 + 0.001 * i, input, &state);
  EXPECT_GT(force.x(), 1);
  // Lost: it holds where the robot is, and no wave goes out.
  input.X_BE.p.x() = 0.42;
  dut.Update(0.7, input, &state);
  EXPECT_EQ(state.output.link.status, LinkStatus::kLost);
  EXPECT_LT(force.norm(), 1e-12);
  EXPECT_EQ(state.target, input.X_BE.p);
  const double energy = state.sent.energy;
  dut.Update(0.701, input, &state);
  EXPECT_EQ(state.sent.energy, energy);
  // And so it does while the sensor is not ready.
  input.message = At(2, 0.702, message);
  input.sensor_ready = false;
  dut.Update(0.702, input, &state);
  EXPECT_EQ(state.mode, WaveVariablesRobotHalfState::Mode::kHold);
}

TEST(WaveVariablesRobotHalfTest, NotFiniteGivesNoForceAndIsCounted) {
  const WaveVariablesRobotHalf dut({}, {});
  WaveVariablesRobotHalfState state = dut.MakeState();
  RobotHalfInput input;
  input.v_BE(0) = 0.1;
  dut.Update(0, input, &state);
  ASSERT_LT(state.output.setpoint.reference_force.x(), -1);
  input.v_BE(0) = kNan;
  dut.Update(0.001, input, &state);
  EXPECT_EQ(state.output.setpoint.reference_force, Vector3d::Zero());
  EXPECT_EQ(state.output.bad_inputs, 1);
  input.v_BE(0) = 0;
  WaveToRobot message;
  message.sums.energy = -1;
  input.message = At(0, 0.002, message);
  dut.Update(0.002, input, &state);
  message = {};
  message.orientation(0, 0) = 2;
  input.message = At(1, 0.003, message);
  dut.Update(0.003, input, &state);
  EXPECT_EQ(state.output.link.bad_inputs, 2);
  EXPECT_EQ(state.output.link.status, LinkStatus::kWaiting);
}

TEST(WaveVariablesTest, DoesNotAllocate) {
  Bench bench(MakeContactParams(0.05));
  ScopedNoAlloc guard;
  bench.AdvanceTo(0.5);
  EXPECT_EQ(guard.count(), 0);
}

TEST(WaveVariablesParamsTest, ErrorsNameFieldRangeAndValue) {
  WaveVariablesParams params;
  params.wave_impedance = 0;
  EXPECT_EQ(ValidationError(params),
            "WaveVariablesParams: field `wave_impedance` expected a finite "
            "value > 0, got 0");
  EXPECT_THROW(WaveVariablesRobotHalf({}, params), std::invalid_argument);
  params = {};
  params.energy_reserve = -0.1;
  EXPECT_THROW(WaveVariablesHapticHalf({}, params), std::invalid_argument);
}

}  // namespace
}  // namespace dual_proxy
