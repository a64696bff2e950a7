// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/perception/pressure_centre_tracker.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "dual_proxy/common/random.h"
#include "dual_proxy/common/rotation.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kHalf = 0.03;  // m: half the tool's size.
constexpr double kForce = 6;    // N
constexpr double kDegree = std::numbers::pi / 180;

// A square tool at a sensor that is some centimetres away, so that its noise of
// forces makes most of that of moments.
class PressureCentreTrackerTest : public ::testing::Test {
 protected:
  explicit PressureCentreTrackerTest(double period = 0.01)
      : period_(period), dut_(params_, period) {}

  Vector3d Noise(double std) {
    return std * Vector3d(random_.Normal(), random_.Normal(), random_.Normal());
  }

  void Feel(const Vector3d& force, const Vector3d& moment,
            const Vector3d& angular_velocity, const Vector3d& normal) {
    const double share = std::sqrt(0.01 / period_);
    dut_.Update({.moment = R_ * moment + bias_ + share * Noise(0.007),
                 .angular_velocity = R_ * angular_velocity,
                 .force = R_ * force + share * Noise(0.06),
                 .normal = R_ * normal},
                &state_);
    time_ += period_;
  }

  void Air(double duration) {
    for (const double end = time_ + duration; time_ < end;) {
      Feel(Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero(),
           Vector3d::Zero());
    }
  }

  // The table's normal is -z. The force presses at a place that goes from
  // `from` to `to` (m, x and y from the tool point).
  struct Pressing {
    double duration{1};
    Vector2d from{0, 0};
    Vector2d to{0, 0};
    double force{kForce};
    double force_at_first{kForce};
    double torsion{0};                   // N m: friction's, about z.
    Vector3d angular_velocity{0, 0, 0};  // rad/s
  };
  // Returns when the dimension first was `dimension`, s from the beginning, or
  // infinity.
  double Press(const Pressing& p, int dimension = -1) {
    const double start = time_;
    double when = std::numeric_limits<double>::infinity();
    while (time_ < start + p.duration) {
      const double share = (time_ - start) / p.duration;
      const double force =
          p.force_at_first + share * (p.force - p.force_at_first);
      Vector3d place = Vector3d::Zero();
      place.head<2>() = p.from + share * (p.to - p.from);
      const Vector3d F(0.2 * force, 0, -force);
      Feel(F, place.cross(F) + Vector3d(0, 0, p.torsion), p.angular_velocity,
           -Vector3d::UnitZ());
      if (state_.dimension == dimension) when = std::min(when, time_ - start);
    }
    return when;
  }

  // As a hand does that tips the tool over its edge until it lies flat.
  void LieFlat() {
    Air(0.5);
    Press({.duration = 2, .from = kEdge, .to = kEdge, .force_at_first = 1});
    EXPECT_EQ(state_.dimension, 1);
    Press({.duration = 0.5, .from = kEdge, .to = 0.6 * kEdge});
    EXPECT_EQ(state_.dimension, 2);
  }

  static double Angle(const Vector3d& a, const Vector3d& b) {
    return std::atan2(a.cross(b).norm(), std::abs(a.dot(b)));
  }

  const Vector2d kEdge{0, kHalf};
  PressureCentreParams params_;
  double period_;
  PressureCentreTracker dut_;
  PressureCentreState state_{dut_.MakeState()};
  RandomStream random_{3};
  Matrix3d R_{Matrix3d::Identity()};
  Vector3d bias_{Vector3d::Zero()};
  double time_{0};
};

TEST_F(PressureCentreTrackerTest, NothingIsBlockedInFreeSpace) {
  Air(2);
  EXPECT_EQ(state_.dimension, 0);
  EXPECT_EQ(state_.CalcSelection(), Matrix3d::Zero());
  EXPECT_EQ(state_.axes, Matrix3d::Identity());
}

TEST_F(PressureCentreTrackerTest, NorUnderneathTheToolPoint) {
  Air(0.5);
  Press({.duration = 3});
  EXPECT_EQ(state_.dimension, 0);
  Press({.duration = 3, .from = {0.006, 0}, .to = {0, -0.006}});
  EXPECT_EQ(state_.dimension, 0);
}

TEST_F(PressureCentreTrackerTest, AnEdgeIsOneDirection) {
  Air(0.5);
  const Pressing lightly{.duration = 2,
                         .from = kEdge,
                         .to = kEdge,
                         .force = 5,
                         .force_at_first = 1};
  EXPECT_LT(Press(lightly, 1), 0.05);
  EXPECT_EQ(state_.dimension, 1);
  EXPECT_LT(Angle(state_.axes.col(0), Vector3d::UnitX()), 3 * kDegree);
  // Neither the size of the force nor where along the edge makes it two.
  const Vector2d left(-0.8 * kHalf, kHalf);
  const Vector2d right(0.8 * kHalf, kHalf);
  for (int i = 0; i < 3; ++i) {
    Press({.from = left, .to = right, .force = 3, .force_at_first = 5});
    EXPECT_EQ(state_.dimension, 1);
    Press({.from = right, .to = left, .force = 5, .force_at_first = 3});
    EXPECT_EQ(state_.dimension, 1);
  }
  Press({.from = left, .to = left});
  EXPECT_LT(Angle(state_.axes.col(0), Vector3d(1, 0.8, 0)), 3 * kDegree);
}

TEST_F(PressureCentreTrackerTest, LyingFlatIsTwoDirections) {
  Air(0.5);
  Press({.duration = 2, .from = kEdge, .to = kEdge, .force_at_first = 1});
  const Pressing landing{.from = 0.6 * kEdge, .to = 0.6 * kEdge};
  EXPECT_LT(Press(landing, 2), 0.2);
}

// However the moment changes, its sign and size do not matter.
TEST_F(PressureCentreTrackerTest, TwoDirectionsRemainHoweverTheMomentTurns) {
  LieFlat();
  const Vector2d a(0.5 * kHalf, -0.5 * kHalf);
  Press({.from = 0.6 * kEdge, .to = a});
  Press({.from = a, .to = -a});
  EXPECT_EQ(state_.dimension, 2);
  Press({.from = -a, .to = a, .force = 2, .force_at_first = 2});
  EXPECT_EQ(state_.dimension, 2);
  Press({.duration = 10});
  EXPECT_EQ(state_.dimension, 2);
  const Matrix3d expected = Vector3d(1, 1, 0).asDiagonal();
  EXPECT_TRUE(state_.CalcSelection().isApprox(expected, 1e-12));
  EXPECT_EQ(state_.axes.col(2), -Vector3d::UnitZ());
  EXPECT_TRUE((state_.axes.transpose() * state_.axes).isIdentity(1e-12));
  EXPECT_NEAR(state_.axes.determinant(), 1, 1e-12);
}

TEST_F(PressureCentreTrackerTest, FrictionAboutTheNormalIsNotCounted) {
  Air(0.5);
  Press({.duration = 2, .torsion = 0.1});
  Press({.duration = 2, .torsion = -0.1, .angular_velocity = {0, 0, 0.4}});
  EXPECT_EQ(state_.dimension, 0);
  LieFlat();
  Press({.duration = 2, .torsion = 0.1});
  Press({.duration = 2, .torsion = -0.1, .angular_velocity = {0, 0, 0.4}});
  EXPECT_EQ(state_.dimension, 2);
  EXPECT_EQ(state_.axes.col(2), -Vector3d::UnitZ());
}

TEST_F(PressureCentreTrackerTest, ABiasIsLearnedInFreeSpace) {
  bias_ << 0.03, -0.03, 0.025;  // 0.05 N m
  Air(0.3);
  EXPECT_LT((state_.bias - bias_).norm(), 0.005);
  Press({.duration = 3, .force_at_first = 1});
  EXPECT_EQ(state_.dimension, 0);
  Air(1);
  LieFlat();
  // One that comes later is followed.
  bias_ << 0, 0.05, 0;
  Air(8);
  EXPECT_LT((state_.bias - bias_).norm(), 0.005);
}

TEST_F(PressureCentreTrackerTest, ABiasThatNobodyHasLearnedIsSmallToAForce) {
  bias_ << 0.03, -0.03, 0.025;
  Press({.duration = 3});
  EXPECT_EQ(state_.dimension, 0);
}

TEST_F(PressureCentreTrackerTest, LiftedThereIsNone) {
  LieFlat();
  Feel(Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero());
  EXPECT_EQ(state_.dimension, 0);
  EXPECT_EQ(state_.CalcSelection(), Matrix3d::Zero());
  EXPECT_FALSE(state_.touched);
  LieFlat();
}

TEST_F(PressureCentreTrackerTest, OneDirectionIsLostWithItsMoment) {
  Air(0.5);
  Press({.from = kEdge, .to = kEdge});
  EXPECT_EQ(state_.dimension, 1);
  Press({.duration = 0.1,
         .from = kEdge,
         .to = kEdge,
         .force = 0.1,
         .force_at_first = 1});
  Press({.from = kEdge, .to = kEdge, .force = 0.1, .force_at_first = 0.1});
  EXPECT_EQ(state_.dimension, 0);
}

TEST_F(PressureCentreTrackerTest, ATippedToolHasOneDirection) {
  LieFlat();
  Press({.duration = 0.3,
         .from = 0.6 * kEdge,
         .to = kEdge,
         .angular_velocity = {0.01, 0, 0}});
  EXPECT_EQ(state_.dimension, 2);
  const Pressing tipping{.duration = 0.5,
                         .from = kEdge,
                         .to = kEdge,
                         .angular_velocity = {0.15, 0, 0}};
  EXPECT_LT(Press(tipping, 1), 0.3);
  Press({.from = kEdge, .to = kEdge});
  EXPECT_EQ(state_.dimension, 1);
  EXPECT_LT(Press({.duration = 0.5, .from = kEdge, .to = 0.6 * kEdge}, 2), 0.5);
}

// About a normal that is 2 degrees off: the twist seems to tip the tool.
TEST_F(PressureCentreTrackerTest, TwistingIsNotTipping) {
  LieFlat();
  const Vector3d w = ExpRotation({2 * kDegree, 0, 0}) * Vector3d(0, 0, 2);
  Press({.duration = 2,
         .from = 0.3 * kEdge,
         .to = 0.3 * kEdge,
         .angular_velocity = w});
  EXPECT_EQ(state_.dimension, 2);
}

// Seen from B the place on the edge moves, but not in the tool.
TEST_F(PressureCentreTrackerTest, TheEdgeTurnsWithTheTool) {
  Air(0.5);
  Press({.from = kEdge, .to = kEdge});
  constexpr double kSpeed = 0.5;  // rad/s
  for (int i = 0; i < 400; ++i) {
    const double angle = kSpeed * period_ * i;
    const Vector2d place = kHalf * Vector2d(-std::sin(angle), std::cos(angle));
    Press({.duration = 0.5 * period_,
           .from = place,
           .to = place,
           .angular_velocity = {0, 0, kSpeed}});
    ASSERT_EQ(state_.dimension, 1) << i;
  }
  EXPECT_LT(
      Angle(state_.axes.col(0), ExpRotation({0, 0, 2}) * Vector3d::UnitX()),
      3 * kDegree);
}

TEST_F(PressureCentreTrackerTest, EveryFrameIsAlike) {
  R_ = ExpRotation({0.3, -1.2, 2.1});
  LieFlat();
  EXPECT_TRUE(state_.axes.col(2).isApprox(R_ * -Vector3d::UnitZ(), 1e-12));
}

class PressureCentreTrackerRateTest
    : public PressureCentreTrackerTest,
      public ::testing::WithParamInterface<double> {
 protected:
  PressureCentreTrackerRateTest() : PressureCentreTrackerTest(GetParam()) {}
};

TEST_P(PressureCentreTrackerRateTest, EveryPeriodIsAlike) {
  Air(1);
  Press({.duration = 10});
  EXPECT_EQ(state_.dimension, 0);
  Air(0.2);
  EXPECT_LT(Press({.duration = 4, .from = kEdge, .to = kEdge}, 1), 0.1);
  EXPECT_EQ(state_.dimension, 1);
  EXPECT_LT(Press({.from = 0.6 * kEdge, .to = 0.6 * kEdge}, 2), 0.3);
  Press({.duration = 10, .from = 0.6 * kEdge, .to = -0.6 * kEdge});
  EXPECT_EQ(state_.dimension, 2);
}

INSTANTIATE_TEST_SUITE_P(Periods, PressureCentreTrackerRateTest,
                         ::testing::Values(0.001, 0.01, 1 / 15.0));

TEST_F(PressureCentreTrackerTest, RefusesWhatIsNotFinite) {
  LieFlat();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto updates = state_.updates;
  for (const double bad :
       {nan, std::numeric_limits<double>::infinity(), 1e200}) {
    Feel({0, bad, 0}, {0, 0, 0}, {0, 0, 0}, -Vector3d::UnitZ());
    Feel({0, 0, 0}, {0, bad, 0}, {0, 0, 0}, -Vector3d::UnitZ());
    Feel({0, 0, 0}, {0, 0, 0}, {bad, 0, 0}, -Vector3d::UnitZ());
    Feel({0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, bad});
  }
  EXPECT_EQ(state_.bad_inputs, 12);
  EXPECT_EQ(state_.updates, updates);
  EXPECT_EQ(state_.dimension, 2);
}

TEST_F(PressureCentreTrackerTest, WhatIsWildDoesNotOverflow) {
  for (int i = 0; i < 1000; ++i) {
    const double size = std::pow(10, 150 * random_.Uniform() - 10);
    Vector3d normal = Vector3d::Zero();
    if (i % 50 > 0) normal = Noise(1).normalized();
    Feel(Noise(size), Noise(size), Noise(size), normal);
    ASSERT_TRUE(state_.CalcSelection().allFinite()) << i;
    ASSERT_TRUE(state_.lever.allFinite() && state_.scatter.allFinite()) << i;
    const Matrix3d Omega = state_.CalcSelection();
    ASSERT_TRUE((Omega * Omega).isApprox(Omega, 1e-9)) << i;
    ASSERT_NEAR(Omega.trace(), state_.dimension, 1e-9) << i;
  }
}

TEST_F(PressureCentreTrackerTest, DoesNotAllocate) {
  ScopedNoAlloc guard;
  LieFlat();
  Air(0.1);
  EXPECT_EQ(guard.count(), 0);
}

TEST_F(PressureCentreTrackerTest, ErrorsNameTheField) {
  const std::string who = "PressureCentreParams: field ";
  params_.loss_moment = 0.02;
  EXPECT_EQ(ValidationError(params_).find(who + "`loss_moment` expected"), 0u);
  params_ = {};
  params_.bias_time = 0;
  EXPECT_EQ(ValidationError(params_),
            who + "`bias_time` expected a finite value > 0, got 0");
  EXPECT_THROW(PressureCentreTracker(params_, 0.01), std::invalid_argument);
  EXPECT_EQ(InvalidArgument([] { PressureCentreTracker({}, 0); }),
            "PressureCentreTracker: field `period` expected a finite value > "
            "0, got 0");
}

}  // namespace
}  // namespace dual_proxy
