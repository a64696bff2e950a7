// SPDX-License-Identifier: BSD-3-Clause
// Any values of a scenario's fields: an error of one line that names a field,
// or a scenario that runs within its limits.
#include <cmath>
#include <cstdint>
#include <exception>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "dual_proxy/experiment/bare_engine.h"
#include "dual_proxy/experiment/run_log.h"
#include "dual_proxy/experiment/scenario.h"
#include "dual_proxy/experiment/teleop_loop_params.h"
#include "fuzz_tools.h"
#include "test_arm.h"

namespace dual_proxy {
namespace {

constexpr int kMostItems = 4;
constexpr int kPeriods = 20;

struct Edit {
  int leaf{0};
  int item{0};  // Of a vector, or of an enum.
  double number{0};
};

std::vector<Edit> TakeEdits(FuzzInput* input) {
  std::vector<Edit> edits;
  while (!input->empty() && edits.size() < 12) {
    Edit edit{.leaf = input->Take<std::uint16_t>(), .item = input->Byte()};
    edit.number = input->Number();
    edits.push_back(edit);
  }
  return edits;
}

// Visits all leaves that a file may set, and sets some of them.
class Editor {
 public:
  Editor(const std::vector<Edit>& edits, int count)
      : edits_(edits), count_(count) {}

  int visited() const { return visited_; }

  template <typename T>
  void Visit(const NameValue<T>& field) {
    Change(field.value());
  }

  template <typename Enum>
  void VisitEnumField(const char*, Enum* value, const char*) {
    Next([value](const Edit& edit) {
      const auto& values = EnumStrings<Enum>::kValues;
      const auto size = static_cast<int>(std::size(values));
      *value = values[edit.item % size].first;
    });
  }

 private:
  // Calls `change` with the edits of this leaf.
  template <typename Function>
  void Next(const Function& change) {
    for (const Edit& edit : edits_) {
      if (count_ > 0 && edit.leaf % count_ == visited_) change(edit);
    }
    ++visited_;
  }

  template <typename T>
  void Change(T* value) {
    if constexpr (Serializable<T>) {
      value->Serialize(this);
    } else if constexpr (std::is_same_v<T, bool>) {
      Next([value](const Edit&) { *value = !*value; });
    } else if constexpr (std::is_same_v<T, std::string>) {
      Next([value](const Edit& edit) {
        constexpr const char* kTexts[] = {"", "a", "b", "/no/such.csv"};
        *value = kTexts[edit.item % 4];
      });
    } else if constexpr (std::is_integral_v<T>) {
      Next([value](const Edit& edit) {
        constexpr auto kMost =
            static_cast<double>(std::numeric_limits<T>::max() / 2);
        *value = static_cast<T>(std::isfinite(edit.number)
                                    ? std::clamp(edit.number, -kMost, kMost)
                                    : kMost);
        if (edit.item % 2 == 1) *value = static_cast<T>(edit.item);
      });
    } else if constexpr (std::is_floating_point_v<T>) {
      Next([value](const Edit& edit) {
        *value = edit.item % 2 == 0 ? edit.number : *value * edit.number;
      });
    } else {
      Next([value](const Edit& edit) {
        value->reshaped()(edit.item % value->size()) = edit.number;
      });
    }
  }

  template <typename T>
  void Change(std::optional<T>* value) {
    Next([value](const Edit& edit) {
      if (edit.item % 2 == 0)
        value->reset();
      else if (!*value)
        value->emplace();
    });
    if (*value) Change(&**value);
  }

  template <typename T>
  void Change(std::vector<T>* values) {
    Next([values](const Edit& edit) {
      values->resize(edit.item % (kMostItems + 1), MakeItem<T>());
    });
    for (T& value : *values) Change(&value);
  }

  template <typename T>
  static T MakeItem() {
    if constexpr (Serializable<T>) {
      return {};
    } else {
      return T::Zero();
    }
  }

  const std::vector<Edit>& edits_;
  int count_;
  int visited_{0};
};

// All values as text, to compare scenarios.
class Printer {
 public:
  const std::string& text() const { return text_; }

  template <typename T>
  void Visit(const NameValue<T>& field) {
    text_.append(field.name()).append(" ");
    Print(field.value());
  }

  template <typename Enum>
  void VisitEnumField(const char* name, Enum* value, const char*) {
    text_.append(name).append(" ").append(EnumToString(*value)).append("\n");
  }

 private:
  template <typename T>
  void Print(T* value) {
    if constexpr (Serializable<T>) {
      value->Serialize(this);
    } else if constexpr (std::is_same_v<T, std::string>) {
      text_.append(*value).append("\n");
    } else if constexpr (std::is_arithmetic_v<T>) {
      text_.append(NumberText(static_cast<double>(*value))).append("\n");
    } else {
      for (auto x : value->reshaped()) text_.append(NumberText(x)).append("\n");
    }
  }

  template <typename T>
  void Print(std::optional<T>* value) {
    if (*value) Print(&**value);
  }

  template <typename T>
  void Print(std::vector<T>* values) {
    for (T& value : *values) Print(&value);
  }

  std::string text_;
};

std::string Print(Scenario scenario) {
  Printer printer;
  scenario.VisitFields(&printer, true);
  return printer.text();
}

Scenario MakeScenario(bool point_mass) {
  Scenario scenario;
  scenario.name = "tiny";
  scenario.robot = point_mass ? RobotKind::kPointMass : RobotKind::kPanda;
  scenario.scene.table_height = 0.14;
  scenario.sensor.tare = false;
  scenario.filter.num_particles = 100;
  scenario.operator_params.waypoints = {Waypoint{0, {0.45, 0, 0.18}},
                                        Waypoint{1.5, {0.45, 0, 0.11}}};
  return scenario;
}

// Of a recording that cannot be read the error names the file.
void RequireError(std::string_view text, const std::string& recording) {
  Require(text.starts_with("tiny.") ||
              (!recording.empty() && text.starts_with(recording + ": ")),
          "an error that names the field");
  Require(text.find(": ") != text.npos, "and what is wrong");
  Require(text.find('\n') == text.npos && text.size() < 2000,
          "an error of one line");
}

template <typename Engine>
void Advance(Engine engine, const Scenario& scenario) {
  engine.AdvanceTo(kPeriods * scenario.control_period);
  const auto log = engine.log();
  Require(log->num_rows() == kPeriods, "a row for each period");
  const RunLog run = MakeRunLog(log, engine.layout());
  const auto force = run.Signal<3>("device_force");
  Require(
      force.allFinite() && (force.rowwise().norm().array() <=
                            (1 + 1e-9) * scenario.haptic_controller.max_force)
                               .all(),
      "the device's force within its limit");
  if (scenario.robot == RobotKind::kPanda) {
    const auto torque = run.Signal<7>("torque");
    const auto& limit = scenario.controller.torque_limit;
    const Eigen::Matrix<double, 1, 7> largest =
        torque.cwiseAbs().colwise().maxCoeff();
    Require(
        torque.allFinite() &&
            (largest.transpose().array() <= (1 + 1e-9) * limit.array()).all(),
        "torques within their limits");
  } else {
    const auto command = run.Signal<3>("commanded_force");
    Require(command.allFinite(), "a finite command");
  }
}

void RunFirstPeriods(const Scenario& scenario) {
  const double duration = kPeriods * scenario.control_period;
  if (scenario.robot == RobotKind::kPointMass) {
    Advance(MakePointMassEngine(scenario, duration), scenario);
    return;
  }
  // Which posture a place is reached in is not the scenario's to say.
  const Eigen::Vector3d start = MakeScenario(false).scene.start_position;
  if (scenario.scene.start_position != start) return;
  const auto& limits = scenario.controller.joint_limits;
  if ((kTestArmAtRest.array() < limits.lower.array()).any() ||
      (kTestArmAtRest.array() > limits.upper.array()).any()) {
    return;
  }
  ArmModelParams<7> arm = MakeTestArm();
  arm.mass(6) += scenario.scene.tool_mass;
  Advance(MakeArmEngine(scenario, arm, kTestArmAtRest, duration), scenario);
}

void Check(Scenario scenario) {
  try {
    scenario.ApplyPresets();
    scenario.Validate();
    const std::string values = Print(scenario);
    scenario.Validate();
    Require(Print(scenario) == values, "a second check changes nothing");
    const double duration = scenario.CalcRunDuration();
    Require(duration > 0 && duration < 2e5, "a duration");
    Require(OperatorPath(CalcHandlePath(scenario))
                .Calc(duration / 2)
                .position.allFinite(),
            "a path of the handle");
    const HapticSide haptic(MakeHapticSideParams(scenario));
    if (scenario.robot == RobotKind::kPanda) {
      const RobotSide<SerialArm<7>> robot(
          MakeRobotSideParams<SerialArm<7>>(scenario));
    } else {
      const RobotSide<PointMass> robot(
          MakeRobotSideParams<PointMass>(scenario));
    }
    RunFirstPeriods(scenario);
  } catch (const ScenarioError& error) {
    RequireError(error.what(), scenario.operator_params.recording);
  } catch (const std::exception& error) {
    RequireNoOther(error);
  }
}

}  // namespace
}  // namespace dual_proxy

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data,
                                      std::size_t size) {
  using namespace dual_proxy;  // NOLINT(google-build-using-namespace)
  FuzzInput input(data, size);
  const bool point_mass = input.Byte() % 2 == 1;
  Scenario scenario = MakeScenario(point_mass);
  const std::vector<Edit> edits = TakeEdits(&input);
  const std::vector<Edit> none;
  Editor counter(none, 0);
  scenario.VisitFields(&counter, true);
  Editor editor(edits, counter.visited());
  scenario.VisitFields(&editor, true);
  Check(std::move(scenario));
  return 0;
}
