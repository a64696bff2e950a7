// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/joint_limits.h"

#include <gtest/gtest.h>

#include "dual_proxy/common/random.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

Vector7 Middle(const JointLimitsParams<7>& params) {
  return 0.5 * (params.lower + params.upper);
}

TEST(JointLimitsTest, FarFromAllLimitsNothingIsNear) {
  const JointLimits<7> dut;
  const Vector7 q = Middle(dut.params());
  EXPECT_FALSE(dut.IsNear(q, 0.4 * dut.params().speed));
  EXPECT_TRUE(dut.IsNear(q, 0.5 * dut.params().speed));
  EXPECT_TRUE(dut.IsNear(dut.params().upper, Vector7::Zero()));
  EXPECT_TRUE(dut.IsNear(dut.params().lower, Vector7::Zero()));
}

// Whatever is commanded: driven at full acceleration, a joint stays within its
// speed and its ends, with the margin.
TEST(JointLimitsTest, WhateverIsCommandedTheMarginsStay) {
  const JointLimits<7> dut;
  const JointLimitsParams<7>& params = dut.params();
  const Vector7 speed = (1 - params.speed_margin) * params.speed;
  RandomStream random(3);
  for (int run = 0; run < 20; ++run) {
    Vector7 q = Middle(params);
    Vector7 v = Vector7::Zero();
    Vector7 command;
    for (int i = 0; i < 4000; ++i) {
      if (i % 400 == 0) {
        for (double& a : command) a = 400 * (random.Uniform() - 0.5);
      }
      v += 0.001 * dut.Limit(q, v, command);
      q += 0.001 * v;
      ASSERT_TRUE((v.array().abs() <= speed.array() + 1e-9).all()) << i;
      const double margin = params.position_margin - 1e-9;
      ASSERT_TRUE((q.array() <= params.upper.array() - margin).all()) << i;
      ASSERT_TRUE((q.array() >= params.lower.array() + margin).all()) << i;
    }
  }
}

TEST(JointLimitsTest, WhatIsWithinTheLimitsPassesUnchanged) {
  const JointLimits<7> dut;
  const Vector7 a = Vector7::LinSpaced(-20, 20);
  EXPECT_EQ(dut.Limit(Middle(dut.params()), Vector7::Zero(), a), a);
}

TEST(JointLimitsTest, OneBeyondTheMarginIsLedBack) {
  const JointLimits<7> dut;
  const Vector7 zero = Vector7::Zero();
  EXPECT_LT(dut.Limit(dut.params().upper, zero, zero).maxCoeff(), 0);
  EXPECT_GT(dut.Limit(dut.params().lower, zero, zero).minCoeff(), 0);
}

TEST(JointLimitsTest, ErrorsNameFieldRangeAndValue) {
  JointLimitsParams<7> params;
  params.speed(3) = 0;
  EXPECT_EQ(ValidationError(params),
            "JointLimitsParams: field `speed[3]` expected a finite value > 0, "
            "got 0");
  params = {};
  params.upper(2) = params.lower(2);
  EXPECT_NE(ValidationError(params).find("`upper[2]` expected more than"),
            std::string::npos);
  params = {};
  params.speed_margin = 1;
  EXPECT_NE(ValidationError(params).find("`speed_margin`"), std::string::npos);
}

}  // namespace
}  // namespace dual_proxy
