// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/elementary.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "dual_proxy/common/random.h"

namespace dual_proxy {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr long double kPi = std::numbers::pi_v<long double>;

/** How far values are from exact ones, in units in the last place, and a digest
of their bits. */
class Errors {
 public:
  void Add(double value, long double exact) {
    const double rounded = std::abs(static_cast<double>(exact));
    const double ulp = std::nextafter(rounded, kInfinity) - rounded;
    worst_ =
        std::max(worst_, static_cast<double>(std::abs(value - exact) / ulp));
    // Fowler, Noll and Vo's.
    digest_ = (digest_ ^ std::bit_cast<std::uint64_t>(value)) * 0x100000001b3;
  }

  double worst() const { return worst_; }
  std::uint64_t digest() const { return digest_; }

 private:
  double worst_{0};
  std::uint64_t digest_{0xcbf29ce484222325};
};

/** Between -largest and largest, of all magnitudes from 1e-12 of it on. The
same on every machine: made without the C library. */
std::vector<double> MakeArguments(double largest) {
  RandomStream random(1);
  std::vector<double> result = {0.0, -0.0, 1e-300, largest, -largest};
  while (result.size() < 200'000) {
    double x = largest * (2 * random.Uniform() - 1);
    if (result.size() % 2)
      x = std::ldexp(x, -static_cast<int>(40 * random.Uniform()));
    result.push_back(x);
  }
  return result;
}

// The digests are what this test computed first: whoever gets others has other
// results than everybody else.

TEST(ElementaryTest, SinCos) {
  Errors sines;
  Errors cosines;
  for (const double largest : {10.0, 1e6}) {
    for (const double x : MakeArguments(largest)) {
      const auto [sin, cos] = CalcSinCos(x);
      sines.Add(sin, std::sin(static_cast<long double>(x)));
      cosines.Add(cos, std::cos(static_cast<long double>(x)));
    }
  }
  // Next to multiples of pi/2, where all but what was rounded off cancels.
  for (int i = 1; i < 600'000; i += 7) {
    const double x = static_cast<double>(kPi / 2 * i);
    const auto [sin, cos] = CalcSinCos(x);
    if (i % 2) {
      sines.Add(sin, std::sin(static_cast<long double>(x)));
    } else {
      cosines.Add(cos, std::cos(static_cast<long double>(x)));
    }
  }
  EXPECT_LT(sines.worst(), 0.9);
  EXPECT_LT(cosines.worst(), 0.9);
  EXPECT_EQ(sines.digest(), 0x18c79d4faef6c52a);
  EXPECT_EQ(cosines.digest(), 0xd4d11e614ba7f486);
}

TEST(ElementaryTest, SinCosNextToZeros) {
  // sin(pi - d) is d: what the double next to pi is off by.
  EXPECT_DOUBLE_EQ(CalcSinCos(std::numbers::pi).sin, 0x1.1a62633145c07p-53);
  EXPECT_DOUBLE_EQ(CalcSinCos(std::numbers::pi / 2).cos, 0x1.1a62633145c07p-54);
  EXPECT_DOUBLE_EQ(CalcSinCos(-std::numbers::pi / 2).cos,
                   0x1.1a62633145c07p-54);
}

TEST(ElementaryTest, SinCosOfWhatIsNoAngle) {
  const auto [sin, cos] = CalcSinCos(1e300);
  EXPECT_NEAR(sin * sin + cos * cos, 1, 1e-15);
  for (const double x : {kInfinity, -kInfinity, std::nan("")}) {
    EXPECT_TRUE(std::isnan(CalcSinCos(x).sin));
    EXPECT_TRUE(std::isnan(CalcSinCos(x).cos));
  }
}

TEST(ElementaryTest, Atan2) {
  Errors errors;
  const std::vector<double> values = MakeArguments(3);
  for (std::size_t i = 1; i < values.size(); ++i) {
    errors.Add(Atan2(values[i], values[i - 1]),
               std::atan2(static_cast<long double>(values[i]),
                          static_cast<long double>(values[i - 1])));
  }
  EXPECT_LT(errors.worst(), 0.9);
  EXPECT_EQ(errors.digest(), 0x400d6ed82d78dbd1);
  // Every quadrant, and its borders.
  for (const double x : {-2.0, -1.0, -0.0, 0.0, 1.0, 2.0}) {
    for (const double y : {-2.0, -1.0, -0.0, 0.0, 1.0, 2.0}) {
      EXPECT_DOUBLE_EQ(Atan2(y, x), std::atan2(y, x)) << y << ' ' << x;
      EXPECT_EQ(std::signbit(Atan2(y, x)), std::signbit(y)) << y << ' ' << x;
    }
  }
  for (const double bad : {kInfinity, -kInfinity, std::nan("")}) {
    EXPECT_TRUE(std::isnan(Atan2(bad, 1)));
    EXPECT_TRUE(std::isnan(Atan2(1, bad)));
  }
}

TEST(ElementaryTest, Exp) {
  Errors exps;
  Errors less_ones;
  for (const double largest : {2.0, 700.0}) {
    for (const double x : MakeArguments(largest)) {
      exps.Add(Exp(x), std::exp(static_cast<long double>(x)));
      less_ones.Add(ExpMinusOne(x), std::expm1(static_cast<long double>(x)));
    }
  }
  EXPECT_LT(exps.worst(), 1);
  EXPECT_LT(less_ones.worst(), 2);
  EXPECT_EQ(exps.digest(), 0xc8d7aca6158e09cc);
  EXPECT_EQ(less_ones.digest(), 0xb489f6b6da4239e2);
  EXPECT_EQ(Exp(0), 1);
  EXPECT_EQ(Exp(-700.1), 0);
  EXPECT_EQ(Exp(-kInfinity), 0);
  EXPECT_EQ(Exp(kInfinity), kInfinity);
  EXPECT_EQ(ExpMinusOne(-kInfinity), -1);
  EXPECT_EQ(ExpMinusOne(kInfinity), kInfinity);
  EXPECT_TRUE(std::isnan(Exp(std::nan(""))));
  EXPECT_TRUE(std::isnan(ExpMinusOne(std::nan(""))));
}

}  // namespace
}  // namespace dual_proxy
