// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/franka/push_test.h"

#include <limits>

#include <gtest/gtest.h>

namespace dual_proxy {
namespace {

using Eigen::Vector3d;

const Vector3d kStart(0.4, 0.1, 0.3);

class PushTestTest : public ::testing::Test {
 protected:
  // A push that displaces by `x` and is sensed as `force`, for `cycles`.
  PushResult Push(const Vector3d& x, const Vector3d& force, int cycles = 100) {
    PushResult result = PushResult::kNone;
    for (int i = 0; i < cycles && result == PushResult::kNone; ++i) {
      result = dut_.Update(kStart + x, force);
    }
    return result;
  }

  void SetUp() override { Push(Vector3d::Zero(), Vector3d::Zero()); }

  PushTest dut_{5, 0.001};
};

TEST_F(PushTestTest, AForceAgainstTheDisplacementPasses) {
  EXPECT_EQ(Push({0.003, 0, 0}, {-8, 0, 0}), PushResult::kPassed);
  EXPECT_DOUBLE_EQ(dut_.cosine(), 1);
}

TEST_F(PushTestTest, TheArmMayYieldAskew) {
  EXPECT_EQ(Push({0.003, 0, 0}, {-8, 8, 4}), PushResult::kPassed);
}

TEST_F(PushTestTest, TheWrongSignFails) {
  EXPECT_EQ(Push({0.003, 0, 0}, {8, 0, 0}), PushResult::kFailed);
  EXPECT_DOUBLE_EQ(dut_.cosine(), -1);
}

TEST_F(PushTestTest, TheWrongAxisFails) {
  EXPECT_EQ(Push({0.003, 0, 0}, {0, -8, 0}), PushResult::kFailed);
}

TEST_F(PushTestTest, WhatIsTooLittleOrTooShortIsNoPush) {
  EXPECT_EQ(Push({0.003, 0, 0}, {4, 0, 0}), PushResult::kNone);
  EXPECT_EQ(Push({0.0004, 0, 0}, {8, 0, 0}), PushResult::kNone);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(Push({0.003, 0, 0}, {nan, 0, 0}), PushResult::kNone);
  // A knock, and then the right push: only the latter counts.
  EXPECT_EQ(Push({0.003, 0, 0}, {8, 0, 0}, 99), PushResult::kNone);
  EXPECT_EQ(Push({0, 0, 0}, {0, 0, 0}, 1), PushResult::kNone);
  EXPECT_EQ(Push({0.003, 0, 0}, {-8, 0, 0}), PushResult::kPassed);
}

}  // namespace
}  // namespace dual_proxy
