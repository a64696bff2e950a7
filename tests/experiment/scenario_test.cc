// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/scenario.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include <gtest/gtest.h>

#include "dual_proxy/experiment/recording.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// A document: a leaf's text, a list, or named parts.
struct Tree {
  std::string text;
  std::vector<Tree> items;
  std::map<std::string, Tree> parts;

  // The node at a dotted key, made if it is not there.
  Tree& operator[](const std::string& key) {
    const std::size_t dot = key.find('.');
    Tree& part = parts[key.substr(0, dot)];
    return dot == std::string::npos ? part : part[key.substr(dot + 1)];
  }
  void operator=(const std::string& leaf) { text = leaf; }
};

// Reads a Tree as Drake's reader reads YAML: what is not there keeps its value,
// what is not visited is an error.
class TreeReader {
 public:
  explicit TreeReader(const Tree& tree) : tree_(&tree) {}

  template <typename T>
  void Visit(const NameValue<T>& field) {
    visited_.insert(field.name());
    const auto found = tree_->parts.find(field.name());
    if (found != tree_->parts.end()) Read(found->second, field.value());
  }

  template <typename T>
  static void Read(const Tree& tree, T* value) {
    if constexpr (Serializable<T>) {
      TreeReader reader(tree);
      value->Serialize(&reader);
      for (const auto& [name, part] : tree.parts) {
        if (!reader.visited_.contains(name)) {
          throw std::runtime_error("unknown key " + name);
        }
      }
    } else if constexpr (std::is_base_of_v<Eigen::MatrixBase<T>, T>) {
      ASSERT_EQ(static_cast<int>(tree.items.size()), value->size());
      for (int i = 0; i < value->size(); ++i) {
        Read(tree.items[i], value->data() + i);
      }
    } else if constexpr (std::is_same_v<T, bool>) {
      *value = tree.text == "true";
    } else if constexpr (std::is_same_v<T, std::string>) {
      *value = tree.text;
    } else if constexpr (std::is_integral_v<T>) {
      *value = static_cast<T>(std::stoll(tree.text));
    } else {
      *value = std::stod(tree.text);
    }
  }

  template <typename T>
  static void Read(const Tree& tree, std::optional<T>* value) {
    Read(tree, &value->emplace());
  }

  template <typename T>
  static void Read(const Tree& tree, std::vector<T>* value) {
    value->resize(tree.items.size());
    for (std::size_t i = 0; i < value->size(); ++i) {
      Read(tree.items[i], &(*value)[i]);
    }
  }

 private:
  const Tree* tree_;
  std::set<std::string> visited_;
};

// The dotted keys of all that is visited, structs included.
class KeyArchive {
 public:
  explicit KeyArchive(std::vector<std::string>* keys, std::string prefix = "")
      : keys_(keys), prefix_(std::move(prefix)) {}

  template <typename T>
  void Visit(const NameValue<T>& field) {
    const std::string key = prefix_ + field.name();
    keys_->push_back(key);
    if constexpr (Serializable<T>) {
      KeyArchive archive(keys_, key + ".");
      field.value()->Serialize(&archive);
    }
  }

 private:
  std::vector<std::string>* keys_;
  std::string prefix_;
};

Tree Numbers(std::vector<double> values) {
  Tree list;
  for (const double value : values) {
    list.items.push_back({std::to_string(value), {}, {}});
  }
  return list;
}

// Read as it is, with presets and overrides, but not validated.
Scenario ReadTree(const Tree& tree) {
  Scenario scenario;
  TreeReader::Read(tree, &scenario);
  return scenario;
}

Scenario ValidScenario() {
  Scenario scenario;
  scenario.name = "tiny";
  Waypoint start{0, {0.45, 0, 0.18}};
  Waypoint end{1, {0.45, 0, 0.15}};
  scenario.operator_params.waypoints = {start, end};
  return scenario;
}

template <typename Change>
std::string ErrorAfter(const Change& change) {
  Scenario scenario = ValidScenario();
  change(&scenario);
  return InvalidArgument([&] { scenario.Validate(); });
}

TEST(ScenarioTest, NothingWrittenKeepsTheDefaults) {
  const Scenario dut = ReadTree({});
  EXPECT_EQ(dut.scheme, SchemeOf<DualProxyScheme>);
  EXPECT_EQ(dut.law, Law::kDefault);
  EXPECT_EQ(dut.duration, 20.0);
  EXPECT_EQ(dut.seed, 0);
  EXPECT_EQ(dut.link.rate(), 50.0);
  EXPECT_EQ(dut.link.delay(), 0.0);
  EXPECT_EQ(dut.map.scale, 2.5);
  EXPECT_EQ(dut.filter.num_particles, 1000);
  EXPECT_EQ(dut.robot_proxy.max_motion_error, 0.02);
  EXPECT_EQ(dut.controller.position_stiffness, 500.0);
  EXPECT_EQ(dut.operator_params.press_depth, 0.04);
}

TEST(ScenarioTest, EveryKindOfLeafIsRead) {
  Tree tree;
  tree["description"] = "one line";
  tree["extend_for_delay"] = "false";
  tree["seed"] = "9007199254740993";  // Not a double.
  tree["scene.start_position"] = Numbers({0.5, 0.1, 0.2});
  tree["scene.contact_approximation"] = "sap";
  tree["link.rate"] = "40";
  tree["link.delay"] = "0.25";
  tree["link.timeout"] = "0.75";
  tree["robot_proxy.workspace.shape"] = "sphere";
  tree["filter.update_thresholds.force_high"] = "9";
  Tree waypoint;
  waypoint["time"] = "2";
  waypoint["position"] = Numbers({1, 2, 3});
  tree["operator.waypoints"].items = {waypoint, waypoint};
  const Scenario dut = ReadTree(tree);
  EXPECT_EQ(dut.description, "one line");
  EXPECT_FALSE(dut.extend_for_delay);
  EXPECT_EQ(dut.seed, 9007199254740993);
  EXPECT_EQ(dut.scene.start_position, Eigen::Vector3d(0.5, 0.1, 0.2));
  EXPECT_EQ(dut.scene.contact_approximation, ContactApproximation::kSap);
  EXPECT_EQ(dut.link.sender.rate, 40.0);
  EXPECT_EQ(dut.link.channel.delay, 0.25);
  EXPECT_EQ(dut.link.monitor.timeout, 0.75);
  EXPECT_EQ(dut.robot_proxy.workspace.shape,
            WorkspaceLimitsParams::Shape::kSphere);
  EXPECT_EQ(dut.filter.update_thresholds.force_high, 9.0);
  ASSERT_EQ(dut.operator_params.waypoints.size(), 2u);
  EXPECT_EQ(dut.operator_params.waypoints[1].time, 2.0);
  EXPECT_EQ(dut.operator_params.waypoints[1].position,
            Eigen::Vector3d(1, 2, 3));
}

TEST(ScenarioTest, UnknownNameOfAChoiceIsAnError) {
  Tree tree;
  tree["law"] = "murphy";
  EXPECT_EQ(InvalidArgument([&] { ReadTree(tree); }),
            "Scenario: field `law` expected one of \"default\", \"printed\", "
            "got \"murphy\"");
}

TEST(ScenarioTest, PresetsWinOverWhatIsWrittenAndOverridesOverPresets) {
  Tree tree;
  tree["scheme"] = "position_force";
  tree["law"] = "printed";
  tree["controller.position_stiffness"] = "300";
  tree["controller.position_damping"] = "30";
  tree["controller.force_integral_gain"] = "2";
  tree["overrides.controller.position_damping"] = "25";
  tree["overrides.controller.passivity"] = "true";
  tree["overrides.robot_proxy.handover"] = "bumpless";
  const Scenario dut = ReadTree(tree);
  EXPECT_EQ(dut.controller.position_stiffness, 100.0);
  EXPECT_EQ(dut.controller.position_damping, 25.0);
  EXPECT_EQ(dut.controller.force_integral_gain, 2.0);
  EXPECT_EQ(dut.controller.force_gain, 2.5);
  EXPECT_TRUE(dut.controller.passivity);
  EXPECT_FALSE(dut.controller.feed_forward);
  EXPECT_EQ(dut.robot_proxy.handover, Handover::kBumpless);
  EXPECT_EQ(dut.robot_proxy.max_motion_error, 0.0);
}

TEST(ScenarioTest, SchemeAndLawAreNoOverrides) {
  for (const char* key : {"overrides.scheme", "overrides.law"}) {
    Tree tree;
    tree[key] = "default";
    EXPECT_THROW(ReadTree(tree), std::runtime_error) << key;
  }
}

TEST(ScenarioTest, PresetsOfTheLaw) {
  Scenario dut;
  dut.law = Law::kPrinted;
  dut.ApplyPresets();
  EXPECT_EQ(dut.angular_filter.method, AngularMethod::kParticles);
  EXPECT_EQ(dut.robot_proxy.handover, Handover::kPrinted);
  EXPECT_FALSE(dut.robot_proxy.interpolate);
  EXPECT_EQ(dut.robot_proxy.max_motion_error, 0.0);
  EXPECT_FALSE(dut.controller.unit_mass_motion_force);
  EXPECT_FALSE(dut.controller.feed_forward);
  EXPECT_EQ(dut.controller.selection_blend_time, 0.0);
  EXPECT_EQ(dut.controller.force_filter_cutoff, 0.0);
  EXPECT_EQ(dut.controller.force_integral_delay, 0.0);
  EXPECT_FALSE(dut.controller.passivity);
  EXPECT_EQ(dut.controller.position_stiffness, 500.0);
}

TEST(ScenarioTest, WritingChangesNothing) {
  Scenario dut;
  dut.law = Law::kPrinted;
  std::vector<std::string> keys;
  KeyArchive archive(&keys);
  dut.SerializeSections(&archive);
  EXPECT_TRUE(dut.controller.passivity);
  EXPECT_FALSE(std::ranges::count(keys, "overrides"));
  EXPECT_TRUE(std::ranges::count(keys, "filter.resampling_thresholds"));
  EXPECT_TRUE(std::ranges::count(keys, "link.spike_threshold"));
}

TEST(ScenarioTest, DerivedKeysCannotBeWritten) {
  for (const DerivedKey& derived : DerivedKeys()) {
    const std::string key(derived.key);
    for (const std::string& written : {key, "overrides." + key}) {
      Tree tree;
      tree[written] = "0";
      EXPECT_THROW(ReadTree(tree), std::runtime_error) << written;
    }
  }
}

TEST(ScenarioTest, DerivedKeysAndTheirSourcesExist) {
  Scenario dut;
  std::vector<std::string> written;
  KeyArchive archive(&written);
  dut.SerializeSections(&archive);
  // Without the filter for what is written, which is about a whole scenario.
  std::vector<std::string> all;
  const auto visit = [&all](const char* section, auto* params) {
    KeyArchive keys(&all, section);
    params->Serialize(&keys);
  };
  visit("map.", &dut.map);
  visit("link.", &dut.link);
  visit("robot_proxy.", &dut.robot_proxy);
  visit("controller.", &dut.controller);
  visit("filter.", &dut.filter);
  visit("gripper.", &dut.gripper);
  visit("haptic_proxy.", &dut.haptic_proxy);
  visit("haptic_controller.", &dut.haptic_controller);
  visit("operator_aids.", &dut.operator_aids);
  visit("device.", &dut.device);
  visit("sensor.", &dut.sensor);
  visit("point_controller.", &dut.point_controller);
  visit("point_mass.", &dut.point_mass);
  for (const DerivedKey& derived : DerivedKeys()) {
    EXPECT_TRUE(std::ranges::count(all, derived.key)) << derived.key;
    EXPECT_FALSE(std::ranges::count(written, derived.key)) << derived.key;
    EXPECT_TRUE(std::ranges::count(written, derived.source)) << derived.source;
  }
  // The filter alone has a rate of its own.
  for (const std::string& key : all) {
    if (key.ends_with(".period")) {
      EXPECT_EQ(FindSource(key).empty(), key == "filter.period") << key;
    }
  }
}

TEST(ScenarioTest, WhatIsBelowADerivedKeyHasItsSource) {
  EXPECT_EQ(FindSource("robot_proxy.map"), "map");
  EXPECT_EQ(FindSource("robot_proxy.map.scale"), "map");
  EXPECT_EQ(FindSource("robot_proxy.mapping"), "");
  EXPECT_EQ(FindSource("robot_proxy"), "");
}

TEST(ScenarioTest, SharedValuesAreDistributed) {
  Scenario dut = ValidScenario();
  dut.control_period = 5e-4;
  dut.scene.start_position << 0.5, 0.01, 0.2;
  dut.scene.tool_mass = 0.3;
  dut.scene.gravity = 9.8;
  dut.map.scale = 2.0;
  dut.link.monitor.timeout = 0.25;
  dut.robot_proxy.stiffness = 400;
  dut.controller.passivity = false;
  dut.operator_params.waypoints[0].position << 0.5, 0, 0.2;
  dut.Validate();
  EXPECT_EQ(dut.map.p_cw, dut.scene.start_position);
  for (const WorkspaceMapParams& map :
       {dut.robot_proxy.map, dut.haptic_proxy.map}) {
    EXPECT_EQ(map.scale, 2.0);
    EXPECT_EQ(map.p_cw, dut.scene.start_position);
  }
  for (const LinkMonitorParams& monitor :
       {dut.robot_proxy.link, dut.haptic_proxy.link}) {
    EXPECT_EQ(monitor.timeout, 0.25);
  }
  EXPECT_EQ(dut.haptic_proxy.robot_stiffness, 400.0);
  EXPECT_FALSE(dut.controller.force_passivity.enabled);
  EXPECT_FALSE(dut.controller.moment_passivity.enabled);
  EXPECT_EQ(dut.sensor.tool_mass, 0.3);
  EXPECT_EQ(dut.sensor.tool_com, kToolCom);
  EXPECT_EQ(dut.sensor.gravity, 9.8);
  for (const double period :
       {dut.link.sender.period, dut.robot_proxy.period,
        dut.robot_proxy.limiter.period, dut.controller.period,
        dut.controller.force_passivity.period,
        dut.controller.moment_passivity.period, dut.haptic_proxy.period,
        dut.haptic_controller.period, dut.device.period, dut.sensor.period}) {
    EXPECT_EQ(period, 5e-4);
  }
  EXPECT_EQ(dut.filter.period, 0.01);
}

TEST(ScenarioTest, WrongFieldsAreNamedByTheirPath) {
  using S = Scenario;
  EXPECT_EQ(ErrorAfter([](S*) {}), "no exception");
  EXPECT_EQ(ErrorAfter([](S* s) { s->duration = 0; }),
            "tiny.duration: expected a number in [0.001, 100000], got 0");
  EXPECT_EQ(ErrorAfter([](S* s) { s->seed = -1; }),
            "tiny.seed: expected a finite value >= 0, got -1");
  EXPECT_EQ(ErrorAfter([](S* s) { s->scene.friction = -1; }),
            "tiny.scene.friction: expected a number in [0, 5], got -1");
  EXPECT_EQ(ErrorAfter([](S* s) {
              s->scene.surfaces.resize(2);
              s->scene.surfaces[1].size = Eigen::Vector3d(0, 1, 1);
            }),
            "tiny.scene.surfaces[1].size[0]: expected a number in "
            "[0.0001, 10], got 0");
  EXPECT_EQ(ErrorAfter([](S* s) {
              s->scene.surfaces.resize(1);
              s->scene.surfaces[0].radius = 0.1;
            }),
            "tiny.scene.surfaces[0].radius: expected none, as a half_space has "
            "no use for it, got a value");
  EXPECT_EQ(ErrorAfter([](S* s) { s->scene.surfaces.resize(1); }),
            "tiny.scene.surfaces: expected names used once, not empty and not "
            "'table', got ['']");
  EXPECT_EQ(ErrorAfter([](S* s) { s->map.scale = 0; }),
            "tiny.map.scale: expected a number in [0.001, 1000], got 0");
  EXPECT_EQ(ErrorAfter([](S* s) { s->link.channel.loss = 2; }),
            "tiny.link.loss: expected a number in [0, 1], got 2");
  EXPECT_EQ(
      ErrorAfter([](S* s) { s->robot_proxy.limiter.max_velocity = 0; }),
      "tiny.robot_proxy.limiter.max_velocity: expected a finite value > 0, "
      "got 0");
  EXPECT_EQ(ErrorAfter([](S* s) { s->controller.max_mass = -3; }),
            "tiny.controller.max_mass: expected a finite value > 0, got -3");
  EXPECT_EQ(ErrorAfter([](S* s) {
              s->controller.force_passivity.damping_margin = 501;
            }),
            "tiny.controller.force_passivity.damping_margin: expected a number "
            "in [0, max_damping = 500], got 501");
  EXPECT_EQ(
      ErrorAfter([](S* s) { s->operator_params.press_depth = kNan; }),
      "tiny.operator.press_depth: expected a number in [0, 0.1], got nan");
  EXPECT_EQ(
      ErrorAfter([](S* s) { s->operator_params.waypoints[1].time = 100001; }),
      "tiny.operator.waypoints[1].time: expected a number in [0, 100000], got "
      "100001");
  EXPECT_EQ(
      ErrorAfter([](S* s) { s->operator_params.waypoints[1].position(2) = 3; }),
      "tiny.operator.waypoints[1].position[2]: expected a number in "
      "[-2, 2], got 3");
}

// What passes the checks gives a run in which all is finite.
TEST(ScenarioTest, WhatNoHandDeviceOrLinkHasIsRefused) {
  using S = Scenario;
  EXPECT_EQ(ErrorAfter([](S* s) { s->device.hand_stiffness = 1e300; }),
            "tiny.device.hand_stiffness: expected a number in [0, 1e+06], got "
            "1e+300");
  EXPECT_EQ(ErrorAfter([](S* s) { s->device.hand_mass = 5e-324; }),
            "tiny.device.hand_mass: expected a number in [0.001, 500], got "
            "4.94066e-324");
  EXPECT_EQ(ErrorAfter([](S* s) { s->device.device_mass = 5e-324; }),
            "tiny.device.device_mass: expected a number in [0.0001, 500], got "
            "4.94066e-324");
  EXPECT_EQ(ErrorAfter([](S* s) { s->device.hand_damping = 1e300; }),
            "tiny.device.hand_damping: expected a number in [0, 100000], got "
            "1e+300");
  EXPECT_EQ(ErrorAfter([](S* s) { s->device.device_damping = 1e300; }),
            "tiny.device.device_damping: expected a number in [0, 10000], got "
            "1e+300");
  EXPECT_EQ(ErrorAfter([](S* s) { s->map.scale = 1e300; }),
            "tiny.map.scale: expected a number in [0.001, 1000], got 1e+300");
  EXPECT_EQ(ErrorAfter([](S* s) { s->link.channel.jitter = 1e300; }),
            "tiny.link.jitter: expected a number in [0, 10], got 1e+300");
  EXPECT_EQ(ErrorAfter([](S* s) { s->sensor.cutoff = 1e-300; }),
            "tiny.sensor.cutoff: expected 0 or a finite value >= 0.01, got "
            "1e-300");
  EXPECT_EQ(ErrorAfter([](S* s) { s->device.velocity_cutoff = 1e-300; }),
            "tiny.device.velocity_cutoff: expected 0 or a finite value >= "
            "0.01, got 1e-300");
}

TEST(ScenarioTest, FieldsThatContradictEachOtherAreNamed) {
  using S = Scenario;
  EXPECT_EQ(ErrorAfter([](S* s) { s->link.channel.delay = 10.5; }),
            "tiny.link.delay: expected a number in [0, 10], got 10.5");
  EXPECT_EQ(ErrorAfter([](S* s) { s->link.monitor.timeout = 0.01; }),
            "tiny.link.timeout: expected at least two messages long (0.04 s at "
            "50 Hz), got 0.01");
  EXPECT_EQ(ErrorAfter([](S* s) {
              s->link.channel.delay = 0.5;
              s->link.monitor.max_age = 0.5;
            }),
            "tiny.link.max_age: expected more than the delay and a message "
            "interval (0.52 s), got 0.5");
  EXPECT_EQ(ErrorAfter([](S* s) { s->filter.period = 5e-4; }),
            "tiny.filter.period: expected at least control_period (0.001 s), "
            "got 0.0005");
}

TEST(ScenarioTest, EntriesOfListsAreNamed) {
  using S = Scenario;
  using Spans = std::vector<Eigen::Vector2d>;
  EXPECT_EQ(ErrorAfter([](S* s) {
              s->operator_params.force_scale = Spans{{1, 1}, {5, -1}};
            }),
            "tiny.operator.force_scale[1][1]: expected a finite value >= 0, "
            "got -1");
  EXPECT_EQ(
      ErrorAfter(
          [](S* s) { s->operator_params.force_scale = Spans{{2, 1}, {1, 1}}; }),
      "tiny.operator.force_scale[1][0]: expected a finite value > the time "
      "before = 2, got 1");
  EXPECT_EQ(
      ErrorAfter([](S* s) { s->operator_params.clutch = Spans{{7, 5}}; }),
      "tiny.operator.clutch[0][1]: expected a finite value > its start = 7, "
      "got 5");
  EXPECT_EQ(
      ErrorAfter([](S* s) { s->link.channel.outages = Spans{{1, 2}, {3, 1}}; }),
      "tiny.link.outages[1][1]: expected a finite value > its start = 3, "
      "got 1");
}

TEST(ScenarioTest, APlannerHasToBeAbleTo) {
  const auto error = [](auto change) {
    return ErrorAfter([change](Scenario* s) {
      s->planner.active = {{1, 2}};
      s->planner.directions = {{0, 0, 1}};
      change(s);
    });
  };
  using S = Scenario;
  EXPECT_EQ(error([](S* s) { s->scheme = SchemeOf<TdpaScheme>; }),
            "tiny.planner.active: expected none with scheme tdpa, which has no "
            "directions of force");
  EXPECT_EQ(error([](S* s) { s->planner.force.z() = -500; }),
            "tiny.planner.force: expected at most robot_proxy.max_force (20 "
            "N), got 500");
  EXPECT_EQ(error([](S* s) {
              s->planner.scan_amplitude.y() = 0.02;
              s->planner.scan_frequency = 100;
              s->robot_proxy.limiter.max_velocity = 0.3;
            }),
            "tiny.planner.scan_frequency: expected a scan of 0.02 m no faster "
            "than robot_proxy.limiter.max_velocity (0.3 m/s), which is "
            "2.38 Hz, got 100");
}

TEST(ScenarioTest, AForceScaleStaysBelowTheMost) {
  EXPECT_EQ(ErrorAfter(
                [](Scenario* s) { s->operator_params.force_scale = {{5, 3}}; }),
            "tiny.operator.force_scale[0][1]: expected at most "
            "operator_aids.max_force_scale (2), got 3");
}

// The default gain is for heavy devices; the default device is light.
TEST(ScenarioTest, ForceLoopsOfTheDeviceThatSwingAreRefused) {
  const auto error = [](double device_mass, double gain, double integral_gain) {
    return ErrorAfter([=](Scenario* s) {
      s->haptic_controller.method = HapticControlMethod::kForceFeedback;
      s->haptic_controller.force_gain = gain;
      s->haptic_controller.force_integral_gain = integral_gain;
      s->device.device_mass = device_mass;
    });
  };
  EXPECT_EQ(error(0.25, 8, 30),
            "tiny.haptic_controller.force_gain: expected at most 4.14, as with "
            "2 times more the force loop of a device of 0.25 kg "
            "(device.device_mass) in a hand of 0.5 kg swings, got 8");
  EXPECT_EQ(error(0.25, 4, 30), "no exception");
  EXPECT_EQ(error(4, 8, 30), "no exception");
  EXPECT_EQ(
      error(8, 0.2, 30),
      "tiny.haptic_controller.force_integral_gain: expected at most 3.57, "
      "as with 2 times more the force loop of a device of 8 kg "
      "(device.device_mass) in a hand of 0.5 kg swings, got 30");
  EXPECT_EQ(ErrorAfter([](Scenario* s) { s->device.device_mass = 0.1; }),
            "no exception");
}

TEST(ScenarioTest, PeriodsAtWhichTheLawIsNotStableAreRefused) {
  const auto error = [](double control_period, double time_step) {
    return ErrorAfter([=](Scenario* s) {
      s->controller.force_gain = 2.5;
      s->control_period = control_period;
      s->scene.time_step = time_step;
    });
  };
  // What works in Drake (tests/control/loop_stability_test.cc), with a margin.
  EXPECT_EQ(error(1e-3, 1.0 / 240), "no exception");
  EXPECT_EQ(error(1e-3, 1e-2), "no exception");
  EXPECT_EQ(error(2e-3, 1e-3), "no exception");
  EXPECT_EQ(error(2e-3, 2e-3), "no exception");
  EXPECT_EQ(error(4e-3, 1e-3), "no exception");
  EXPECT_EQ(ErrorAfter([](Scenario* s) {
              s->controller.force_gain = 2.5;
              s->controller.max_proportional_force = 0;
              s->control_period = 3e-3;
            }),
            "tiny.control_period: expected at most 0.0025 s with "
            "scene.time_step 0.001 s, as force control "
            "(controller.force_speed_limit 0.1) is too fast in the air, got "
            "0.003");
  EXPECT_EQ(error(5e-3, 1e-3),
            "tiny.control_period: expected at most 0.004 s with "
            "scene.time_step 0.001 s, as force control (controller.force_gain "
            "2.5) swings on a contact of 30000 N/m, got 0.005");
  EXPECT_EQ(ErrorAfter([](Scenario* s) {
              s->controller.force_gain = 2.5;
              s->scene.surfaces = {{.name = "steel", .stiffness = 1e6}};
              s->control_period = 4e-3;
            }),
            "tiny.control_period: expected at most 0.001 s with "
            "scene.time_step 0.001 s, as force control (controller.force_gain "
            "2.5) swings on a contact of 1e+06 N/m, got 0.004");
  EXPECT_NE(error(1.0 / 240, 1.0 / 240), "no exception");
  EXPECT_EQ(error(0.011, 1e-3),
            "tiny.control_period: expected a number in [1e-05, 0.01], got "
            "0.011");
  EXPECT_EQ(ErrorAfter([](Scenario* s) {
              s->scheme = SchemeOf<PositionForceScheme>;
              s->control_period = 8e-3;
            }),
            "no exception");
  EXPECT_EQ(ErrorAfter([](Scenario* s) {
              s->controller.position_damping = 500;
              s->control_period = 8e-3;
            }),
            "tiny.control_period: expected at most 0.005 s with "
            "scene.time_step 0.001 s, as motion control "
            "(controller.position_damping 500) swings, got 0.008");
  // Physical gains act on what the tool weighs where it is lightest.
  EXPECT_EQ(ErrorAfter([](Scenario* s) {
              s->controller.motion = MotionLaw::kCartesianImpedance;
              s->control_period = 8e-3;
            }),
            "tiny.control_period: expected at most 0.005 s with "
            "scene.time_step 0.001 s, as motion control "
            "(controller.impedance.rotational_damping 1.5) swings, got 0.008");
  EXPECT_EQ(ErrorAfter([](Scenario* s) {
              s->controller.motion = MotionLaw::kCartesianImpedance;
              s->controller.impedance.damping = 600;
              s->control_period = 1.5e-3;
            }),
            "tiny.control_period: expected at most 0.001 s with "
            "scene.time_step 0.001 s, as motion control "
            "(controller.impedance.damping 600) swings, got 0.0015");
}

TEST(ScenarioTest, TheUsualPeriodIsNeverRefused) {
  EXPECT_EQ(ErrorAfter([](Scenario* s) {
              s->scene.contact_stiffness = 1e8;
              s->controller.force_gain = 100;
            }),
            "no exception");
}

TEST(ScenarioTest, ClaimsAreChecked) {
  const auto error = [](const Claim& claim) {
    return ErrorAfter([&](Scenario* s) { s->claims = {claim}; });
  };
  const char* key = "normal_error_mean_deg";
  EXPECT_EQ(error({.metric = key, .at_most = 10}), "no exception");
  EXPECT_EQ(error({.metric = key, .at_least = 2, .at_most = 2}),
            "no exception");
  EXPECT_EQ(error({.metric = "moment_dimension_accuracy", .at_least = 1}),
            "no exception");
  EXPECT_EQ(error({.metric = "charm", .at_most = 10}),
            "tiny.claims[0].metric: expected a number among the keys of "
            "metrics.json, got "
            "\"charm\"");
  EXPECT_EQ(error({.metric = key}),
            "tiny.claims[0].at_most: expected that or at_least, got neither");
  EXPECT_EQ(
      error({.metric = key, .at_least = 3, .at_most = 2}),
      "tiny.claims[0].at_most: expected a finite value >= at_least = 3, got 2");
  EXPECT_EQ(error({.metric = key,
                   .at_most = std::numeric_limits<double>::infinity()}),
            "tiny.claims[0].at_most: expected a finite value, got inf");
  EXPECT_EQ(
      error({.metric = key, .at_most = 1, .min_delay = 2, .max_delay = 1}),
      "tiny.claims[0].max_delay: expected a finite value >= min_delay = 2, got "
      "1");
  EXPECT_EQ(
      error({.metric = key, .at_most = 1, .max_friction = -1}),
      "tiny.claims[0].max_friction: expected a finite value >= 0, got -1");
}

TEST(ScenarioTest, WaypointsAreChecked) {
  using Points = std::vector<Waypoint>;
  const auto error = [](const Points& points) {
    return ErrorAfter(
        [&](Scenario* s) { s->operator_params.waypoints = points; });
  };
  const Eigen::Vector3d p{0.45, 0, 0.18};
  EXPECT_EQ(error({{0, p}}),
            "tiny.operator.waypoints: expected at least two (or "
            "operator.recording), got 1");
  EXPECT_EQ(error({{1, p}, {2, p}}),
            "tiny.operator.waypoints[0].time: expected 0, got 1");
  EXPECT_EQ(error({{0, p}, {1, p}, {1, p}}),
            "tiny.operator.waypoints[2].time: expected more than the one "
            "before (1 s), got 1");
  EXPECT_EQ(error({{0, p}, {1, {0.9, 0, 0.1}}}),
            "tiny.operator.waypoints[1].position: expected a place that the "
            "device reaches (scene.start_position is the middle of its "
            "workspace, map.scale its size), got [0.9, 0, 0.1]");
  // There need not be a table below.
  const Eigen::Vector3d aside{0.55, 0, 0.18};
  EXPECT_EQ(ErrorAfter([&](Scenario* s) {
              s->scene.table_size << 0.01, 0.01;
              s->operator_params.waypoints = {{0, p}, {1, aside}};
            }),
            "no exception");
}

TEST(ScenarioTest, ARecordingTakesTheWaypointsPlace) {
  Scenario dut = ValidScenario();
  dut.operator_params.waypoints.clear();
  dut.operator_params.recording = "motion.csv";
  EXPECT_NO_THROW(dut.Validate());
  const auto here = std::filesystem::canonical(".").string();
  EXPECT_EQ(InvalidArgument([&] { dut.CalcOperatorPath(); }),
            here + "/motion.csv: No such file or directory");

  const auto file = std::filesystem::path(testing::TempDir()) / "motion.csv";
  std::ofstream csv(file);
  csv << "t,px,py,pz\n";
  for (int i = 0; i <= 20; ++i) csv << 0.1 * i << ",0,0,0\n";
  csv.close();
  dut.operator_params.recording = file.string();
  const OperatorPathParams path = dut.CalcOperatorPath();
  EXPECT_EQ(path.interpolation, PathInterpolation::kCubic);
  const double end = path.times(path.times.size() - 1);
  EXPECT_NEAR(end, 2 + 2 * kRecordingMoveTime, 1e-12);
  // Where the person worked is `press_depth` below first touch.
  EXPECT_NEAR(path.points.row(2).minCoeff(),
              dut.scene.contact_height() - dut.operator_params.press_depth,
              1e-12);
  dut.duration = 1;
  EXPECT_NEAR(dut.CalcRunDuration(), end + 2 + 3 * dut.link.delay(), 1e-3);

  EXPECT_EQ(dut.CalcRecordedMotion().scale, 1);
  dut.operator_params.recording_scale = 0.25;
  EXPECT_EQ(dut.CalcRecordedMotion().scale, 0.25);
  dut.operator_params.recording_scale = 0;
  EXPECT_EQ(InvalidArgument([&] { dut.Validate(); }),
            "tiny.operator.recording_scale: expected a number in (0, 1000], "
            "got 0");
}

TEST(ScenarioTest, ARecordingsPathBecomesAbsolute) {
  const std::string here = std::filesystem::canonical(".").string();
  const auto resolved = [](const std::string& path,
                           const std::string& directory = "") {
    Scenario dut = ValidScenario();
    dut.operator_params.recording = path;
    dut.ResolvePaths(directory);
    dut.Validate();  // Changes it no more.
    return dut.operator_params.recording;
  };
  EXPECT_EQ(resolved(""), "");
  EXPECT_EQ(resolved("a.csv"), here + "/a.csv");
  EXPECT_EQ(resolved("./x/../a.csv", "sub"), here + "/sub/a.csv");
  EXPECT_EQ(resolved("a.csv", "/none"), "/none/a.csv");
  EXPECT_EQ(resolved("/none/a.csv", "/other"), "/none/a.csv");
  setenv("HOME", "/none", 1);
  EXPECT_EQ(resolved("~/a.csv", "/other"), "/none/a.csv");
  EXPECT_EQ(resolved("~a.csv", "/other"), "/other/~a.csv");
}

TEST(ScenarioTest, MotionIsThatOfTheWaypoints) {
  const OperatorPathParams path = ValidScenario().CalcOperatorPath();
  EXPECT_EQ(path.interpolation, PathInterpolation::kMinimumJerk);
  EXPECT_EQ(path.times, Eigen::Vector2d(0, 1));
  EXPECT_EQ(path.points.col(1), Eigen::Vector3d(0.45, 0, 0.15));
}

TEST(ScenarioTest, TheToolTurnsIfAWaypointSaysSo) {
  Scenario dut = ValidScenario();
  EXPECT_EQ(dut.CalcOperatorPath().rotations.cols(), 0);
  dut.operator_params.waypoints[1].rotation << 0, 0.1, 0.5;
  const OperatorPathParams path = dut.CalcOperatorPath();
  ASSERT_EQ(path.rotations.cols(), 2);
  EXPECT_EQ(path.rotations.col(0), Eigen::Vector3d::Zero());
  EXPECT_EQ(path.rotations.col(1), Eigen::Vector3d(0, 0.1, 0.5));
}

TEST(ScenarioTest, TheAngularFilterIsOffAndPartOfTheDualProxy) {
  Scenario dut = ValidScenario();
  EXPECT_FALSE(dut.has_angular_filter());
  dut.angular_filter.enabled = true;
  EXPECT_TRUE(dut.has_angular_filter());
  dut.scheme = SchemeOf<PositionForceScheme>;
  EXPECT_FALSE(dut.has_angular_filter());
  dut.angular_filter.filter.period = 1e-4;
  EXPECT_EQ(InvalidArgument([&] { dut.Validate(); }),
            "tiny.angular_filter.period: expected at least control_period "
            "(0.001 s), got 0.0001");
  dut.angular_filter.filter.update_thresholds.force_high = 0.01;
  EXPECT_EQ(InvalidArgument([&] { dut.Validate(); }),
            "tiny.angular_filter.update_thresholds.force_high: expected a "
            "finite value > force_low = 0.08, got 0.01");
}

TEST(ScenarioTest, ReachableIsWithinTheDevicesWorkspace) {
  Scenario dut = ValidScenario();
  // x of D is y of B, so that the cylinder's axis lies along y of B.
  dut.map.R_DB << 0, 1, 0, -1, 0, 0, 0, 0, 1;
  dut.scene.start_position << 0.45, 0, 0.2;
  dut.Distribute();
  const double length = 0.95 * 0.055 * 2.5;
  const double radius = 0.95 * 0.08 * 2.5;
  Eigen::Matrix3Xd points(3, 5);
  points.col(0) << 0.45, 0, 0.2;
  points.col(1) << 0.45, length - 1e-6, 0.2;
  points.col(2) << 0.45, length + 1e-6, 0.2;
  points.col(3) << 0.45, 0, 0.2 + radius - 1e-6;
  points.col(4) << 0.45, 0, 0.2 + radius + 1e-6;
  const Eigen::VectorX<bool> reachable = dut.Reachable(points);
  const std::vector<bool> result(reachable.begin(), reachable.end());
  EXPECT_EQ(result, std::vector<bool>({true, true, false, true, false}));
}

// 2300 x 0.001 is a bit more than 2.3: the last period would not be reached.
TEST(ScenarioTest, TheLastPeriodBelongsToTheRun) {
  Scenario dut = ValidScenario();
  dut.extend_for_delay = false;
  dut.duration = 2.3;
  EXPECT_EQ(dut.CalcRunDuration(), 2300 * 0.001);
  EXPECT_GT(dut.CalcRunDuration(), 2.3);
  dut.duration = 2.3004;
  EXPECT_EQ(dut.CalcRunDuration(), 2.3004);
}

TEST(ScenarioTest, ThePapersThresholdsAreAboveTheNoise) {
  EXPECT_NE(ErrorAfter([](Scenario* s) {
              s->filter.likelihood = Likelihood::kPaper;
              s->filter.update_thresholds.force_low = 0;
              s->filter.update_thresholds.force_high = 0.1;
            })
                .find("tiny.filter.update_thresholds.force_high: expected at "
                      "least 3 times the sensor's noise"),
            std::string::npos);
}

TEST(ScenarioTest, RunIsLongEnoughForALateRelease) {
  Scenario dut = ValidScenario();
  const auto duration = [&dut](double motion_end) {
    dut.operator_params.waypoints.back().time = motion_end;
    return dut.CalcRunDuration();
  };
  EXPECT_EQ(duration(18), 20.0);
  dut.link.channel.delay = 0.15;
  EXPECT_EQ(duration(18), 20.45);
  dut.link.channel.delay = 1.5;
  EXPECT_EQ(duration(18), 24.5);
  EXPECT_EQ(duration(18.0001), 24.501);
  dut.duration = 30;
  EXPECT_EQ(duration(18), 30.0);
  dut.duration = 5;
  dut.extend_for_delay = false;
  EXPECT_EQ(duration(18), 5.0);
}

}  // namespace
}  // namespace dual_proxy
