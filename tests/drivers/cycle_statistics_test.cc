// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/cycle_statistics.h"

#include <limits>
#include <thread>

#include <gtest/gtest.h>

#include "no_alloc.h"

namespace dual_proxy {
namespace {

TEST(CycleStatisticsTest, QuantilesAreThoseOfWhatWasAdded) {
  CycleStatistics dut;
  EXPECT_EQ(dut.count(), 0);
  EXPECT_EQ(dut.Quantile(0.5), 0);
  for (int i = 1; i <= 1000; ++i) dut.Add(1e-6 * i - 1e-7);
  EXPECT_EQ(dut.count(), 1000);
  EXPECT_NEAR(dut.Quantile(0.5), 500e-6, 1e-6);
  EXPECT_NEAR(dut.Quantile(0.999), 999e-6, 1e-6);
  EXPECT_NEAR(dut.Quantile(0), 1e-6, 1e-6);
  EXPECT_EQ(dut.Quantile(1), dut.max());
  EXPECT_DOUBLE_EQ(dut.max(), 999.9e-6);
}

TEST(CycleStatisticsTest, WhatIsBeyondTheBinsOrNoDurationCounts) {
  CycleStatistics dut;
  dut.Add(0.5);
  EXPECT_EQ(dut.Quantile(0.5), 0.5);
  dut.Add(-1);
  dut.Add(std::numeric_limits<double>::quiet_NaN());
  dut.Add(std::numeric_limits<double>::infinity());
  EXPECT_EQ(dut.count(), 4);
  EXPECT_LE(dut.Quantile(0.5), CycleStatistics::kBin);
}

TEST(CycleStatisticsTest, AnotherThreadMayRead) {
  CycleStatistics dut;
  std::thread writer([&dut] {
    const ScopedNoAlloc guard;
    for (int i = 0; i < 100000; ++i) dut.Add(1e-6 * (i % 10));
    EXPECT_EQ(guard.count(), 0);
  });
  while (dut.count() < 100000) EXPECT_LE(dut.Quantile(0.9), 10e-6);
  writer.join();
  EXPECT_NEAR(dut.Quantile(0.95), 9e-6, 1e-6);
}

}  // namespace
}  // namespace dual_proxy
