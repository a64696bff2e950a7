// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/vector_rate_limiter.h"

#include <limits>

#include <gtest/gtest.h>

#include "no_alloc.h"
#include "test_support.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;

TEST(VectorRateLimiterTest, LimitsTheNormAndKeepsTheDirection) {
  const Vector3d result = RateLimit({0, 0, 0}, {30, 40, 0}, 0.05);
  EXPECT_TRUE(result.isApprox(Vector3d(0.03, 0.04, 0), 1e-15));
}

TEST(VectorRateLimiterTest, WithinReachTheTargetComesBackToTheBit) {
  const Vector3d target(0.1, 0.2, 0.3);
  EXPECT_EQ(RateLimit({0.11, 0.19, 0.3}, target, 0.05), target);
  EXPECT_EQ(RateLimit(target, target, 0.0), target);
}

TEST(VectorRateLimiterTest, TargetsThatAreNotFiniteAreNotApproached) {
  const Vector3d previous(1, 2, 3);
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(),
                           std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(RateLimit(previous, {0, bad, 0}, 0.05), previous);
    EXPECT_EQ(Saturate({bad, 0, 0}, 1.0), Vector3d::Zero());
  }
}

TEST(VectorRateLimiterTest, FarTargetsDoNotOverflow) {
  EXPECT_TRUE(Saturate({1e300, 0, 0}, 2.0).isApprox(Vector3d(2, 0, 0)));
  EXPECT_TRUE(
      RateLimit({0, 0, 0}, {0, 1e300, 0}, 2.0).isApprox(Vector3d(0, 2, 0)));
}

TEST(VectorRateLimiterTest, SaturateKeepsWhatIsWithinToTheBit) {
  const Vector3d value(0.1, -0.2, 0.3);
  EXPECT_EQ(Saturate(value, 1.0), value);
  EXPECT_TRUE(Saturate(value, 0.0).isZero(0.0));
}

TEST(VectorRateLimiterTest, RandomStepsAreBoundedAndArrive) {
  RandomStream random(6);
  for (int i = 0; i < 1000; ++i) {
    Vector3d value = RandomVector(10.0, &random);
    const Vector3d target = RandomVector(10.0, &random);
    const double max_step = 0.5 + random.Uniform();
    const int steps = static_cast<int>((target - value).norm() / max_step) + 2;
    for (int k = 0; k < steps; ++k) {
      const Vector3d next = RateLimit(value, target, max_step);
      ASSERT_LE((next - value).norm(), max_step * (1.0 + 1e-12));
      value = next;
    }
    ASSERT_EQ(value, target) << i;
  }
}

TEST(VectorRateLimiterTest, ABoundOfZeroIsNoneWhereThatIsSaid) {
  const Vector3d value(3, 0, 4);
  EXPECT_TRUE(Saturate(value, 0).isZero(0));
  EXPECT_EQ(SaturateUnlessZero(value, 0), value);
  EXPECT_EQ(SaturateUnlessZero(value, 1), Saturate(value, 1));
}

TEST(VectorRateLimiterTest, DoesNotAllocate) {
  Vector3d value(1, 2, 3);
  ScopedNoAlloc guard;
  value = Saturate(RateLimit(value, {4, 5, 6}, 0.1), 0.2);
  EXPECT_EQ(guard.count(), 0);
  EXPECT_NEAR(value.norm(), 0.2, 1e-15);
}

}  // namespace
}  // namespace dual_proxy
