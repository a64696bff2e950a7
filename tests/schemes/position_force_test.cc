// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/schemes/position_force/scheme.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "dual_proxy/common/random.h"
#include "dual_proxy/common/rotation.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Message Force(std::int64_t sequence, double send_time, const Vector3d& force) {
  return ToMessage(ForceMessage{
      .sequence = sequence, .send_time = send_time, .force = force});
}

class PositionForceHapticHalfTest : public ::testing::Test {
 protected:
  PositionForceHapticHalfTest() {
    // x of the robot is y of the device.
    shared_.proxy.map.R_DB = ExpRotation({0, 0, std::numbers::pi / 2});
  }

  // F_h after a period with this message.
  Vector3d Feel(double time, const Message& message) {
    const PositionForceHapticHalf dut(shared_, {});
    dut.Update(time, {.message = message, .X_DH = {}}, &state_);
    return state_.output.setpoint.reference_force;
  }

  HapticHalfParams shared_;
  PositionForceHapticHalfState state_;
};

TEST_F(PositionForceHapticHalfTest, ZeroBeforeTheFirstMessage) {
  EXPECT_EQ(Feel(0, {}), Vector3d::Zero());
  EXPECT_EQ(state_.output.link.status, LinkStatus::kWaiting);
}

TEST_F(PositionForceHapticHalfTest, HandFeelsTheScaledReaction) {
  const Message message = Force(0, 0, {10, 0, -5});
  EXPECT_LT((Feel(0.1, message) - Vector3d(0, -4, 2)).norm(), 1e-15);
  // Held until the next message.
  EXPECT_LT((Feel(0.11, message) - Vector3d(0, -4, 2)).norm(), 1e-15);
  EXPECT_NEAR(state_.output.link.age, 0.11, 1e-15);
}

TEST_F(PositionForceHapticHalfTest, ForceIsBoundedAndKeepsItsDirection) {
  RandomStream random(6);
  for (int i = 0; i < 1000; ++i) {
    Vector3d force;
    for (double& value : force) value = 30 * random.Normal();
    const Vector3d felt = Feel(0.01 * i, Force(i, 0.01 * i, force));
    EXPECT_LE(felt.norm(), 12 * (1 + 1e-15));
    EXPECT_NEAR(
        felt.normalized().dot(shared_.proxy.map.R_DB * force.normalized()), -1,
        1e-14);
  }
}

TEST_F(PositionForceHapticHalfTest, ZeroWhenLostAndBackOnRecovery) {
  Feel(0, Force(0, 0, {10, 0, 0}));
  EXPECT_EQ(Feel(0.6, Force(0, 0, {10, 0, 0})), Vector3d::Zero());
  EXPECT_EQ(state_.output.link.status, LinkStatus::kLost);
  EXPECT_LT((Feel(0.7, Force(1, 0.7, {5, 0, 0})) - Vector3d(0, -2, 0)).norm(),
            1e-15);
}

TEST_F(PositionForceHapticHalfTest, BadAndOldMessagesAreNotUsed) {
  const Vector3d before = Feel(0.1, Force(5, 0.1, {10, 0, 0}));
  EXPECT_EQ(Feel(0.11, Force(6, 0.11, {kNan, 0, 0})), before);
  EXPECT_EQ(Feel(0.12, ToMessage(PoseMessage{.sequence = 7, .pose = {}})),
            before);
  EXPECT_EQ(state_.output.link.bad_inputs, 2);
  EXPECT_EQ(Feel(0.13, Force(4, 0.09, {1, 2, 3})), before);
  EXPECT_EQ(state_.output.link.dropped, 1);
}

TEST_F(PositionForceHapticHalfTest, HandlesPoseGoesToTheRobot) {
  const PositionForceHapticHalf dut(shared_, {});
  const Vector3d p(0.01, 0.02, -0.03);
  dut.Update(0, {.message = {}, .X_DH = {.p = p}}, &state_);
  EXPECT_EQ(FromMessage<PoseMessage>(state_.output.message).pose.p, p);
}

TEST_F(PositionForceHapticHalfTest, DoesNotAllocate) {
  const PositionForceHapticHalf dut(shared_, {});
  ScopedNoAlloc guard;
  for (int i = 0; i < 10; ++i) {
    dut.Update(i, {.message = Force(i, i, {100, 0, 0}), .X_DH = {}}, &state_);
  }
  EXPECT_EQ(guard.count(), 0);
}

// The robot follows the handle everywhere, and sends what it feels: no force is
// controlled.
TEST(PositionForceRobotHalfTest, FollowsThePoseAndSendsTheForce) {
  RobotHalfParams shared;
  shared.proxy.map.p_cw = {0.4, 0, 0.2};
  shared.proxy.max_motion_error = 0;
  shared.sender.average = false;
  const PositionForceRobotHalf dut(shared, {});
  PositionForceRobotHalfState state = dut.MakeState();
  RobotHalfInput input;
  input.X_BE.p = {0.4, 0, 0.2};
  input.sensed_wrench << 1, 2, -6, 0, 0, 0;
  // What perception has found is of no use.
  input.force_selection = Vector3d::UnitZ().asDiagonal();
  for (int i = 0; i < 1000; ++i) {
    input.message = ToMessage(PoseMessage{.sequence = i / 20,
                                          .send_time = 0.02 * (i / 20),
                                          .pose = {.p = {0, 0, -0.01}}});
    dut.Update(0.001 * i, input, &state);
  }
  const RobotSetpoint& setpoint = state.output.setpoint;
  EXPECT_NEAR(setpoint.motion_error.z(), 0.025, 1e-9);
  EXPECT_EQ(setpoint.force_selection, Eigen::Matrix3d::Zero());
  EXPECT_EQ(setpoint.reference_force, Vector3d::Zero());
  const auto sent = FromMessage<ForceMessage>(state.output.message);
  EXPECT_EQ(sent.force, Vector3d(1, 2, -6));
}

TEST(PositionForceParamsTest, ErrorsNameFieldRangeAndValue) {
  const std::string who = "PositionForceParams: field `";
  PositionForceParams params;
  EXPECT_EQ(ValidationError(params), "no exception");
  params.force_scale = -1;
  EXPECT_EQ(ValidationError(params),
            who + "force_scale` expected a finite value >= 0, got -1");
  EXPECT_THROW(PositionForceHapticHalf({}, params), std::invalid_argument);
  params = {};
  params.max_force = std::numeric_limits<double>::infinity();
  EXPECT_EQ(ValidationError(params),
            who + "max_force` expected a finite value >= 0, got inf");
}

}  // namespace
}  // namespace dual_proxy
