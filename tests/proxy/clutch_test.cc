// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/clutch.h"

#include <limits>

#include <gtest/gtest.h>

#include "dual_proxy/common/rotation.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

class ClutchTest : public ::testing::Test {
 protected:
  // A handle that turns and moves on steadily.
  static Pose Handle(int tick) {
    return {Vector3d(1e-4, -2e-4, 5e-5) * tick,
            ExpRotation(Vector3d(0, 1e-3, 2e-3) * tick)};
  }

  Clutch dut_{{}, 0.001};
  ClutchState state_ = dut_.MakeState();
};

TEST_F(ClutchTest, IsNotThereUntilItIsPressed) {
  for (int i = 0; i < 100; ++i) {
    dut_.Update(false, Handle(i), &state_);
    EXPECT_EQ(state_.pose.p, Handle(i).p);
    EXPECT_EQ(state_.pose.R, Handle(i).R);
    EXPECT_EQ(state_.engagement, 1);
  }
}

TEST_F(ClutchTest, HoldsAndGoesOnFromThere) {
  for (int i = 0; i < 100; ++i) dut_.Update(false, Handle(i), &state_);
  for (int i = 100; i < 400; ++i) {
    dut_.Update(true, Handle(i), &state_);
    ASSERT_EQ(state_.pose.p, Handle(99).p);
    ASSERT_EQ(state_.pose.R, Handle(99).R);
  }
  // As it is released nothing jumps; afterwards it moves with the handle.
  for (int i = 400; i < 500; ++i) {
    const Vector3d before = state_.pose.p;
    dut_.Update(false, Handle(i), &state_);
    const Vector3d step = i == 400 ? Vector3d(Vector3d::Zero())
                                   : Vector3d(Handle(1).p - Handle(0).p);
    ASSERT_LT((state_.pose.p - before - step).norm(), 1e-15) << i;
  }
  const Matrix3d turned = Handle(499).R * Handle(400).R.transpose();
  EXPECT_LT((state_.pose.R - turned * Handle(99).R).norm(), 1e-12);
  // And again, from the home that it has now.
  const Pose held = state_.pose;
  for (int i = 0; i < 50; ++i) dut_.Update(true, Handle(i), &state_);
  dut_.Update(false, Handle(50), &state_);
  EXPECT_EQ(state_.pose.p, held.p);
}

TEST_F(ClutchTest, EngagementFallsFastAndGrowsSlowly) {
  for (int i = 0; i < 50; ++i) dut_.Update(true, Handle(i), &state_);
  EXPECT_NEAR(state_.engagement, 0.5, 1e-12);
  for (int i = 0; i < 60; ++i) dut_.Update(true, Handle(i), &state_);
  EXPECT_EQ(state_.engagement, 0);
  dut_.Update(false, Handle(0), &state_);
  EXPECT_NEAR(state_.engagement, 1 / 600.0, 1e-12);
  for (int i = 0; i < 600; ++i) dut_.Update(false, Handle(0), &state_);
  EXPECT_EQ(state_.engagement, 1);
}

TEST_F(ClutchTest, StaysPressedWithoutAPose) {
  Pose none;
  none.p.x() = std::numeric_limits<double>::quiet_NaN();
  dut_.Update(false, Handle(7), &state_);
  dut_.Update(true, none, &state_);
  EXPECT_EQ(state_.pose.p, Handle(7).p);
  dut_.Update(false, none, &state_);
  EXPECT_TRUE(state_.clutched);
  EXPECT_EQ(state_.pose.p, Handle(7).p);
  dut_.Update(false, Handle(30), &state_);
  EXPECT_FALSE(state_.clutched);
  EXPECT_EQ(state_.pose.p, Handle(7).p);
}

// The robot is where the home is: it must not go to the handle.
TEST_F(ClutchTest, PressedFromTheStartItHoldsTheHome) {
  dut_.Update(true, Handle(100), &state_);
  EXPECT_TRUE(state_.pose.p.isZero(0));
  dut_.Update(false, Handle(100), &state_);
  EXPECT_TRUE(state_.pose.p.isZero(0));
}

TEST_F(ClutchTest, DoesNotAllocate) {
  ScopedNoAlloc guard;
  dut_.Update(true, Handle(1), &state_);
  dut_.Update(false, Handle(2), &state_);
  EXPECT_EQ(guard.count(), 0);
}

TEST(ClutchParamsTest, AreChecked) {
  EXPECT_EQ(ValidationError(ClutchParams{.engage_time = 0}),
            "ClutchParams: field `engage_time` expected a finite value > 0, "
            "got 0");
  EXPECT_THROW(Clutch({.release_time = -1}, 0.001), std::invalid_argument);
  EXPECT_THROW(Clutch({}, 0), std::invalid_argument);
}

}  // namespace
}  // namespace dual_proxy
