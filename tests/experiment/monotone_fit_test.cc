// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/monotone_fit.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

namespace dual_proxy {
namespace {

using Eigen::Vector3d;
using Eigen::Vector4d;
using Eigen::VectorXd;

TEST(MonotoneFitTest, WhatOnlyRisesOrOnlyFallsHasNone) {
  EXPECT_EQ(CalcMonotoneResidual(VectorXd(0)), 0);
  EXPECT_EQ(CalcMonotoneResidual(VectorXd::Constant(9, 0.1)), 0);
  const VectorXd settles =
      (-VectorXd::LinSpaced(1000, 0, 5).array()).exp().matrix();
  EXPECT_EQ(CalcMonotoneResidual(settles), 0);
  EXPECT_EQ(CalcMonotoneResidual(-settles), 0);
}

TEST(MonotoneFitTest, FewValuesByHand) {
  // Rising 1, 2.5, 2.5.
  EXPECT_DOUBLE_EQ(CalcMonotoneResidual(Vector3d(1, 3, 2)), 0.5);
  EXPECT_DOUBLE_EQ(CalcMonotoneResidual(Vector3d(-1, -3, -2)), 0.5);
  // Rising 0, 2, 2, 2: 4 and 1 are joined with 1 only after each other.
  EXPECT_DOUBLE_EQ(CalcMonotoneResidual(Vector4d(0, 4, 1, 1)), 6);
  // To and fro about a line: all but the ends are joined.
  EXPECT_DOUBLE_EQ(CalcMonotoneResidual(Vector4d(0, 1, 0, 1)), 0.5);
}

// A swing counts whole, however slow: over n periods all but the quarters at
// both ends that lie on the fit's side.
TEST(MonotoneFitTest, ASwingsPeriodDoesNotMatter) {
  for (const int periods : {2, 5, 100}) {
    const VectorXd sine =
        (VectorXd::LinSpaced(20000, 0, 2 * std::numbers::pi * periods))
            .array()
            .sin();
    const double rms = std::sqrt(CalcMonotoneResidual(sine) / 20000);
    EXPECT_LT(rms, std::sqrt(0.5)) << periods;
    EXPECT_GT(rms, periods == 2 ? 0.5 : 0.6) << periods;
  }
  // On a drift, too.
  const VectorXd line = VectorXd::LinSpaced(20000, 0, 1);
  const VectorXd drifts = line.array() + (40 * line).array().sin();
  EXPECT_GT(std::sqrt(CalcMonotoneResidual(drifts) / 20000), 0.6);
}

TEST(MonotoneFitTest, NotFiniteIsNotFinite) {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(),
                           std::numeric_limits<double>::infinity()}) {
    EXPECT_TRUE(std::isnan(CalcMonotoneResidual(Vector3d(1, bad, 2))));
  }
}

}  // namespace
}  // namespace dual_proxy
