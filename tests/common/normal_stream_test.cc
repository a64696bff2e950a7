// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/normal_stream.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "no_alloc.h"

namespace dual_proxy {
namespace {

constexpr int kGroup = NormalStream::kGroup;

std::vector<double> Draw(NormalStream* dut, int count,
                         InstructionSet set = FastestInstructionSet()) {
  std::vector<double> normals(static_cast<std::size_t>(count));
  dut->Fill(count, normals.data(), set);
  return normals;
}

TEST(NormalStreamTest, SameSeedSameBitsWithEveryInstructionSet) {
  NormalStream first(7);
  NormalStream second(8);
  const std::vector<double> expected = Draw(&first, 10'007);
  EXPECT_NE(Draw(&second, 10'007), expected);
  for (const InstructionSet set : AvailableInstructionSets()) {
    NormalStream dut(7);
    EXPECT_EQ(Draw(&dut, 10'007, set), expected) << EnumToString(set);
    NormalStream continued = first;
    EXPECT_EQ(Draw(&dut, 100, set), Draw(&continued, 100));
  }
}

TEST(NormalStreamTest, WholeGroupsAreDrawn) {
  NormalStream at_once(3);
  const std::vector<double> expected = Draw(&at_once, 5 * kGroup);
  NormalStream dut(3);
  std::vector<double> normals = Draw(&dut, 2 * kGroup + 1);
  EXPECT_TRUE(std::equal(normals.begin(), normals.end(), expected.begin()));
  Draw(&dut, 0);
  normals = Draw(&dut, kGroup - 1);
  EXPECT_TRUE(std::equal(normals.begin(), normals.end(),
                         expected.begin() + 3 * kGroup));
  EXPECT_EQ(Draw(&dut, 1)[0], expected[4 * kGroup]);
}

TEST(NormalStreamTest, WritesNoMoreThanAskedFor) {
  NormalStream dut(1);
  std::vector<double> normals(40, 99.0);
  dut.Fill(21, normals.data());
  EXPECT_NE(normals[20], 99);
  EXPECT_EQ(std::count(normals.begin(), normals.end(), 99.0), 19);
}

TEST(NormalStreamTest, MomentsAndTails) {
  NormalStream dut(42);
  constexpr int kSamples = 8'000'000;
  const std::vector<double> normals = Draw(&dut, kSamples);
  double moments[5] = {};
  for (const double x : normals) {
    double power = 1;
    for (double& moment : moments) {
      moment += power / kSamples;
      power *= x;
    }
  }
  // Five standard errors of each mean.
  const double error = 5 / std::sqrt(kSamples);
  EXPECT_NEAR(moments[1], 0, error);
  EXPECT_NEAR(moments[2], 1, error * std::sqrt(2.0));
  EXPECT_NEAR(moments[3], 0, error * std::sqrt(15.0));
  EXPECT_NEAR(moments[4], 3, error * std::sqrt(96.0));
  for (const double limit : {0.1, 0.5, 1.0, 2.0, 3.0, 4.0, 4.5}) {
    double above = 0;
    double below = 0;
    for (const double x : normals) {
      above += x > limit;
      below += x < -limit;
    }
    const double expected =
        kSamples * 0.5 * std::erfc(limit / std::numbers::sqrt2);
    EXPECT_NEAR(above, expected, 5 * std::sqrt(expected)) << limit;
    EXPECT_NEAR(below, expected, 5 * std::sqrt(expected)) << limit;
  }
  const auto [least, largest] =
      std::minmax_element(normals.begin(), normals.end());
  EXPECT_LT(*least, -4.8);
  EXPECT_GT(*largest, 4.8);
  EXPECT_LT(std::max(-*least, *largest), 8.5);
}

// Numbers of a group come from different generators, or are a pair of
// Box-Muller; those of neighbouring groups from the same generators. Neither
// they nor their squares know of each other.
TEST(NormalStreamTest, LanesAndGroupsAreUncorrelated) {
  NormalStream dut(5);
  constexpr int kGroups = 200'000;
  const std::vector<double> normals = Draw(&dut, kGroup * kGroups);
  // Of about a thousand sums none is beyond five and a half standard errors.
  const double limit = 5.5 / std::sqrt(kGroups - 1);
  for (int lag = 0; lag <= 1; ++lag) {
    for (int i = 0; i < kGroup; ++i) {
      for (int k = lag == 0 ? i + 1 : 0; k < kGroup; ++k) {
        double product = 0;
        double of_squares = 0;
        for (int group = 0; group < kGroups - 1; ++group) {
          const double* x = normals.data() + kGroup * group;
          const double a = x[i];
          const double b = x[k + kGroup * lag];
          product += a * b;
          of_squares += (a * a - 1) * (b * b - 1) / 2;
        }
        EXPECT_LT(std::abs(product) / (kGroups - 1), limit)
            << lag << " " << i << " " << k;
        EXPECT_LT(std::abs(of_squares) / (kGroups - 1), limit)
            << lag << " " << i << " " << k;
      }
    }
  }
}

TEST(NormalStreamTest, PairsGoAllAround) {
  NormalStream dut(6);
  constexpr int kGroups = 100'000;
  constexpr int kSectors = 32;
  const std::vector<double> normals = Draw(&dut, kGroup * kGroups);
  double counts[kSectors] = {};
  for (int group = 0; group < kGroups; ++group) {
    const double* x = normals.data() + kGroup * group;
    for (int i = 0; i < kGroup / 2; ++i) {
      const double turn =
          std::atan2(x[kGroup / 2 + i], x[i]) / (2 * std::numbers::pi) + 0.5;
      ++counts[std::min(static_cast<int>(kSectors * turn), kSectors - 1)];
    }
  }
  const double expected = kGroup / 2 * kGroups / double{kSectors};
  for (const double count : counts) {
    EXPECT_NEAR(count, expected, 5 * std::sqrt(expected));
  }
}

TEST(NormalStreamTest, DoesNotAllocate) {
  double normals[100];
  NormalStream dut(1);
  ScopedNoAlloc guard;
  for (const InstructionSet set : AvailableInstructionSets()) {
    dut.Fill(100, normals, set);
  }
  EXPECT_EQ(guard.count(), 0);
}

}  // namespace
}  // namespace dual_proxy
