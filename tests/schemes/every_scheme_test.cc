// SPDX-License-Identifier: BSD-3-Clause
// What every scheme owes the sides: each fails by name on what it leaves out.
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "dual_proxy/link/communication_channel.h"
#include "dual_proxy/schemes/schemes.h"
#include "no_alloc.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;

constexpr double kPeriod = 0.001;
const Vector3d kStart(0.45, 0, 0.18);

// Two halves over a link, on machines that stay where they are.
class Pair {
 public:
  explicit Pair(int scheme)
      : robot_(Schemes::MakeRobotHalf(scheme, MakeRobot(), {})),
        haptic_(Schemes::MakeHapticHalf(scheme, MakeHaptic(), {})),
        channel_(CommunicationChannelParams()) {
    robot_input.X_BE.p = kStart;
  }

  RobotHalfInput robot_input;
  HapticHalfInput haptic_input;

  const RobotHalfOutput& robot() const { return robot_state_.output(); }
  const HapticHalfOutput& haptic() const { return haptic_state_.output(); }

  void Step() {
    const double time = kPeriod * tick_++;
    robot_input.message = channel_.Receive(time, to_robot_);
    haptic_input.message = channel_.Receive(time, to_device_);
    const ScopedNoAlloc guard;
    robot_.Update(time, robot_input, &robot_state_);
    haptic_.Update(time, haptic_input, &haptic_state_);
    ASSERT_EQ(guard.count(), 0);
    channel_.Send(time, robot().message, &to_device_);
    channel_.Send(time, haptic().message, &to_robot_);
  }

 private:
  static RobotHalfParams MakeRobot() {
    RobotHalfParams params;
    params.proxy.map.p_cw = kStart;
    return params;
  }
  static HapticHalfParams MakeHaptic() {
    HapticHalfParams params;
    params.proxy.map.p_cw = kStart;
    return params;
  }

  RobotHalf robot_;
  HapticHalf haptic_;
  CommunicationChannel channel_;
  RobotHalf::State robot_state_{robot_.MakeState()};
  HapticHalf::State haptic_state_{haptic_.MakeState()};
  CommunicationChannelState to_robot_{channel_.MakeState(1)};
  CommunicationChannelState to_device_{channel_.MakeState(2)};
  int tick_{0};
};

class EverySchemeTest : public testing::TestWithParam<int> {};

TEST_P(EverySchemeTest, SendsWhatItSaysAndTellsOfItsLink) {
  Pair pair(GetParam());
  for (int i = 0; i < 1000; ++i) pair.Step();
  const auto scheme = static_cast<Scheme>(GetParam());
  EXPECT_EQ(pair.haptic().message.tag, ToRobotTag(scheme));
  EXPECT_EQ(pair.robot().message.tag, ToDeviceTag(scheme));
  EXPECT_EQ(pair.robot().link.status, LinkStatus::kConnected);
  EXPECT_EQ(pair.haptic().link.status, LinkStatus::kConnected);
  // A sequence number for each message, not for each period.
  EXPECT_EQ(pair.robot().link.gaps, 0);
  EXPECT_EQ(pair.haptic().link.gaps, 0);
  EXPECT_LT((pair.robot().proxy_pose.p - kStart).norm(), 1e-6);
  EXPECT_LT(pair.haptic().proxy_pose.p.norm(), 1e-6);
}

TEST_P(EverySchemeTest, RefusesAndCountsWhatIsNotValid) {
  Pair pair(GetParam());
  for (int i = 0; i < 100; ++i) pair.Step();
  pair.robot_input.X_BE.p.x() = std::numeric_limits<double>::quiet_NaN();
  pair.haptic_input.X_DH.p.x() = std::numeric_limits<double>::quiet_NaN();
  for (int i = 0; i < 100; ++i) {
    pair.Step();
    const RobotSetpoint& robot = pair.robot().setpoint;
    ASSERT_TRUE(robot.motion_error.allFinite());
    ASSERT_TRUE(robot.reference_force.allFinite());
    ASSERT_TRUE(robot.velocity.allFinite());
    ASSERT_TRUE(robot.force_selection.allFinite());
    ASSERT_TRUE(pair.haptic().setpoint.reference_force.allFinite());
    ASSERT_TRUE(pair.haptic().setpoint.force_selection.allFinite());
    ASSERT_TRUE(pair.haptic().proxy_pose.p.allFinite());
  }
  // By whichever part refuses it first.
  EXPECT_GE(pair.robot().bad_inputs + pair.robot().sender_bad_inputs, 100);
  EXPECT_GE(pair.haptic().bad_inputs + pair.haptic().sender_bad_inputs, 100);
}

INSTANTIATE_TEST_SUITE_P(Schemes, EverySchemeTest,
                         testing::Range(0, Schemes::kSize));

}  // namespace
}  // namespace dual_proxy
