// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/haptic_fixtures.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

#include "dual_proxy/common/random.h"
#include "dual_proxy/simulation/haptic_device.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;

const Vector3d kNone =
    Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
const Vector3d kRest = Vector3d::Zero();

TEST(WorkspaceWallTest, PushesInwardBeyondItsEdge) {
  const WorkspaceWall dut({.stiffness = 1000});
  EXPECT_TRUE(dut.Calc({0.049, 0.0749, 0}, kRest).isZero(0));
  EXPECT_LT((dut.Calc({0.052, 0, 0}, kRest) - Vector3d(-2, 0, 0)).norm(), 1e-9);
  EXPECT_LT((dut.Calc({-0.052, 0, 0}, kRest) - Vector3d(2, 0, 0)).norm(), 1e-9);
  const Vector3d out(0, 0.6, 0.8);
  EXPECT_LT((dut.Calc(0.078 * out, kRest) + 3 * out).norm(), 1e-9);
  // It resists on the way out, and does not hold on the way back.
  EXPECT_LT((dut.Calc(0.078 * out, 0.1 * out) + 4 * out).norm(), 1e-9);
  EXPECT_LT((dut.Calc(0.078 * out, -0.1 * out) + 3 * out).norm(), 1e-9);
  // Its edge is no step for a fast hand.
  EXPECT_LT(dut.Calc(0.07501 * out, out).norm(), 0.03);
  EXPECT_TRUE(dut.Calc(kNone, kRest).isZero(0));
  EXPECT_FALSE(WorkspaceWall({}).on());
}

TEST(WorkspaceWallTest, IsBounded) {
  const WorkspaceWall dut({.stiffness = 1000});
  RandomStream random(3);
  for (int i = 0; i < 1000; ++i) {
    const Vector3d p =
        0.1 * Vector3d(random.Normal(), random.Normal(), random.Normal());
    const Vector3d F = dut.Calc(p, random.Normal() * p);
    EXPECT_LE(F.norm(), 8 * (1 + 1e-12));
    EXPECT_LE(F.dot(p), 0);
  }
}

// A hand that means to go 15 mm beyond the edge comes to rest before the hard
// stop, which is 5 mm beyond it.
TEST(WorkspaceWallTest, IsFeltBeforeTheHardStop) {
  const WorkspaceWall dut({.stiffness = 1500});
  const SimulatedHapticDevice device({.hand_stiffness = 300});
  SimulatedHapticDeviceState hand = device.MakeState();
  Pose intended;
  intended.p.y() = 0.09;
  for (int i = 0; i < 3000; ++i) {
    Vector6d wrench = Vector6d::Zero();
    wrench.head<3>() = dut.Calc(hand.read_pose.p, hand.read_velocity.head<3>());
    device.Update(intended, kRest, wrench, &hand);
  }
  EXPECT_LT(hand.pose.p.y(), 0.079);
  EXPECT_LT(hand.velocity.norm(), 1e-6);
  EXPECT_LT(hand.handle_force.y(), -3);
}

class GuidanceTest : public ::testing::Test {
 protected:
  // In the long run.
  static Vector3d Settle(const Guidance& dut, const Vector3d& p) {
    GuidanceState state = dut.MakeState();
    for (int i = 0; i < 1000; ++i) dut.Update(p, true, &state);
    return state.force;
  }

  GuidanceParams params_{.point = {0.01, 0, 0}, .direction = {0, 0, 2}};
};

TEST_F(GuidanceTest, LeadsOntoALineOrAPlane) {
  const Vector3d p(0.013, 0.004, 0.05);
  params_.shape = GuidanceShape::kLine;
  EXPECT_LT(
      (Settle(Guidance(params_, 0.001), p) - Vector3d(-0.9, -1.2, 0)).norm(),
      1e-12);
  params_.shape = GuidanceShape::kPlane;
  params_.direction = {0, 1, 0};
  EXPECT_LT((Settle(Guidance(params_, 0.001), p) - Vector3d(0, -1.2, 0)).norm(),
            1e-12);
  params_.direction = {0, 1e200, 0};  // Of any length.
  EXPECT_LT((Settle(Guidance(params_, 0.001), p) - Vector3d(0, -1.2, 0)).norm(),
            1e-12);
  params_.shape = GuidanceShape::kNone;
  EXPECT_TRUE(Settle(Guidance(params_, 0.001), p).isZero(0));
}

TEST_F(GuidanceTest, IsLimitedInForceAndRate) {
  params_.shape = GuidanceShape::kPlane;
  const Guidance dut(params_, 0.001);
  GuidanceState state = dut.MakeState();
  RandomStream random(5);
  for (int i = 0; i < 5000; ++i) {
    const Vector3d before = state.force;
    const bool active = i % 1000 < 900;
    dut.Update({0, 0, i % 7 == 0 ? kNone(0) : 0.05 * random.Normal()}, active,
               &state);
    ASSERT_LE(state.force.norm(), 3 * (1 + 1e-12));
    ASSERT_LE((state.force - before).norm(), 0.02 * (1 + 1e-9));
  }
  EXPECT_TRUE(Settle(dut, {0, 0, 1}).isApprox(Vector3d(0, 0, -3)));
}

class HomingTest : public ::testing::Test {
 protected:
  // A hand that leaves the handle alone (0 N/m), or holds it where it started.
  void Run(double hand_stiffness, int ticks) {
    const SimulatedHapticDevice device(
        {.hand_stiffness = hand_stiffness, .hand_damping = 2});
    for (int i = 0; i < ticks; ++i) {
      dut_.Update(true, hand_.read_pose.p, hand_.read_velocity.head<3>(),
                  &state_);
      Vector6d wrench = Vector6d::Zero();
      wrench.head<3>() = state_.force;
      device.Update(start_, kRest, wrench, &hand_);
      top_speed_ = std::max(top_speed_, hand_.velocity.norm());
      top_force_ = std::max(top_force_, state_.force.norm());
    }
  }

  const Pose start_{{0.03, -0.04, 0.02}, Eigen::Matrix3d::Identity()};
  Homing dut_{{}, 0.001};
  HomingState state_ = dut_.MakeState();
  SimulatedHapticDeviceState hand_ = SimulatedHapticDevice().MakeState(start_);
  double top_speed_{0};
  double top_force_{0};
};

TEST_F(HomingTest, GoesHomeSlowly) {
  Run(0, 900);
  EXPECT_TRUE(state_.active);
  Run(0, 3000);
  EXPECT_TRUE(state_.done);
  EXPECT_LT(top_speed_, 0.075);
  EXPECT_LT(hand_.pose.p.norm(), 1e-4);
  // It is kept there.
  EXPECT_TRUE(state_.active);
  dut_.Update(true, {0.003, 0, 0}, kRest, &state_);
  EXPECT_LT(state_.force.x(), 0);
  // Asked anew it begins anew.
  dut_.Update(false, {0.03, 0, 0}, kRest, &state_);
  dut_.Update(true, {0.03, 0, 0}, kRest, &state_);
  EXPECT_TRUE(state_.active);
}

TEST_F(HomingTest, WaitsForAHandThatHolds) {
  Run(600, 5000);
  EXPECT_TRUE(state_.active);
  EXPECT_LE(top_force_, 4 * (1 + 1e-12));
  EXPECT_LT((hand_.pose.p - start_.p).norm(), 4.0 / 500);
  // And does not fling the handle home when it lets go.
  Run(0, 3000);
  EXPECT_TRUE(state_.done);
  EXPECT_LT(top_speed_, 0.15);
}

TEST_F(HomingTest, StopsWithoutAPoseAndWhenLetGo) {
  Run(0, 300);
  for (int i = 0; i < 200; ++i) dut_.Update(true, kNone, kRest, &state_);
  EXPECT_TRUE(state_.force.isZero(0));
  EXPECT_TRUE(state_.active);
  dut_.Update(false, kNone, kRest, &state_);
  EXPECT_FALSE(state_.active);
}

TEST(HapticFixturesTest, DoNotAllocate) {
  const WorkspaceWall wall({.stiffness = 1000});
  const Guidance guidance({.shape = GuidanceShape::kLine}, 0.001);
  const Homing homing({}, 0.001);
  GuidanceState guided = guidance.MakeState();
  HomingState homed = homing.MakeState();
  ScopedNoAlloc guard;
  wall.Calc({0.1, 0.1, 0.1}, kRest);
  guidance.Update({0.1, 0.1, 0.1}, true, &guided);
  homing.Update(true, {0.1, 0.1, 0.1}, kRest, &homed);
  EXPECT_EQ(guard.count(), 0);
}

TEST(HapticFixturesTest, InvalidParamsNameTheField) {
  EXPECT_EQ(ValidationError(GuidanceParams{.direction = kRest}),
            "GuidanceParams: field `direction` expected a finite value > 0, "
            "got 0");
  EXPECT_THROW(WorkspaceWall({.stiffness = -1}), std::invalid_argument);
  EXPECT_THROW(Guidance({.max_force = -1}, 0.001), std::invalid_argument);
  EXPECT_THROW(Homing({.speed = 0}, 0.001), std::invalid_argument);
  EXPECT_THROW(Homing({}, 0), std::invalid_argument);
}

}  // namespace
}  // namespace dual_proxy
