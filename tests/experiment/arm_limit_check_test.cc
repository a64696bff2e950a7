// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/arm_limit_check.h"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "log_table.h"

namespace dual_proxy {
namespace {

using Eigen::VectorXd;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kPeriod = 1e-3;
constexpr int kRows = 1001;

/** An arm at rest in the middle of its joints' ranges, beside its proxy. */
class ArmLimitCheckTest : public testing::Test {
 protected:
  ArmLimitCheckTest() {
    log_.time = VectorXd::LinSpaced(kRows, 0, 1);
    log_.signals = {{"joint_position", 0, 7},  {"joint_velocity", 7, 7},
                    {"torque", 14, 7},         {"robot_velocity", 21, 3},
                    {"robot_position", 24, 3}, {"robot_proxy_position", 27, 3}};
    log_.values.setZero(kRows, 30);
    log_.values.leftCols<7>().rowwise() =
        (limits_.joint_lower + limits_.joint_upper).transpose() / 2;
  }

  auto Row(const std::string& signal, int row) {
    for (const SignalSlice& slice : log_.signals) {
      if (slice.name == signal) {
        return log_.values.row(row).segment(slice.start, slice.size);
      }
    }
    throw std::logic_error(signal);
  }

  ArmLimitCheck Check(const std::string& limit) const {
    for (ArmLimitCheck& check : CheckArmLimits(log_, limits_, kPeriod)) {
      if (check.limit == limit) return check;
    }
    throw std::logic_error(limit);
  }

  LogTable log_;
  const ArmLimits<7> limits_;
};

TEST_F(ArmLimitCheckTest, TheWorstHasItsShareAndItsTime) {
  Row("joint_velocity", 7)(3) = 0.5 * limits_.joint_speed(3);
  EXPECT_NEAR(Check("joint_speed").share, 0.5, 1e-12);
  EXPECT_EQ(Check("joint_speed").time, log_.time(7));
  Row("joint_position", 9)(2) = limits_.joint_upper(2) + 0.2;
  EXPECT_NEAR(Check("joint_position").share, 1.2, 1e-12);
  EXPECT_EQ(Check("joint_position").time, log_.time(9));
  Row("torque", 4)(1) = 20;
  EXPECT_NEAR(Check("torque_rate").share, 20 / kPeriod / limits_.torque_rate,
              1e-9);
  EXPECT_EQ(Check("torque_rate").time, log_.time(4));
}

TEST_F(ArmLimitCheckTest, AtRestNothingIsUsed) {
  const auto checks = CheckArmLimits(log_, limits_, kPeriod);
  ASSERT_EQ(checks.size(), 6u);
  for (const ArmLimitCheck& check : checks) {
    EXPECT_FALSE(check.broken) << check.limit;
    if (std::string(check.limit) != "joint_position") {
      EXPECT_EQ(check.value, 0) << check.limit;
    }
  }
  EXPECT_NEAR(checks[0].value, (3.0718 - 0.0698) / 2, 1e-12) << "joint 4's";
}

TEST_F(ArmLimitCheckTest, ALimitItselfIsKept) {
  Row("joint_position", 3) = limits_.joint_lower.transpose();
  Row("joint_position", 4) = limits_.joint_upper.transpose();
  Row("joint_velocity", 5) = -limits_.joint_speed.transpose();
  for (int i = 0; i < kRows; ++i) {
    // Up to the limit, one control period after the other, with rounding.
    Row("torque", i) =
        (limits_.torque.array().min(i * limits_.torque_rate * kPeriod))
            .matrix()
            .transpose();
  }
  Row("robot_velocity", 6) << 0, -limits_.tool_speed, 0;
  Row("robot_proxy_position", 7) << 0, 0, limits_.proxy_distance;
  for (const ArmLimitCheck& check : CheckArmLimits(log_, limits_, kPeriod)) {
    EXPECT_FALSE(check.broken) << check.worst;
  }
  EXPECT_EQ(Check("joint_position").value, 0);
  EXPECT_EQ(Check("joint_speed").value, 1);
  EXPECT_EQ(Check("torque").value, 1);
  EXPECT_NEAR(Check("torque_rate").value, 1000, 1e-6);
}

TEST_F(ArmLimitCheckTest, WhatIsBrokenIsDescribed) {
  Row("joint_position", 214)(3) = -3.08;
  Row("joint_velocity", 500)(0) = 2.18;
  Row("joint_velocity", 600)(6) = -3.915;  // More of its limit.
  Row("robot_velocity", 700) << 3, 0, 4;
  Row("torque", 1000)(4) = -12.5;
  Row("robot_position", 0) << 0.3, 0, 0;
  for (const auto& [limit, value, worst] :
       {std::tuple("joint_position", -0.0082,
                   "joint 4 position -3.08 rad at 0.214 s (limit -3.0718)"),
        {"joint_speed", 1.5, "joint 7 speed 3.915 rad/s at 0.6 s (limit 2.61)"},
        {"tool_speed", 5.0, "tool speed 5 m/s at 0.7 s (limit 1.7)"},
        {"torque", 12.5 / 12, "joint 5 torque 12.5 N m at 1 s (limit 12)"},
        {"torque_rate", 12500.0,
         "joint 5 torque rate 12500 N m/s at 1 s (limit 1000)"},
        {"proxy_distance", 0.3,
         "distance from the proxy 0.3 m at 0 s (limit 0.25)"}}) {
    const ArmLimitCheck check = Check(limit);
    EXPECT_TRUE(check.broken) << limit;
    EXPECT_NEAR(check.value, value, 1e-9) << limit;
    EXPECT_EQ(check.worst, worst);
  }
}

TEST_F(ArmLimitCheckTest, OnlyALogOfEveryPeriodTellsTheRateOfTheTorque) {
  const auto with_spacing = [this](double spacing) {
    log_.time = VectorXd::LinSpaced(kRows, 0, (kRows - 1) * spacing);
    for (const ArmLimitCheck& check : CheckArmLimits(log_, limits_, kPeriod)) {
      if (std::string(check.limit) == "torque_rate") return check.value;
    }
    return kNaN;
  };
  Row("torque", 500)(2) = 0.5;
  EXPECT_NEAR(with_spacing(kPeriod), 500, 1e-9);
  // The torque is constant between two control periods: no faster for that.
  EXPECT_NEAR(with_spacing(kPeriod / 4), 500, 1e-9);
  EXPECT_TRUE(std::isnan(with_spacing(2 * kPeriod)));
}

TEST_F(ArmLimitCheckTest, NotFiniteCannotBeGivenButMayBeBroken) {
  Row("joint_velocity", 10)(2) = kNaN;
  EXPECT_TRUE(std::isnan(Check("joint_speed").value));
  EXPECT_FALSE(Check("joint_speed").broken);
  Row("joint_velocity", 5)(2) = 33;
  EXPECT_TRUE(std::isnan(Check("joint_speed").value));
  EXPECT_TRUE(Check("joint_speed").broken);
  Row("joint_position", 10)(2) = kNaN;
  EXPECT_TRUE(std::isnan(Check("joint_position").value));
  Row("robot_velocity", 7)(0) = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(Check("tool_speed").broken);
}

TEST_F(ArmLimitCheckTest, WhatTheLogDoesNotHaveIsLeftOut) {
  for (int rows : {1, 0}) {
    log_.time.conservativeResize(rows);
    log_.values.conservativeResize(rows, Eigen::NoChange);
    EXPECT_EQ(CheckArmLimits(log_, limits_, kPeriod).size(),
              rows == 1 ? 5u : 0u)
        << "no rate";
  }
  log_.time.setZero(1);
  log_.values.setZero(1, 30);
  log_.signals.clear();
  EXPECT_TRUE(CheckArmLimits(log_, limits_, kPeriod).empty());
}

}  // namespace
}  // namespace dual_proxy
