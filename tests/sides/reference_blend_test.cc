// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/sides/reference_blend.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "dual_proxy/common/random.h"
#include "no_alloc.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kPeriod = 0.001;

Matrix3d Along(const Vector3d& direction) {
  const Vector3d u = direction.normalized();
  return u * u.transpose();
}

class ReferenceBlendTest : public ::testing::Test {
 protected:
  ReferenceBlendTest() { Operate(0); }

  // An operator who moves about and presses, within a proxy's limits.
  void Operate(double t) {
    setpoint_ = {};
    pose_.p = {0.4 + 0.02 * std::sin(2 * t), 0.03 * std::cos(t),
               0.39 - 0.001 * std::sin(5 * t)};
    setpoint_.velocity.head<3>() << 0.04 * std::cos(2 * t), -0.03 * std::sin(t),
        -0.005 * std::cos(5 * t);
    setpoint_.reference_force.z() = -6 + 2 * std::sin(3 * t);
    setpoint_.force_selection = Along(Vector3d::UnitZ());
    setpoint_.motion_error = X_BE_.p - pose_.p;
    setpoint_.motion_error.z() = 0;
    own_ = setpoint_;
    own_pose_ = pose_;
  }

  void Step(const PlannerReference& planner, bool ready = true) {
    Operate(time_);
    dut_.TakePlanner(planner, ready, &state_);
    dut_.Update(X_BE_, &state_, &setpoint_, &pose_);
    time_ += kPeriod;
  }

  static PlannerReference Normal(double force) {
    return {.selection = Along(Vector3d::UnitZ()), .force = {0, 0, force}};
  }

  RobotSideProxyParams params_;
  ReferenceBlend dut_{params_};
  ReferenceBlendState state_ = dut_.MakeState();
  Pose X_BE_{.p = {0.4, 0, 0.4}};
  double time_{0};
  RobotSetpoint setpoint_;  // Blended.
  Pose pose_;
  RobotSetpoint own_;  // The operator's.
  Pose own_pose_;
};

TEST_F(ReferenceBlendTest, WithoutAPlannerItIsTheOperatorsToTheBit) {
  for (int i = 0; i < 500; ++i) {
    Step({});
    ASSERT_EQ(pose_.p, own_pose_.p);
    ASSERT_EQ(setpoint_.motion_error, own_.motion_error);
    ASSERT_EQ(setpoint_.velocity, own_.velocity);
    ASSERT_EQ(setpoint_.reference_force, own_.reference_force);
  }
}

TEST_F(ReferenceBlendTest, EachHasItsDirections) {
  for (int i = 0; i < 3000; ++i) {
    PlannerReference planner = Normal(-5);
    planner.selection += Along(Vector3d::UnitY());
    planner.position << 9, 0.01 * std::sin(time_), 9;
    planner.velocity << 9, 0.01 * std::cos(time_), 9;
    planner.position.z() = 0.4;
    planner.velocity.z() = 0;
    Step(planner);
  }
  const double t = time_ - kPeriod;
  EXPECT_NEAR(pose_.p.x(), own_pose_.p.x(), 1e-9);
  EXPECT_NEAR(setpoint_.velocity(0), own_.velocity(0), 1e-9);
  EXPECT_NEAR(pose_.p.y(), 0.01 * std::sin(t), 1e-9);
  EXPECT_NEAR(setpoint_.velocity(1), 0.01 * std::cos(t), 1e-9);
  EXPECT_LT((setpoint_.reference_force - Vector3d(0, 0, -5)).norm(), 1e-12);
  // Motion is controlled where the force is not.
  const Vector3d dx = X_BE_.p - pose_.p;
  EXPECT_LT((setpoint_.motion_error - Vector3d(dx.x(), dx.y(), 0)).norm(),
            1e-12);
  EXPECT_EQ(setpoint_.force_selection, own_.force_selection);
}

TEST_F(ReferenceBlendTest, WholeReference) {
  PlannerReference planner = Normal(-5);
  planner.selection.setIdentity();
  planner.position << 0.45, 0.02, 0.41;
  for (int i = 0; i < 3000; ++i) Step(planner);
  EXPECT_LT((pose_.p - planner.position).norm(), 1e-9);
  EXPECT_LT(setpoint_.velocity.norm(), 1e-9);
}

TEST_F(ReferenceBlendTest, HandsBackToTheBit) {
  for (int i = 0; i < 1000; ++i) Step(Normal(-9));
  EXPECT_TRUE(state_.blending);
  for (int i = 0; i < 3000; ++i) Step({});
  EXPECT_FALSE(state_.blending);
  EXPECT_EQ(pose_.p, own_pose_.p);
  EXPECT_EQ(setpoint_.reference_force, own_.reference_force);
}

// Whatever is taken over, handed back, asked for, or refused.
// The hand has sunk meanwhile, and asks for more than it is to get at once;
// less it has at once, and what it once has met it keeps.
TEST_F(ReferenceBlendTest, AForceThatIsHandedBackGrowsSlowly) {
  for (int i = 0; i < 300; ++i) Step(Normal(-2));
  EXPECT_EQ(setpoint_.reference_force.z(), -2);
  double last = 2;
  int met = 0;
  for (int i = 0; i < 4000; ++i) {
    Step({});
    const double asked = -own_.reference_force.z();
    const double force = -setpoint_.reference_force.z();
    if (met == 0) {
      ASSERT_LE(force, std::max(last, std::min(asked, last + 1.001e-3))) << i;
      ASSERT_GE(force, std::min(asked, last)) << i;
    }
    if (force == asked) met = met == 0 ? i : met;
    if (met > 0) {
      ASSERT_EQ(force, asked) << i;
    }
    last = force;
  }
  EXPECT_GT(met, 1000);
  EXPECT_FALSE(state_.blending);
}

TEST_F(ReferenceBlendTest, NothingSteps) {
  RandomStream random(5);
  const double v_max = params_.limiter.max_velocity;
  const double a_max = params_.limiter.max_acceleration;
  PlannerReference planner;
  bool ready = true;
  double farthest = 0;
  double hardest = 0;
  Step(planner);
  for (int i = 0; i < 40000; ++i) {
    if (random.Uniform() < 0.004) {
      const Vector3d n(random.Normal(), random.Normal(), random.Normal());
      const double kind = random.Uniform();
      planner.selection = Along(n);
      if (kind < 0.5) planner.selection = Matrix3d::Identity() - Along(n);
      if (kind < 0.4) planner.selection.setIdentity();
      if (kind < 0.3) planner.selection.setZero();
      planner.position =
          X_BE_.p + 0.1 * Vector3d(random.Normal(), random.Normal(), 0);
      planner.velocity = 0.2 * n;
      planner.force = 20 * n;
      if (kind > 0.97) planner.force.x() = std::nan("");
      ready = random.Uniform() < 0.9;
    }
    const RobotSetpoint last = setpoint_;
    const Vector3d last_p = pose_.p;
    Step(planner, ready);
    const Vector3d step = pose_.p - last_p;
    const Vector3d change =
        setpoint_.velocity.head<3>() - last.velocity.head<3>();
    const double force_step =
        (setpoint_.reference_force - last.reference_force).norm();
    ASSERT_LE(step.cwiseAbs().maxCoeff(), (v_max + 1e-6) * kPeriod) << i;
    ASSERT_LE(change.cwiseAbs().maxCoeff(), (a_max + 1e-3) * kPeriod) << i;
    ASSERT_LE(force_step, (params_.force_rate + 1e-6) * kPeriod) << i;
    // The velocity is that of the position.
    ASSERT_LT((step / kPeriod - setpoint_.velocity.head<3>()).norm(), 0.02);
    farthest = std::max(farthest, (pose_.p - own_pose_.p).norm());
    hardest = std::max(
        hardest, (setpoint_.reference_force - own_.reference_force).norm());
  }
  EXPECT_GT(farthest, 0.05);
  EXPECT_GT(hardest, 5);
  EXPECT_GT(state_.bad_inputs, 0);
}

// A contact that is found or let go is the half's to step at.
TEST_F(ReferenceBlendTest, StepsOnPurposeStay) {
  PlannerReference planner = Normal(-5);
  planner.position.z() = 0.4;
  for (int i = 0; i < 2000; ++i) Step(planner);
  const Vector3d jump(0, 0, 3);
  Operate(time_);
  setpoint_.reference_force += jump;
  pose_.p.x() += 0.01;
  const Vector3d last = state_.limiter.pose.p;
  dut_.TakePlanner(planner, true, &state_);
  dut_.Update(X_BE_, &state_, &setpoint_, &pose_);
  EXPECT_NEAR(setpoint_.reference_force.z(), -2, 0.1);
  // But for what a limiter moves in a period, either way.
  EXPECT_NEAR(pose_.p.x() - last.x(), 0.01,
              2 * params_.limiter.max_velocity * kPeriod);
}

TEST_F(ReferenceBlendTest, StaysNearTheRobotAndWithinTheWorkspace) {
  params_.workspace.shape = WorkspaceLimitsParams::Shape::kBox;
  params_.workspace.center << 0.4, 0, 0.4;
  params_.workspace.half_size.setConstant(0.1);
  dut_ = ReferenceBlend(params_);
  PlannerReference planner{.selection = Matrix3d::Identity(),
                           .position = {5, 0, 0.4}};
  for (int i = 0; i < 3000; ++i) Step(planner);
  EXPECT_NEAR(pose_.p.x(), 0.5, 1e-9);
  params_.workspace.shape = WorkspaceLimitsParams::Shape::kNone;
  dut_ = ReferenceBlend(params_);
  for (int i = 0; i < 3000; ++i) Step(planner);
  EXPECT_NEAR(pose_.p.x(), 0.4 + params_.max_distance, 1e-9);
}

TEST_F(ReferenceBlendTest, WhatIsNoReferenceIsRefusedAndCounted) {
  for (int i = 0; i < 100; ++i) Step({});
  PlannerReference planner = Normal(-5);
  planner.selection *= 2;
  Step(planner);
  planner = Normal(-5);
  planner.velocity.y() = std::numeric_limits<double>::infinity();
  Step(planner);
  EXPECT_EQ(state_.bad_inputs, 2);
  EXPECT_EQ(setpoint_.reference_force, own_.reference_force);
  Step(Normal(-5));
  EXPECT_TRUE(state_.blending);
  EXPECT_EQ(state_.bad_inputs, 2);
}

TEST_F(ReferenceBlendTest, NoHeap) {
  ScopedNoAlloc guard;
  for (int i = 0; i < 300; ++i) {
    PlannerReference planner;
    if (i % 100 < 50) {
      planner = Normal(-5);
      planner.selection.setIdentity();
      planner.position << 0.3, 0.1, 0.4;
    }
    Step(planner);
  }
  EXPECT_EQ(guard.count(), 0);
}

}  // namespace
}  // namespace dual_proxy
