// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/robot_side_proxy.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "dual_proxy/link/communication_channel.h"
#include "dual_proxy/link/pose_sender.h"
#include "no_alloc.h"
#include "test_support.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kPeriod = 0.001;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kForceStep = 0.05;   // 50 N/s x 1 ms.
constexpr double kMomentStep = 0.01;  // 10 N m/s x 1 ms.
constexpr double kTolerance = 1e-12;

class RobotSideProxyTest : public ::testing::Test {
 protected:
  RobotSideProxyTest() { input_.X_BE.p = Vector3d(0.5, 0.0, 0.3); }

  static RobotSideProxyParams Params() {
    RobotSideProxyParams params;
    params.map.p_cw = Vector3d(0.5, 0.0, 0.3);
    return params;
  }

  // A new message with the device at x_h.
  void Send(const Vector3d& x_h) {
    ++input_.message.sequence;
    input_.message.send_time = time();
    input_.message.pose.p = x_h;
  }

  double time() const { return kPeriod * tick_; }

  // One tick; the forces and the proxy must not step.
  void Step(bool handover_allowed = false) {
    const RobotSideProxyOutput last = state_.output;
    const bool first = !state_.initialized;
    const Matrix3d last_selection = state_.force.selection;
    dut_.Update(time(), input_, &state_);
    ++tick_;
    const RobotSideProxyOutput& output = state_.output;
    if (!handover_allowed) {
      ASSERT_LE((output.reference_force - last.reference_force).norm(),
                kForceStep + kTolerance);
      ASSERT_LE((output.reference_moment - last.reference_moment).norm(),
                kMomentStep + kTolerance);
    }
    ASSERT_LE(output.reference_force.norm(), 20.0 + kForceStep);
    ASSERT_LE(output.reference_moment.norm(), 2.0 + kMomentStep);
    ASSERT_LE(output.motion_error.norm(), 0.02 + kTolerance);
    // Without a link, a direction that leaves force space lets go of the proxy.
    const bool released = output.link_status != LinkStatus::kConnected &&
                          state_.force.selection != last_selection;
    if (first || released) return;
    const Vector3d moved = output.proxy_pose.p - last.proxy_pose.p;
    ASSERT_LE(moved.cwiseAbs().maxCoeff(), 0.2 * kPeriod + kTolerance);
    ASSERT_LE((output.proxy_velocity - last.proxy_velocity)
                  .head<3>()
                  .cwiseAbs()
                  .maxCoeff(),
              10.0 * kPeriod + kTolerance);
  }

  // Ticks with a message every 20 of them.
  void Run(int ticks, const Vector3d& x_h) {
    for (int i = 0; i < ticks; ++i) {
      if (i % 20 == 0) Send(x_h);
      ASSERT_NO_FATAL_FAILURE(Step()) << i;
    }
  }

  void Silence(int ticks) {
    for (int i = 0; i < ticks; ++i) ASSERT_NO_FATAL_FAILURE(Step()) << i;
  }

  const RobotSideProxy dut_{Params()};
  RobotSideProxyState state_{dut_.MakeState()};
  RobotSideProxyInput input_;
  int tick_{0};
  const Matrix3d z_ = Direction(Vector3d::UnitZ());
};

TEST_F(RobotSideProxyTest, HoldsItsPlaceBeforeTheFirstMessage) {
  input_.X_BE.p = Vector3d(0.4, 0.1, 0.2);
  input_.X_BE.R = ExpRotation({0.1, 0.2, 0.3});
  const Pose start = input_.X_BE;
  input_.force_selection = z_;
  Step();
  EXPECT_TRUE(state_.output.motion_error.isZero(0.0));
  EXPECT_LT(state_.output.rotation_error.norm(), 1e-12);
  input_.X_BE.p += Vector3d(0.001, 0.0, 0.002);
  Silence(2000);
  EXPECT_EQ(state_.output.link_status, LinkStatus::kWaiting);
  EXPECT_EQ(state_.output.proxy_pose.p, start.p);
  EXPECT_EQ(state_.output.proxy_pose.R, start.R);
  EXPECT_TRUE(state_.output.motion_error.isApprox(Vector3d(0.001, 0, 0), 1e-9));
  EXPECT_TRUE(state_.output.reference_force.isZero(0.0));
}

// However far the hand is: at the first message, after a loss of the link and
// after one of the sensor.
TEST_F(RobotSideProxyTest, NeverTravelsByItselfWithReclutch) {
  RobotSideProxyParams params = Params();
  params.reclutch = true;
  const RobotSideProxy dut(params);
  state_ = dut.MakeState();
  input_.X_BE.R = ExpRotation({3.0, 0.1, 0.2});
  const Pose start = input_.X_BE;
  input_.message.pose.R = ExpRotation({0.4, -0.3, 0.2});
  const auto run = [&](int ticks, const Vector3d& x_h, bool silent = false) {
    for (int i = 0; i < ticks; ++i, ++tick_) {
      if (i % 20 == 0 && !silent) Send(x_h);
      dut.Update(time(), input_, &state_);
      input_.X_BE = state_.output.proxy_pose;  // A robot that follows at once.
    }
  };
  const auto travelled = [&](const Pose& from) {
    return (state_.output.proxy_pose.p - from.p).norm() +
           LogRotation(state_.output.proxy_pose.R * from.R.transpose()).norm();
  };
  run(500, {0.03, -0.02, 0.01});
  EXPECT_LT(travelled(start), 1e-9);
  // From there it goes by what the hand does, in the map's directions.
  input_.message.pose.R = ExpRotation({0, 0, 0.2}) * input_.message.pose.R;
  run(1500, {0.03, -0.02, 0.02});
  const Pose moved = state_.output.proxy_pose;
  EXPECT_TRUE((moved.p - start.p).isApprox(Vector3d(0, 0, 0.025), 1e-6));
  EXPECT_TRUE(LogRotation(moved.R * start.R.transpose())
                  .isApprox(Vector3d(0, 0, 0.2), 1e-3));
  // What the hand is told lies where the hand is.
  const Pose told = WorkspaceMap(params.map)
                        .HapticProxy(dut.FromRobot(moved, state_).p,
                                     dut.FromRobot(moved, state_).R);
  EXPECT_TRUE(told.p.isApprox(input_.message.pose.p, 1e-6));
  EXPECT_LT(LogRotation(told.R * input_.message.pose.R.transpose()).norm(),
            1e-3);
  run(1000, {}, true);
  EXPECT_EQ(state_.output.link_status, LinkStatus::kLost);
  run(500, {-0.05, 0.05, 0.0});
  EXPECT_EQ(state_.output.link_status, LinkStatus::kConnected);
  EXPECT_LT(travelled(moved), 1e-9);
  input_.sensor_ready = false;
  run(500, {0.01, 0.0, 0.03});
  input_.sensor_ready = true;
  run(500, {0.01, 0.0, 0.03});
  EXPECT_LT(travelled(moved), 1e-9);
}

// A surface that was pressed on has gone: nothing but a spring keeps the robot.
TEST_F(RobotSideProxyTest, WithReclutchAFadedForceLeavesNoDirectionFree) {
  RobotSideProxyParams params = Params();
  params.reclutch = true;
  const RobotSideProxy dut(params);
  state_ = dut.MakeState();
  input_.force_selection = z_;
  double largest_step = 0;
  const auto run = [&](int ticks, double depth, bool silent) {
    for (int i = 0; i < ticks; ++i, ++tick_) {
      if (i % 20 == 0 && !silent) Send({0, 0, -depth});
      const Vector3d last = state_.output.reference_force;
      dut.Update(time(), input_, &state_);
      largest_step =
          std::max(largest_step, (state_.output.reference_force - last).norm());
    }
  };
  run(500, 0, false);
  run(1000, 0.004, false);
  EXPECT_NEAR(state_.output.reference_force.z(), -5, 1e-3);
  run(1500, 0, true);
  EXPECT_EQ(state_.output.link_status, LinkStatus::kLost);
  EXPECT_TRUE(state_.output.reference_force.isZero());
  EXPECT_TRUE(state_.output.motion_error.isZero());
  EXPECT_LE(largest_step, kForceStep + kTolerance);
  input_.X_BE.p.z() += 0.001;
  run(10, 0, true);
  EXPECT_NEAR(state_.output.motion_error.z(), 0.001, 1e-12);
  // When it is guided again it is from where it is.
  run(500, 0.02, false);
  EXPECT_EQ(state_.output.link_status, LinkStatus::kConnected);
  EXPECT_NEAR(state_.output.reference_force.z(), -0.5, 1e-9);
}

TEST_F(RobotSideProxyTest, SettlesAtEquation4) {
  // The device 4 mm down and 2 mm aside: the robot proxy 10 and 5 mm.
  input_.force_selection = z_;
  Run(2000, {0.002, 0.0, -0.004});
  const RobotSideProxyOutput& output = state_.output;
  EXPECT_EQ(output.link_status, LinkStatus::kConnected);
  EXPECT_TRUE(output.proxy_pose.p.isApprox(Vector3d(0.505, 0, 0.29), 1e-12));
  EXPECT_NEAR(output.motion_error.x(), -0.005, 1e-12);
  EXPECT_EQ(output.motion_error.z(), 0.0);
  EXPECT_NEAR(output.reference_force.z(), -5.0, 1e-9);
  // Exactly zero in motion space.
  EXPECT_EQ(output.reference_force.x(), 0.0);
  EXPECT_EQ(output.reference_force.y(), 0.0);
  EXPECT_TRUE(output.proxy_velocity.isZero(1e-12));
}

TEST_F(RobotSideProxyTest, HoldsItsPlaceWhileTheSensorIsNotReady) {
  input_.sensor_ready = false;
  input_.force_selection = z_;
  Run(500, {0.01, 0.0, -0.01});
  EXPECT_EQ(state_.output.link_status, LinkStatus::kConnected);
  EXPECT_EQ(state_.output.proxy_pose.p, input_.X_BE.p);
  EXPECT_TRUE(state_.output.reference_force.isZero(0.0));
  input_.sensor_ready = true;
  Run(2000, {0.01, 0.0, -0.01});
  EXPECT_TRUE(
      state_.output.proxy_pose.p.isApprox(Vector3d(0.525, 0, 0.275), 1e-9));
}

TEST_F(RobotSideProxyTest, TheProxyWaitsForARobotThatCanNotFollow) {
  input_.force_selection = z_;
  Run(4000, {0.1, 0.0, -0.05});
  const Vector3d way = state_.output.proxy_pose.p - input_.X_BE.p;
  EXPECT_NEAR(way.norm(), Params().max_distance, 1e-9);
  EXPECT_NEAR(way.x() / way.z(), -2, 1e-9);
}

TEST_F(RobotSideProxyTest, RotationAlike) {
  input_.moment_selection = Direction(Vector3d::UnitX());
  input_.message.pose.R = ExpRotation({0.1, 0.0, 0.0});
  Run(1000, Vector3d::Zero());
  // Robot minus proxy is -0.1 rad: 10 N m/rad pushes the robot to the proxy.
  EXPECT_NEAR(state_.output.reference_moment.x(), 1.0, 1e-9);
  EXPECT_TRUE(state_.output.rotation_error.isZero(1e-12));
  input_.moment_selection.setZero();
  Run(1000, Vector3d::Zero());
  EXPECT_TRUE(state_.output.reference_moment.isZero(0.0));
  EXPECT_NEAR(state_.output.rotation_error.x(), -0.1, 1e-9);
}

TEST_F(RobotSideProxyTest, CapsTheMotionErrorAndZeroMeansNoCap) {
  Run(1000, {0.02, 0.0, 0.0});  // 50 mm.
  EXPECT_NEAR(state_.output.motion_error.norm(), 0.02, 1e-12);
  RobotSideProxyParams params = Params();
  params.max_motion_error = 0.0;
  const RobotSideProxy dut(params);
  dut.Update(time(), input_, &state_);
  EXPECT_NEAR(state_.output.motion_error.x(), -0.05, 1e-9);
}

TEST_F(RobotSideProxyTest, HandoverStartsFromTheSensedForce) {
  input_.has_sensed = true;
  input_.sensed_force = Vector3d(1.0, 0.0, -7.0);
  input_.sensed_moment = Vector3d(0.5, 0.0, 0.0);
  Run(1000, {0.0, 0.0, -0.004});
  EXPECT_TRUE(state_.output.reference_force.isZero(0.0));
  input_.force_selection = z_;
  input_.moment_selection = Direction(Vector3d::UnitX());
  Step(true);
  EXPECT_NEAR(state_.output.reference_force.z(), -7.0, kForceStep + 1e-9);
  EXPECT_NEAR(state_.output.reference_force.x(), 0.0, 1e-9);
  EXPECT_NEAR(state_.output.reference_moment.x(), 0.5, kMomentStep + 1e-9);
  Run(1000, {0.0, 0.0, -0.004});
  EXPECT_NEAR(state_.output.reference_force.z(), -5.0, 1e-9);
}

TEST_F(RobotSideProxyTest, PrintedHandoverStartsFromZero) {
  RobotSideProxyParams params = Params();
  params.handover = Handover::kPrinted;
  const RobotSideProxy dut(params);
  input_.has_sensed = true;
  input_.sensed_force = Vector3d(0.0, 0.0, -7.0);
  Send({0.0, 0.0, -0.01});
  dut.Update(0.0, input_, &state_);
  input_.force_selection = z_;
  dut.Update(kPeriod, input_, &state_);
  EXPECT_LE(state_.output.reference_force.norm(), kForceStep + 1e-9);
}

TEST_F(RobotSideProxyTest, LostLinkFreezesTheProxyAndFadesTheForce) {
  input_.force_selection = z_;
  Run(1000, {0.0, 0.0, -0.004});
  // Moving at full speed when the messages stop: on the way to 100 mm.
  Run(100, {0.04, 0.0, -0.004});
  ASSERT_NEAR(state_.output.proxy_velocity(0), 0.2, 1e-9);
  input_.message.pose.p.x() = 1.0;  // Not a new message: must not matter.
  Silence(420);
  EXPECT_EQ(state_.output.link_status, LinkStatus::kConnected);
  input_.has_sensed = true;
  input_.sensed_force = Vector3d(0, 0, -5);
  Silence(150);
  EXPECT_EQ(state_.output.link_status, LinkStatus::kLost);
  EXPECT_EQ(state_.link.losses, 1);
  EXPECT_TRUE(state_.output.proxy_velocity.isZero(0.0));
  const Vector3d frozen = state_.output.proxy_pose.p;
  // The robot drifts; the error pulls it back to the frozen proxy, without a
  // force in force space.
  input_.X_BE.p = frozen + Vector3d(0.003, 0.0, 0.01);
  Silence(1000);
  EXPECT_EQ(state_.output.proxy_pose.p, frozen);
  EXPECT_TRUE(state_.output.motion_error.isApprox(Vector3d(0.003, 0, 0), 1e-9));
  EXPECT_TRUE(state_.output.reference_force.isZero(0.0));
  EXPECT_NEAR(state_.output.link_age, 1.57 + 0.02, 0.021);
  // A contact that is found meanwhile is no hand-over either.
  input_.force_selection.setIdentity();
  Silence(10);
  EXPECT_TRUE(state_.output.reference_force.isZero(0.0));
}

TEST_F(RobotSideProxyTest, RecoversThroughTheLimiterWithoutAJump) {
  input_.force_selection = z_;
  Run(500, {0.0, 0.0, -0.004});
  Silence(1000);
  ASSERT_EQ(state_.output.link_status, LinkStatus::kLost);
  // The hand has gone 100 mm (of the robot) meanwhile. Step() checks that
  // neither proxy nor force steps.
  for (int i = 0; i < 1600; ++i) {
    Run(1, {0.04, 0.0, -0.004});
    ASSERT_LE(state_.output.proxy_velocity.norm(), 0.06 + 1e-9);
  }
  EXPECT_NEAR(state_.output.proxy_pose.p.x(), 0.5 + 0.06 * 1.6, 0.002);
  Run(400, {0.04, 0.0, -0.004});
  EXPECT_EQ(state_.output.link_status, LinkStatus::kConnected);
  EXPECT_TRUE(
      state_.output.proxy_pose.p.isApprox(Vector3d(0.6, 0, 0.29), 1e-12));
  EXPECT_NEAR(state_.output.reference_force.z(), -5.0, 1e-9);
}

TEST_F(RobotSideProxyTest, IsAsFastAsBeforeOnceItHasCaughtUpAfterALoss) {
  Run(500, Vector3d::Zero());
  Silence(1000);
  ASSERT_EQ(state_.output.link_status, LinkStatus::kLost);
  Run(500, {0.004, 0.0, 0.0});
  EXPECT_NEAR(state_.output.proxy_pose.p.x(), 0.51, 1e-9);
  Run(100, {0.04, 0.0, 0.0});
  EXPECT_NEAR(state_.output.proxy_velocity(0), 0.2, 1e-9);
}

TEST_F(RobotSideProxyTest, StaleAndReorderedMessagesAreDropped) {
  Run(500, Vector3d::Zero());
  const PoseMessage newest = input_.message;
  // Older sequence, another place.
  input_.message.sequence = newest.sequence - 3;
  input_.message.pose.p.x() = 0.04;
  Silence(10);
  EXPECT_EQ(state_.link.dropped, 1);
  // Newer sequence, sent long ago.
  input_.message.sequence = newest.sequence + 1;
  input_.message.send_time = -100.0;
  Silence(10);
  EXPECT_EQ(state_.link.dropped, 2);
  EXPECT_EQ(state_.output.proxy_pose.p, Vector3d(0.5, 0.0, 0.3));
}

TEST_F(RobotSideProxyTest, BadMessagesAreRefusedAndTheProxyStays) {
  Run(500, Vector3d::Zero());
  const auto offer = [this](const PoseMessage& message) {
    const auto sequence = input_.message.sequence;
    input_.message = message;
    input_.message.sequence = sequence + 1;
    input_.message.send_time = time();
    Silence(5);
  };
  PoseMessage message;
  message.pose.p.x() = kNan;
  offer(message);
  message = {};
  message.pose.p.x() = 0.04;
  message.pose.R *= 2.0;
  offer(message);
  message = {};
  message.pose.p.x() = 0.04;
  message.force_selection.setConstant(kNan);
  offer(message);
  EXPECT_EQ(state_.link.bad_inputs, 3);
  EXPECT_EQ(state_.bad_inputs, 0);
  EXPECT_EQ(state_.output.proxy_pose.p, Vector3d(0.5, 0.0, 0.3));
}

TEST_F(RobotSideProxyTest, AMessageFromFarAwayStillMovesWithinTheLimits) {
  Run(100, Vector3d::Constant(300));
  EXPECT_EQ(state_.output.link_status, LinkStatus::kConnected);
  EXPECT_LT((state_.output.proxy_pose.p - input_.X_BE.p).norm(), 0.04);
}

TEST_F(RobotSideProxyTest, BadInputsFadeTheForceAndStopTheProxy) {
  input_.force_selection = z_;
  input_.has_sensed = true;
  Run(1000, {0.0, 0.0, -0.004});
  ASSERT_NEAR(state_.output.reference_force.z(), -5.0, 1e-9);
  const RobotSideProxyInput good = input_;
  const auto Reset = [&] {
    const auto message = input_.message;
    input_ = good;
    input_.message = message;
  };
  int bad = 0;
  for (int kind = 0; kind < 6; ++kind) {
    switch (kind) {
      case 0:
        input_.X_BE.p.x() = kNan;
        break;
      case 1:
        input_.X_BE.R *= 1.5;
        break;
      case 2:
        input_.force_selection(0, 0) = kNan;
        break;
      case 3:
        input_.moment_selection(0, 1) = 4.0;
        break;
      case 4:
        input_.sensed_force.x() = kNan;
        break;
      case 5:
        input_.sensed_moment.x() = kNan;
        break;
    }
    Run(200, {0.02, 0.0, -0.004});
    bad += 200;
    EXPECT_EQ(state_.bad_inputs, bad) << kind;
    EXPECT_TRUE(state_.output.reference_force.isZero(0.0)) << kind;
    EXPECT_TRUE(state_.output.proxy_velocity.isZero(0.0)) << kind;
    EXPECT_TRUE(state_.output.motion_error.allFinite()) << kind;
    EXPECT_TRUE(state_.output.rotation_error.allFinite()) << kind;
    if (kind < 2) {
      EXPECT_TRUE(state_.output.motion_error.isZero(0.0));
    }
    Reset();
    Run(500, {0.0, 0.0, -0.004});
    EXPECT_NEAR(state_.output.reference_force.z(), -5.0, 1e-9) << kind;
  }
}

TEST_F(RobotSideProxyTest, ABadTimeIsRefused) {
  Run(100, Vector3d::Zero());
  dut_.Update(kNan, input_, &state_);
  EXPECT_EQ(state_.bad_inputs, 1);
  EXPECT_EQ(state_.output.link_status, LinkStatus::kConnected);
  EXPECT_TRUE(std::isfinite(state_.output.link_age));
}

TEST_F(RobotSideProxyTest, ABadFirstPoseIsWaitedFor) {
  const Pose good = input_.X_BE;
  input_.X_BE.p.y() = kNan;
  Silence(10);
  EXPECT_FALSE(state_.initialized);
  EXPECT_TRUE(state_.output.motion_error.isZero(0.0));
  input_.X_BE = good;
  Step();
  EXPECT_TRUE(state_.initialized);
  EXPECT_EQ(state_.output.proxy_pose.p, good.p);
}

TEST_F(RobotSideProxyTest, TheProxyNeverLeavesTheWorkspace) {
  using Shape = WorkspaceLimitsParams::Shape;
  RandomStream random(12);
  for (const Shape shape : {Shape::kBox, Shape::kSphere, Shape::kCylinder}) {
    RobotSideProxyParams params = Params();
    params.workspace.shape = shape;
    params.workspace.center = params.map.p_cw;
    params.workspace.half_size = Vector3d(0.05, 0.04, 0.03);
    params.workspace.radius = 0.05;
    params.workspace.half_height = 0.03;
    const RobotSideProxy dut(params);
    const WorkspaceLimits limits(params.workspace);
    RobotSideProxyState state = dut.MakeState();
    int at_the_limit = 0;
    Vector3d last = params.map.p_cw;
    for (int i = 0; i < 30'000; ++i) {
      if (i % 300 == 0) {
        ++input_.message.sequence;
        input_.message.send_time = kPeriod * i;
        input_.message.pose.p = RandomVector(0.03, &random);
      }
      dut.Update(kPeriod * i, input_, &state);
      const Vector3d p = state.output.proxy_pose.p;
      ASSERT_TRUE(limits.Contains(p)) << i;
      // Sliding on a round limit may add up all axes, no more.
      ASSERT_LE((p - last).norm(), std::sqrt(3.0) * 0.2 * kPeriod + 1e-9);
      if (!limits.Contains(p + 1e-4 * (p - params.map.p_cw))) ++at_the_limit;
      last = p;
    }
    EXPECT_GT(at_the_limit, 1000);
    input_.message = {};
  }
}

TEST_F(RobotSideProxyTest, ARobotOutsideTheWorkspaceIsLedIntoIt) {
  RobotSideProxyParams params = Params();
  params.workspace.shape = WorkspaceLimitsParams::Shape::kSphere;
  params.workspace.center = params.map.p_cw;
  params.workspace.radius = 0.05;
  const RobotSideProxy dut(params);
  RobotSideProxyState state = dut.MakeState();
  input_.X_BE.p = params.map.p_cw + Vector3d(0.1, 0.02, 0.0);
  Send(Vector3d(0.1, 0.1, 0.1));
  Vector3d last = input_.X_BE.p;
  for (int i = 0; i < 480; ++i) {
    dut.Update(kPeriod * i, input_, &state);
    ASSERT_LE((state.output.proxy_pose.p - last).norm(),
              std::sqrt(3.0) * 0.2 * kPeriod + 1e-9);
    last = state.output.proxy_pose.p;
  }
  EXPECT_TRUE(WorkspaceLimits(params.workspace).Contains(last));
}

// Whatever the link, the hand, the filter and the contact do, with every kind
// of bad value in between.
TEST_F(RobotSideProxyTest, SeededChaosNeitherStepsNorBreaksALimit) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    RandomStream random(seed);
    CommunicationChannelParams link;
    link.delay = 0.15;
    link.jitter = 0.05;
    link.loss = 0.2;
    const CommunicationChannel channel(link);
    auto channel_state = channel.MakeState(seed);
    const PoseSender sender{PoseSenderParams{}};
    PoseSenderState sender_state;
    state_ = dut_.MakeState();
    input_ = {};
    tick_ = 0;
    Pose hand;
    bool silent = false;
    for (int i = 0; i < 20'000; ++i) {
      if (i % 500 == 0) {
        hand.p = RandomVector(0.03, &random);
        hand.R = RandomRotation(0.5, &random);
        silent = random.Uniform() < 0.2;
      }
      if (i % 66 == 0) {
        input_.force_selection = RandomSelection(&random);
        input_.moment_selection = RandomSelection(&random);
      }
      sender.Update(time(), {.pose = hand}, &sender_state);
      if (!silent) {
        channel.Send(time(), ToMessage(sender_state.message), &channel_state);
      }
      input_.message =
          FromMessage<PoseMessage>(channel.Receive(time(), channel_state));
      const RobotSideProxyInput good = input_;
      if (random.Uniform() < 0.01) input_.X_BE.p.x() = kNan;
      if (random.Uniform() < 0.01) input_.force_selection(1, 1) = kNan;
      if (random.Uniform() < 0.01) input_.message.pose.p.z() = kNan;
      ASSERT_NO_FATAL_FAILURE(Step()) << "seed " << seed << " tick " << i;
      ASSERT_TRUE(state_.output.motion_error.allFinite());
      ASSERT_TRUE(state_.output.rotation_error.allFinite());
      ASSERT_TRUE(state_.output.proxy_pose.p.allFinite());
      input_ = good;
      input_.X_BE.p += 0.001 * (state_.output.proxy_pose.p - input_.X_BE.p) +
                       RandomVector(1e-5, &random);
    }
    EXPECT_GT(state_.link.losses, 0) << seed;
    EXPECT_GT(state_.link.dropped, 0) << seed;
    EXPECT_GT(state_.link.gaps, 0) << seed;
    EXPECT_GT(state_.bad_inputs, 100) << seed;
  }
}

TEST_F(RobotSideProxyTest, CopiesGoOnAlikeAndAFreshStateForgets) {
  input_.force_selection = z_;
  Run(300, {0.01, 0.0, -0.004});
  RobotSideProxyState copy = state_;
  dut_.Update(time(), input_, &state_);
  dut_.Update(time(), input_, &copy);
  EXPECT_EQ(copy.output.proxy_pose.p, state_.output.proxy_pose.p);
  EXPECT_EQ(copy.output.reference_force, state_.output.reference_force);
  EXPECT_FALSE(dut_.MakeState().initialized);
}

TEST_F(RobotSideProxyTest, DoesNotAllocate) {
  input_.has_sensed = true;
  Send({0.01, 0.02, -0.01});
  ScopedNoAlloc guard;
  for (int i = 0; i < 200; ++i) {
    if (i == 100) input_.force_selection = z_;
    dut_.Update(kPeriod * i, input_, &state_);
  }
  EXPECT_EQ(guard.count(), 0);
}

TEST(RobotSideProxyParamsTest, InvalidParametersAreNamed) {
  using P = RobotSideProxyParams;
  for (const auto& [field, name] :
       std::initializer_list<std::pair<double P::*, const char*>>{
           {&P::stiffness, "`stiffness`"},
           {&P::rotational_stiffness, "`rotational_stiffness`"},
           {&P::max_force, "`max_force`"},
           {&P::max_moment, "`max_moment`"},
           {&P::force_rate, "`force_rate`"},
           {&P::moment_rate, "`moment_rate`"},
           {&P::max_motion_error, "`max_motion_error`"},
           {&P::period, "`period`"}}) {
    P params;
    params.*field = -1.0;
    const std::string message =
        InvalidArgument([&p = params] { RobotSideProxy{p}; });
    EXPECT_NE(message.find(std::string("RobotSideProxyParams: field ") + name),
              std::string::npos)
        << message;
    EXPECT_NE(message.find("-1"), std::string::npos) << message;
  }
}

TEST(RobotSideProxyParamsTest, PartsAreValidatedAndMustShareThePeriod) {
  RobotSideProxyParams params;
  params.link.timeout = 0.0;
  EXPECT_NE(InvalidArgument([&] {
              RobotSideProxy{params};
            }).find("LinkMonitorParams: field `timeout`"),
            std::string::npos);
  params = {};
  params.period = 0.002;
  EXPECT_NE(InvalidArgument([&] {
              RobotSideProxy{params};
            }).find("RobotSideProxyParams: field `limiter.period`"),
            std::string::npos);
  params.limiter.period = 0.002;
  EXPECT_EQ(InvalidArgument([&] { RobotSideProxy{params}; }), "no exception");
}

TEST_F(RobotSideProxyTest, DoesNotPressAgainAfterALostLink) {
  // Pressing: the proxy is 10 mm inside the surface. The link is lost, the
  // force fades, and the filter gives the direction back to motion space.
  input_.force_selection = z_;
  Run(2000, Vector3d(0, 0, -0.004));
  EXPECT_NEAR(state_.output.reference_force.z(), -5.0, 1e-6);
  Silence(1000);
  EXPECT_EQ(state_.output.link_status, LinkStatus::kLost);
  EXPECT_TRUE(state_.output.reference_force.isZero(0.0));
  EXPECT_NEAR(state_.output.proxy_pose.p.z(), 0.29, 1e-9);  // Frozen.
  input_.force_selection.setZero();
  const RobotSideProxyOutput before = state_.output;
  dut_.Update(time(), input_, &state_);
  EXPECT_LT(state_.output.motion_error.norm(), 1e-9);
  EXPECT_TRUE(state_.output.proxy_pose.p.isApprox(input_.X_BE.p, 1e-9));
  EXPECT_EQ(before.proxy_pose.R, state_.output.proxy_pose.R);
}

TEST_F(RobotSideProxyTest, WithoutInterpolationTheTargetIsAStaircase) {
  RobotSideProxyParams params = Params();
  const auto fastest = [&](bool interpolate) {
    params.interpolate = interpolate;
    const RobotSideProxy dut(params);
    RobotSideProxyState state = dut.MakeState();
    RobotSideProxyInput input;
    input.X_BE.p = params.map.p_cw;
    double result = 0;
    for (int tick = 0; tick < 2000; ++tick) {
      const double t = kPeriod * tick;
      if (tick % 20 == 0) {
        ++input.message.sequence;
        input.message.send_time = t;
        input.message.pose.p.x() = 0.01 * (1 - std::cos(2 * t));
      }
      dut.Update(t, input, &state);
      result = std::max(result, state.output.proxy_acceleration.norm());
    }
    return result;
  };
  // The robot's own acceleration: 2.5 x 0.01 x 4 = 0.1 m/s^2.
  EXPECT_LT(fastest(true), 0.5);  // Where it starts from rest, and less later.
  EXPECT_GT(fastest(false), 9.0);
}

}  // namespace
}  // namespace dual_proxy
