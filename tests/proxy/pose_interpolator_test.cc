// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/pose_interpolator.h"

#include <cmath>

#include <gtest/gtest.h>

#include "no_alloc.h"
#include "test_support.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;
using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr double kPeriod = 0.001;
constexpr double kInterval = 0.02;

// A smooth motion of a hand.
Pose Sender(double time) {
  return {
      Vector3d(0.05 * std::sin(2 * time), 0.1 * std::cos(time), 0.02 * time),
      ExpRotation({0.3 * std::sin(time), 0, 0.2 * time})};
}

Vector6 SenderVelocity(double time) {
  Vector6 velocity;
  const double h = 1e-6;
  velocity << (Sender(time + h).p - Sender(time - h).p) / (2 * h),
      LogRotation(Sender(time + h).R * Sender(time - h).R.transpose()) /
          (2 * h);
  return velocity;
}

class PoseInterpolatorTest : public ::testing::Test {
 protected:
  const PoseInterpolator dut_;
  PoseInterpolatorState state_{dut_.MakeState()};
};

TEST_F(PoseInterpolatorTest, FirstPoseIsAtRest) {
  dut_.Add(1.0, Sender(0.5), 0.5, &state_);
  const MovingPose motion = dut_.Calc(1.3, state_);
  EXPECT_EQ(motion.pose.p, Sender(0.5).p);
  EXPECT_EQ(motion.pose.R, Sender(0.5).R);
  EXPECT_TRUE(motion.velocity.isZero(0.0));
}

TEST_F(PoseInterpolatorTest, TrailsTheSenderByOneInterval) {
  const double delay = 0.15;
  for (int tick = 0; tick < 3000; ++tick) {
    const double time = kPeriod * tick;
    if (tick % 20 == 0) dut_.Add(time + delay, Sender(time), time, &state_);
    const MovingPose motion = dut_.Calc(time + delay, state_);
    if (tick < 100) continue;
    // Third order in the interval: 0.2 m/s^2 x (20 ms)^2 / 8 and less.
    const Pose expected = Sender(time - kInterval);
    ASSERT_LT((motion.pose.p - expected.p).norm(), 4e-5) << tick;
    ASSERT_LT(LogRotation(motion.pose.R * expected.R.transpose()).norm(), 1e-4);
    // The backward difference is the velocity half an interval ago.
    ASSERT_LT((motion.velocity - SenderVelocity(time - kInterval)).norm(), 8e-3)
        << tick;
  }
}

TEST_F(PoseInterpolatorTest, VelocityNeverStepsWhateverTheJitter) {
  RandomStream random(5);
  int next = 0;
  double due = 0;
  MovingPose last;
  for (int tick = 0; tick < 20'000; ++tick) {
    const double time = kPeriod * tick;
    if (time >= due) {  // Late by up to 8 ms, never out of order.
      dut_.Add(time, Sender(kInterval * next), kInterval * next, &state_);
      ++next;
      due = kInterval * next + 0.008 * random.Uniform();
    }
    const MovingPose motion = dut_.Calc(time, state_);
    if (tick > 100) {
      // Of velocities around 0.4; a step would be as large.
      ASSERT_LT((motion.velocity - last.velocity).norm(), 0.06) << tick;
      ASSERT_LT((motion.pose.p - last.pose.p -
                 0.5 * kPeriod * (motion.velocity + last.velocity).head<3>())
                    .norm(),
                5e-6)
          << tick;
    }
    last = motion;
  }
}

TEST_F(PoseInterpolatorTest, GoesOnForOneAndAHalfIntervalsAndStops) {
  const Vector3d v(0.1, 0, 0);
  for (int i = 0; i < 3; ++i) {
    dut_.Add(kInterval * i, {kInterval * i * v}, kInterval * i, &state_);
  }
  const double end = 3 * kInterval;  // Of the last piece.
  EXPECT_LT(
      (dut_.Calc(end + 0.005, state_).pose.p - (2 * kInterval + 0.005) * v)
          .norm(),
      1e-12);
  EXPECT_LT((dut_.Calc(end + 0.005, state_).velocity.head<3>() - v).norm(),
            1e-12);
  const MovingPose stopped = dut_.Calc(end + 1.0, state_);
  EXPECT_LT((stopped.pose.p - 3.5 * kInterval * v).norm(), 1e-12);
  EXPECT_TRUE(stopped.velocity.isZero(0.0));
}

TEST_F(PoseInterpolatorTest, StopsSoonWhereIntervalsAreLong) {
  const Vector3d v(0.1, 0, 0);
  for (int i = 0; i < 3; ++i) {
    dut_.Add(0.2 * i, {0.2 * i * v}, 0.2 * i, &state_);
  }
  const MovingPose stopped = dut_.Calc(0.6 + 1.0, state_);
  EXPECT_LT((stopped.pose.p - (0.4 + 0.05) * v).norm(), 1e-12);
  EXPECT_TRUE(stopped.velocity.isZero(0.0));
}

TEST_F(PoseInterpolatorTest, MovesEvenlyWherePosesAreLost) {
  const Vector3d v(0.1, 0, 0);
  RandomStream random(6);
  int lost = 0;
  for (int tick = 0; tick < 20'000; ++tick) {
    const double time = kPeriod * tick;
    const int ticks = static_cast<int>(std::round(kInterval / kPeriod));
    if (tick % ticks == 0) {
      // Never two in a row.
      if (tick > 100 && lost == 0 && random.Uniform() < 0.5) {
        lost = 1;
      } else {
        lost = 0;
        dut_.Add(time, {time * v}, time, &state_);
      }
    }
    if (tick < 100) continue;
    const MovingPose motion = dut_.Calc(time, state_);
    ASSERT_LT((motion.pose.p - (time - kInterval) * v).norm(), 1e-9) << tick;
    ASSERT_LT((motion.velocity.head<3>() - v).norm(), 1e-6) << tick;
  }
}

TEST_F(PoseInterpolatorTest, StartsAnewAfterALongPauseOrARestartedSender) {
  dut_.Add(0.0, Sender(0), 5.0, &state_);
  dut_.Add(0.3, Sender(1), 5.3, &state_);  // Longer than max_interval.
  EXPECT_EQ(dut_.Calc(0.3, state_).pose.p, Sender(1).p);
  EXPECT_TRUE(dut_.Calc(0.31, state_).velocity.isZero(0.0));
  dut_.Add(0.32, Sender(2), 0.0, &state_);  // Its clock went back.
  EXPECT_EQ(dut_.Calc(0.32, state_).pose.p, Sender(2).p);
  EXPECT_TRUE(dut_.Calc(0.33, state_).velocity.isZero(0.0));
}

TEST_F(PoseInterpolatorTest, DoesNotAllocate) {
  ScopedNoAlloc guard;
  for (int i = 0; i < 100; ++i) {
    dut_.Add(kInterval * i, Sender(kInterval * i), kInterval * i, &state_);
    dut_.Calc(kInterval * i + 0.007, state_);
  }
  EXPECT_EQ(guard.count(), 0);
}

TEST_F(PoseInterpolatorTest, ChecksItsParams) {
  EXPECT_EQ(InvalidArgument([] { PoseInterpolator({.max_interval = 0}); }),
            "PoseInterpolatorParams: field `max_interval` expected a finite "
            "value > 0, got 0");
}

}  // namespace
}  // namespace dual_proxy
