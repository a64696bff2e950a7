// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/ft_sensor/rdt_stream.h"

#include <limits>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "no_alloc.h"
#include "rdt_datagram.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Counts = std::array<std::int32_t, 6>;

class RdtStreamTest : public testing::Test {
 protected:
  explicit RdtStreamTest(const RdtSensorParams& params = {}) : dut_(params) {
    dut_.NoteRequest();
  }

  // The next record, a millisecond later, with other values.
  void Go(std::uint32_t status = 0) {
    counts_[0] += 1000;
    Send(status);
  }

  // The next one with the same values.
  void Send(std::uint32_t status = 0) {
    ++sample_;
    Stall(status);
  }

  // The next one of the same sample.
  void Stall(std::uint32_t status = 0) {
    time_ += 0.001;
    const RdtDatagram datagram{.sequence = ++sequence_,
                               .sample = sample_,
                               .status = status,
                               .counts = counts_};
    dut_.Take(datagram.Bytes(), time_);
  }

  RdtStream dut_;
  double time_{100};
  std::uint32_t sequence_{0};
  std::uint32_t sample_{0};
  Counts counts_{};
};

TEST_F(RdtStreamTest, NothingIsNotValid) {
  EXPECT_FALSE(dut_.reading().valid);
  EXPECT_EQ(dut_.reading().Age(1e6), std::numeric_limits<double>::infinity());
  EXPECT_EQ(dut_.fault(), RdtFault::kSilent);
}

TEST_F(RdtStreamTest, RecordIsARead) {
  counts_ = {1000000, -2000000, 3000000, 40000, 50000, -60000};
  Send();
  EXPECT_TRUE(dut_.reading().valid);
  EXPECT_EQ(dut_.reading().time, time_);
  EXPECT_EQ(dut_.fault(), RdtFault::kNone);
  // An ATI gives the load on it; wanted is what the arm exerts on the tool.
  const Vector6 wanted{{-1, 2, -3, -0.04, -0.05, 0.06}};
  EXPECT_LT((dut_.reading().value - wanted).norm(), 1e-12);
}

TEST(RdtStreamUnitsTest, ScalesTurnsAndSigns) {
  RdtSensorParams params;
  params.counts_per_force = 1000;
  params.counts_per_torque = 100;
  params.force_unit = ForceUnit::kLbf;
  params.torque_unit = TorqueUnit::kLbfIn;
  params.reports = SensedForce::kArmOnTool;
  // Its x is along y of S.
  params.R_SN << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  RdtStream dut(params);
  dut.Take(RdtDatagram{.counts = {1000, 0, 2000, 0, 100, 0}}.Bytes(), 1);
  const Vector6 wanted{
      {0, 4.4482216152605, 8.896443230521, -0.1129848290276167, 0, 0}};
  ASSERT_TRUE(dut.reading().valid);
  EXPECT_LT((dut.reading().value - wanted).norm(), 1e-12);
}

TEST(RdtStreamUnitsTest, UnitsAreAsDefined) {
  EXPECT_DOUBLE_EQ(InNewton(ForceUnit::kKlbf), 4448.2216152605);
  EXPECT_DOUBLE_EQ(InNewton(ForceUnit::kKgf), 9.80665);
  EXPECT_DOUBLE_EQ(InNewton(ForceUnit::kGf), 0.00980665);
  EXPECT_DOUBLE_EQ(InNewton(ForceUnit::kKN), 1000);
  EXPECT_DOUBLE_EQ(InNewtonMetre(TorqueUnit::kLbfFt), 1.3558179483314004);
  EXPECT_DOUBLE_EQ(InNewtonMetre(TorqueUnit::kKgfCm), 0.0980665);
  EXPECT_DOUBLE_EQ(InNewtonMetre(TorqueUnit::kNmm), 0.001);
  EXPECT_DOUBLE_EQ(InNewtonMetre(TorqueUnit::kKNm), 1000);
}

TEST_F(RdtStreamTest, OldOnesAreDropped) {
  Go();
  Go();
  const Reading<Vector6> newest = dut_.reading();
  const RdtDatagram old{.sequence = 1, .sample = 1, .counts = {7, 7, 7}};
  dut_.Take(old.Bytes(), time_ + 1);
  dut_.Take(RdtDatagram{.sequence = 2}.Bytes(), time_ + 1);
  EXPECT_EQ(dut_.reading().value, newest.value);
  EXPECT_EQ(dut_.reading().time, newest.time);
  EXPECT_EQ(dut_.counts().late, 1);
  EXPECT_EQ(dut_.counts().repeated, 1);
}

TEST_F(RdtStreamTest, MalformedChangesNothing) {
  Go();
  const double arrival = dut_.last_arrival();
  const auto bytes = RdtDatagram{.sequence = 2, .sample = 2}.Bytes();
  dut_.Take(std::span(bytes).first(35), time_ + 1);
  dut_.Take({}, time_ + 1);
  EXPECT_EQ(dut_.counts().malformed, 2);
  EXPECT_TRUE(dut_.reading().valid);
  EXPECT_EQ(dut_.last_arrival(), arrival);
}

TEST_F(RdtStreamTest, FaultOfTheSensor) {
  Go();
  const Reading<Vector6> good = dut_.reading();
  Go(0x80000004);
  EXPECT_FALSE(dut_.reading().valid);
  EXPECT_EQ(dut_.reading().value, good.value);
  EXPECT_EQ(dut_.reading().time, good.time);
  EXPECT_EQ(dut_.fault(), RdtFault::kStatus);
  EXPECT_EQ(dut_.status(), 0x80000004);
  EXPECT_EQ(dut_.counts().faulty, 1);
  EXPECT_EQ(dut_.last_arrival(), time_);
  Go(1u << 16);
  EXPECT_TRUE(dut_.reading().valid);
  EXPECT_EQ(dut_.fault(), RdtFault::kNone);
}

TEST(RdtStreamRangeTest, BeyondTheRangeIsNotValid) {
  RdtSensorParams params;
  params.max_force = 100;
  params.max_moment = 5;
  RdtStream dut(params);
  std::uint32_t sequence = 0;
  const auto is_valid = [&dut, &sequence](const Counts& counts) {
    ++sequence;
    dut.Take(
        RdtDatagram{.sequence = sequence, .sample = sequence, .counts = counts}
            .Bytes(),
        sequence);
    return dut.reading().valid;
  };
  EXPECT_TRUE(is_valid({100000000, 0, -99999999, 5000000, 0, 0}));
  EXPECT_FALSE(is_valid({0, 0, -100000001, 0, 0, 0}));
  EXPECT_EQ(dut.fault(), RdtFault::kRange);
  EXPECT_FALSE(is_valid({0, 0, 0, 0, 0, 5000001}));
  EXPECT_TRUE(is_valid({0, 0, 0, 0, 0, 4000000}));
}

TEST(RdtStreamRangeTest, OverflowIsNotValid) {
  RdtSensorParams params;
  params.counts_per_force = std::numeric_limits<double>::denorm_min();
  RdtStream dut(params);
  dut.Take(RdtDatagram{.counts = {1, 0, 0, 0, 0, 0}}.Bytes(), 1);
  EXPECT_FALSE(dut.reading().valid);
  dut.Take(RdtDatagram{.sequence = 2, .sample = 2}.Bytes(), 2);
  EXPECT_FALSE(dut.reading().valid);
  EXPECT_TRUE(dut.reading().value.allFinite());
}

// The stream goes on, but the sensor does not measure: readings grow old at
// once, and are not valid when frozen_time is over.
TEST_F(RdtStreamTest, SampleThatStandsStill) {
  Go();
  const double measured = time_;
  for (int i = 0; i < 49; ++i) {
    Stall();
    ASSERT_TRUE(dut_.reading().valid) << i;
    ASSERT_EQ(dut_.reading().time, measured) << i;
  }
  Stall();
  Stall();
  EXPECT_FALSE(dut_.reading().valid);
  EXPECT_EQ(dut_.fault(), RdtFault::kFrozen);
  EXPECT_EQ(dut_.last_arrival(), time_);
  Go();
  EXPECT_TRUE(dut_.reading().valid);
  EXPECT_EQ(dut_.reading().time, time_);
}

TEST_F(RdtStreamTest, ValuesThatStandStill) {
  Go();
  for (int i = 0; i < 49; ++i) {
    Send();
    ASSERT_TRUE(dut_.reading().valid) << i;
    ASSERT_EQ(dut_.reading().time, time_) << i;
  }
  Send();
  Send();
  EXPECT_FALSE(dut_.reading().valid);
  EXPECT_EQ(dut_.fault(), RdtFault::kFrozen);
  // Asking again does not make them better.
  dut_.NoteRequest();
  Send();
  EXPECT_FALSE(dut_.reading().valid);
  Go();
  EXPECT_TRUE(dut_.reading().valid);
}

TEST_F(RdtStreamTest, AskedAgain) {
  for (int i = 0; i < 20; ++i) Go();
  const Reading<Vector6> last = dut_.reading();
  dut_.NoteRequest();
  EXPECT_FALSE(dut_.reading().valid);
  EXPECT_EQ(dut_.reading().value, last.value);
  EXPECT_EQ(dut_.fault(), RdtFault::kSilent);
  sequence_ = 0;
  Go();
  EXPECT_TRUE(dut_.reading().valid);
  EXPECT_EQ(dut_.counts().requests, 2);
  EXPECT_EQ(dut_.counts().late, 0);
}

TEST_F(RdtStreamTest, TimeDoesNotGoBack) {
  Go();
  const double time = time_;
  time_ -= 10;
  Go();
  EXPECT_EQ(dut_.reading().time, time);
}

TEST_F(RdtStreamTest, DoesNotAllocate) {
  Go();
  const ScopedNoAlloc guard;
  for (int i = 0; i < 100; ++i) Go(i % 2);
  dut_.NoteRequest();
  dut_.Close();
  EXPECT_EQ(guard.count(), 0);
}

TEST(RdtSensorParamsTest, BadOnesAreNamed) {
  const auto error = [](auto change) {
    RdtSensorParams params;
    change(&params);
    return ValidationError(params);
  };
  EXPECT_EQ(error([](auto*) {}), "no exception");
  EXPECT_EQ(error([](auto* p) { p->host = ""; }),
            "RdtSensorParams: field `host` expected a name or address, got "
            "\"\"");
  EXPECT_EQ(error([](auto* p) { p->port = 0; }),
            "RdtSensorParams: field `port` expected a number in [1, 65535], "
            "got 0");
  EXPECT_EQ(error([](auto* p) { p->counts_per_force = 0; }),
            "RdtSensorParams: field `counts_per_force` expected a finite value "
            "> 0, got 0");
  EXPECT_NE(error([](auto* p) { p->R_SN *= 2; }).find("field `R_SN`"),
            std::string::npos);
  EXPECT_NE(error([](auto* p) { p->silence = 0; }).find("field `silence`"),
            std::string::npos);
}

}  // namespace
}  // namespace dual_proxy
