// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/inverse_kinematics.h"

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "dual_proxy/common/arm_limits.h"
#include "dual_proxy/common/random.h"
#include "dual_proxy/common/rotation.h"
#include "test_arm.h"

namespace dual_proxy {
namespace {

constexpr int kCases = 100;

class FindPostureTest : public ::testing::Test {
 protected:
  Pose CalcPose(const Vector7& q) const {
    Pose X_BE;
    arm_.Calc(q, Vector7::Zero(), &X_BE, &terms_);
    return X_BE;
  }

  std::optional<Vector7> Find(const Pose& X_BE) const {
    return FindPosture<7>(arm_, X_BE, kTestArmAtRest, limits_.joint_lower,
                          limits_.joint_upper);
  }

  /** At most `share` of the joints' ranges away from rest. */
  Vector7 DrawPosture(double share) {
    Vector7 q;
    for (int i = 0; i < 7; ++i) {
      const double lower = limits_.joint_lower(i);
      q(i) = lower + random_.Uniform() * (limits_.joint_upper(i) - lower);
    }
    return kTestArmAtRest + share * (q - kTestArmAtRest);
  }

  const ArmModel<7> arm_{MakeTestArm()};
  const ArmLimits<7> limits_;
  RandomStream random_{1};
  mutable ModelTerms<7> terms_;
};

TEST_F(FindPostureTest, ReachesThePoseWithTheNearestPosture) {
  for (int k = 0; k < kCases; ++k) {
    const Vector7 there = DrawPosture(0.3);
    const Pose X_BE = CalcPose(there);
    const std::optional<Vector7> q = Find(X_BE);
    ASSERT_TRUE(q) << there.transpose();
    const Pose found = CalcPose(*q);
    EXPECT_LT((found.p - X_BE.p).norm(), 2e-9);
    EXPECT_LT(LogRotation(found.R * X_BE.R.transpose()).norm(), 2e-9);
    // One joint more than the pose has: nothing is left of the way to rest
    // along what does not move the tool.
    const Eigen::FullPivLU<Jacobian<7>> lu(terms_.J_BE);
    const Vector7 idle = lu.kernel().col(0).normalized();
    EXPECT_LT(std::abs(idle.dot(kTestArmAtRest - *q)), 1e-9);
  }
}

TEST_F(FindPostureTest, StaysWithinLimits) {
  int found = 0;
  int at_limit = 0;
  for (int k = 0; k < kCases; ++k) {
    const Pose X_BE = CalcPose(DrawPosture(0.9));
    const std::optional<Vector7> q = Find(X_BE);
    if (!q) continue;
    ++found;
    EXPECT_LT((CalcPose(*q).p - X_BE.p).norm(), 2e-9);
    EXPECT_TRUE((q->array() >= limits_.joint_lower.array()).all());
    EXPECT_TRUE((q->array() <= limits_.joint_upper.array()).all());
    at_limit += q->cwiseEqual(limits_.joint_lower).any() ||
                q->cwiseEqual(limits_.joint_upper).any();
  }
  EXPECT_GT(found, 0.7 * kCases);
  EXPECT_GT(at_limit, 0);
}

TEST_F(FindPostureTest, RestIsItsOwn) {
  const std::optional<Vector7> q = Find(CalcPose(kTestArmAtRest));
  ASSERT_TRUE(q);
  EXPECT_LT((*q - kTestArmAtRest).norm(), 1e-12);
}

TEST_F(FindPostureTest, SaysThatItFoundNone) {
  Pose X_BE = CalcPose(kTestArmAtRest);
  X_BE.p.x() = 2;
  EXPECT_FALSE(Find(X_BE));
}

TEST(FindPostureSixJointsTest, ReachesThePose) {
  const ArmModel<6> arm(MakeSixJointArm());
  const JointVector<6> limit = JointVector<6>::Constant(6.28);
  const JointVector<6> there =
      kSixJointArmAtRest + JointVector<6>{{0.2, -0.1, 0.2, 0.3, -0.2, 0.1}};
  Pose X_BE;
  ModelTerms<6> terms;
  arm.Calc(there, JointVector<6>::Zero(), &X_BE, &terms);
  const std::optional<JointVector<6>> q =
      FindPosture<6>(arm, X_BE, kSixJointArmAtRest, -limit, limit);
  ASSERT_TRUE(q);
  EXPECT_LT((*q - there).norm(), 1e-8);
}

}  // namespace
}  // namespace dual_proxy
