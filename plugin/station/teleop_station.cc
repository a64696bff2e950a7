// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/station/teleop_station.h"

#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include <drake/common/yaml/yaml_io.h>
#include <drake/systems/primitives/multiplexer.h>

#include "dual_proxy/experiment/teleop_loop_params.h"
#include "dual_proxy/faces/systems.h"
#include "dual_proxy/loop/loop_signals.h"
#include "dual_proxy/station/contact_truth_system.h"

namespace dual_proxy {

namespace {

using Vector14 = Eigen::Matrix<double, 14, 1>;

using drake::systems::DiagramBuilder;
using drake::systems::OutputPort;

// Adds the parts one after the other, as dual_proxy.station.Station does.
class StationBuilder {
 public:
  StationBuilder(DiagramBuilder<double>* builder, const Scenario& scenario)
      : builder_(*builder), scenario_(scenario) {}

  TeleopStation Build(Wiring wiring) {
    AddRobot();
    if (wiring == Wiring::kFused) {
      AddLoop();
    } else {
      AddSides();
    }
    AddLog();
    return {.scene = *scene_,
            .log = log_,
            .signals = std::move(signals_),
            .num_columns = logged_size_,
            .log_period = scenario_.control_period,
            .path = OperatorPath(CalcHandlePath(scenario_))};
  }

 private:
  template <typename S, typename... Args>
  S* Add(const std::string& name, Args&&... args) {
    return builder_.AddNamedSystem(
        name, std::make_unique<S>(std::forward<Args>(args)...));
  }

  // Logs a port whose columns have these names.
  void Log(const OutputPort<double>& port, std::vector<SignalSlice> layout) {
    AddColumns(std::move(layout));
    logged_.push_back(&port);
  }

  void AddColumns(std::vector<SignalSlice> layout) {
    const int begin = logged_size_;
    for (SignalSlice& signal : layout) {
      signal.start += begin;
      logged_size_ = signal.start + signal.size;
      signals_.push_back(std::move(signal));
    }
  }

  void Export(const drake::systems::System<double>& system,
              std::initializer_list<const char*> names) {
    for (const char* name : names) {
      builder_.ExportOutput(system.GetOutputPort(name), name);
    }
  }

  // What has found the directions of contact, if anything looks for them.
  void ExportSelections(const drake::systems::System<double>& system) {
    if (!UsesSelections(scenario_.scheme)) return;
    Export(system, {"force_selection", "dimension"});
    if (scenario_.has_angular_filter()) {
      Export(system, {"moment_selection", "moment_dimension"});
    }
  }

  // The arm in its scene, and what its tool really touches.
  void AddRobot() {
    const SceneParams& params = scenario_.scene;
    const bool angular = scenario_.has_angular_filter();
    const PandaModel model(params.tool_mass, params.gravity);
    arm_ = model.arm_params();
    q_start_ = model.SolveInverseKinematics(
        scenario_.map.p_cw, scenario_.map.R_cw, scenario_.controller.q_rest);
    try {
      scene_ = AddPandaScene(&builder_, params, q_start_, false);
    } catch (const ScenarioError& error) {
      throw ScenarioError(scenario_.name + "." + error.what());
    }
    auto* truth =
        Add<ContactTruthSystem>("contact_truth", scene_->tool_body, angular);
    builder_.Connect(scene_->get_contact_results_output_port(),
                     truth->get_contact_results_input_port());
    Log(truth->get_truth_output_port(),
        MakeLayout(VisitContactTruth, Vector14(Vector14::Zero()), angular));
    builder_.ExportOutput(scene_->get_state_output_port(), "robot_state");
  }

  // Everything else, as one system.
  void AddLoop() {
    auto* loop = Add<TeleopLoopSystem>(
        "loop", MakeTeleopLoopParams<SerialArm<7>>(scenario_, arm_),
        scene_->sensor_joint, q_start_);
    builder_.Connect(scene_->get_state_output_port(),
                     loop->GetInputPort("robot_state"));
    builder_.Connect(scene_->get_reaction_forces_output_port(),
                     loop->GetInputPort("reaction_forces"));
    builder_.Connect(loop->GetOutputPort("torque"),
                     scene_->get_actuation_input_port());
    Log(loop->GetOutputPort("signals"), loop->block().layout());
    Export(*loop, {"sensed_wrench", "torque", "device_pose", "device_wrench"});
    ExportSelections(*loop);
  }

  // The same in the systems that people's own diagrams are made of.
  void AddSides() {
    auto* reaction =
        Add<SensorReactionSystem>("reaction", scene_->sensor_joint);
    auto* robot_side = Add<RobotSideSystem>(
        "robot_side", MakeRobotSideParams<SerialArm<7>>(scenario_), arm_,
        q_start_,
        RobotSideSensor{.params = scenario_.sensor,
                        .p_SE = kSensorToToolPoint,
                        .seed = scenario_.CalcSeed(Stream::kSensor)},
        RobotSideSeeds{
            .filter = scenario_.CalcSeed(Stream::kFilter),
            .angular_filter = scenario_.CalcSeed(Stream::kAngularFilter)});
    auto* haptic_side = Add<HapticSideSystem>(
        "haptic_side", MakeHapticSideParams(scenario_),
        HapticSideDevice{.params = scenario_.device,
                         .path = CalcHandlePath(scenario_)});
    builder_.Connect(scene_->get_state_output_port(),
                     robot_side->GetInputPort("robot_state"));
    builder_.Connect(scene_->get_reaction_forces_output_port(),
                     reaction->GetInputPort("reaction_forces"));
    builder_.Connect(reaction->GetOutputPort("reaction"),
                     robot_side->GetInputPort("reaction"));
    builder_.Connect(robot_side->GetOutputPort("torque"),
                     scene_->get_actuation_input_port());
    Log(haptic_side->GetOutputPort("signals"), haptic_side->block().layout());
    Log(haptic_side->GetOutputPort("device_bad_inputs"),
        MakeLayout(VisitDevice, SimulatedHapticDeviceState()));
    Log(robot_side->GetOutputPort("signals"), robot_side->block().layout());
    Log(robot_side->GetOutputPort("sensor_counters"),
        MakeLayout(VisitSensor, ForceTorqueSensorState()));
    AddChannel("to_robot", Direction::kToRobot, Stream::kToRobot,
               ToRobotTag(scenario_.scheme),
               haptic_side->GetOutputPort("message"),
               robot_side->GetInputPort("haptic_message"));
    AddChannel("to_device", Direction::kToDevice, Stream::kToDevice,
               ToDeviceTag(scenario_.scheme),
               robot_side->GetOutputPort("message"),
               haptic_side->GetInputPort("robot_message"));
    Export(*robot_side, {"sensed_wrench", "torque"});
    Export(*haptic_side, {"device_pose", "device_wrench"});
    ExportSelections(*robot_side);
  }

  void AddChannel(const std::string& name, Direction direction, Stream seed,
                  MessageTag tag, const OutputPort<double>& from,
                  const drake::systems::InputPort<double>& to) {
    const LinkParams& link = scenario_.link;
    auto* channel = Add<CommunicationChannelSystem>(
        name, link.channel, scenario_.CalcSeed(seed), link.rate(),
        scenario_.control_period, true, tag);
    builder_.Connect(from, channel->GetInputPort("message"));
    builder_.Connect(channel->GetOutputPort("message"), to);
    Log(channel->GetOutputPort("counters"),
        MakeLayout(VisitChannel, direction,
                   CommunicationChannel(link.channel).MakeState(0)));
  }

  // One sink for all that is logged: every event of Drake's has its price.
  void AddLog() {
    std::vector<int> sizes;
    for (const auto* port : logged_) sizes.push_back(port->size());
    auto* everything =
        Add<drake::systems::Multiplexer<double>>("everything", sizes);
    for (int i = 0; i < static_cast<int>(logged_.size()); ++i) {
      builder_.Connect(*logged_[i], everything->get_input_port(i));
    }
    log_ = LogVectorOutput(everything->get_output_port(0), &builder_,
                           scenario_.control_period);
    // What follows from the time alone is added when the log is read.
    AddColumns(MakeLayout(VisitHand, Eigen::Vector3d(Eigen::Vector3d::Zero())));
  }

  DiagramBuilder<double>& builder_;
  const Scenario& scenario_;
  ArmModelParams<7> arm_;
  Vector7 q_start_;
  std::optional<PandaScene> scene_;
  std::vector<const OutputPort<double>*> logged_;
  std::vector<SignalSlice> signals_;
  int logged_size_{0};
  drake::systems::VectorLogSink<double>* log_{};
};

// Appends the samples of the sink, with what follows from the time.
void AppendLog(const TeleopStation& station,
               const drake::systems::VectorLog<double>& log,
               RunLogStore* store) {
  const auto size = static_cast<int>(log.get_input_size());
  const auto log_times = log.sample_times();
  const auto log_samples = log.data();
  Eigen::VectorXd times(log_times.size());
  Eigen::MatrixXd samples =
      Eigen::MatrixXd::Zero(station.num_columns, times.size());
  Eigen::Index count = 0;
  for (Eigen::Index i = 0; i < times.size(); ++i) {
    // A simulator that goes on from a copied context notes its time once more.
    if (i + 1 < times.size() && log_times(i + 1) == log_times(i)) continue;
    times(count) = log_times(i);
    samples.col(count).head(size) = log_samples.col(i);
    samples.col(count).segment<3>(size) =
        station.path.Calc(log_times(i)).position;
    ++count;
  }
  store->Append(times.head(count), samples.leftCols(count));
}

}  // namespace

Scenario LoadScenario(const std::string& path) {
  // What is not written keeps its default.
  drake::yaml::LoadYamlOptions options;
  options.allow_cpp_with_no_yaml = true;
  auto scenarios = drake::yaml::LoadYamlFile<std::map<std::string, Scenario>>(
      path, std::nullopt, std::nullopt, options);
  if (scenarios.size() != 1) {
    throw ScenarioError(path +
                        ": expected one top-level key, the scenario's name");
  }
  auto& [name, scenario] = *scenarios.begin();
  scenario.name = name;
  scenario.ResolvePaths(std::filesystem::path(path).parent_path());
  scenario.Validate();
  return std::move(scenario);
}

TeleopStation AddTeleopStation(DiagramBuilder<double>* builder,
                               const Scenario& scenario, Wiring wiring) {
  Scenario checked = scenario;
  checked.Validate();
  checked.CheckForDrake(wiring == Wiring::kFused);
  return StationBuilder(builder, checked).Build(wiring);
}

std::shared_ptr<RunLogStore> MakeRunLogStore(const TeleopStation& station,
                                             double duration) {
  return std::make_shared<RunLogStore>(
      station.num_columns,
      static_cast<Eigen::Index>(std::ceil(duration / station.log_period)) + 1);
}

void MoveLog(const TeleopStation& station,
             drake::systems::Context<double>* context, RunLogStore* store) {
  auto& log = station.log->FindMutableLog(context);
  try {
    AppendLog(station, log, store);
  } catch (...) {
    log.Clear();
    throw;
  }
  log.Clear();
}

RunLog MakeRunLog(const TeleopStation& station,
                  const drake::systems::Context<double>& context) {
  const auto& log = station.log->FindLog(context);
  const auto store =
      std::make_shared<RunLogStore>(station.num_columns, log.num_samples());
  AppendLog(station, log, store.get());
  return MakeRunLog(store, station.signals);
}

MetricsParams MakeMetricsParams(const Scenario& scenario) {
  MetricsParams params{.map = scenario.map,
                       .delay = scenario.link.delay(),
                       .control_period = scenario.controller.period};
  if (!scenario.operator_params.recording.empty()) {
    params.recording_scale = scenario.CalcRecordedMotion().scale;
  }
  return params;
}

}  // namespace dual_proxy
