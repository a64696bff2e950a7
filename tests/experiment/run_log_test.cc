// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/run_log.h"

#include <limits>

#include <gtest/gtest.h>

#include "validation_error.h"

namespace dual_proxy {
namespace {

RunLog MakeLog() {
  RunLog log;
  log.time = Eigen::Vector2d(0, 0.001);
  log.signals = {{"force", 0, 3}, {"dimension", 3, 1}};
  log.values =
      (Eigen::Matrix<double, 2, 4>() << 1, 2, 3, 4, 5, 6, 7, 8).finished();
  return log;
}

TEST(RunLogTest, SignalIsItsColumns) {
  const RunLog dut = MakeLog();
  dut.Validate();
  EXPECT_EQ(dut.Signal("force"), dut.values.leftCols(3));
  EXPECT_EQ(dut.Signal<3>("force").row(1), Eigen::RowVector3d(5, 6, 7));
  EXPECT_EQ(dut.Signal<1>("dimension"), Eigen::Vector2d(4, 8));
  // A view, no copy.
  EXPECT_EQ(dut.Signal<3>("force").data(), dut.values.data());
}

TEST(RunLogTest, MissingSignalsAndOtherSizesAreNamed) {
  const RunLog dut = MakeLog();
  EXPECT_EQ(InvalidArgument([&] { dut.Signal("torque"); }),
            "RunLog: there is no signal `torque`");
  EXPECT_EQ(InvalidArgument([&] { dut.Signal<3>("dimension"); }),
            "RunLog: signal `dimension` expected size 3, got 1");
}

TEST(RunLogTest, InvalidLogsAreRefused) {
  RunLog dut = MakeLog();
  dut.time(1) = 0;
  EXPECT_EQ(ValidationError(dut),
            "RunLog: field `time` expected strictly increasing times, got 0");
  dut.time(1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(ValidationError(dut),
            "RunLog: field `time` expected finite values, got [0, nan]");
  dut = MakeLog();
  dut.time = Eigen::VectorXd::Zero(1);
  EXPECT_EQ(ValidationError(dut),
            "RunLog: field `values` expected one row per time, got 2");
  dut = MakeLog();
  dut.signals[1].start = 4;
  EXPECT_EQ(
      ValidationError(dut),
      "RunLog: signal `dimension` expected columns among 4, got 1 from 4");
}

TEST(RunLogTest, EmptyLogIsValid) {
  RunLog dut = MakeLog();
  dut.time.resize(0);
  dut.values.resize(0, 4);
  dut.Validate();
  EXPECT_EQ(dut.Signal<3>("force").rows(), 0);
}

}  // namespace
}  // namespace dual_proxy
