// SPDX-License-Identifier: BSD-3-Clause
// Whatever comes in for a while, both sides stay within their limits, and do
// afterwards what they did before.
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "dual_proxy/common/rotation.h"
#include "dual_proxy/link/communication_channel.h"
#include "dual_proxy/sides/haptic_side.h"
#include "dual_proxy/sides/robot_side.h"
#include "test_arm.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;

constexpr double kPeriod = 0.001;
constexpr int kSettled = 1000;  // Ticks.
constexpr int kFault = 50;
constexpr int kAfter = 1000;

// What both sides get in a cycle.
struct Inputs {
  double robot_time;
  double haptic_time;
  RobotSideInput<SerialArm<7>> robot;
  HapticSideInput haptic;
};

using Change = std::function<void(double, Inputs*)>;

// Both sides over a link, on machines that stay where they are.
struct PairState {
  RobotSideState<SerialArm<7>> robot;
  HapticSideState haptic;
  CommunicationChannelState to_robot;
  CommunicationChannelState to_device;
};

class Pair {
 public:
  Pair(int scheme, bool contact) : contact_(contact) {
    arm_.Calc(kTestArmAtRest, Vector7::Zero(), &X_BE_, &terms_);
    RobotSideParams<SerialArm<7>> robot;
    HapticSideParams haptic;
    robot.scheme = haptic.scheme = static_cast<Scheme>(scheme);
    robot.proxy.map.p_cw = haptic.proxy.map.p_cw = X_BE_.p;
    robot.proxy.map.R_cw = haptic.proxy.map.R_cw = X_BE_.R;
    robot.controller.q_rest = kTestArmAtRest;
    robot_ = std::make_unique<RobotSide<SerialArm<7>>>(robot);
    haptic_ = std::make_unique<HapticSide>(haptic);
  }

  PairState MakeState() const {
    return {robot_->MakeState(), haptic_->MakeState(), channel_.MakeState(1),
            channel_.MakeState(2)};
  }

  void Step(int tick, const Change& change, double value,
            PairState* state) const {
    const double time = kPeriod * tick;
    Inputs inputs{time, time, {}, {}};
    RobotSideInput<SerialArm<7>>& robot = inputs.robot;
    robot.message = channel_.Receive(time, state->to_robot);
    robot.X_BE = X_BE_;
    robot.model = terms_;
    robot.q = kTestArmAtRest;
    HapticSideInput& haptic = inputs.haptic;
    haptic.message = channel_.Receive(time, state->to_device);
    if (contact_ && tick > 300) {
      robot.sensed_wrench(2) = -5;
      haptic.X_DH.p.z() = 0.005;
    }
    if (change) change(value, &inputs);
    robot_->Update(inputs.robot_time, robot, &state->robot);
    haptic_->Update(inputs.haptic_time, haptic, &state->haptic);
    channel_.Send(time, state->robot.half.output().message, &state->to_device);
    channel_.Send(time, state->haptic.half.output().message, &state->to_robot);
  }

  const RobotSide<SerialArm<7>>& robot() const { return *robot_; }
  const HapticSide& haptic() const { return *haptic_; }

 private:
  bool contact_;
  ArmModel<7> arm_{MakeTestArm()};
  Pose X_BE_;
  ModelTerms<7> terms_;
  CommunicationChannel channel_{{.delay = 0.02}};
  std::unique_ptr<RobotSide<SerialArm<7>>> robot_;
  std::unique_ptr<HapticSide> haptic_;
};

std::vector<std::pair<std::string, Change>> ListChanges() {
  return {
      {"robot time", [](double x, Inputs* in) { in->robot_time = x; }},
      {"device time", [](double x, Inputs* in) { in->haptic_time = x; }},
      {"robot time ahead", [](double x, Inputs* in) { in->robot_time += x; }},
      {"device time ahead", [](double x, Inputs* in) { in->haptic_time += x; }},
      {"message to robot",
       [](double x, Inputs* in) { in->robot.message.body[0] = x; }},
      {"message to device",
       [](double x, Inputs* in) { in->haptic.message.body[0] = x; }},
      {"stamp to robot",
       [](double x, Inputs* in) { in->robot.message.send_time = x; }},
      {"stamp to device",
       [](double x, Inputs* in) { in->haptic.message.send_time = x; }},
      {"robot position", [](double x, Inputs* in) { in->robot.X_BE.p(0) = x; }},
      {"robot rotation",
       [](double x, Inputs* in) { in->robot.X_BE.R(0, 0) = x; }},
      {"jacobian",
       [](double x, Inputs* in) { in->robot.model.J_BE(0, 0) = x; }},
      {"mass", [](double x, Inputs* in) { in->robot.model.mass(0, 0) = x; }},
      {"bias", [](double x, Inputs* in) { in->robot.model.bias(0) = x; }},
      {"gravity", [](double x, Inputs* in) { in->robot.model.gravity(0) = x; }},
      {"jdot_v", [](double x, Inputs* in) { in->robot.model.Jdot_v(0) = x; }},
      {"q", [](double x, Inputs* in) { in->robot.q(0) = x; }},
      {"v", [](double x, Inputs* in) { in->robot.v(0) = x; }},
      {"sensed force",
       [](double x, Inputs* in) { in->robot.sensed_wrench(0) = x; }},
      {"sensed moment",
       [](double x, Inputs* in) { in->robot.sensed_wrench(5) = x; }},
      {"planner",
       [](double x, Inputs* in) {
         in->robot.planner =
             PlannerReference{.selection = Vector3d::UnitX().asDiagonal(),
                              .position = Vector3d::Constant(x),
                              .velocity = Vector3d::Constant(x),
                              .force = Vector3d::Constant(x)};
       }},
      {"device position",
       [](double x, Inputs* in) { in->haptic.X_DH.p(0) = x; }},
      {"device rotation",
       [](double x, Inputs* in) { in->haptic.X_DH.R(0, 0) = x; }},
      {"device velocity",
       [](double x, Inputs* in) { in->haptic.device_velocity(0) = x; }},
      {"handle force",
       [](double x, Inputs* in) { in->haptic.handle_force(0) = x; }}};
}

class ImpossibleInputsTest
    : public ::testing::TestWithParam<std::tuple<int, bool>> {};

TEST_P(ImpossibleInputsTest, StaysWithinLimitsAndRecovers) {
  const auto [scheme, contact] = GetParam();
  const Pair pair(scheme, contact);
  PairState settled = pair.MakeState();
  for (int i = 0; i < kSettled; ++i) pair.Step(i, {}, 0, &settled);
  PairState good = settled;
  for (int i = kSettled; i < kSettled + kFault + kAfter; ++i) {
    pair.Step(i, {}, 0, &good);
  }
  const auto& controller = pair.robot().params().controller;
  const Vector7 most = (1 - controller.torque_margin) * controller.torque_limit;
  const double most_step =
      (1 + 1e-9) * controller.torque_rate_limit * controller.period;
  const double most_force = pair.haptic().params().controller.max_force;

  for (const auto& [name, change] : ListChanges()) {
    for (const double value : {1e3, -1e3, 1e6, -1e6, 1e100, -1e100, 1e160,
                               -1e160, 1e200, -1e200, 1e300, -1e300, 5e-324}) {
      SCOPED_TRACE(name + " " + std::to_string(std::log10(std::abs(value))) +
                   (value < 0 ? " negative" : ""));
      PairState state = settled;
      for (int i = kSettled; i < kSettled + kFault + kAfter; ++i) {
        const Vector7 last = state.robot.output.controller.torque;
        const bool bad = i < kSettled + kFault;
        pair.Step(i, bad ? change : Change{}, value, &state);
        const Vector7& torque = state.robot.output.controller.torque;
        const auto& wrench = state.haptic.output.device_wrench;
        ASSERT_TRUE((torque.cwiseAbs().array() <= 1.0001 * most.array()).all())
            << i;
        ASSERT_LE((torque - last).cwiseAbs().maxCoeff(), most_step) << i;
        ASSERT_TRUE(wrench.allFinite()) << i;
        ASSERT_LE(wrench.head<3>().norm(), 1.0001 * most_force) << i;
        ASSERT_TRUE(IsValidPose(state.robot.half.output().proxy_pose)) << i;
        ASSERT_TRUE(IsValidPose(state.haptic.half.output().proxy_pose)) << i;
      }
      EXPECT_LT((state.robot.output.controller.torque -
                 good.robot.output.controller.torque)
                    .cwiseAbs()
                    .maxCoeff(),
                1);
      EXPECT_LT(
          (state.haptic.output.device_wrench - good.haptic.output.device_wrench)
              .norm(),
          0.5);
      EXPECT_EQ(state.robot.half.output().link.status, LinkStatus::kConnected);
      EXPECT_EQ(state.haptic.half.output().link.status, LinkStatus::kConnected);
      EXPECT_EQ(state.robot.output.selections.force.trace() > 0.5,
                good.robot.output.selections.force.trace() > 0.5);
    }
  }
}

// What no robot does is refused like no number, each time.
TEST_P(ImpossibleInputsTest, IsCounted) {
  const auto [scheme, contact] = GetParam();
  const Pair pair(scheme, contact);
  for (const auto& [name, change] : ListChanges()) {
    const bool by_robot = name == "v" || name == "q" || name == "mass" ||
                          name == "robot position" || name == "sensed force";
    const bool by_device =
        name == "device position" || name == "device velocity";
    if (!by_robot && !by_device) continue;
    PairState state = pair.MakeState();
    for (int i = 0; i < kFault; ++i) pair.Step(i, change, 1e7, &state);
    EXPECT_EQ(state.robot.output.bad_inputs, by_robot ? kFault : 0) << name;
    EXPECT_EQ(state.haptic.output.bad_inputs, by_device ? kFault : 0) << name;
  }
}

TEST_P(ImpossibleInputsTest, TimeThatGoesBackIsCounted) {
  const auto [scheme, contact] = GetParam();
  const Pair pair(scheme, contact);
  PairState state = pair.MakeState();
  const Change ahead = [](double x, Inputs* in) {
    in->robot_time += x;
    in->haptic_time += x;
  };
  for (int i = 0; i < 200; ++i) {
    pair.Step(i, i >= 100 && i < 150 ? ahead : Change{}, 100, &state);
  }
  EXPECT_EQ(state.robot.output.bad_inputs, 1);
  EXPECT_EQ(state.haptic.output.bad_inputs, 1);
}

INSTANTIATE_TEST_SUITE_P(Schemes, ImpossibleInputsTest,
                         ::testing::Combine(::testing::Range(0, Schemes::kSize),
                                            ::testing::Bool()));

}  // namespace
}  // namespace dual_proxy
