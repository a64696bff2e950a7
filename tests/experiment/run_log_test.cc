// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/run_log.h"

#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "validation_error.h"

namespace dual_proxy {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
const std::vector<SignalSlice> kSignals = {{"force", 0, 3},
                                           {"dimension", 3, 1}};

Eigen::MatrixXd Values() {
  return (Eigen::Matrix<double, 2, 4>() << 1, 2, 3, 4, 5, 6, 7, 8).finished();
}

RunLog MakeLog(const Eigen::VectorXd& time = Eigen::Vector2d(0, 0.001),
               const std::vector<SignalSlice>& signals = kSignals) {
  return RunLog::FromValues(time, signals, Values());
}

TEST(RunLogTest, SignalIsItsColumns) {
  const RunLog dut = MakeLog();
  EXPECT_EQ(dut.Signal("force"), Values().leftCols(3));
  EXPECT_EQ(dut.Signal<3>("force").row(1), Eigen::RowVector3d(5, 6, 7));
  EXPECT_EQ(dut.Signal<1>("dimension"), Eigen::Vector2d(4, 8));
  // A view, no copy.
  EXPECT_EQ(dut.Signal<3>("force").data(), dut.signals[0].values.data());
  EXPECT_TRUE(dut.AllFinite());
}

TEST(RunLogTest, WhatIsNotFiniteIsFound) {
  Eigen::MatrixXd values = Values();
  values(1, 3) = std::numeric_limits<double>::infinity();
  const Eigen::Vector2d time(0, 0.001);
  EXPECT_FALSE(RunLog::FromValues(time, kSignals, values).AllFinite());
}

TEST(RunLogTest, MissingSignalsAndOtherSizesAreNamed) {
  const RunLog dut = MakeLog();
  EXPECT_EQ(InvalidArgument([&] { dut.Signal("torque"); }),
            "RunLog: there is no signal `torque`");
  EXPECT_EQ(InvalidArgument([&] { dut.Signal<3>("dimension"); }),
            "RunLog: signal `dimension` expected size 3, got 1");
}

TEST(RunLogTest, InvalidLogsAreRefused) {
  EXPECT_EQ(InvalidArgument([] { MakeLog(Eigen::Vector2d(0, 0)); }),
            "RunLog: field `time` expected strictly increasing times, got 0");
  EXPECT_EQ(InvalidArgument([] { MakeLog(Eigen::Vector2d(0, kNaN)); }),
            "RunLog: field `time` expected finite values, got [0, nan]");
  EXPECT_EQ(InvalidArgument([] { MakeLog(Eigen::VectorXd::Zero(1)); }),
            "RunLog: signal `force` expected one row per time, got 2 for 1");
  EXPECT_EQ(
      InvalidArgument(
          [] { MakeLog(Eigen::Vector2d(0, 1), {{"dimension", 4, 1}}); }),
      "RunLog: signal `dimension` expected columns among 4, got 1 from 4");
}

TEST(RunLogTest, EmptyLogIsValid) {
  const RunLog dut =
      RunLog::FromValues({}, kSignals, Eigen::MatrixXd::Zero(0, 4));
  EXPECT_EQ(dut.Signal<3>("force").rows(), 0);
  EXPECT_TRUE(dut.AllFinite());
}

}  // namespace
}  // namespace dual_proxy
