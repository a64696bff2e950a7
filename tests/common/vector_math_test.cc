// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/vector_math.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "dual_proxy/common/random.h"

namespace dual_proxy {
namespace {

DUAL_PROXY_INLINE void ExpBody(const double* __restrict x, int count,
                               double* __restrict y) {
  for (int i = 0; i < count; ++i) y[i] = ExpOfNonPositive(x[i]);
}

DUAL_PROXY_INLINE void LogBody(const double* __restrict x, int count,
                               double* __restrict y) {
  for (int i = 0; i < count; ++i) y[i] = LogOfPositive(x[i]);
}

DUAL_PROXY_INLINE void SinCosBody(const double* __restrict t, int count,
                                  double* __restrict sin,
                                  double* __restrict cos) {
  for (int i = 0; i < count; ++i) SinCosOfQuarterTurns(t[i], sin + i, cos + i);
}

/** How far `value` is from `exact`, in units in the last place. */
double ErrorUlp(double value, long double exact) {
  const double rounded = std::abs(static_cast<double>(exact));
  const double ulp =
      std::nextafter(rounded, std::numeric_limits<double>::infinity()) -
      rounded;
  return static_cast<double>(std::abs(value - exact) / ulp);
}

/** Calls `run(instruction_set)` for each that there is; results must be the
same bits. Returns them. */
template <typename Run>
std::vector<double> SameBits(const Run& run) {
  const std::vector<double> expected = run(InstructionSet::kBaseline);
  for (const InstructionSet set : AvailableInstructionSets()) {
    EXPECT_EQ(run(set), expected) << EnumToString(set);
  }
  return expected;
}

TEST(InstructionSetTest, BaselineFirstFastestLast) {
  const auto sets = AvailableInstructionSets();
  ASSERT_GE(sets.size(), 1u);
  EXPECT_EQ(sets.front(), InstructionSet::kBaseline);
  EXPECT_EQ(sets.back(), FastestInstructionSet());
  EXPECT_TRUE(std::is_sorted(sets.begin(), sets.end()));
}

TEST(VectorMathTest, ExpOfNonPositive) {
  RandomStream random(1);
  std::vector<double> x = {0, -0.0, -1e-300, -1e-17, -std::log(2) / 2, -700};
  while (x.size() < 100'000) {
    const double scale = x.size() % 2 ? 700 : 2;
    x.push_back(-scale * random.Uniform());
  }
  const int count = static_cast<int>(x.size());
  const std::vector<double> y = SameBits([&](InstructionSet set) {
    std::vector<double> result(x.size());
    PerInstructionSet<ExpBody>::Run(set, x.data(), count, result.data());
    return result;
  });
  double worst = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    worst = std::max(worst,
                     ErrorUlp(y[i], std::exp(static_cast<long double>(x[i]))));
  }
  EXPECT_LE(worst, 2);
  EXPECT_EQ(ExpOfNonPositive(0), 1);
  for (const double below : {-700.01, -746.0, -1e10, -1e308,
                             -std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(ExpOfNonPositive(below), 0) << below;
  }
}

TEST(VectorMathTest, LogOfPositive) {
  RandomStream random(2);
  std::vector<double> x = {1,
                           0.5,
                           2,
                           std::sqrt(0.5),
                           std::nextafter(std::sqrt(0.5), 0),
                           std::nextafter(1, 0),
                           std::nextafter(1, 2),
                           0x1p-52,
                           std::numeric_limits<double>::min(),
                           std::numeric_limits<double>::max()};
  while (x.size() < 100'000) {
    const double u = 1 - random.Uniform();
    x.push_back(x.size() % 2 ? u : std::exp(600 * (u - 0.5)));
  }
  const int count = static_cast<int>(x.size());
  const std::vector<double> y = SameBits([&](InstructionSet set) {
    std::vector<double> result(x.size());
    PerInstructionSet<LogBody>::Run(set, x.data(), count, result.data());
    return result;
  });
  double worst = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    worst = std::max(worst,
                     ErrorUlp(y[i], std::log(static_cast<long double>(x[i]))));
  }
  EXPECT_LE(worst, 2);
  EXPECT_EQ(LogOfPositive(1), 0);
}

TEST(VectorMathTest, SinCosOfQuarterTurns) {
  RandomStream random(3);
  std::vector<double> t = {0, 0.5, -0.5, 1e-300, -1e-20};
  while (t.size() < 100'000) t.push_back(random.Uniform() - 0.5);
  const int count = static_cast<int>(t.size());
  const std::vector<double> y = SameBits([&](InstructionSet set) {
    std::vector<double> result(2 * t.size());
    PerInstructionSet<SinCosBody>::Run(set, t.data(), count, result.data(),
                                       result.data() + count);
    return result;
  });
  double worst = 0;
  for (std::size_t i = 0; i < t.size(); ++i) {
    const long double angle = std::numbers::pi_v<long double> / 2 * t[i];
    worst = std::max(worst, ErrorUlp(y[i], std::sin(angle)));
    worst = std::max(worst, ErrorUlp(y[t.size() + i], std::cos(angle)));
  }
  EXPECT_LE(worst, 2);
  EXPECT_EQ(y[0], 0);
  EXPECT_EQ(y[t.size()], 1);
}

}  // namespace
}  // namespace dual_proxy
