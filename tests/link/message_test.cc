// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/link/message.h"

#include <limits>

#include <gtest/gtest.h>

namespace dual_proxy {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(MessageTest, EmptyMessagesAreValidAndCarryNoSequence) {
  EXPECT_EQ(PoseMessage{}.sequence, -1);
  EXPECT_EQ(ForceMessage{}.sequence, -1);
  EXPECT_TRUE(IsValid(PoseMessage{}));
  EXPECT_TRUE(IsValid(ForceMessage{}));
}

TEST(MessageTest, EveryFieldIsChecked) {
  for (const double bad : {kNan, kInfinity, -kInfinity}) {
    PoseMessage message;
    message.send_time = bad;
    EXPECT_FALSE(IsFinite(message) || IsValid(message));
    for (int i = 0; i < 3; ++i) {
      message = {};
      message.pose.p(i) = bad;
      EXPECT_FALSE(IsFinite(message) || IsValid(message)) << i;
      ForceMessage force;
      force.force(i) = bad;
      EXPECT_FALSE(IsFinite(force) || IsValid(force)) << i;
    }
    for (int i = 0; i < 9; ++i) {
      message = {};
      message.pose.R(i) = bad;
      EXPECT_FALSE(IsFinite(message) || IsValid(message)) << i;
      message = {};
      message.force_selection(i) = bad;
      EXPECT_FALSE(IsFinite(message) || IsValid(message)) << i;
      message = {};
      message.moment_selection(i) = bad;
      EXPECT_FALSE(IsFinite(message) || IsValid(message)) << i;
    }
    ForceMessage force;
    force.send_time = bad;
    EXPECT_FALSE(IsFinite(force) || IsValid(force));
  }
}

TEST(MessageTest, FiniteIsNotEnoughForARotationOrASelection) {
  PoseMessage message;
  message.pose.R *= 2.0;
  EXPECT_TRUE(IsFinite(message));
  EXPECT_FALSE(IsValid(message));
  message = {};
  // Would amplify every force tenfold.
  message.force_selection = 10.0 * Eigen::Matrix3d::Identity();
  EXPECT_FALSE(IsValid(message));
}

TEST(MessageTest, SelectionMustBeAnOrthogonalProjection) {
  const Eigen::Vector3d n = Eigen::Vector3d(1, 2, 3).normalized();
  EXPECT_TRUE(IsSelection(Eigen::Matrix3d::Zero()));
  EXPECT_TRUE(IsSelection(Eigen::Matrix3d::Identity()));
  EXPECT_TRUE(IsSelection(n * n.transpose()));
  EXPECT_TRUE(IsSelection(Eigen::Matrix3d::Identity() - n * n.transpose()));
  Eigen::Matrix3d oblique = Eigen::Matrix3d::Zero();
  oblique(0, 0) = 1.0;
  oblique(0, 1) = 5.0;  // Idempotent, but not symmetric.
  ASSERT_TRUE((oblique * oblique).isApprox(oblique));
  EXPECT_FALSE(IsSelection(oblique));
  EXPECT_FALSE(IsSelection(0.5 * Eigen::Matrix3d::Identity()));
}

}  // namespace
}  // namespace dual_proxy
