// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/force_loop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "dual_proxy/common/random.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

const Matrix3d kAlongX{Vector3d::UnitX().asDiagonal()};
const Matrix3d kAlongZ{Vector3d::UnitZ().asDiagonal()};
const Matrix3d kZero = Matrix3d::Zero();

class ForceLoopTest : public ::testing::Test {
 protected:
  ForceLoopTest() {
    params_.passivity.enabled = false;
    params_.filter_cutoff = 0;
    params_.speed_limit = 1e9;
  }

  ForceLoopParams params_;
};

// Eq. (13), term by term.
TEST_F(ForceLoopTest, LawOfEquation13) {
  const ForceLoop dut(params_);
  ForceLoopState state = dut.MakeState();
  const Vector3d force =
      dut.Update(Vector3d(0, 0, 5), Vector3d(1, 2, 4), Vector3d(.3, .2, .1),
                 kAlongZ, kAlongZ, &state);
  EXPECT_EQ(force.x(), 0);
  EXPECT_EQ(force.y(), 0);
  EXPECT_NEAR(force.z(), 5 + 2.5 + 5.5 * 0.001 - 20 * 0.1, 1e-12);
}

// Against nothing the loop drives the tool to the speed limit at most, however
// large the force that it wants, with a period of delay and a force that
// changes only so fast, as the arm's.
TEST_F(ForceLoopTest, SpeedLimitHoldsAToolThatNothingStops) {
  params_.speed_limit = 0.1;
  for (const double mass : {1.0, 4.0, 7.0}) {
    for (const bool passivity : {false, true}) {
      params_.passivity.enabled = passivity;
      params_.passivity.initial_energy = 0;
      const ForceLoop dut(params_);
      ForceLoopState state = dut.MakeState();
      Vector3d velocity = Vector3d::Zero();
      Vector3d acting = Vector3d::Zero();
      for (int i = 0; i < 3000; ++i) {
        velocity += 0.001 / mass * acting;
        ASSERT_LT(velocity.norm(), params_.speed_limit) << i;
        // A phantom: the sensor says that the tool pulls.
        const Vector3d wanted =
            dut.Update(Vector3d(0, 0, 10), Vector3d(0, 0, -30), velocity,
                       kAlongZ, kAlongZ, &state);
        acting.z() += std::clamp(wanted.z() - acting.z(), -2.0, 2.0);
      }
      EXPECT_GT(velocity.norm(), 0.3 * params_.speed_limit);
    }
  }
}

TEST_F(ForceLoopTest, SpeedLimitOnlyTakesPower) {
  ForceLoopParams slow = params_;
  slow.speed_limit = 0.05;
  RandomStream random(5);
  const auto draw = [&random](double size) {
    return Vector3d(size * random.Normal(), size * random.Normal(),
                    size * random.Normal());
  };
  for (int i = 0; i < 1000; ++i) {
    const ForceLoop free(params_);
    const ForceLoop limited(slow);
    ForceLoopState a = free.MakeState();
    ForceLoopState b = limited.MakeState();
    const Vector3d reference = draw(5);
    const Vector3d sensed = draw(5);
    const Vector3d velocity = draw(0.05);
    const Matrix3d all = Matrix3d::Identity();
    const Vector3d change =
        limited.Update(reference, sensed, velocity, all, all, &b) -
        free.Update(reference, sensed, velocity, all, all, &a);
    EXPECT_LE(change.dot(velocity), 1e-12);
  }
}

TEST_F(ForceLoopTest, WithoutForceSpaceTheReferencePassesAlone) {
  const ForceLoop dut(params_);
  ForceLoopState state = dut.MakeState();
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(dut.Update(Vector3d(0, 0, 5), Vector3d(1, 2, 9),
                         Vector3d(.3, .2, .1), kZero, kZero, &state),
              Vector3d(0, 0, 5));
  }
  EXPECT_EQ(state.integral, Vector3d::Zero());
}

TEST_F(ForceLoopTest, IntegralIsBounded) {
  const ForceLoop dut(params_);
  ForceLoopState state = dut.MakeState();
  Vector3d force;
  for (int i = 0; i < 5000; ++i) {
    force = dut.Update(Vector3d(0, 0, 5), Vector3d::Zero(), Vector3d::Zero(),
                       kAlongZ, kAlongZ, &state);
  }
  EXPECT_NEAR(force.z(), 5 + 12.5 + 10, 1e-9);
}

// The bound on the integral's force follows its direction; what the new
// selection cuts off fades instead of stepping.
TEST_F(ForceLoopTest, IntegralIsProjectedAndReleasedWithoutAStep) {
  params_.gain = 0;
  const ForceLoop dut(params_);
  ForceLoopState state = dut.MakeState();
  const Vector3d reference = Vector3d::Zero();
  const Vector3d sensed(-4, 0, -4);
  const Matrix3d both = kAlongX + kAlongZ;
  Vector3d last;
  for (int i = 0; i < 300; ++i) {
    last = dut.Update(reference, sensed, Vector3d::Zero(), both, both, &state);
  }
  ASSERT_GT(last.x(), 5);
  for (int i = 0; i < 60; ++i) {
    const Vector3d force = dut.Update(reference, sensed, Vector3d::Zero(),
                                      kAlongZ, kAlongZ, &state);
    EXPECT_LT(std::abs(force.x() - last.x()), 0.11 * 10);
    EXPECT_GE(force.z(), last.z());
    last = force;
  }
  EXPECT_LT(std::abs(last.x()), 0.05);
  EXPECT_EQ(state.integral.x(), 0);
}

TEST_F(ForceLoopTest, IntegralIsResetWithoutForceSpace) {
  const ForceLoop dut(params_);
  ForceLoopState state = dut.MakeState();
  for (int i = 0; i < 100; ++i) {
    dut.Update(Vector3d(0, 0, 5), Vector3d::Zero(), Vector3d::Zero(), kAlongZ,
               kAlongZ, &state);
  }
  EXPECT_GT(state.integral.norm(), 0);
  dut.Update(Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero(), kZero,
             kAlongZ, &state);
  EXPECT_EQ(state.integral, Vector3d::Zero());
}

TEST_F(ForceLoopTest, WhatAnImpactLeavesIsNotIntegrated) {
  params_.integral_delay = 0.1;
  const ForceLoop dut(params_);
  ForceLoopState state = dut.MakeState();
  const auto update = [&](const Matrix3d& selection, int cycles) {
    for (int i = 0; i < cycles; ++i) {
      dut.Update(Vector3d(0, 0, 1), Vector3d(0, 0, 9), Vector3d::Zero(),
                 selection, selection, &state);
    }
  };
  for (int contact = 0; contact < 2; ++contact) {
    update(kAlongZ, 99);
    EXPECT_EQ(state.integral, Vector3d::Zero());
    update(kAlongZ, 50);
    EXPECT_GT(state.integral.z(), 0.3);
    update(kZero, 1);
  }
}

// While the blend is at zero a bumpless reference is passed on in full.
TEST_F(ForceLoopTest, BumplessReferenceIsNotHeldBackByTheBlend) {
  const ForceLoop dut(params_);
  ForceLoopState state = dut.MakeState();
  dut.Update(Vector3d::Zero(), Vector3d(0, 0, 8), Vector3d::Zero(), kZero,
             kZero, &state);
  const Vector3d force = dut.Update(Vector3d(0, 0, 8), Vector3d(0, 0, 8),
                                    Vector3d::Zero(), kAlongZ, kZero, &state);
  EXPECT_NEAR(force.z(), 8, 1e-12);
}

TEST_F(ForceLoopTest, FilterHasItsCutoff) {
  params_.filter_cutoff = 50;
  const ForceLoop dut(params_);
  ForceLoopState state = dut.MakeState();
  dut.Update(Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero(), kZero, kZero,
             &state);
  double largest = 0;
  for (int i = 0; i < 2000; ++i) {
    dut.Update(Vector3d::Zero(),
               Vector3d(std::sin(2 * M_PI * 50 * i * 0.001), 0, 0),
               Vector3d::Zero(), kZero, kZero, &state);
    if (i > 1000) largest = std::max(largest, state.sensed.x());
  }
  EXPECT_NEAR(largest, std::sqrt(0.5), 0.05);  // -3 dB
}

TEST_F(ForceLoopTest, CopyContinuesAlikeWithoutAllocation) {
  const ForceLoop dut{ForceLoopParams{}};
  ForceLoopState state = dut.MakeState();
  dut.Update(Vector3d(0, 0, 5), Vector3d(0, 0, 3), Vector3d(0, 0, .1), kAlongZ,
             kAlongZ, &state);
  ForceLoopState copy = state;
  ScopedNoAlloc guard;
  const Vector3d a = dut.Update(Vector3d(0, 0, 5), Vector3d(0, 0, 3),
                                Vector3d(0, 0, .1), kAlongX, kAlongZ, &state);
  EXPECT_EQ(guard.count(), 0);
  EXPECT_EQ(dut.Update(Vector3d(0, 0, 5), Vector3d(0, 0, 3), Vector3d(0, 0, .1),
                       kAlongX, kAlongZ, &copy),
            a);
}

// A phantom of 50 N would ask for 120 N, which no arm turns round in time.
TEST_F(ForceLoopTest, ProportionalForceIsBounded) {
  const ForceLoop dut(
      {.integral_gain = 0, .max_proportional_force = 20, .filter_cutoff = 0});
  ForceLoopState state = dut.MakeState();
  const Vector3d force = dut.Update(Vector3d(0, 0, 2), Vector3d(0, 0, 50),
                                    Vector3d::Zero(), kAlongZ, kAlongZ, &state);
  EXPECT_DOUBLE_EQ(force.z(), 2 - dut.params().max_proportional_force);
}

TEST_F(ForceLoopTest, InvalidParamsNameTheField) {
  const auto error = [](auto set) {
    ForceLoopParams params;
    set(params);
    EXPECT_THROW(ForceLoop{params}, std::invalid_argument);
    return ValidationError(params);
  };
  using P = ForceLoopParams;
  const auto negative = [](const std::string& field) {
    return "ForceLoopParams: field `" + field +
           "` expected a finite value >= 0, got -1";
  };
  EXPECT_EQ(error([](P& p) { p.gain = -1; }), negative("gain"));
  EXPECT_EQ(error([](P& p) { p.integral_gain = -1; }),
            negative("integral_gain"));
  EXPECT_EQ(error([](P& p) { p.damping = -1; }), negative("damping"));
  EXPECT_EQ(error([](P& p) { p.max_proportional_force = -1; }),
            negative("max_proportional_force"));
  EXPECT_EQ(error([](P& p) { p.max_integral_force = -1; }),
            negative("max_integral_force"));
  EXPECT_EQ(error([](P& p) { p.integral_delay = -1; }),
            negative("integral_delay"));
  EXPECT_EQ(error([](P& p) { p.filter_cutoff = -1; }),
            "ForceLoopParams: field `filter_cutoff` expected 0 or a finite "
            "value >= 0.01, got -1");
  EXPECT_EQ(error([](P& p) { p.release_time = -1; }), negative("release_time"));
  EXPECT_EQ(error([](P& p) { p.period = 0; }),
            "ForceLoopParams: field `period` expected a finite value > 0, got "
            "0");
  EXPECT_EQ(error([](P& p) { p.passivity.max_energy = 0; }),
            "TimeDomainPassivityParams: field `max_energy` expected a finite "
            "value > 0, got 0");
}

// The closed loop: a mass at a wall of 3e4 N/m without any damping of its own,
// reference from 5 to 8 N at 50 N/s, torques that act one period late, 0.2 N
// sensor noise. x is the normal; motion along y and z is free and undamped.
struct ContactResult {
  double ac{0};       // rms about the mean from 1 s on, N
  double peak{0};     // N
  double settled{0};  // last time with more than 1 N of error, s
  int lost{0};        // periods without contact after 0.2 s
};

struct ContactCase {
  double mass{7};
  double cutoff{100};
  int delay{1};
  bool passivity{true};
  double gain{2.5};
  double damping{20};
};

ContactResult SimulateContact(const ContactCase& c) {
  ForceLoopParams params;
  params.speed_limit = 1e9;  // What it does alone is not asked here.
  params.filter_cutoff = c.cutoff;
  params.passivity.enabled = c.passivity;
  params.gain = c.gain;
  params.damping = c.damping;
  const ForceLoop dut(params);
  ForceLoopState state = dut.MakeState();
  RandomStream random(6);

  constexpr double kStiffness = 3e4;
  constexpr double kPeriod = 1e-3;
  constexpr int kSubsteps = 20;
  constexpr int kPeriods = 3000;
  const Vector3d noise_scale(0.2, 0.2, 0.2);
  Vector3d x(5 / kStiffness, 0, 0);
  Vector3d v(0.02, 0, 0);
  Vector3d reference(5, 0, 0);
  std::array<Vector3d, 4> pending;
  pending.fill(reference);
  ContactResult result;
  double sum = 0;
  double sum_of_squares = 0;
  int count = 0;
  for (int i = 0; i < kPeriods; ++i) {
    const double wall = std::max(0.0, kStiffness * x.x());
    reference.x() = std::min(8.0, reference.x() + 0.05);
    Vector3d sensed(wall, 0, 0);
    Vector3d measured_v = v;
    for (int j = 0; j < 3; ++j) {
      sensed(j) += noise_scale(j) * random.Normal();
      measured_v(j) += 5e-5 * random.Normal();
    }
    std::copy_backward(pending.begin(), pending.end() - 1, pending.end());
    pending[0] =
        dut.Update(reference, sensed, measured_v, kAlongX, kAlongX, &state);
    const Vector3d& acting = pending[c.delay];
    for (int j = 0; j < kSubsteps; ++j) {
      Vector3d force = acting;
      force.x() -= std::max(0.0, kStiffness * x.x());
      v += kPeriod / kSubsteps * force / c.mass;
      x += kPeriod / kSubsteps * v;
    }
    result.peak = std::max(result.peak, wall);
    if (std::abs(wall - 8) > 1) result.settled = i * kPeriod;
    if (i > 200 && wall <= 0) ++result.lost;
    if (i >= 1000) {
      sum += wall;
      sum_of_squares += wall * wall;
      ++count;
    }
  }
  const double mean = sum / count;
  result.ac = std::sqrt(std::max(0.0, sum_of_squares / count - mean * mean));
  return result;
}

// Without the passivity controller the gains of the paper hammer on the wall.
TEST(ForceLoopContact, PrintedGainsAreUnstableWithoutPassivity) {
  for (const double cutoff : {50.0, 100.0}) {
    const ContactResult result =
        SimulateContact({.cutoff = cutoff, .passivity = false});
    EXPECT_GT(result.ac, 10) << cutoff;
    EXPECT_GT(result.lost, 100) << cutoff;
  }
}

// With it the loop settles quickly and quietly: for every apparent mass of the
// arm, for the delay assumed and for one period less or more (a mass of 1 kg
// does not bear two periods: there max_damping is too much).
TEST(ForceLoopContact, PassivityMakesItSettleQuickly) {
  for (const double mass : {1.0, 2.0, 4.0, 7.0, 12.0}) {
    for (const double cutoff : {0.0, 50.0, 100.0, 200.0}) {
      for (const int delay : {0, 1, 2}) {
        if (mass < 2 && delay > 1) continue;
        const ContactResult result =
            SimulateContact({.mass = mass, .cutoff = cutoff, .delay = delay});
        const std::string label = "mass " + std::to_string(mass) + " cutoff " +
                                  std::to_string(cutoff) + " delay " +
                                  std::to_string(delay);
        EXPECT_LT(result.ac, 0.3) << label;
        EXPECT_LT(result.settled, 0.7) << label;
        EXPECT_LT(result.peak, 15) << label;
        EXPECT_EQ(result.lost, 0) << label;
      }
    }
  }
}

// What is sure of the alternative cure: enough damping for the mass.
TEST(ForceLoopContact, DampingScaledByMassAlsoSettles) {
  const ContactResult result =
      SimulateContact({.passivity = false, .gain = 1.0, .damping = 7 * 40.0});
  EXPECT_LT(result.ac, 0.1);
  EXPECT_EQ(result.lost, 0);
}

}  // namespace
}  // namespace dual_proxy
