// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/number_text.h"

#include <bit>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <random>
#include <string>
#include <utility>

#include <gtest/gtest.h>

namespace dual_proxy {
namespace {

TEST(NumberTextTest, IsWhatPythonWrites) {
  const std::pair<double, const char*> cases[] = {
      {0, "0.0"},
      {-0.0, "-0.0"},
      {8, "8.0"},
      {-100, "-100.0"},
      {0.1, "0.1"},
      {0.1 + 0.2, "0.30000000000000004"},
      {1.0 / 3, "0.3333333333333333"},
      {119.00000000000021, "119.00000000000021"},
      {1e-4, "0.0001"},
      {9.999999999999999e-05, "9.999999999999999e-05"},
      {1e-5, "1e-05"},
      {1e15, "1000000000000000.0"},
      {9007199254740994, "9007199254740994.0"},
      {9999999999999998, "9999999999999998.0"},
      {1e16, "1e+16"},
      {123456789012345680, "1.2345678901234568e+17"},
      {5e-324, "5e-324"},
      {-2.2250738585072014e-308, "-2.2250738585072014e-308"},
      {1.7976931348623157e308, "1.7976931348623157e+308"},
      {std::numeric_limits<double>::quiet_NaN(), "nan"},
      {std::numeric_limits<double>::infinity(), "inf"},
      {-std::numeric_limits<double>::infinity(), "-inf"},
  };
  for (const auto& [value, text] : cases) EXPECT_EQ(ShortestText(value), text);
}

TEST(NumberTextTest, ReadsBackAsTheSameNumber) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 10000; ++i) {
    const double value = std::bit_cast<double>(random() >> 1);
    if (value != value) continue;
    EXPECT_EQ(std::strtod(ShortestText(value).c_str(), nullptr), value);
  }
}

}  // namespace
}  // namespace dual_proxy
