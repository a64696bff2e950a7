// SPDX-License-Identifier: BSD-3-Clause
// What an operator presses beside moving the hand, in whole runs of every
// scheme.
#include <algorithm>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "dual_proxy/experiment/bare_engine.h"
#include "dual_proxy/experiment/run_log.h"
#include "test_arm.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;
using Positions = RunLog::Values<3>;

// A table 30 mm below the tool point's start.
Scenario MakeScenario(Scheme scheme, double delay) {
  Scenario scenario;
  scenario.name = "buttons";
  scenario.scheme = scheme;
  scenario.ApplyPresets();
  scenario.scene.start_position = {0.45, 0, 0.18};
  scenario.scene.table_height = 0.14;
  scenario.robot_proxy.max_force = 10;
  scenario.link.channel.delay = delay;
  scenario.sensor.tare = false;
  scenario.filter.num_particles = 100;
  return scenario;
}

Waypoint To(double time, double x, double z) {
  return {time, Vector3d(0.45 + x, 0, 0.18 + z)};
}

RunLog RunBare(Scenario scenario, double duration) {
  scenario.Validate();
  auto engine =
      MakeArmEngine(scenario, MakeTestArm(), kTestArmAtRest, duration);
  engine.AdvanceTo(duration);
  return MakeRunLog(engine.log(), engine.layout());
}

Eigen::Index Row(double time) {
  return static_cast<Eigen::Index>(time / 1e-3 + 0.5);
}

// m: the most by which a coordinate changes from one time to another.
double Span(const Positions& p, double from, double to) {
  const auto rows = p.middleRows(Row(from), Row(to) - Row(from));
  return (rows.colwise().maxCoeff() - rows.colwise().minCoeff()).maxCoeff();
}

// The longest step from one period to the next.
double LongestStep(const Positions& p, double from, double to) {
  const Eigen::Index n = Row(to) - Row(from);
  return (p.middleRows(Row(from) + 1, n) - p.middleRows(Row(from), n))
      .rowwise()
      .norm()
      .maxCoeff();
}

class OperatorButtonsTest
    : public ::testing::TestWithParam<std::tuple<int, double>> {
 protected:
  Scheme scheme() const { return static_cast<Scheme>(std::get<0>(GetParam())); }
  double delay() const { return std::get<1>(GetParam()); }
};

INSTANTIATE_TEST_SUITE_P(
    Schemes, OperatorButtonsTest,
    ::testing::Combine(::testing::Range(0, Schemes::kSize),
                       ::testing::Values(0.0, 0.15)),
    [](const auto& info) {
      const int scheme = std::get<0>(info.param);
      return std::string(EnumStrings<Scheme>::kValues[scheme].second) +
             (std::get<1>(info.param) > 0 ? "WithDelay" : "");
    });

TEST_P(OperatorButtonsTest, HomingLeadsTheHandleAndTheRobotWaits) {
  constexpr double kAsked = 4;
  constexpr double kEnd = 8;
  Scenario scenario = MakeScenario(scheme(), delay());
  scenario.operator_params.waypoints = {To(0, 0, 0), To(2.5, 0.08, 0.05),
                                        To(9, 0.08, 0.05), To(10, 0.12, 0)};
  scenario.operator_params.home = {{kAsked, kEnd}};
  const RunLog log = RunBare(scenario, 12);
  EXPECT_TRUE(log.AllFinite());

  const Positions handle = log.Signal<3>("handle_position");
  const HomingParams& homing = scenario.operator_aids.homing;
  ASSERT_GT(handle.row(Row(kAsked)).norm(), 0.02);
  EXPECT_LT(handle.row(Row(kEnd)).norm(), homing.tolerance);
  EXPECT_LT(LongestStep(handle, kAsked + 0.2, kEnd),
            1.5e-3 * homing.speed + 1e-5);
  EXPECT_LE(log.Signal<3>("fixture_force").rowwise().norm().maxCoeff(),
            homing.max_force + 1e-12);

  const Positions proxy = log.Signal<3>("robot_proxy_position");
  const Positions robot = log.Signal<3>("robot_position");
  // What was under way has come, and the arm is at rest.
  const double settled = kAsked + 2 * delay() + 0.8;
  EXPECT_LT(Span(proxy, kEnd - 1, kEnd), 1e-4);
  EXPECT_LT(Span(robot, settled, kEnd), 1e-3);
  // Nor is there a jump where it goes on, before the hand has moved.
  EXPECT_LT(LongestStep(proxy, settled, kEnd + delay() + 0.04), 1e-4);
  EXPECT_LT(LongestStep(log.Signal<3>("device_position"), kAsked, kEnd + 0.9),
            1e-4);

  // From there it goes on along the path: 40 mm forward. Without a delay all
  // schemes are there in the end.
  if (delay() > 0) return;
  EXPECT_NEAR(robot(robot.rows() - 1, 0) - robot(Row(kEnd), 0), 0.04, 0.006);
}

TEST_P(OperatorButtonsTest, ClutchHoldsTheRobotWhileTheHandMoves) {
  constexpr double kPressed = 4;
  constexpr double kReleased = 7;
  for (const bool contact : {false, true}) {
    SCOPED_TRACE(contact ? "in contact" : "in free space");
    const double z = contact ? -0.06 : 0.03;
    Scenario scenario = MakeScenario(scheme(), delay());
    scenario.operator_params.waypoints = {
        To(0, 0, 0), To(2.5, 0.06, z), To(kPressed + 0.2, 0.06, z),
        To(kPressed + 1.2, -0.04, z + 0.08), To(9, -0.04, z + 0.08)};
    scenario.operator_params.clutch = {{kPressed, kReleased}};
    const RunLog log = RunBare(scenario, 9);
    EXPECT_TRUE(log.AllFinite());

    const Positions handle = log.Signal<3>("handle_position");
    ASSERT_GT(Span(handle, kPressed, kReleased), 0.03);
    const Positions proxy = log.Signal<3>("robot_proxy_position");
    const Positions robot = log.Signal<3>("robot_position");
    const double settled = kPressed + 2 * delay() + 0.8;
    EXPECT_LT(Span(proxy, kReleased - 1, kReleased), 1e-4);
    EXPECT_LT(Span(robot, settled, kReleased), 1e-3);
    EXPECT_LT(LongestStep(proxy, settled, kReleased + delay() + 0.04), 1e-4);
    const Positions force = log.Signal<3>("device_force");
    EXPECT_EQ(Span(force, kPressed + 0.2, kReleased - 0.01), 0);
    // It comes back from zero, whatever the scheme asks for.
    const Eigen::Index start = Row(kReleased);
    for (int i = 0; i < 600; ++i) {
      const double share = i * 1e-3 / scenario.operator_aids.clutch.engage_time;
      ASSERT_LT(force.row(start + i).norm(),
                share * scenario.device.max_force + 0.2)
          << i;
    }
    // What grows, 0.02 N, and a twelfth of a scheme's own steps.
    EXPECT_LT(LongestStep(force, kReleased - 0.01, kReleased + 0.05), 0.06);
    if (contact) {
      EXPECT_LT(log.Signal<3>("contact_force")(Row(kReleased), 2), -0.1);
    }
  }
}

TEST_P(OperatorButtonsTest, GripperFollowsAndHolds) {
  Scenario scenario = MakeScenario(scheme(), delay());
  scenario.operator_params.waypoints = {To(0, 0, 0), To(1, 0.02, 0.02)};
  EXPECT_FALSE(RunBare(scenario, 0.1).Has("gripper_width_command"));
  scenario.operator_params.clutch = {{2.5, 4}};
  scenario.operator_params.gripper = {{1, 0.01}, {3, 0.02}, {5, 0}};
  scenario.link.channel.outages = {{4.9, 6.5}};
  const RunLog log = RunBare(scenario, 8.5);
  const auto width = log.Signal<1>("gripper_width_command");
  const double start = scenario.gripper.start_width;
  const auto at = [&](double time) { return width(Row(time), 0); };
  // What was sent before the operator's gripper is known, and 20 ms of
  // messages.
  EXPECT_EQ(at(1 + delay()), start);
  EXPECT_LT(at(1.1 + delay()), start);
  EXPECT_NEAR(at(2.4), 0.03, 1e-12);
  // The clutch, of which the release follows.
  EXPECT_NEAR(at(3.99), 0.03, 1e-12);
  EXPECT_NEAR(at(4.8), 0.06, 1e-12);
  // No link.
  EXPECT_NEAR(at(6.49 + delay()), 0.06, 1e-12);
  EXPECT_NEAR(at(8.4), 0, 1e-12);
  const Eigen::Index n = width.rows() - 1;
  EXPECT_LE((width.bottomRows(n) - width.topRows(n)).cwiseAbs().maxCoeff(),
            1e-3 * scenario.gripper.max_speed + 1e-12);
}

}  // namespace
}  // namespace dual_proxy
