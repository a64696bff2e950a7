// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/run_watch.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "log_table.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

constexpr double kPeriod = 1e-3;
constexpr int kRows = 2001;

/** Two seconds at rest, of which the second is to be so. */
class RunWatchTest : public testing::Test {
 protected:
  RunWatchTest() {
    log_.time = Eigen::VectorXd::LinSpaced(kRows, 0, 2);
    log_.signals = {{"device_force", 0, 3},
                    {"device_velocity", 3, 3},
                    {"device_position", 6, 3},
                    {"contact_force", 9, 3},
                    {"robot_position", 12, 3},
                    {"force_selection", 15, 9},
                    {"robot_proxy_orientation", 24, 4},
                    {"torque", 28, 7},
                    {"robot_link_status", 35, 1},
                    {"haptic_link_status", 36, 1},
                    {"motion_error", 37, 3},
                    {"haptic_reference_force", 40, 3},
                    {"joint_velocity", 43, 7},
                    {"force_space_force", 50, 3},
                    {"reference_force", 53, 3},
                    {"robot_velocity", 56, 3},
                    {"robot_proxy_position", 59, 3}};
    log_.values.setZero(kRows, 62);
    Column("robot_proxy_orientation").setOnes();
  }

  Eigen::Block<Eigen::MatrixXd, Eigen::Dynamic, 1, true> Column(
      const std::string& signal, int element = 0) {
    for (const SignalSlice& slice : log_.signals) {
      if (slice.name == signal) return log_.values.col(slice.start + element);
    }
    throw std::logic_error(signal);
  }

  /** In pieces, as the engine gives them. */
  WatchedValue Watch(const std::string& name, int rows_in_piece = kRows) const {
    RunWatch watch({.reference_force_rate = 20,
                    .rest_start = 1,
                    .fault_end = 0.9,
                    .follow_lag = 0.1});
    for (Index begin = 0; begin < kRows - 1; begin += rows_in_piece - 1) {
      const Index count = std::min<Index>(rows_in_piece, kRows - begin);
      LogTable piece = log_;
      piece.time = log_.time.segment(begin, count);
      piece.values = log_.values.middleRows(begin, count);
      watch.Add(piece);
    }
    for (const WatchedValue& value : watch.Summarise()) {
      if (value.name == name) return value;
    }
    throw std::logic_error(name);
  }

  LogTable log_;
};

TEST_F(RunWatchTest, AtRestNothingIsWrong) {
  RunWatch watch({.rest_start = 1});
  watch.Add(log_);
  for (const WatchedValue& value : watch.Summarise()) {
    if (value.most) {
      EXPECT_LE(value.value, *value.most) << value.name;
    }
    EXPECT_EQ(value.value, 0) << value.name;
  }
}

TEST_F(RunWatchTest, PiecesAreAsGoodAsTheWhole) {
  for (int i = 0; i < kRows; ++i) {
    Column("torque", 1)(i) = 0.9 * i;  // 900 N m/s, but for one step.
    Column("device_force", 2)(i) = std::sin(0.01 * i);
    Column("device_velocity", 2)(i) = std::cos(0.02 * i);
    Column("contact_force", 2)(i) = 3 + 0.2 * std::sin(0.1 * i);
  }
  Column("torque", 1).tail(1000).array() += 5;
  for (const char* name :
       {"torque_rate", "device_energy", "device_force", "rest_contact_force"}) {
    EXPECT_NEAR(Watch(name).value, Watch(name, 37).value, 1e-12) << name;
  }
  EXPECT_NEAR(Watch("torque_rate", 37).value, 5.9, 1e-9);
  EXPECT_NE(Watch("torque_rate", 37).detail.find("joint 2 torque rate"),
            std::string::npos);
}

TEST_F(RunWatchTest, TheWorstIsTheLargestShareOfItsLimit) {
  Column("joint_velocity", 3)(200) = 2.4;    // Of 2.175 rad/s.
  Column("joint_velocity", 0)(900) = -2.5;   // Likewise.
  Column("joint_velocity", 5)(1500) = 2.62;  // Of 2.61.
  for (const int rows : {kRows, 100}) {
    const WatchedValue speed = Watch("joint_speed", rows);
    EXPECT_NEAR(speed.value, 2.5 / 2.175, 1e-12);
    EXPECT_NEAR(speed.time, 0.9, 1e-12);
    EXPECT_EQ(speed.detail, "joint 1 speed 2.5 rad/s at 0.9 s (limit 2.175)");
    EXPECT_GT(speed.value, *speed.most);
  }
}

TEST_F(RunWatchTest, WhatIsNotFiniteIsFound) {
  Column("contact_force")(700) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(Watch("rows_not_finite", 100).value, 1);
  EXPECT_EQ(Watch("commands_not_finite").value, 0);
  Column("torque", 6)(800) = std::numeric_limits<double>::infinity();
  EXPECT_EQ(Watch("commands_not_finite", 100).value, 1);
}

TEST_F(RunWatchTest, LimitsOfTheDeviceHoldInEveryPeriod) {
  Column("device_force", 1)(333) = -12.1;
  const WatchedValue force = Watch("device_force");
  EXPECT_NEAR(force.value, 12.1, 1e-12);
  EXPECT_NEAR(force.time, 0.333, 1e-12);
  EXPECT_GT(force.value, *force.most);
}

TEST_F(RunWatchTest, TheReferenceForceChangesNoFasterThanItMay) {
  for (int i = 0; i < kRows; ++i)
    Column("haptic_reference_force", 2)(i) = 0.02 * i;
  // The step is between two pieces.
  Column("haptic_reference_force", 2).tail(kRows - 99).array() += 0.01;
  for (const int rows : {kRows, 100}) {
    const WatchedValue rate = Watch("reference_force_rate", rows);
    EXPECT_NEAR(rate.value, 30, 1e-9);
    EXPECT_NEAR(rate.time, 0.099, 1e-12);
    EXPECT_NEAR(rate.most.value(), 20, 1e-6);
  }
}

TEST_F(RunWatchTest, WhatCouldNotBeToldOnceStaysSo) {
  Column("device_force", 1)(333) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(std::isnan(Watch("device_force", 100).value));
  EXPECT_TRUE(std::isnan(Watch("device_energy", 100).value));
}

TEST_F(RunWatchTest, ShapesAreLookedAt) {
  Column("force_selection", 8).setOnes();  // A projection still.
  EXPECT_EQ(Watch("projection_error").value, 0);
  Column("force_selection", 8)(10) = 1 + 1e-11;
  EXPECT_NEAR(Watch("projection_error").value, 1e-11, 1e-15);
  Column("force_selection", 1)(20) = 1e-9;  // Not symmetric.
  EXPECT_NEAR(Watch("projection_error").time, 0.02, 1e-12);
  Column("robot_proxy_orientation")(30) = 1.001;
  EXPECT_NEAR(Watch("rotation_error").value, 0.001, 1e-12);
}

TEST_F(RunWatchTest, TheDevicesEnergyIsTheMostInAnyStretch) {
  // Takes 1 J, gives 0.6 J in 0.3 s, takes 1 J.
  Column("device_velocity").setConstant(1);
  Column("device_force").segment(1, 500).setConstant(-2);
  Column("device_force").segment(501, 300).setConstant(2);
  Column("device_force").segment(801, 500).setConstant(-2);
  EXPECT_NEAR(Watch("device_energy", 100).value, 0.6 - 0.3e-3, 1e-9);
}

TEST_F(RunWatchTest, TheForceLoopsEnergyIsOfItsFeedback) {
  // 2 N more than it was asked for, for 0.3 s, at 1 m/s; then 1 N less.
  Column("force_selection", 8).setOnes();
  Column("robot_velocity", 2).setOnes();
  Column("reference_force", 2).setConstant(5);
  Column("reference_force", 0).setConstant(7);  // Not in the force space.
  Column("force_space_force", 2).setConstant(4);
  Column("force_space_force", 2).segment(500, 300).setConstant(7);
  for (const int rows : {kRows, 100}) {
    EXPECT_NEAR(Watch("force_loop_energy", rows).value, 0.6 - 0.3e-3, 1e-9);
  }
  RunWatch open({.closes_force_loop = false});
  open.Add(log_);
  for (const WatchedValue& value : open.Summarise()) {
    EXPECT_NE(value.name, "force_loop_energy");
  }
}

TEST_F(RunWatchTest, RecoveryIsFollowingAgainWithALink) {
  Column("robot_link_status").setOnes();
  Column("haptic_link_status").setOnes();
  Column("haptic_link_status").segment(800, 300).setConstant(2);
  // The hand goes at 0.2 m/s, the robot's map makes 0.5 m/s of it; its proxy is
  // 50 ms late, but for when it waits from 0.7 s to 1.4 s.
  for (int i = 0; i < kRows; ++i) {
    Column("device_position", 1)(i) = 0.2e-3 * i;
    const int seen = i < 700 || i >= 1400 ? i - 50 : 650;
    Column("robot_proxy_position", 1)(i) = 0.5e-3 * seen;
  }
  for (const int rows : {kRows, 100}) {
    EXPECT_NEAR(Watch("recovery_time", rows).value, 0.5, 0.011);
    EXPECT_EQ(Watch("recovery_time", rows).detail, "");
  }
  // It never left it: from when there is a link.
  for (int i = 0; i < kRows; ++i) {
    Column("robot_proxy_position", 1)(i) = 0.5e-3 * (i - 50);
  }
  EXPECT_NEAR(Watch("recovery_time").value, 0.2, 0.011);
  Column("robot_proxy_position", 1).tail(kRows - 700).setConstant(0.3);
  EXPECT_NEAR(Watch("recovery_time").value, 1.1, 0.011);
  EXPECT_EQ(Watch("recovery_time").detail, "not yet");
}

TEST_F(RunWatchTest, RestIsSwingAboutALine) {
  for (int i = 0; i < kRows; ++i) {
    const double t = kPeriod * i;
    // Creeps, and swings by 1 mm, 0.71 mm RMS; what is before rest is not it.
    Column("robot_position", 0)(i) =
        0.4 + 0.01 * t + 1e-3 * std::sin(20 * std::numbers::pi * t);
    Column("contact_force", 2)(i) = i < 1000 ? 50 : -7;
  }
  EXPECT_NEAR(Watch("rest_robot_position").value, 1e-3 / std::sqrt(2), 1e-5);
  EXPECT_NEAR(Watch("rest_contact_force").value, 0, 1e-6);
}

TEST_F(RunWatchTest, TheEndIsTheLastRow) {
  Column("robot_link_status").head(kRows - 1).setConstant(2);
  Column("robot_link_status")(kRows - 1) = 1;
  Column("motion_error", 1)(kRows - 1) = 0.003;
  EXPECT_EQ(Watch("robot_link_status", 100).value, 1);
  EXPECT_NEAR(Watch("motion_error", 100).value, 0.003, 1e-12);
}

TEST(RunWatchParamsTest, InvalidOnesAreNamed) {
  EXPECT_NE(ValidationError(RunWatchParams{.control_period = 0})
                .find("`control_period`"),
            std::string::npos);
}

}  // namespace
}  // namespace dual_proxy
