// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/baselines/position_force.h"

#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "dual_proxy/common/random.h"
#include "dual_proxy/common/rotation.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;

ForceMessage Message(std::int64_t sequence, double send_time,
                     const Vector3d& force) {
  ForceMessage message;
  message.sequence = sequence;
  message.send_time = send_time;
  message.force = force;
  return message;
}

class PositionForceHapticSideTest : public ::testing::Test {
 protected:
  PositionForceHapticSideTest() {
    // x of the robot is y of the device.
    params_.map.R_DB = ExpRotation({0, 0, std::numbers::pi / 2});
  }

  PositionForceHapticSideParams params_;
  PositionForceHapticSideState state_;
};

TEST_F(PositionForceHapticSideTest, ZeroBeforeTheFirstMessage) {
  const PositionForceHapticSide dut(params_);
  dut.Update(0, {}, &state_);
  EXPECT_EQ(state_.reference_force, Vector3d::Zero());
  EXPECT_EQ(state_.link.status, LinkStatus::kWaiting);
}

TEST_F(PositionForceHapticSideTest, HandFeelsTheScaledReaction) {
  const PositionForceHapticSide dut(params_);
  dut.Update(0.1, Message(0, 0, {10, 0, -5}), &state_);
  EXPECT_LT((state_.reference_force - Vector3d(0, -4, 2)).norm(), 1e-15);
  // Held until the next message.
  dut.Update(0.11, Message(0, 0, {10, 0, -5}), &state_);
  EXPECT_LT((state_.reference_force - Vector3d(0, -4, 2)).norm(), 1e-15);
  EXPECT_NEAR(state_.link.age, 0.11, 1e-15);
}

TEST_F(PositionForceHapticSideTest, ForceIsBoundedAndKeepsItsDirection) {
  const PositionForceHapticSide dut(params_);
  RandomStream random(6);
  for (int i = 0; i < 1000; ++i) {
    Vector3d force;
    for (double& value : force) value = 30 * random.Normal();
    dut.Update(0.01 * i, Message(i, 0.01 * i, force), &state_);
    EXPECT_LE(state_.reference_force.norm(), 12 * (1 + 1e-15));
    EXPECT_NEAR(state_.reference_force.normalized().dot(params_.map.R_DB *
                                                        force.normalized()),
                -1, 1e-14);
  }
}

TEST_F(PositionForceHapticSideTest, ZeroWhenLostAndBackOnRecovery) {
  const PositionForceHapticSide dut(params_);
  dut.Update(0, Message(0, 0, {10, 0, 0}), &state_);
  dut.Update(0.6, Message(0, 0, {10, 0, 0}), &state_);
  EXPECT_EQ(state_.link.status, LinkStatus::kLost);
  EXPECT_EQ(state_.reference_force, Vector3d::Zero());
  dut.Update(0.7, Message(1, 0.7, {5, 0, 0}), &state_);
  EXPECT_LT((state_.reference_force - Vector3d(0, -2, 0)).norm(), 1e-15);
}

TEST_F(PositionForceHapticSideTest, BadAndOldMessagesAreNotUsed) {
  const PositionForceHapticSide dut(params_);
  dut.Update(0.1, Message(5, 0.1, {10, 0, 0}), &state_);
  const Vector3d before = state_.reference_force;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  dut.Update(0.11, Message(6, 0.11, {nan, 0, 0}), &state_);
  EXPECT_EQ(state_.reference_force, before);
  EXPECT_EQ(state_.link.bad_inputs, 1);
  dut.Update(0.12, Message(4, 0.09, {1, 2, 3}), &state_);
  EXPECT_EQ(state_.reference_force, before);
  EXPECT_EQ(state_.link.dropped, 1);
}

TEST_F(PositionForceHapticSideTest, DoesNotAllocate) {
  const PositionForceHapticSide dut(params_);
  ScopedNoAlloc guard;
  for (int i = 0; i < 10; ++i) {
    dut.Update(i, Message(i, i, {100, 0, 0}), &state_);
  }
  EXPECT_EQ(guard.count(), 0);
}

TEST_F(PositionForceHapticSideTest, ErrorsNameFieldRangeAndValue) {
  const std::string who = "PositionForceHapticSideParams: field `";
  EXPECT_EQ(ValidationError(params_), "no exception");
  params_.force_scale = -1;
  EXPECT_EQ(ValidationError(params_),
            who + "force_scale` expected a finite value >= 0, got -1");
  EXPECT_THROW(PositionForceHapticSide{params_}, std::invalid_argument);
  params_ = {};
  params_.max_force = std::numeric_limits<double>::infinity();
  EXPECT_EQ(ValidationError(params_),
            who + "max_force` expected a finite value >= 0, got inf");
  params_ = {};
  params_.link.timeout = 0;
  EXPECT_NE(ValidationError(params_).find("`timeout`"), std::string::npos);
}

}  // namespace
}  // namespace dual_proxy
