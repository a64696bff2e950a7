// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/haptic_side_proxy.h"

#include <cmath>
#include <initializer_list>
#include <limits>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "no_alloc.h"
#include "test_support.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kPeriod = 0.001;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kForceStep = 0.02;      // 20 N/s x 1 ms.
constexpr double kLostForceStep = 0.12;  // 120 N/s x 1 ms.
constexpr double kTolerance = 1e-12;

class HapticSideProxyTest : public ::testing::Test {
 protected:
  HapticSideProxyTest() { input_.message.pose.p = p_cw_; }

  HapticSideProxyParams Params() const {
    HapticSideProxyParams params;
    params.map.p_cw = p_cw_;
    params.map.R_DB << 0, -1, 0, 1, 0, 0, 0, 0, 1;
    return params;
  }

  double time() const { return kPeriod * tick_; }

  void Send() {
    ++input_.message.sequence;
    input_.message.send_time = time();
  }

  void Step() {
    const Vector3d last = state_.output.reference_force;
    dut_.Update(time(), input_, &state_);
    ++tick_;
    const bool lost = state_.output.link_status == LinkStatus::kLost;
    ASSERT_LE((state_.output.reference_force - last).norm(),
              (lost ? kLostForceStep : kForceStep) + kTolerance);
    ASSERT_LE(state_.output.reference_force.norm(), 12.0 + 1e-9);
  }

  void Run(int ticks) {
    for (int i = 0; i < ticks; ++i) {
      if (i % 20 == 0) Send();
      ASSERT_NO_FATAL_FAILURE(Step()) << i;
    }
  }

  void Silence(int ticks) {
    for (int i = 0; i < ticks; ++i) ASSERT_NO_FATAL_FAILURE(Step()) << i;
  }

  const Vector3d p_cw_{0.5, 0.0, 0.3};
  const HapticSideProxy dut_{Params()};
  HapticSideProxyState state_{dut_.MakeState()};
  HapticSideProxyInput input_;
  int tick_{0};
};

TEST_F(HapticSideProxyTest, NothingIsFeltBeforeTheFirstMessage) {
  input_.X_DH.p = Vector3d(0.01, 0.02, 0.03);
  Silence(1000);
  EXPECT_EQ(state_.output.link_status, LinkStatus::kWaiting);
  EXPECT_TRUE(state_.output.reference_force.isZero(0.0));
  EXPECT_EQ(state_.output.proxy_pose.p, input_.X_DH.p);
}

TEST_F(HapticSideProxyTest, SettlesAtEquation5ExactlyInForceSpace) {
  // Force space along B's x, which is D's y; the robot rests 5 mm before the
  // place to which the hand points.
  input_.message.force_selection = Direction(Vector3d::UnitX());
  input_.message.pose.p = p_cw_ + Vector3d(0.005, 0.0, 0.0);
  input_.X_DH.p = Vector3d(0.03, 0.004, -0.02);
  Run(1000);
  // x_ph = (0, 2 mm, 0) in D, k = 1250 N/m, displacement 2 mm: 2.5 N back.
  EXPECT_TRUE(
      state_.output.proxy_pose.p.isApprox(Vector3d(0, 0.002, 0), 1e-12));
  EXPECT_NEAR(state_.output.reference_force.y(), -2.5, 1e-9);
  EXPECT_EQ(state_.output.reference_force.x(), 0.0);
  EXPECT_EQ(state_.output.reference_force.z(), 0.0);
  EXPECT_TRUE(state_.output.force_selection.isApprox(
      Direction(Vector3d::UnitY()), 1e-15));
}

TEST_F(HapticSideProxyTest, ForceMatchedStiffnessMakesHandAndRobotEqual) {
  EXPECT_DOUBLE_EQ(dut_.stiffness(), 1250.0);
  HapticSideProxyParams params = Params();
  params.stiffness = 200.0;  // As printed.
  EXPECT_DOUBLE_EQ(HapticSideProxy(params).stiffness(), 200.0);
  // With the robot at x_r and the device at x_h, both sides see the same
  // displacement, s times larger on the robot: F_h = -R_DB F_r.
  RandomStream random(1);
  const WorkspaceMap map(params.map);
  for (int i = 0; i < 100; ++i) {
    const Vector3d x_h = RandomVector(0.001, &random);
    const Vector3d x_r = p_cw_ + RandomVector(0.001, &random);
    const Vector3d x_pr = map.RobotProxy(x_h, Matrix3d::Identity()).p;
    const Vector3d x_ph = map.HapticProxy(x_r, Matrix3d::Identity()).p;
    const Vector3d F_r = -500.0 * (x_r - x_pr);
    const Vector3d F_h = -dut_.stiffness() * (x_h - x_ph);
    ASSERT_LT((F_h + params.map.R_DB * F_r).norm(), 1e-9) << i;
  }
}

TEST_F(HapticSideProxyTest, FreeSpaceIsFeltAsNothing) {
  input_.X_DH.p = Vector3d(0.05, 0.05, 0.05);
  Run(500);
  EXPECT_TRUE(state_.output.reference_force.isZero(0.0));
}

TEST_F(HapticSideProxyTest, SaturatesAtTheDevice) {
  input_.message.force_selection.setIdentity();
  input_.X_DH.p = Vector3d(0.05, -0.05, 0.02);
  Run(1000);
  EXPECT_NEAR(state_.output.reference_force.norm(), 12.0, 1e-9);
}

TEST_F(HapticSideProxyTest, FadesWhenTheLinkIsLostAndComesBackWithoutAStep) {
  input_.message.force_selection.setIdentity();
  input_.X_DH.p = Vector3d(0.0, 0.0, -0.004);
  Run(600);
  ASSERT_NEAR(state_.output.reference_force.z(), 5.0, 1e-9);
  Silence(480);
  EXPECT_EQ(state_.output.link_status, LinkStatus::kConnected);
  EXPECT_NEAR(state_.output.reference_force.z(), 5.0, 1e-9);
  Silence(300);
  EXPECT_EQ(state_.output.link_status, LinkStatus::kLost);
  EXPECT_TRUE(state_.output.reference_force.isZero(0.0));
  Run(600);
  EXPECT_EQ(state_.output.link_status, LinkStatus::kConnected);
  EXPECT_NEAR(state_.output.reference_force.z(), 5.0, 1e-9);
}

TEST_F(HapticSideProxyTest, WithoutALinkTheHandIsFreeWithinATenthOfASecond) {
  input_.message.force_selection.setIdentity();
  input_.message.contact_normals.col(0) = -Vector3d::UnitZ();
  input_.X_DH.p = Vector3d(0.0, 0.0, -0.03);
  Run(1000);
  ASSERT_NEAR(state_.output.reference_force.norm(), 12.0, 1e-9);
  while (state_.output.link_status != LinkStatus::kLost) Silence(1);
  Silence(100);
  EXPECT_TRUE(state_.output.reference_force.isZero(0.0));
  // Nor is it damped.
  EXPECT_TRUE(state_.output.force_selection.isZero(0.0));
  EXPECT_TRUE(state_.output.contact_normals.isZero(0.0));
}

// The robot presses along B's x, which is D's y; the hand has lifted and the
// robot does not know it yet.
TEST_F(HapticSideProxyTest, NeverPullsTheHandIntoASurface) {
  input_.message.force_selection = Direction(Vector3d::UnitX());
  input_.message.contact_normals.col(0) = Vector3d::UnitX();
  input_.X_DH.p = Vector3d(0.0, 0.004, 0.0);
  Run(1000);
  EXPECT_NEAR(state_.output.reference_force.y(), -5.0, 1e-9);
  input_.X_DH.p = Vector3d(0.0, -0.004, 0.0);
  for (int i = 0; i < 1000; ++i) {
    Run(1);
    ASSERT_LE(state_.output.reference_force.y(), 0.0);
  }
  EXPECT_TRUE(state_.output.reference_force.isZero(1e-12));
  EXPECT_TRUE(state_.output.contact_normals.col(0).isApprox(Vector3d::UnitY()));
  // As printed it is pulled.
  HapticSideProxyParams params = Params();
  params.unilateral = false;
  const HapticSideProxy printed(params);
  state_ = printed.MakeState();
  for (int i = 0; i < 1000; ++i) {
    if (i % 20 == 0) Send();
    printed.Update(time(), input_, &state_);
    ++tick_;
  }
  EXPECT_NEAR(state_.output.reference_force.y(), 5.0, 1e-9);
}

TEST_F(HapticSideProxyTest, StaleReorderedAndBadMessagesAreNotFelt) {
  input_.message.force_selection.setIdentity();
  Run(200);
  const PoseMessage newest = input_.message;
  const auto offer = [this](const PoseMessage& message) {
    input_.message = message;
    Silence(5);
    EXPECT_LT(state_.output.reference_force.norm(), 1e-9);
  };
  PoseMessage message = newest;
  message.pose.p += Vector3d(0.1, 0, 0);
  --message.sequence;
  offer(message);
  message.sequence = newest.sequence + 1;
  message.send_time = -10.0;
  offer(message);
  message.sequence = newest.sequence + 2;
  message.send_time = time();
  message.force_selection *= 100.0;
  offer(message);
  message.sequence = newest.sequence + 3;
  message.force_selection.setIdentity();
  message.pose.p.y() = kNan;
  offer(message);
  EXPECT_EQ(state_.link.dropped, 2);
  EXPECT_EQ(state_.link.bad_inputs, 2);
  EXPECT_EQ(state_.bad_inputs, 0);
}

TEST_F(HapticSideProxyTest, ABadHandlePoseOrTimeIsRefused) {
  input_.message.force_selection.setIdentity();
  input_.X_DH.p = Vector3d(0.0, 0.0, -0.004);
  Run(600);
  const Pose good = input_.X_DH;
  input_.X_DH.p.x() = kNan;
  Run(300);
  EXPECT_EQ(state_.bad_inputs, 300);
  EXPECT_TRUE(state_.output.reference_force.isZero(0.0));
  input_.X_DH = good;
  Run(600);
  EXPECT_NEAR(state_.output.reference_force.z(), 5.0, 1e-9);
  dut_.Update(kNan, input_, &state_);
  EXPECT_EQ(state_.bad_inputs, 301);
  EXPECT_NEAR(state_.output.reference_force.z(), 5.0 - kForceStep, 1e-9);
}

TEST_F(HapticSideProxyTest, MomentsAreOffUnlessTheDeviceHasThem) {
  input_.message.moment_selection = Direction(Vector3d::UnitZ());
  input_.X_DH.R = ExpRotation({0.0, 0.0, 0.3});
  Run(500);
  EXPECT_TRUE(state_.output.reference_moment.isZero(0.0));
  HapticSideProxyParams params = Params();
  params.max_moment = 0.4;
  const HapticSideProxy dut(params);
  HapticSideProxyState state = dut.MakeState();
  Send();
  for (int i = 0; i < 400; ++i) {
    const Vector3d last = state.output.reference_moment;
    dut.Update(time(), input_, &state);
    ASSERT_LE((state.output.reference_moment - last).norm(), 1e-3 + 1e-12);
  }
  EXPECT_NEAR(state.output.reference_moment.z(), -0.15, 1e-9);
}

TEST_F(HapticSideProxyTest, SeededChaosNeitherStepsNorExceedsTheDevice) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    RandomStream random(seed);
    state_ = dut_.MakeState();
    input_ = {};
    tick_ = 0;
    bool silent = false;
    for (int i = 0; i < 20'000; ++i) {
      if (i % 700 == 0) silent = random.Uniform() < 0.3;
      if (i % 20 == 0 && !silent) {
        Send();
        if (random.Uniform() < 0.2) {
          input_.message.sequence -= 2;  // Late.
        }
        input_.message.pose.p = p_cw_ + RandomVector(0.02, &random);
        input_.message.pose.R = RandomRotation(0.5, &random);
        input_.message.force_selection = RandomSelection(&random);
        if (random.Uniform() < 0.1) input_.message.pose.R(0, 0) = kNan;
      }
      input_.X_DH.p = RandomVector(0.01, &random);
      if (random.Uniform() < 0.01) input_.X_DH.p.z() = kNan;
      ASSERT_NO_FATAL_FAILURE(Step()) << "seed " << seed << " tick " << i;
    }
    EXPECT_GT(state_.link.losses, 0);
    EXPECT_GT(state_.link.dropped, 0);
    EXPECT_GT(state_.link.bad_inputs, 0);
    EXPECT_GT(state_.bad_inputs, 0);
  }
}

TEST_F(HapticSideProxyTest, CopiesGoOnAlikeAndAFreshStateForgets) {
  input_.message.force_selection.setIdentity();
  input_.X_DH.p = Vector3d(0.0, 0.0, -0.004);
  Run(100);
  HapticSideProxyState copy = state_;
  dut_.Update(time(), input_, &state_);
  dut_.Update(time(), input_, &copy);
  EXPECT_EQ(copy.output.reference_force, state_.output.reference_force);
  EXPECT_TRUE(dut_.MakeState().output.reference_force.isZero(0.0));
}

TEST_F(HapticSideProxyTest, DoesNotAllocate) {
  Send();
  input_.message.force_selection.setIdentity();
  ScopedNoAlloc guard;
  for (int i = 0; i < 100; ++i) dut_.Update(kPeriod * i, input_, &state_);
  EXPECT_EQ(guard.count(), 0);
}

TEST(HapticSideProxyParamsTest, InvalidParametersAreNamed) {
  using P = HapticSideProxyParams;
  for (const auto& [field, name] :
       std::initializer_list<std::pair<double P::*, const char*>>{
           {&P::stiffness, "`stiffness`"},
           {&P::robot_stiffness, "`robot_stiffness`"},
           {&P::rotational_stiffness, "`rotational_stiffness`"},
           {&P::max_force, "`max_force`"},
           {&P::max_moment, "`max_moment`"},
           {&P::force_rate, "`force_rate`"},
           {&P::moment_rate, "`moment_rate`"},
           {&P::period, "`period`"}}) {
    P params;
    params.*field = -1.0;
    const std::string message =
        InvalidArgument([&p = params] { HapticSideProxy{p}; });
    EXPECT_NE(message.find(std::string("HapticSideProxyParams: field ") + name),
              std::string::npos)
        << message;
    EXPECT_NE(message.find("-1"), std::string::npos) << message;
  }
  P params;
  params.map.scale = 0.0;
  EXPECT_NE(InvalidArgument([&] {
              HapticSideProxy{params};
            }).find("WorkspaceMapParams: field `scale`"),
            std::string::npos);
}

}  // namespace
}  // namespace dual_proxy
