// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/bare_engine.h"

#include <string>

#include <gtest/gtest.h>

#include "dual_proxy/experiment/run_log.h"
#include "dual_proxy/experiment/scenario_error.h"
#include "test_arm.h"

namespace dual_proxy {
namespace {

constexpr double kDuration = 3;

// The hand means to be 40 mm in the table.
Scenario MakeScenario(Scheme scheme) {
  Scenario scenario;
  scenario.name = "tiny";
  scenario.scheme = scheme;
  scenario.ApplyPresets();
  scenario.scene.table_height = 0.14;
  scenario.sensor.tare = false;
  scenario.filter.num_particles = 100;
  scenario.angular_filter.enabled = true;
  scenario.angular_filter.filter.num_particles = 100;
  scenario.operator_params.waypoints = {Waypoint{0, {0.45, 0, 0.18}},
                                        Waypoint{1.5, {0.45, 0, 0.11}}};
  scenario.Validate();
  return scenario;
}

BareEngine<SimulatedArm<7>> MakeEngine(const Scenario& scenario) {
  return MakeArmEngine(scenario, MakeTestArm(), kTestArmAtRest, kDuration);
}

RunLog RunBare(const Scenario& scenario) {
  auto engine = MakeEngine(scenario);
  engine.AdvanceTo(kDuration);
  return MakeRunLog(engine.log(), engine.layout());
}

TEST(BareEngineTest, RunsEverySchemeAndLogsEveryPeriod) {
  Schemes::ForEach([]<typename S>() {
    SCOPED_TRACE(S::kName);
    const RunLog log = RunBare(MakeScenario(SchemeOf<S>));
    const Eigen::Index last = log.time.size() - 1;
    EXPECT_EQ(log.time.size(), 3000);
    EXPECT_NEAR(log.time(0), 0.001, 1e-15);
    EXPECT_NEAR(log.time(last), kDuration, 1e-12);
    EXPECT_TRUE(log.AllFinite());
    EXPECT_LT(log.Signal<3>("contact_force")(last, 2), -1);
    EXPECT_LT(log.Signal<3>("sensed_force")(last, 2), -1);
    EXPECT_GT(log.Signal<3>("device_force")(last, 2), 0.3);
    EXPECT_EQ(log.Signal<1>("contact_dimension")(last, 0), 1);
    EXPECT_LT(log.Signal<3>("hand_position")(last, 2), -0.025);
    EXPECT_EQ(log.Has("contact_rotation_axis"), S::kUsesSelections);
  });
}

TEST(BareEngineTest, InSmallStepsAndAgainTheSameBits) {
  const Scenario scenario = MakeScenario(SchemeOf<DualProxyScheme>);
  const RunLog log = RunBare(scenario);
  auto engine = MakeEngine(scenario);
  for (const double time : {0.0, 0.0004, 0.7, 0.7, 1.2345, kDuration}) {
    engine.AdvanceTo(time);
    EXPECT_GE(engine.time(), time - 1e-12);
    EXPECT_LT(engine.time(), time + 0.001);
  }
  const RunLog again = MakeRunLog(engine.log(), engine.layout());
  EXPECT_EQ(again.time, log.time);
  ASSERT_EQ(again.signals.size(), log.signals.size());
  for (const RunLog::NamedValues& signal : log.signals) {
    EXPECT_EQ(again.Signal(signal.name), signal.values) << signal.name;
  }
}

TEST(BareEngineTest, SaysWhatOnlyDrakeHas) {
  const auto error = [](const Scenario& scenario) -> std::string {
    try {
      MakeEngine(scenario);
    } catch (const ScenarioError& thrown) {
      return thrown.what();
    }
    return "no exception";
  };
  Scenario scenario = MakeScenario(SchemeOf<DualProxyScheme>);
  EXPECT_EQ(error(scenario), "no exception");
  scenario.scene.surfaces.resize(ContactScene::kMaxSurfaces);
  EXPECT_EQ(error(scenario),
            "tiny.scene.surfaces: expected at most 7 with engine bare, got 8");
  scenario.scene.table = false;
  EXPECT_EQ(error(scenario), "no exception");
  scenario.scene = {};
  scenario.scene.model_directives = "models.dmd.yaml";
  EXPECT_EQ(error(scenario),
            "tiny.scene.model_directives: expected none with engine bare, as "
            "they need Drake, got \"models.dmd.yaml\"");
  scenario.scene = {};
  scenario.scene.contact_approximation = ContactApproximation::kSap;
  EXPECT_NE(error(scenario).find("scene.contact_approximation"),
            std::string::npos);
}

}  // namespace
}  // namespace dual_proxy
