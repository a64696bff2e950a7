// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/quantile.h"

#include <gtest/gtest.h>

namespace dual_proxy {
namespace {

using Eigen::Vector4d;
using Eigen::VectorXd;

TEST(QuantileTest, IsLinearBetweenValues) {
  const Vector4d values(30, 10, 40, 20);
  EXPECT_EQ(CalcQuantile(values, 0), 10);
  EXPECT_EQ(CalcQuantile(values, 1), 40);
  EXPECT_EQ(CalcQuantile(values, 0.5), 25);
  EXPECT_DOUBLE_EQ(CalcQuantile(values, 0.95), 38.5);
  EXPECT_DOUBLE_EQ(CalcQuantile(values, 0.1), 13);
}

TEST(QuantileTest, OneOrEqualValuesAreGivenBackExactly) {
  for (const double share : {0.0, 0.01, 0.5, 0.95, 1.0}) {
    EXPECT_EQ(CalcQuantile(VectorXd::Constant(1, 0.1), share), 0.1);
    EXPECT_EQ(CalcQuantile(VectorXd::Constant(7, 0.1), share), 0.1);
  }
}

// What numpy.quantile gives, to the last bit, on both sides of the middle.
TEST(QuantileTest, RoundsAsNumpyDoes) {
  const Eigen::Vector3d values(0.1, 0.7, 1.3);
  EXPECT_EQ(CalcQuantile(values, 0.2), 0.33999999999999997);
  EXPECT_EQ(CalcQuantile(values, 0.33), 0.496);
  EXPECT_EQ(CalcQuantile(values, 0.9), 1.1800000000000002);
}

}  // namespace
}  // namespace dual_proxy
