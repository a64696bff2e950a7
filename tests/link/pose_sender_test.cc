// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/link/pose_sender.h"

#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "dual_proxy/common/random.h"
#include "dual_proxy/common/rotation.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

PoseSenderParams Params(double rate, bool average) {
  PoseSenderParams params;
  params.rate = rate;
  params.average = average;
  return params;
}

class PoseSenderTest : public ::testing::Test {
 protected:
  const PoseSender dut_{PoseSenderParams{}};
  PoseSenderState state_{dut_.MakeState()};
};

TEST_F(PoseSenderTest, FirstMessageGoesOutWithTheFirstSample) {
  EXPECT_EQ(state_.message.sequence, -1);
  Pose pose;
  pose.p = Vector3d(1, 2, 3);
  const PoseMessage& message = dut_.Update(
      7.5, {.pose = pose, .force_selection = Matrix3d::Identity()}, &state_);
  EXPECT_EQ(message.sequence, 0);
  EXPECT_EQ(message.send_time, 7.5);
  EXPECT_EQ(message.pose.p, pose.p);
  EXPECT_EQ(message.force_selection, Matrix3d::Identity());
}

TEST_F(PoseSenderTest, SendsTheMeanOfTheSamplesSinceTheLastMessage) {
  // 50 Hz from 1 kHz: the second message holds samples 1 to 20, the mean of
  // which is 10.5.
  for (int i = 0; i <= 20; ++i) {
    Pose pose;
    pose.p.x() = i;
    pose.R = ExpRotation(Vector3d(0, 0, 0.01 * i));
    const Matrix3d latest = (i == 20 ? 1.0 : 0.0) * Matrix3d::Identity();
    dut_.Update(
        0.001 * i,
        {.pose = pose, .force_selection = latest, .moment_selection = latest},
        &state_);
    EXPECT_EQ(state_.message.sequence, i < 20 ? 0 : 1) << i;
  }
  EXPECT_DOUBLE_EQ(state_.message.pose.p.x(), 10.5);
  // About one axis the chordal mean of evenly spread angles is the middle one.
  EXPECT_NEAR(LogRotation(state_.message.pose.R).z(), 0.105, 1e-12);
  EXPECT_EQ(state_.message.force_selection, Matrix3d::Identity());
  EXPECT_EQ(state_.message.moment_selection, Matrix3d::Identity());
  EXPECT_DOUBLE_EQ(state_.message.send_time, 0.020);
}

TEST_F(PoseSenderTest, TimeThatGoesBackHoldsNoMessageUp) {
  for (const double wrong : {100.0, 1e300, -100.0, -1e300}) {
    state_ = dut_.MakeState();
    for (int i = 0; i < 100; ++i) {
      const bool bad = i >= 20 && i < 70;
      dut_.Update(0.001 * i + (bad ? wrong : 0), {}, &state_);
    }
    const std::int64_t before = state_.message.sequence;
    for (int i = 100; i < 300; ++i) dut_.Update(0.001 * i, {}, &state_);
    EXPECT_EQ(state_.message.sequence - before, 10) << wrong;
    EXPECT_GT(state_.message.send_time, 0.27) << wrong;
  }
}

TEST_F(PoseSenderTest, WithoutAveragingSendsTheNewestSample) {
  const PoseSender dut(Params(50.0, false));
  for (int i = 0; i <= 20; ++i) {
    Pose pose;
    pose.p.x() = i;
    dut.Update(0.001 * i, {.pose = pose}, &state_);
  }
  EXPECT_EQ(state_.message.sequence, 1);
  EXPECT_EQ(state_.message.pose.p.x(), 20.0);
}

TEST_F(PoseSenderTest, KeepsItsRateWithoutDrift) {
  // 30 Hz does not divide 1 kHz: intervals of 33 and 34 ticks, 30 Hz on the
  // whole, wherever the clock stands.
  for (const double start : {0.0, 0.1234, 1e6}) {
    const PoseSender dut(Params(30.0, true));
    PoseSenderState state = dut.MakeState();
    int last = 0;
    for (int i = 0; i < 10'000; ++i) {
      const auto before = state.message.sequence;
      dut.Update(start + 0.001 * i, {}, &state);
      if (state.message.sequence == before) continue;
      ASSERT_TRUE(i == 0 || i - last == 33 || i - last == 34) << i - last;
      last = i;
    }
    EXPECT_EQ(state.message.sequence, 299) << start;
  }
}

TEST_F(PoseSenderTest, SendsEveryTickAtTheControlRate) {
  const PoseSender dut(Params(1000.0, true));
  for (int i = 0; i < 1000; ++i) {
    dut.Update(0.001 * i, {}, &state_);
    ASSERT_EQ(state_.message.sequence, i);
  }
}

TEST_F(PoseSenderTest, APauseIsNotMadeUpForByABurst) {
  dut_.Update(0.0, {}, &state_);
  dut_.Update(10.0, {}, &state_);
  EXPECT_EQ(state_.message.sequence, 1);
  for (int i = 1; i < 20; ++i) {
    dut_.Update(10.0 + 0.001 * i, {}, &state_);
    ASSERT_EQ(state_.message.sequence, 1) << i;
  }
}

TEST_F(PoseSenderTest, BadSamplesAreLeftOutAndCounted) {
  for (int i = 0; i <= 20; ++i) {
    Pose pose;
    pose.p.x() = i % 2 == 0 ? 3.0 : kNan;
    dut_.Update(0.001 * i, {.pose = pose}, &state_);
  }
  EXPECT_EQ(state_.message.sequence, 1);
  EXPECT_DOUBLE_EQ(state_.message.pose.p.x(), 3.0);
  EXPECT_EQ(state_.bad_inputs, 10);
}

TEST_F(PoseSenderTest, WithNothingButBadSamplesItIsSilent) {
  dut_.Update(0.0, {}, &state_);
  for (int i = 1; i <= 100; ++i) {
    dut_.Update(0.001 * i, {.force_selection = Matrix3d::Constant(kNan)},
                &state_);
  }
  EXPECT_EQ(state_.message.sequence, 0);
  EXPECT_EQ(state_.bad_inputs, 100);
  dut_.Update(kNan, {}, &state_);
  EXPECT_EQ(state_.bad_inputs, 101);
}

TEST_F(PoseSenderTest, RandomMeansAreRotationsWithinTheSpreadOfTheSamples) {
  RandomStream random(3);
  dut_.Update(0.0, {}, &state_);
  for (int k = 0; k < 200; ++k) {
    const Matrix3d center = ExpRotation(
        2.0 * Vector3d(random.Normal(), random.Normal(), random.Normal()));
    for (int i = 0; i < 20; ++i) {
      Pose pose;
      pose.R = center * ExpRotation(Vector3d::Constant(0.2 * random.Uniform()));
      dut_.Update(0.001 * (20 * k + i + 1), {.pose = pose}, &state_);
    }
    const Matrix3d& R = state_.message.pose.R;
    ASSERT_TRUE((R * R.transpose()).isIdentity(1e-12)) << k;
    ASSERT_EQ(state_.message.sequence, k + 1);
    ASSERT_LT(LogRotation(center.transpose() * R).norm(), 0.2 * 1.74) << k;
  }
}

TEST_F(PoseSenderTest, ACopiedStateGoesOnAlike) {
  for (int i = 0; i < 7; ++i) {
    Pose pose;
    pose.p.x() = 0.3 * i;
    dut_.Update(0.001 * i, {.pose = pose}, &state_);
  }
  PoseSenderState copy = state_;
  for (int i = 7; i <= 20; ++i) {
    dut_.Update(0.001 * i, {}, &state_);
    dut_.Update(0.001 * i, {}, &copy);
  }
  EXPECT_EQ(copy.message.sequence, state_.message.sequence);
  EXPECT_EQ(copy.message.pose.p, state_.message.pose.p);
  EXPECT_EQ(dut_.MakeState().message.sequence, -1);
}

TEST_F(PoseSenderTest, DoesNotAllocate) {
  ScopedNoAlloc guard;
  for (int i = 0; i < 100; ++i) {
    dut_.Update(0.001 * i, {}, &state_);
  }
  EXPECT_EQ(guard.count(), 0);
}

TEST(PoseSenderParamsTest, InvalidParametersAreNamed) {
  const auto message = [](double rate, double period) {
    PoseSenderParams params;
    params.rate = rate;
    params.period = period;
    return InvalidArgument([&] { PoseSender{params}; });
  };
  EXPECT_NE(message(0.0, 0.001).find("PoseSenderParams: field `rate`"),
            std::string::npos);
  EXPECT_NE(message(1001.0, 0.001).find("`rate`"), std::string::npos);
  EXPECT_NE(message(1001.0, 0.001).find("1001"), std::string::npos);
  EXPECT_NE(message(50.0, kNan).find("`period`"), std::string::npos);
  EXPECT_EQ(message(1000.0, 0.001), "no exception");
}

TEST(ForceSenderTest, SendsTheMeanForce) {
  const ForceSender dut{PoseSenderParams{}};
  ForceSenderState state = dut.MakeState();
  for (int i = 0; i <= 20; ++i) {
    dut.Update(0.001 * i, Vector3d(i, 0, i == 5 ? kNan : 1.0), &state);
  }
  EXPECT_EQ(state.message.sequence, 1);
  EXPECT_DOUBLE_EQ(state.message.force.x(), (210.0 - 5.0) / 19.0);
  EXPECT_DOUBLE_EQ(state.message.force.z(), 1.0);
  EXPECT_EQ(state.bad_inputs, 1);
}

}  // namespace
}  // namespace dual_proxy
