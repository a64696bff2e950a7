// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/input_faults.h"

#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// What becomes of (1, 2, 3) half way through a fault.
Vector3d Spoilt(FaultKind kind) {
  const InputFaults dut({{FaultyInput::kSensor, kind, 1, 2}});
  InputFaultsState state;
  Vector3d values(1, 2, 3);
  dut.Apply(1.5, FaultyInput::kSensor, values, &state);
  return values;
}

TEST(InputFaultsTest, EachKindIsWhatItSays) {
  EXPECT_TRUE(Spoilt(FaultKind::kNan).array().isNaN().all());
  EXPECT_EQ(Spoilt(FaultKind::kInfinite), Vector3d::Constant(kInfinity));
  EXPECT_EQ(Spoilt(FaultKind::kHuge), Vector3d::Constant(1e300));
  const double denormal = Spoilt(FaultKind::kDenormal).x();
  EXPECT_EQ(std::fpclassify(denormal), FP_SUBNORMAL);
  EXPECT_EQ(Spoilt(FaultKind::kFrozen), Vector3d(1, 2, 3));
}

TEST(InputFaultsTest, AFaultIsOfItsInputAndItsTime) {
  const InputFaults dut({{FaultyInput::kSensor, FaultKind::kNan, 1, 2}});
  InputFaultsState state;
  Vector3d values(1, 2, 3);
  dut.Apply(0.999, FaultyInput::kSensor, values, &state);
  dut.Apply(2, FaultyInput::kSensor, values, &state);
  dut.Apply(1.5, FaultyInput::kRobotPosition, values, &state);
  EXPECT_EQ(values, Vector3d(1, 2, 3));
  dut.Apply(1, FaultyInput::kSensor, values, &state);
  EXPECT_TRUE(values.array().isNaN().all());
}

TEST(InputFaultsTest, WhatIsFrozenIsWhatItWasWhenItBegan) {
  const InputFaults dut({{FaultyInput::kDevicePose, FaultKind::kFrozen, 1, 2}});
  InputFaultsState state;
  for (const double time : {0.9, 1.0, 1.5, 2.0}) {
    Pose pose;
    pose.p.x() = time;
    dut.Apply(time, FaultyInput::kDevicePose, &pose, &state);
    EXPECT_EQ(pose.p.x(), time >= 1 && time < 2 ? 1.0 : time);
    EXPECT_TRUE(pose.R.isIdentity(0));
  }
}

TEST(InputFaultsTest, OfAMessageItsBodyIsWrong) {
  const InputFaults dut(
      {{FaultyInput::kMessageToRobot, FaultKind::kInfinite, 0, 1}});
  InputFaultsState state;
  Message message{.tag = 1, .size = 3, .sequence = 7, .send_time = 0.25};
  dut.Apply(0.5, FaultyInput::kMessageToRobot, &message, &state);
  EXPECT_EQ(message.sequence, 7);
  EXPECT_EQ(message.send_time, 0.25);
  EXPECT_EQ(message.body[2], kInfinity);
  EXPECT_EQ(message.body[3], 0);
}

TEST(InputFaultsTest, SelectionsFlipOrAreTilted) {
  const InputFaults dut({{FaultyInput::kSelections, FaultKind::kFlipping, 1, 2},
                         {FaultyInput::kSelections, FaultKind::kTilted, 3, 4}});
  EXPECT_FALSE(dut.Select(0.5, 0.001));
  const Eigen::Matrix3d down = Vector3d(0, 0, 1).asDiagonal();
  EXPECT_EQ(dut.Select(1.000, 0.001)->force, down);
  EXPECT_TRUE(dut.Select(1.001, 0.001)->force.isZero(0));
  EXPECT_EQ(dut.Select(1.002, 0.001)->force, down);
  const Eigen::Matrix3d tilted = dut.Select(3.5, 0.001)->force;
  EXPECT_TRUE((tilted * tilted).isApprox(tilted, 1e-15));
  EXPECT_NEAR(std::acos(std::sqrt(tilted(2, 2))), std::acos(-1) / 4, 1e-12);
}

TEST(InputFaultsTest, DoesNotAllocate) {
  const InputFaults dut(
      {{FaultyInput::kMessageToRobot, FaultKind::kFrozen, 0, 1}});
  InputFaultsState state;
  Message message{.tag = 1, .size = Message::kMaxSize};
  Pose pose;
  ScopedNoAlloc guard;
  dut.Apply(0.5, FaultyInput::kMessageToRobot, &message, &state);
  dut.Apply(0.5, FaultyInput::kDevicePose, &pose, &state);
  dut.Select(0.5, 0.001);
  EXPECT_EQ(guard.count(), 0);
}

TEST(InputFaultsTest, InvalidOnesAreNamed) {
  const auto error = [](const InputFault& fault) {
    return ValidationError(fault);
  };
  EXPECT_NE(error({.start = 1, .end = 1}).find("`end`"), std::string::npos);
  EXPECT_NE(error({.start = -1, .end = 1}).find("`start`"), std::string::npos);
  EXPECT_NE(
      error({FaultyInput::kSensor, FaultKind::kTilted, 0, 1}).find("`kind`"),
      std::string::npos);
  EXPECT_NE(
      error({FaultyInput::kSelections, FaultKind::kNan, 0, 1}).find("`kind`"),
      std::string::npos);
}

}  // namespace
}  // namespace dual_proxy
