// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/random.h"

#include <cmath>
#include <cstdint>
#include <set>

#include <gtest/gtest.h>

namespace dual_proxy {
namespace {

TEST(RandomStreamTest, SameSeedSameNumbersOtherSeedOthers) {
  RandomStream a(7);
  RandomStream b(7);
  RandomStream c(8);
  bool differs = false;
  for (int i = 0; i < 1000; ++i) {
    const double x = a.Normal();
    EXPECT_EQ(x, b.Normal());
    differs |= x != c.Normal();
  }
  EXPECT_TRUE(differs);
}

TEST(RandomStreamTest, CopyContinuesWithTheSameNumbers) {
  RandomStream a(1);
  a.Normal();  // Leaves a spare normal behind, which the copy must have too.
  RandomStream b = a;
  for (int i = 0; i < 5; ++i) EXPECT_EQ(a.Normal(), b.Normal());
}

TEST(RandomStreamTest, MomentsOfUniformAndNormal) {
  RandomStream dut(42);
  constexpr int kSamples = 200'000;
  double uniform = 0, first = 0, second = 0, fourth = 0;
  for (int i = 0; i < kSamples; ++i) {
    const double u = dut.Uniform();
    ASSERT_GE(u, 0.0);
    ASSERT_LT(u, 1.0);
    uniform += u / kSamples;
    const double x = dut.Normal();
    ASSERT_TRUE(std::isfinite(x));
    first += x / kSamples;
    second += x * x / kSamples;
    fourth += x * x * x * x / kSamples;
  }
  // Five standard errors of each mean.
  EXPECT_NEAR(uniform, 0.5, 5 * 0.289 / std::sqrt(kSamples));
  EXPECT_NEAR(first, 0.0, 5 / std::sqrt(kSamples));
  EXPECT_NEAR(second, 1.0, 5 * std::sqrt(2.0 / kSamples));
  EXPECT_NEAR(fourth, 3.0, 5 * std::sqrt(96.0 / kSamples));
}

TEST(SplitSeedTest, StreamsAndSeedsDoNotMeet) {
  std::set<std::uint64_t> seeds;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    for (std::uint64_t stream = 0; stream < 100; ++stream) {
      seeds.insert(SplitSeed(seed, stream));
    }
  }
  EXPECT_EQ(seeds.size(), 10000u);
  EXPECT_EQ(SplitSeed(3, 2), SplitSeed(3, 2));
}

}  // namespace
}  // namespace dual_proxy
