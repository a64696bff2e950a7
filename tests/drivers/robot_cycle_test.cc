// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/robot_cycle.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "no_alloc.h"
#include "test_arm.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;

const double kNan = std::numeric_limits<double>::quiet_NaN();

RobotCycleParams MakeParams() {
  RobotCycleParams params;
  params.model = MakeTestArm();
  params.side.proxy.reclutch = true;
  params.side.controller.gravity_compensation = false;
  params.side.controller.q_rest = kTestArmAtRest;
  params.sensor.tare = true;
  params.sensor.tool_mass = 0.2;
  params.p_SE = Vector3d(0, 0, 0.1);
  return params;
}

// An arm that stands still, whose sensor carries its tool.
class RobotCycleTest : public ::testing::Test {
 protected:
  RobotCycleTest() {
    input_.q = kTestArmAtRest;
    input_.sensor.valid = true;
    // The tool points down, and S is as E.
    input_.sensor.value << 0.3, 0, -0.2 * 9.81 + 0.7, 0, 0, 0;
  }

  void Step(bool read = true) {
    time_ += dut_.period();
    if (read) input_.sensor.time = time_ - 1e-4;
    dut_.Update(time_, input_, &state_);
  }

  void Send(const Vector3d& x_h) {
    input_.message =
        ToMessage(PoseMessage{.sequence = input_.message.sequence + 1,
                              .send_time = time_,
                              .pose = {.p = x_h}});
  }

  void Run(int steps) {
    for (int i = 0; i < steps; ++i) {
      if (i % 20 == 0) Send({0.02, 0, 0});
      Step();
    }
  }

  RobotCycle dut_{MakeParams()};
  RobotCycleState state_ = dut_.MakeState();
  RobotCycleInput input_;
  double time_{100};
};

TEST_F(RobotCycleTest, HoldsUntilTheSensorsBiasIsKnown) {
  Run(300);
  EXPECT_EQ(state_.side.output.hold, HoldReason::kNoSensor);
  Run(400);
  EXPECT_EQ(state_.side.output.hold, HoldReason::kNone);
  EXPECT_EQ(state_.sensor.tares, 1);
  EXPECT_LT(state_.side.output.sensed_wrench.norm(), 1e-6);
  // An arm that carries its own weight, at its proxy: no torque to speak of.
  EXPECT_LT(state_.torque().cwiseAbs().maxCoeff(), 1e-3);
}

TEST_F(RobotCycleTest, HoldsWhenTheSensorIsSilentAndGoesOn) {
  Run(700);
  for (int i = 0; i < 9; ++i) Step(false);
  EXPECT_EQ(state_.side.output.hold, HoldReason::kNone);
  for (int i = 0; i < 3; ++i) Step(false);
  EXPECT_EQ(state_.side.output.hold, HoldReason::kNoSensor);
  Step();
  EXPECT_EQ(state_.side.output.hold, HoldReason::kNone);
  // What its driver says is not valid, and what is no number.
  input_.sensor.valid = false;
  for (int i = 0; i < 12; ++i) Step();
  EXPECT_EQ(state_.side.output.hold, HoldReason::kNoSensor);
  input_.sensor.valid = true;
  Step();
  EXPECT_EQ(state_.side.output.hold, HoldReason::kNone);
  const Vector6 good = input_.sensor.value;
  input_.sensor.value(1) = kNan;
  for (int i = 0; i < 12; ++i) Step();
  EXPECT_EQ(state_.side.output.hold, HoldReason::kNoSensor);
  input_.sensor.value = good;
  Step();
  EXPECT_EQ(state_.side.output.hold, HoldReason::kNone);
  EXPECT_LT(state_.torque().cwiseAbs().maxCoeff(), 1e-2);
}

TEST_F(RobotCycleTest, RestartsWhereTheArmIsAndKnowsTheBias) {
  Run(700);
  dut_.Restart(&state_);
  input_.q(0) += 0.3;  // Somebody has guided it.
  input_.q(3) += 0.1;
  Run(3);
  EXPECT_EQ(state_.side.output.hold, HoldReason::kNone);
  EXPECT_TRUE(state_.side.output.reference_pose.p.isApprox(state_.X_BE.p));
  EXPECT_LT(state_.torque().cwiseAbs().maxCoeff(), 3);  // Its posture's.
}

// Or the haptic side would take what comes after a restart for old.
TEST_F(RobotCycleTest, MessagesGoOnCountingAfterARestart) {
  EXPECT_EQ(state_.message().sequence, -1);
  Run(100);
  const std::int64_t last = state_.message().sequence;
  EXPECT_GT(last, 2);
  dut_.Restart(&state_);
  EXPECT_EQ(state_.message().sequence, last);
  Run(100);
  EXPECT_GT(state_.message().sequence, last + 2);
  EXPECT_LT(state_.message().sequence, 2 * last + 3);
}

TEST_F(RobotCycleTest, AMessageFromBeforeARestartIsNotFollowed) {
  Run(700);
  dut_.Restart(&state_);
  for (int i = 0; i < 10; ++i) Step();
  EXPECT_EQ(state_.side.output.hold, HoldReason::kNoLink);
  Send({0.02, 0, 0});
  Step();
  EXPECT_EQ(state_.side.output.hold, HoldReason::kNone);
}

TEST_F(RobotCycleTest, ASensorThatIsDistrustedIsReadAndNotUsed) {
  input_.distrust_sensor = true;
  Run(700);
  EXPECT_EQ(state_.side.output.hold, HoldReason::kNoSensor);
  EXPECT_EQ(state_.sensor.tares, 1);
  input_.sensor.value(2) += 4;
  Step();
  EXPECT_NEAR(state_.sensor.wrench(2), -4, 1e-9);
  input_.distrust_sensor = false;
  Run(1);
  EXPECT_EQ(state_.side.output.hold, HoldReason::kNone);
}

TEST_F(RobotCycleTest, DoesNotAllocate) {
  Run(600);
  const ScopedNoAlloc guard;
  for (int i = 0; i < 100; ++i) Step(i % 2 == 0);
  EXPECT_EQ(guard.count(), 0);
}

TEST(RobotCycleParamsTest, PeriodsAreTheSame) {
  RobotCycleParams params = MakeParams();
  params.sensor.period = 0.002;
  EXPECT_EQ(ValidationError(params),
            "RobotCycleParams: field `sensor.period` expected "
            "side.controller.period, got 0.002");
}

}  // namespace
}  // namespace dual_proxy
