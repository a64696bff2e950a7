// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/norm.h"

#include <array>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "dual_proxy/common/random.h"
#include "no_alloc.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;
using Vector7d = Eigen::Matrix<double, 7, 1>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kLargest = std::numeric_limits<double>::max();
constexpr double kSmallest = std::numeric_limits<double>::denorm_min();

TEST(StableNormTest, IsTheLengthAtEveryMagnitude) {
  RandomStream random(3);
  for (int exponent = -1060; exponent <= 1020; exponent += 5) {
    Vector7d value;
    for (double& x : value) x = std::scalbn(random.Uniform() - 0.5, exponent);
    long double sum = 0;
    for (const double x : value) {
      const long double scaled = std::scalbn(x, -exponent);
      sum += scaled * scaled;
    }
    const double expected =
        static_cast<double>(std::scalbn(std::sqrt(sum), exponent));
    EXPECT_NEAR(StableNorm(value), expected, 1e-15 * expected + kSmallest)
        << exponent;
  }
}

TEST(StableNormTest, HugeTinyAndZero) {
  EXPECT_NEAR(StableNorm(Vector3d(3e300, 0, -4e300)), 5e300, 1e285);
  EXPECT_EQ(StableNorm(Vector3d(0, kLargest, 0)), kLargest);
  EXPECT_EQ(StableNorm(Vector3d(kLargest, kLargest, 0)), kInfinity);
  EXPECT_NEAR(StableNorm(Vector3d(3e-300, 4e-300, 0)), 5e-300, 1e-315);
  EXPECT_EQ(StableNorm(Vector3d(0, 0, -kSmallest)), kSmallest);
  EXPECT_EQ(StableNorm(kSmallest * Vector3d(3, 4, 0)), 5 * kSmallest);
  EXPECT_EQ(StableNorm(Vector3d(1, 1e-300, 0)), 1);
  EXPECT_EQ(StableNorm(Vector3d(0, -0.0, 0)), 0);
}

TEST(StableNormTest, IsNotFiniteIfAnEntryIsNot) {
  for (int i = 0; i < 3; ++i) {
    for (const double bad : {kInfinity, -kInfinity, kNan}) {
      for (const double other : {0.0, 1.0, 1e300, kInfinity}) {
        Vector3d value = Vector3d::Constant(other);
        value(i) = bad;
        EXPECT_FALSE(std::isfinite(StableNorm(value)));
      }
    }
  }
  EXPECT_EQ(StableNorm(Vector3d(0, -kInfinity, 1)), kInfinity);
}

// A state whose size changes moves what comes after it in memory.
TEST(StableNormTest, SameBitsWhereverItLies) {
  RandomStream random(4);
  for (int trial = 0; trial < 1000; ++trial) {
    alignas(64) std::array<double, 16> memory{};
    Vector7d value;
    for (double& x : value) x = random.Normal();
    const double expected = StableNorm(value);
    for (int offset = 0; offset < 8; ++offset) {
      Eigen::Map<Vector7d> moved(memory.data() + offset);
      moved = value;
      ASSERT_EQ(StableNorm(moved), expected);
    }
  }
}

TEST(StableNormTest, DoesNotAllocate) {
  ScopedNoAlloc guard;
  const double norm = StableNorm(Vector3d(1e200, 2e200, 2e200));
  EXPECT_EQ(guard.count(), 0);
  EXPECT_NEAR(norm, 3e200, 1e185);
}

}  // namespace
}  // namespace dual_proxy
