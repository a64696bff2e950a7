// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/trajectory_limiter.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <gtest/gtest.h>

#include "no_alloc.h"
#include "test_support.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kPeriod = 0.001;

class TrajectoryLimiterTest : public ::testing::Test {
 protected:
  // One tick towards `target` (brake if null), with every limit checked.
  void Step(const Pose* target) {
    const TrajectoryLimiterState last = state_;
    if (target != nullptr) {
      dut_.Update(*target, &state_);
    } else {
      dut_.Stop(&state_);
    }
    const TrajectoryLimiterParams& limits = dut_.params();
    ASSERT_LE(MaxAbs(state_.v), limits.max_velocity);
    ASSERT_LE(MaxAbs(state_.w), limits.max_angular_velocity);
    // Rounding of a difference of velocities over one tick.
    ASSERT_LE(MaxAbs(state_.v - last.v) / kPeriod,
              limits.max_acceleration * (1.0 + 1e-9));
    ASSERT_LE(MaxAbs(state_.w - last.w) / kPeriod,
              limits.max_angular_acceleration * (1.0 + 1e-9));
    ASSERT_LE(MaxAbs(state_.pose.p - last.pose.p),
              limits.max_velocity * kPeriod * (1.0 + 1e-9));
    const Vector3d turn = LogRotation(state_.pose.R * last.pose.R.transpose());
    ASSERT_LE(MaxAbs(turn), limits.max_angular_velocity * kPeriod + 1e-9);
    // What is reported is what happened.
    ASSERT_TRUE(state_.a.isApprox((state_.v - last.v) / kPeriod, 1e-9) ||
                MaxAbs(state_.v - last.v) < 1e-12);
    ASSERT_LT(MaxAbs(state_.pose.p - last.pose.p -
                     0.5 * kPeriod * (state_.v + last.v)),
              0.25 * limits.max_acceleration * kPeriod * kPeriod + 1e-15);
    ASSERT_TRUE((state_.pose.R * state_.pose.R.transpose()).isIdentity(1e-12));
  }

  static double MaxAbs(const Vector3d& v) { return v.cwiseAbs().maxCoeff(); }

  const TrajectoryLimiter dut_{TrajectoryLimiterParams{}};
  TrajectoryLimiterState state_{dut_.MakeState(Pose{})};
};

TEST_F(TrajectoryLimiterTest, LongWayTakesTheTimeOptimalTime) {
  // 0.1 m at 0.2 m/s and 10 m/s^2: 0.1/0.2 + 0.2/10 = 0.52 s.
  Pose target;
  target.p.x() = 0.1;
  int ticks = 0;
  while (state_.pose.p != target.p && ticks < 1000) {
    Step(&target);
    ++ticks;
  }
  EXPECT_NEAR(ticks * kPeriod, 0.52, 1.5 * kPeriod);
  Step(&target);  // If it got there by rounding, the rest of the velocity.
  EXPECT_TRUE(state_.v.isZero(0.0));
  EXPECT_EQ(state_.pose.p, target.p);
}

TEST_F(TrajectoryLimiterTest, LongTurnTakesTheTimeOptimalTime) {
  // 0.5 rad at 1 rad/s and 20 rad/s^2: 0.5 + 1/20 = 0.55 s.
  Pose target;
  target.R = ExpRotation({0, 0, 0.5});
  int ticks = 0;
  while (state_.pose.R != target.R && ticks < 1000) {
    Step(&target);
    ++ticks;
  }
  EXPECT_NEAR(ticks * kPeriod, 0.55, 1.5 * kPeriod);
  Step(&target);
  EXPECT_TRUE(state_.w.isZero(0.0));
  EXPECT_EQ(state_.pose.R, target.R);
}

TEST_F(TrajectoryLimiterTest, RestIsExact) {
  RandomStream random(1);
  Pose pose;
  pose.p = RandomVector(1.0, &random);
  pose.R = RandomRotation(1.0, &random);
  state_ = dut_.MakeState(pose);
  for (int i = 0; i < 100; ++i) Step(&pose);
  EXPECT_EQ(state_.pose.p, pose.p);
  EXPECT_EQ(state_.pose.R, pose.R);
  Step(nullptr);
  EXPECT_EQ(state_.pose.p, pose.p);
  EXPECT_EQ(state_.pose.R, pose.R);
}

TEST_F(TrajectoryLimiterTest, FollowsASlowTargetWithoutLag) {
  Pose target;
  for (int i = 0; i < 2000; ++i) {
    target.p.x() = 0.05 * std::sin(2.0 * kPeriod * i);
    Step(&target);
    // A target that moves at 0.1 m/s is v^2/(2a) = 0.5 mm ahead at most, since
    // every trajectory ends at rest at the target.
    ASSERT_LT(std::abs(state_.pose.p.x() - target.p.x()), 0.7e-3) << i;
  }
}

TEST_F(TrajectoryLimiterTest, AStepOfTheTargetIsNoStepOfTheProxy) {
  RandomStream random(2);
  for (int k = 0; k < 300; ++k) {
    Pose target;
    target.p = RandomVector(0.02, &random);
    target.R = RandomRotation(0.5, &random);
    const int ticks = 1 + static_cast<int>(60.0 * random.Uniform());
    for (int i = 0; i < ticks; ++i) {
      ASSERT_NO_FATAL_FAILURE(Step(&target)) << k;
    }
    if (random.Uniform() < 0.2) {
      for (int i = 0; i < 10; ++i) ASSERT_NO_FATAL_FAILURE(Step(nullptr)) << k;
    }
  }
}

TEST_F(TrajectoryLimiterTest, ArrivesFromEverywhere) {
  RandomStream random(3);
  for (int k = 0; k < 20; ++k) {
    Pose target;
    target.p = RandomVector(0.05, &random);
    target.R = RandomRotation(2.0, &random);
    for (int i = 0; i < 8000; ++i) dut_.Update(target, &state_);
    ASSERT_LT((state_.pose.p - target.p).norm(), 1e-12) << k;
    ASSERT_LT((state_.pose.R - target.R).norm(), 1e-9) << k;
  }
}

TEST_F(TrajectoryLimiterTest, NeverLeavesTheBoxOfItsTargets) {
  RandomStream random(4);
  for (int k = 0; k < 1000; ++k) {
    Pose target;
    for (int i = 0; i < 3; ++i) {
      target.p(i) = random.Uniform() < 0.5 ? -0.01 : 0.01;
    }
    for (int i = 0; i < 40; ++i) {
      dut_.Update(target, &state_);
      ASSERT_LE(MaxAbs(state_.pose.p), 0.01 + 1e-12) << k;
    }
  }
}

TEST_F(TrajectoryLimiterTest, StopBrakesAtTheLimit) {
  Pose target;
  target.p.x() = 1.0;
  target.R = ExpRotation({1.0, 0, 0});
  for (int i = 0; i < 200; ++i) Step(&target);
  ASSERT_DOUBLE_EQ(state_.v.x(), 0.2);
  const double start = state_.pose.p.x();
  int ticks = 0;
  while (!(state_.v.isZero(0.0) && state_.w.isZero(0.0))) {
    Step(nullptr);
    ASSERT_LT(++ticks, 60);
  }
  // v^2/(2a) = 2 mm in 20 ms; the rotation takes 50 ms.
  EXPECT_NEAR(state_.pose.p.x() - start, 0.002, 1e-12);
  EXPECT_NEAR(ticks, 50, 1);
}

TEST_F(TrajectoryLimiterTest, FarTargetsChangeNothingButTheDistance) {
  TrajectoryLimiterState far_state = state_;
  for (int i = 0; i < 100; ++i) {
    Pose near, far;
    near.p = Vector3d(1.0, -1.0, 0.5);
    far.p = Vector3d(999, -900, 50.0);
    dut_.Update(near, &state_);
    dut_.Update(far, &far_state);
    ASSERT_LT((state_.pose.p - far_state.pose.p).norm(), 1e-15);
  }
  EXPECT_EQ(far_state.bad_inputs, 0);
}

TEST_F(TrajectoryLimiterTest, BadTargetsAreRefusedAndCounted) {
  Pose target;
  target.p.x() = 1.0;
  for (int i = 0; i < 200; ++i) Step(&target);
  Pose bad = target;
  bad.p.y() = std::numeric_limits<double>::quiet_NaN();
  Pose bent = target;
  bent.R *= 1.5;
  for (int i = 0; i < 100; ++i) Step(i % 2 == 0 ? &bad : &bent);
  EXPECT_EQ(state_.bad_inputs, 100);
  EXPECT_TRUE(state_.v.isZero(0.0));
  EXPECT_TRUE(state_.pose.p.allFinite());
}

TEST_F(TrajectoryLimiterTest, HalfATurnAwayItStillFindsItsWay) {
  Pose target;
  target.R = ExpRotation({0, std::numbers::pi, 0});
  for (int i = 0; i < 5000; ++i) ASSERT_NO_FATAL_FAILURE(Step(&target));
  EXPECT_LT((state_.pose.R - target.R).norm(), 1e-9);
}

TEST_F(TrajectoryLimiterTest, CopiesGoOnAlikeAndAFreshStateIsAtRest) {
  Pose target;
  target.p = Vector3d(0.01, 0.02, 0.03);
  for (int i = 0; i < 50; ++i) Step(&target);
  TrajectoryLimiterState copy = state_;
  Step(&target);
  dut_.Update(target, &copy);
  EXPECT_EQ(copy.pose.p, state_.pose.p);
  EXPECT_EQ(copy.v, state_.v);
  EXPECT_TRUE(dut_.MakeState(target).v.isZero(0.0));
}

TEST_F(TrajectoryLimiterTest, DoesNotAllocate) {
  Pose target;
  target.p = Vector3d(0.3, 0.2, 0.1);
  target.R = ExpRotation({0.1, 0.2, 0.3});
  ScopedNoAlloc guard;
  for (int i = 0; i < 1000; ++i) dut_.Update(target, &state_);
  dut_.Stop(&state_);
  EXPECT_EQ(guard.count(), 0);
}

/** With a limit of the jerk: what the acceleration changes by. */
class JerkLimiterTest : public ::testing::Test {
 protected:
  void Step(const Pose* target, const Eigen::Matrix<double, 6, 1>& velocity =
                                    Eigen::Matrix<double, 6, 1>::Zero()) {
    const TrajectoryLimiterState last = state_;
    if (target != nullptr) {
      dut_.Update(*target, velocity, &state_);
    } else {
      dut_.Stop(&state_);
    }
    const auto max_abs = [](const Vector3d& v) {
      return v.cwiseAbs().maxCoeff();
    };
    const TrajectoryLimiterParams& limits = dut_.params();
    ASSERT_LE(max_abs(state_.v), limits.max_velocity);
    ASSERT_LE(max_abs(state_.a), limits.max_acceleration * (1 + 1e-9));
    ASSERT_LE(max_abs(state_.a - last.a), kPeriod * limits.max_jerk + 1e-9);
    ASSERT_LE(max_abs(state_.alpha - last.alpha),
              kPeriod * limits.max_angular_jerk + 1e-9);
    // The motion is that of the accelerations.
    ASSERT_LE(max_abs(state_.v - last.v - kPeriod / 2 * (state_.a + last.a)),
              kPeriod * kPeriod * limits.max_jerk);
  }

  const TrajectoryLimiter dut_{
      TrajectoryLimiterParams{.max_jerk = 100, .max_angular_jerk = 200}};
  TrajectoryLimiterState state_{dut_.MakeState(Pose{})};
};

TEST_F(JerkLimiterTest, HoldsOnTheWayToAPlace) {
  Pose target;
  target.p = Vector3d(0.1, -0.05, 0.002);
  target.R = ExpRotation({0.3, 0, -0.2});
  int ticks = 0;
  while ((state_.pose.p - target.p).norm() > 1e-9 && ticks < 2000) {
    ASSERT_NO_FATAL_FAILURE(Step(&target)) << ticks;
    ++ticks;
  }
  // 0.1 m at 0.2 m/s, which takes 2 sqrt(0.2 / 100) s to reach and to leave.
  EXPECT_NEAR(ticks * kPeriod, 0.5 + 2 * std::sqrt(0.2 / 100), 0.005);
  for (int i = 0; i < 500; ++i) ASSERT_NO_FATAL_FAILURE(Step(&target));
  EXPECT_LT((state_.pose.R - target.R).norm(), 1e-9);
  EXPECT_LT(state_.v.norm() + state_.a.norm(), 1e-9);
}

TEST_F(JerkLimiterTest, HoldsWhenTargetsJumpAboutAndWhenItStops) {
  RandomStream random(7);
  for (int k = 0; k < 300; ++k) {
    Pose target;
    target.p = RandomVector(0.02, &random);
    target.R = RandomRotation(0.5, &random);
    Eigen::Matrix<double, 6, 1> velocity;
    velocity << RandomVector(0.3, &random), RandomVector(1.5, &random);
    const int ticks = 1 + static_cast<int>(60.0 * random.Uniform());
    for (int i = 0; i < ticks; ++i) {
      ASSERT_NO_FATAL_FAILURE(Step(&target, velocity)) << k;
    }
    if (random.Uniform() > 0.3) continue;
    for (int i = 0; i < 20; ++i) ASSERT_NO_FATAL_FAILURE(Step(nullptr)) << k;
  }
}

TEST_F(JerkLimiterTest, StopsForGood) {
  Pose target;
  target.p.x() = 1;
  for (int i = 0; i < 200; ++i) ASSERT_NO_FATAL_FAILURE(Step(&target));
  for (int i = 0; i < 200; ++i) ASSERT_NO_FATAL_FAILURE(Step(nullptr));
  EXPECT_LT(state_.v.norm() + state_.a.norm(), 1e-12);
}

TEST_F(JerkLimiterTest, FollowsASmoothTargetClosely) {
  for (int i = 0; i < 4000; ++i) {
    const double t = kPeriod * i;
    Pose target;
    target.p.x() = 0.03 * (1 - std::cos(3 * t));
    Eigen::Matrix<double, 6, 1> velocity = Eigen::Matrix<double, 6, 1>::Zero();
    velocity(0) = 0.09 * std::sin(3 * t);
    ASSERT_NO_FATAL_FAILURE(Step(&target, velocity));
    if (i > 200) {
      ASSERT_LT(std::abs(state_.pose.p.x() - target.p.x()), 2e-4) << i;
    }
  }
}

TEST_F(JerkLimiterTest, DoesNotAllocate) {
  Pose target;
  target.p = Vector3d(0.3, 0.2, 0.1);
  target.R = ExpRotation({0.1, 0.2, 0.3});
  ScopedNoAlloc guard;
  for (int i = 0; i < 1000; ++i) dut_.Update(target, &state_);
  dut_.Stop(&state_);
  EXPECT_EQ(guard.count(), 0);
}

TEST(TrajectoryLimiterParamsTest, InvalidParametersAreNamed) {
  using Params = TrajectoryLimiterParams;
  const auto message = [](double Params::* field, double value) {
    Params params;
    params.*field = value;
    return InvalidArgument([&] { TrajectoryLimiter{params}; });
  };
  EXPECT_NE(message(&Params::max_velocity, 0.0)
                .find("TrajectoryLimiterParams: field `max_velocity`"),
            std::string::npos);
  EXPECT_NE(message(&Params::max_acceleration, -1).find("`max_acceleration`"),
            std::string::npos);
  EXPECT_NE(
      message(&Params::max_angular_velocity, 0).find("`max_angular_velocity`"),
      std::string::npos);
  EXPECT_NE(message(&Params::max_angular_acceleration, 0)
                .find("`max_angular_acceleration`"),
            std::string::npos);
  EXPECT_NE(message(&Params::max_jerk, -1).find("`max_jerk`"),
            std::string::npos);
  EXPECT_NE(message(&Params::period, std::nan("")).find("`period`"),
            std::string::npos);
}

TEST_F(TrajectoryLimiterTest, FollowsAMovingTargetWithItsOwnAcceleration) {
  // Any way to a target that moves within the limits ends on it; from then on
  // the motion is the target's, one period of its acceleration apart.
  const auto target = [](double t) {
    Eigen::Matrix<double, 6, 1> velocity;
    velocity << 0.1 * std::cos(2 * t), 0, -0.065 * std::sin(1.3 * t), 0, 0,
        0.2 * std::cos(t);
    const Pose pose{
        Vector3d(0.05 * std::sin(2 * t), 0.02, 0.05 * std::cos(1.3 * t)),
        ExpRotation({0, 0, 0.2 * std::sin(t)})};
    return std::pair(pose, velocity);
  };
  for (int tick = 0; tick < 10'000; ++tick) {
    const auto [pose, velocity] = target(kPeriod * tick);
    dut_.Update(pose, velocity, &state_);
    ASSERT_LE(MaxAbs(state_.a), 10.0 * (1.0 + 1e-9));
    if (tick < 500) continue;
    const auto [next, next_velocity] = target(kPeriod * (tick + 1));
    ASSERT_LT((state_.pose.p - next.p).norm(), 1e-6) << tick;
    ASSERT_LT((state_.v - next_velocity.head<3>()).norm(), 1e-3) << tick;
    ASSERT_LT(MaxAbs(state_.a), 0.3) << tick;  // The target's: at most 0.2.
    ASSERT_LT(LogRotation(state_.pose.R * next.R.transpose()).norm(), 1e-6);
  }
}

TEST_F(TrajectoryLimiterTest, TargetFasterThanTheLimitIsFollowedAtTheLimit) {
  Eigen::Matrix<double, 6, 1> velocity =
      Eigen::Matrix<double, 6, 1>::Constant(5.0);
  for (int tick = 0; tick < 1000; ++tick) {
    const double t = kPeriod * tick;
    dut_.Update({5.0 * t * Vector3d::Ones(), Matrix3d::Identity()}, velocity,
                &state_);
    ASSERT_LE(MaxAbs(state_.v), 0.2);
    ASSERT_LE(MaxAbs(state_.w), 1.0);
  }
  EXPECT_NEAR(state_.v.x(), 0.2, 1e-9);
}

}  // namespace
}  // namespace dual_proxy
