// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/run_log_store.h"

#include <cstdlib>
#include <memory>
#include <string>
#include <system_error>

#include <gtest/gtest.h>

#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/** Rows [first, first + count) of a log: row i has i in its first column, and
so on. */
MatrixXd Samples(int num_columns, int first, int count) {
  MatrixXd samples(num_columns, count);
  for (int i = 0; i < count; ++i) {
    samples.col(i) = VectorXd::LinSpaced(num_columns, 0, num_columns - 1);
    samples.col(i).array() += first + i;
  }
  return samples;
}

VectorXd Times(int first, int count) {
  return 0.5 * VectorXd::LinSpaced(count, first, first + count - 1);
}

TEST(RunLogStoreTest, RowsComeBackAsColumns) {
  RunLogStore dut(3, 10);
  EXPECT_TRUE(dut.in_memory());
  EXPECT_EQ(dut.num_rows(), 0);
  EXPECT_EQ(dut.columns(0, 3).rows(), 0);
  dut.Append(Times(1, 4), Samples(3, 1, 4));
  dut.Append(Times(5, 2), Samples(3, 5, 2));
  ASSERT_EQ(dut.num_rows(), 6);
  EXPECT_EQ(dut.last_time(), 3);
  EXPECT_EQ(dut.time(), Times(1, 6));
  EXPECT_EQ(dut.columns(0, 3), Samples(3, 1, 6).transpose());
  EXPECT_EQ(dut.columns(2, 1), Samples(3, 1, 6).row(2).transpose());
  dut.Release();
  EXPECT_EQ(dut.columns(0, 3), Samples(3, 1, 6).transpose());
}

TEST(RunLogStoreTest, RowsThatAreThereAlreadyAreLeftOut) {
  RunLogStore dut(1, 10);
  dut.Append(Times(0, 3), Samples(1, 0, 3));  // A run logs from after 0.
  EXPECT_EQ(dut.time(), Times(1, 2));
  dut.Append(Times(0, 5), Samples(1, 0, 5));
  dut.Append(Times(0, 5), Samples(1, 0, 5));
  EXPECT_EQ(dut.time(), Times(1, 4));
  EXPECT_EQ(dut.columns(0, 1), Samples(1, 1, 4).transpose());
}

TEST(RunLogStoreTest, WhatDoesNotFitChangesNothing) {
  RunLogStore dut(2, 3);
  dut.Append(Times(1, 2), Samples(2, 1, 2));
  EXPECT_EQ(InvalidArgument([&] { dut.Append(Times(3, 2), Samples(2, 3, 2)); }),
            "RunLogStore: expected at most 3 rows, got 4");
  EXPECT_EQ(InvalidArgument([&] { dut.Append(Times(3, 1), Samples(1, 3, 1)); }),
            "RunLogStore: `samples` expected shape (2, 1), got (1, 1)");
  EXPECT_EQ(InvalidArgument([&] {
              dut.Append(VectorXd::Constant(2, 7), Samples(2, 3, 2));
            }),
            "RunLogStore: `times` expected strictly increasing values, got "
            "7.000000");
  EXPECT_EQ(InvalidArgument([] { RunLogStore(-1, 3); }),
            "RunLogStore: `num_columns` and `capacity` expected >= 0, got -1 "
            "and 3");
  EXPECT_EQ(dut.columns(0, 2), Samples(2, 1, 2).transpose());
}

/** A store that is just too large for memory. */
class RunLogStoreFileTest : public testing::Test {
 protected:
  static constexpr int kColumns = 100;
  static constexpr int kCapacity =
      RunLogStore::kMostInMemory / sizeof(double) / kColumns;

  ~RunLogStoreFileTest() override { ::unsetenv("TMPDIR"); }
};

TEST_F(RunLogStoreFileTest, LargeOnesAreInAFile) {
  auto dut = std::make_shared<RunLogStore>(kColumns, kCapacity);
  ASSERT_FALSE(dut->in_memory());
  for (int first = 1; first < 5000; first += 1000) {
    dut->Append(Times(first, 1000), Samples(kColumns, first, 1000));
    EXPECT_EQ(dut->columns(0, kColumns),
              Samples(kColumns, 1, first + 999).transpose());
    dut->Release();
  }
  const RunLog log = MakeRunLog(dut, {{"b", 7, 3}, {"a", 0, 1}});
  dut.reset();  // The log keeps it.
  log.Validate();
  EXPECT_EQ(log.time, Times(1, 5000));
  EXPECT_EQ(log.Signal<3>("b"),
            Samples(kColumns, 1, 5000).middleRows(7, 3).transpose());
  EXPECT_EQ(log.Signal("a"), Samples(kColumns, 1, 5000).row(0).transpose());
}

TEST_F(RunLogStoreFileTest, NoSpaceIsSaidBeforeTheRun) {
  const auto error = [](int num_columns, Eigen::Index capacity) -> std::string {
    try {
      RunLogStore(num_columns, capacity);
    } catch (const std::system_error& caught) {
      return caught.what();
    }
    return "no error";
  };
  EXPECT_NE(error(1 << 20, 1 << 30).find("MB in /"), std::string::npos);
  ::setenv("TMPDIR", "/no/such/folder", 1);
  const std::string text = error(kColumns, kCapacity);
  EXPECT_NE(text.find(" MB in /no/such/folder"), std::string::npos) << text;
  EXPECT_NE(text.find("No such file or directory"), std::string::npos) << text;
}

}  // namespace
}  // namespace dual_proxy
