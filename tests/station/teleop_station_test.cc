// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/station/teleop_station.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include <drake/common/yaml/yaml_io.h>
#include <drake/systems/analysis/simulator.h>
#include <gtest/gtest.h>

namespace dual_proxy {
namespace {

using drake::systems::Diagram;
using drake::systems::DiagramBuilder;
using drake::systems::Simulator;

const std::string kPlane =
    DUAL_PROXY_SOURCE_DIR "/examples/scenarios/plane.yaml";
const std::string kFlatTool =
    DUAL_PROXY_SOURCE_DIR "/examples/scenarios/flat_tool.yaml";
const std::string kEverything =
    DUAL_PROXY_SOURCE_DIR "/tests/data/one_of_everything.yaml";

const std::string kModels = DUAL_PROXY_SOURCE_DIR "/tests/data/models/";

const char* const kCounters[] = {"robot_link_dropped",
                                 "robot_link_bad_messages",
                                 "robot_link_gaps",
                                 "robot_link_spikes",
                                 "robot_link_losses",
                                 "haptic_link_dropped",
                                 "haptic_link_bad_messages",
                                 "haptic_link_gaps",
                                 "haptic_link_spikes",
                                 "haptic_link_losses",
                                 "to_robot_lost",
                                 "to_robot_overflow",
                                 "to_robot_refused",
                                 "to_device_lost",
                                 "to_device_overflow",
                                 "to_device_refused",
                                 "robot_bad_inputs",
                                 "robot_limiter_bad_inputs",
                                 "robot_sender_bad_inputs",
                                 "robot_singular",
                                 "torque_limited",
                                 "torque_rate_limited",
                                 "joint_limited",
                                 "sensor_bad_inputs",
                                 "sensor_tares_refused",
                                 "haptic_bad_inputs",
                                 "haptic_sender_bad_inputs",
                                 "device_bad_inputs"};

std::string WriteFile(const std::string& text) {
  const std::string path = testing::TempDir() + "/scenario.yaml";
  std::ofstream(path) << text;
  return path;
}

// What LoadScenario() says of a file with this text.
std::string LoadError(const std::string& text) {
  const std::string path = WriteFile(text);
  try {
    LoadScenario(path);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "no exception";
}

struct Sections {
  mutable Scenario scenario;
  template <typename Archive>
  void Serialize(Archive* a) const {
    scenario.SerializeSections(a);
  }
};

std::string Text(const Scenario& scenario) {
  return drake::yaml::SaveYamlString(Sections{scenario}, scenario.name);
}

// A station in a diagram of its own.
struct Bench {
  explicit Bench(const Scenario& scenario, Wiring wiring = Wiring::kFused) {
    DiagramBuilder<double> builder;
    station = AddTeleopStation(&builder, scenario, wiring);
    diagram = builder.Build();
    simulator = std::make_unique<Simulator<double>>(*diagram);
    simulator->Initialize();
  }

  RunLog AdvanceTo(double time) {
    simulator->AdvanceTo(time);
    return MakeRunLog(station, simulator->get_context());
  }

  TeleopStation station;
  std::unique_ptr<Diagram<double>> diagram;
  std::unique_ptr<Simulator<double>> simulator;
};

// What is saved in examples/, with a scheme.
Scenario LoadPlane(Scheme scheme) {
  Scenario scenario = LoadScenario(kPlane);
  scenario.scheme = scheme;
  scenario.ApplyPresets();
  scenario.Distribute();
  return scenario;
}

// Signal by signal, whatever their order.
void ExpectEqual(const RunLog& a, const RunLog& b) {
  EXPECT_EQ(a.time, b.time);
  EXPECT_EQ(a.signals.size(), b.signals.size());
  for (const RunLog::NamedValues& signal : a.signals) {
    ASSERT_TRUE(b.Has(signal.name)) << signal.name;
    EXPECT_EQ(signal.values, b.Signal(signal.name)) << signal.name;
  }
}

bool AreEqual(const RunLog& a, const RunLog& b) {
  return a.time == b.time &&
         std::ranges::equal(a.signals, b.signals,
                            [](const auto& x, const auto& y) {
                              return x.name == y.name && x.values == y.values;
                            });
}

TEST(LoadScenarioTest, DrakesReaderReadsWhatPythonReads) {
  const Scenario plane = LoadScenario(kPlane);
  EXPECT_EQ(plane.name, "plane");
  EXPECT_EQ(plane.scene.table_height, 0.40);
  EXPECT_EQ(plane.map.p_cw, plane.scene.start_position);
  EXPECT_EQ(plane.map.R_cw, kToolPointingDown);
  EXPECT_EQ(plane.operator_params.waypoints.size(), 11u);
  // What is not written keeps its default.
  EXPECT_EQ(plane.robot_proxy.max_force, 10);
  EXPECT_EQ(plane.robot_proxy.stiffness, RobotSideProxyParams{}.stiffness);

  const Scenario everything = LoadScenario(kEverything);
  EXPECT_EQ(everything.name, "one_of_everything");
  EXPECT_EQ(everything.scheme, SchemeOf<ModelMediatedScheme>);
  EXPECT_EQ(everything.law, Law::kPrinted);
  EXPECT_FALSE(everything.scene.table);
  ASSERT_EQ(everything.scene.surfaces.size(), 3u);
  const SurfaceParams& wall = everything.scene.surfaces[0];
  EXPECT_EQ(wall.shape, SurfaceShape::kBox);
  EXPECT_EQ(wall.size.value(), Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(wall.radius, std::nullopt);
  EXPECT_EQ(wall.stiffness, 12000);
  const SurfaceParams& bore = everything.scene.surfaces[1];
  EXPECT_EQ(bore.length, 0);
  EXPECT_TRUE(bore.hollow);
  EXPECT_EQ(bore.friction, std::nullopt);
  EXPECT_EQ(std::filesystem::path(everything.scene.model_directives),
            std::filesystem::canonical(kEverything).parent_path() /
                "models.dmd.yaml");
  EXPECT_EQ(everything.scene.tool, Tool::kFlat);
  EXPECT_TRUE(everything.angular_filter.enabled);
  EXPECT_EQ(everything.angular_filter.filter.num_particles, 1002);
  EXPECT_EQ(everything.operator_params.waypoints[1].rotation.z(), 0.3);
}

TEST(LoadScenarioTest, WhatIsSavedIsLoadedAgain) {
  Scenario scenario = LoadScenario(kPlane);
  scenario.link.channel.delay = 0.123;
  scenario.filter.num_particles = 321;
  const Scenario again = LoadScenario(WriteFile(Text(scenario)));
  EXPECT_EQ(Text(again), Text(scenario));
  EXPECT_EQ(again.link.delay(), 0.123);
  EXPECT_EQ(again.filter.num_particles, 321);
}

TEST(LoadScenarioTest, PresetsComeBeforeOverrides) {
  const std::string waypoints = R"(
  operator:
    waypoints:
      - {time: 0, position: [0.45, 0, 0.18]}
      - {time: 1, position: [0.45, 0, 0.15]}
)";
  const Scenario scenario = LoadScenario(WriteFile(
      "s:\n  scheme: position_force\n  controller: {position_damping: 7}\n"
      "  overrides: {controller: {position_stiffness: 123}}" +
      waypoints));
  EXPECT_EQ(scenario.controller.position_stiffness, 123);
  EXPECT_EQ(scenario.controller.position_damping, 20);
}

TEST(LoadScenarioTest, ErrorsNameWhatIsWrong) {
  const auto expect = [](const std::string& text, const std::string& part) {
    const std::string error = LoadError(text);
    EXPECT_NE(error.find(part), std::string::npos) << error;
  };
  expect("s: {no_such_key: 1}", "no_such_key");
  expect("s: {link: {delay: fast}}", "delay");
  expect("s: {map: {p_cw: [0, 0, 0]}}", "p_cw");  // It is a copy.
  expect("s: {link: {delay: -1}}", "s.link.delay");
  expect("s: {law: strict}", "law");
  expect("a: {}\nb: {}", "one top-level key");
}

TEST(TeleopStationTest, DiagramHasThePicturesNamesAndOutputs) {
  const Bench fused(LoadScenario(kPlane));
  const Bench systems(LoadScenario(kPlane), Wiring::kSystems);
  EXPECT_TRUE(fused.diagram->HasSubsystemNamed("loop"));
  for (const char* name :
       {"robot_side", "haptic_side", "to_robot", "to_device", "reaction"}) {
    EXPECT_TRUE(systems.diagram->HasSubsystemNamed(name)) << name;
    EXPECT_FALSE(fused.diagram->HasSubsystemNamed(name)) << name;
  }
  for (const Bench* dut : {&fused, &systems}) {
    for (const char* name :
         {"robot_state", "sensed_wrench", "torque", "device_pose",
          "device_wrench", "force_selection", "dimension"}) {
      EXPECT_TRUE(dut->diagram->HasOutputPort(name)) << name;
    }
  }
}

TEST(TeleopStationTest, OutputsOfTheFiltersThatThereAre) {
  for (const Wiring wiring : {Wiring::kFused, Wiring::kSystems}) {
    const auto has = [wiring](const Scenario& scenario, const char* output) {
      return Bench(scenario, wiring).diagram->HasOutputPort(output);
    };
    for (const char* name : {"moment_selection", "moment_dimension"}) {
      EXPECT_FALSE(has(LoadScenario(kPlane), name)) << name;
      EXPECT_TRUE(has(LoadScenario(kFlatTool), name)) << name;
    }
    for (const char* name : {"force_selection", "dimension"}) {
      EXPECT_FALSE(has(LoadPlane(SchemeOf<PositionForceScheme>), name)) << name;
    }
  }
}

// How a station is wired makes no difference to a single bit, whatever the link
// does to the messages.
TEST(TeleopStationTest, BothWiringsGiveTheSameBits) {
  const auto expect_equal = [](Scenario scenario) {
    scenario.link.channel = {.delay = 0.03, .jitter = 0.02, .loss = 0.2};
    Bench fused(scenario);
    Bench systems(scenario, Wiring::kSystems);
    ExpectEqual(fused.AdvanceTo(4.5), systems.AdvanceTo(4.5));
    // Also what is to be seen at the ports.
    for (int i = 0; i < fused.diagram->num_output_ports(); ++i) {
      const auto& port = fused.diagram->get_output_port(i);
      if (port.get_data_type() != drake::systems::kVectorValued) continue;
      EXPECT_EQ(port.Eval(fused.simulator->get_context()),
                systems.diagram->GetOutputPort(port.get_name())
                    .Eval(systems.simulator->get_context()))
          << port.get_name();
    }
  };
  Schemes::ForEach([&]<typename S>() {
    SCOPED_TRACE(S::kName);
    expect_equal(LoadPlane(SchemeOf<S>));
  });
  SCOPED_TRACE("angular filter");
  expect_equal(LoadScenario(kFlatTool));
}

TEST(TeleopStationTest, FlatToolIsPressedFlat) {
  const Scenario scenario = LoadScenario(kFlatTool);
  const RunLog log = Bench(scenario).AdvanceTo(6.0);
  const Eigen::Index last = log.time.size() - 1;
  EXPECT_EQ(log.Signal<1>("dimension")(last, 0), 1);
  EXPECT_EQ(log.Signal<1>("moment_dimension")(last, 0), 2);
  EXPECT_EQ(log.Signal<1>("contact_moment_dimension")(last, 0), 2);
  EXPECT_NEAR(log.Signal<3>("contact_rotation_axis")(last, 2), -1, 1e-3);
  const Metrics metrics =
      ComputeMetrics(log, MakeMetricsParams(scenario), std::nullopt);
  EXPECT_EQ(metrics.size(),
            MetricDescriptions().size() + AngularMetricDescriptions().size());
}

TEST(TeleopStationTest, SameSeedSameLogOtherSeedAnother) {
  Scenario scenario = LoadScenario(kPlane);
  scenario.sensor.tare = false;  // Its noise is seen at once.
  const RunLog log = Bench(scenario).AdvanceTo(0.3);
  EXPECT_EQ(log.time.size(), 300);
  EXPECT_NO_THROW(log.Validate());
  EXPECT_TRUE(log.AllFinite());
  EXPECT_TRUE(AreEqual(Bench(scenario).AdvanceTo(0.3), log));
  scenario.seed = 1;
  EXPECT_FALSE(AreEqual(Bench(scenario).AdvanceTo(0.3), log));
}

TEST(TeleopStationTest, GoesOnFromACloneWithTheSameBits) {
  for (const Wiring wiring : {Wiring::kFused, Wiring::kSystems}) {
    const Scenario scenario = LoadScenario(kFlatTool);
    Bench dut(scenario, wiring);
    dut.AdvanceTo(5.0);
    const auto clone = dut.simulator->get_context().Clone();
    const RunLog log = dut.AdvanceTo(5.1);
    EXPECT_EQ(log.Signal<1>("dimension")(log.time.size() - 1, 0), 1);
    // Beside what the original's simulator did meanwhile.
    Simulator<double> simulator(*dut.diagram, clone->Clone());
    simulator.AdvanceTo(5.1);
    EXPECT_TRUE(
        AreEqual(MakeRunLog(dut.station, simulator.get_context()), log));
    // The whole of it, as of one that was never interrupted.
    EXPECT_TRUE(AreEqual(Bench(scenario, wiring).AdvanceTo(5.1), log));
  }
}

TEST(TeleopStationTest, LogThatIsMovedOnTheWayIsTheSame) {
  const Scenario scenario = LoadScenario(kPlane);
  const Bench dut(scenario);
  const auto store = MakeRunLogStore(dut.station, 0.3);
  for (const double time : {0.1, 0.2, 0.25, 0.3}) {
    dut.simulator->AdvanceTo(time);
    auto& context = dut.simulator->get_mutable_context();
    MoveLog(dut.station, &context, store.get());
    EXPECT_EQ(dut.station.log->FindLog(context).num_samples(), 0);
  }
  EXPECT_TRUE(AreEqual(MakeRunLog(store, dut.station.signals),
                       Bench(scenario).AdvanceTo(0.3)));
}

TEST(TeleopStationTest, ToolGoesDownOntoTheTableAndFeelsIt) {
  const Scenario scenario = LoadScenario(kPlane);
  const RunLog log = Bench(scenario).AdvanceTo(4.5);
  const Eigen::Index last = log.time.size() - 1;
  EXPECT_EQ(log.Signal<1>("dimension")(last, 0), 1);
  EXPECT_EQ(log.Signal<1>("contact_dimension")(last, 0), 1);
  EXPECT_LT(log.Signal<3>("contact_force")(last, 2), -3);
  EXPECT_GT(log.Signal<3>("device_force")(last, 2), 3);
  const Metrics metrics =
      ComputeMetrics(log, MakeMetricsParams(scenario), std::nullopt);
  EXPECT_EQ(metrics.size(), MetricDescriptions().size());
}

TEST(TeleopStationTest, OtherSchemesLetTheHandFeelTheTable) {
  for (const Scheme scheme :
       {SchemeOf<PositionForceScheme>, SchemeOf<PositionPositionScheme>}) {
    const RunLog log = Bench(LoadPlane(scheme)).AdvanceTo(4.5);
    const Eigen::Index last = log.time.size() - 1;
    EXPECT_LT(log.Signal<3>("contact_force")(last, 2), -1);
    EXPECT_GT(log.Signal<3>("device_force")(last, 2), 0.5);
    EXPECT_EQ(log.Signal<1>("haptic_link_status")(last, 0), 1);
  }
}

TEST(TeleopStationTest, AllCountersAreLogged) {
  Schemes::ForEach([]<typename S>() {
    Scenario scenario = LoadPlane(SchemeOf<S>);
    scenario.link.channel.loss = 0.3;
    const RunLog log = Bench(scenario).AdvanceTo(1.0);
    const Eigen::Index last = log.time.size() - 1;
    for (const char* name : kCounters) {
      EXPECT_GE(log.Signal<1>(name)(last, 0), 0) << name;
    }
    for (const char* name : {"to_robot_lost", "to_device_lost",
                             "robot_link_gaps", "haptic_link_gaps"}) {
      EXPECT_GT(log.Signal<1>(name)(last, 0), 5) << name;
    }
    for (const char* name : {"filter_means_bad_inputs", "filter_bad_inputs",
                             "filter_all_weights_zero", "dimension"}) {
      EXPECT_EQ(log.Has(name), S::kUsesSelections) << name;
    }
  });
}

// A step that has nothing in common with the control period.
TEST(TeleopStationTest, FurtherModelsArePartOfTheWorld) {
  Scenario scenario = LoadScenario(kPlane);
  scenario.scene.model_directives = kModels + "block_and_ball.dmd.yaml";
  Bench fused(scenario);
  const RunLog log = fused.AdvanceTo(8);
  EXPECT_NEAR(log.Signal<3>("robot_position")(log.time.size() - 1, 0), 0.49,
              1e-3);
  Bench systems(scenario, Wiring::kSystems);
  ExpectEqual(systems.AdvanceTo(8), log);
}

TEST(TeleopStationTest, WhatDrakeHasNotIsAnError) {
  const auto error = [](const SceneParams& scene) -> std::string {
    Scenario scenario = LoadScenario(kPlane);
    scenario.scene = scene;
    try {
      Bench dut(scenario);
    } catch (const ScenarioError& thrown) {
      return thrown.what();
    }
    return "no exception";
  };
  SceneParams scene = LoadScenario(kPlane).scene;
  scene.model_directives = "/no/such/file";
  EXPECT_EQ(error(scene),
            "plane.scene.model_directives: expected a file, got "
            "\"/no/such/file\"");
  scene.model_directives =
      std::filesystem::path(WriteFile("directives: 3\n")).lexically_normal();
  EXPECT_TRUE(error(scene).starts_with(
      "plane.scene.model_directives: " + scene.model_directives + ": "))
      << error(scene);
  scene.model_directives = kModels + "egg.dmd.yaml";
  EXPECT_TRUE(error(scene).starts_with(
      "plane.scene.model_directives: geometry 'nest::shell' of body 'egg' of "
      "model 'nest' is an Ellipsoid, "));
  scene.model_directives.clear();
  scene.surfaces = {{.name = "bore",
                     .shape = SurfaceShape::kCylinder,
                     .radius = 2.0,
                     .length = 0.0,
                     .hollow = true}};
  EXPECT_TRUE(error(scene).starts_with("plane.scene.surfaces[0].hollow: "))
      << error(scene);
}

TEST(TeleopStationTest, PlantMayBeSlowerThanControl) {
  Scenario scenario = LoadScenario(kPlane);
  scenario.scene.time_step = 1.0 / 240;
  const RunLog log = Bench(scenario).AdvanceTo(6.0);
  EXPECT_EQ(log.time.size(), 6000);
  const Metrics metrics =
      ComputeMetrics(log, MakeMetricsParams(scenario), std::nullopt);
  const auto value = [&](const std::string& key) {
    for (const auto& [name, metric] : metrics) {
      if (name != key) continue;
      if (const auto* count = std::get_if<std::int64_t>(&metric)) {
        return static_cast<double>(*count);
      }
      return std::get<double>(metric);
    }
    return std::numeric_limits<double>::quiet_NaN();
  };
  EXPECT_EQ(value("contact_losses"), 0);
  EXPECT_LT(value("contact_force_max_N"), 25);
  EXPECT_GT(value("contact_force_max_N"), 5);
}

TEST(TeleopStationTest, WhatCannotBeReachedIsAnError) {
  Scenario scenario = LoadScenario(kPlane);
  scenario.scene.start_position.z() = 1.9;
  DiagramBuilder<double> builder;
  EXPECT_THROW(AddTeleopStation(&builder, scenario), std::invalid_argument);
}

}  // namespace
}  // namespace dual_proxy
