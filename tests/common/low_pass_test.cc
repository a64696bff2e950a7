// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/low_pass.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace dual_proxy {
namespace {

TEST(LowPassGainTest, ZeroCutoffPassesEverything) {
  EXPECT_EQ(LowPassGain(0.0, 1e-3), 1.0);
}

TEST(LowPassGainTest, StepReachesOneMinusOneOverEAfterItsTimeConstant) {
  const double cutoff = 10.0;
  const double period = 1e-4;
  const double time_constant = 1.0 / (2.0 * std::numbers::pi * cutoff);
  double y = 0;
  for (int i = 0; i < std::lround(time_constant / period); ++i) {
    y += LowPassGain(cutoff, period) * (1.0 - y);
  }
  EXPECT_NEAR(y, 1.0 - std::exp(-1.0), 1e-3);
}

TEST(LowPassGainTest, StaysStableWithCutoffFarAboveTheSampleRate) {
  EXPECT_LE(LowPassGain(1e9, 1e-3), 1.0);
}

}  // namespace
}  // namespace dual_proxy
