// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/station/teleop_station.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

#include <drake/common/yaml/yaml_io.h>
#include <drake/systems/primitives/multiplexer.h>

#include "dual_proxy/baselines/position_force_haptic_side_system.h"
#include "dual_proxy/link/communication_channel_system.h"
#include "dual_proxy/perception/force_space_particle_filter_system.h"
#include "dual_proxy/proxy/workspace_map.h"
#include "dual_proxy/sides/haptic_side_system.h"
#include "dual_proxy/sides/robot_side_system.h"
#include "dual_proxy/simulation/simulated_haptic_device_system.h"
#include "dual_proxy/station/contact_truth_system.h"
#include "dual_proxy/station/sensor_reaction_system.h"

namespace dual_proxy {

namespace {

using drake::systems::DiagramBuilder;
using drake::systems::OutputPort;

// Adds the parts one after the other, as dual_proxy.station.Station does.
class StationBuilder {
 public:
  StationBuilder(DiagramBuilder<double>* builder, const Scenario& scenario)
      : builder_(*builder), scenario_(scenario) {}

  TeleopStation Build() {
    AddRobot();
    AddDevice();
    AddLink();
    AddLog();
    return {.scene = *scene_,
            .log = log_,
            .signals = std::move(signals_),
            .num_columns = logged_size_,
            .log_period = scenario_.control_period,
            .path = OperatorPath(path_),
            .scheme = scenario_.scheme};
  }

 private:
  template <typename S, typename... Args>
  S* Add(const std::string& name, Args&&... args) {
    return builder_.AddNamedSystem(
        name, std::make_unique<S>(std::forward<Args>(args)...));
  }

  // Logs a port whose columns have these names.
  void Log(const OutputPort<double>& port,
           const std::vector<SignalSlice>& layout) {
    for (const SignalSlice& signal : layout) {
      signals_.push_back({.name = signal.name,
                          .start = logged_size_ + signal.start,
                          .size = signal.size});
    }
    logged_size_ += port.size();
    logged_.push_back(&port);
  }

  void Log(const OutputPort<double>& port, const std::string& name) {
    Log(port, {{.name = name, .start = 0, .size = port.size()}});
  }

  // Logs a port of scalars.
  void LogScalars(const OutputPort<double>& port,
                  std::initializer_list<const char*> names) {
    std::vector<SignalSlice> layout;
    for (const char* name : names) {
      layout.push_back(
          {.name = name, .start = static_cast<int>(layout.size()), .size = 1});
    }
    Log(port, layout);
  }

  // The arm in its scene, the wrist sensor, the robot side, the filter.
  void AddRobot() {
    const PandaSceneParams& params = scenario_.scene;
    const bool angular = scenario_.has_angular_filter();
    const PandaModel model(params.tool_mass, params.gravity);
    const Vector7 q_start = model.SolveInverseKinematics(
        scenario_.map.p_cw, scenario_.map.R_cw, scenario_.controller.q_rest);
    scene_ = AddPandaScene(&builder_, params, q_start, false);
    auto* reaction =
        Add<SensorReactionSystem>("reaction", scene_->sensor_joint);
    robot_side_ = Add<RobotSideSystem>(
        "robot_side",
        RobotSideParams{
            .proxy = scenario_.robot_proxy,
            .controller = scenario_.controller,
            .sender = scenario_.link.sender,
            .filter_period = scenario_.filter.period,
            .angular_filter_period =
                angular ? scenario_.angular_filter.filter.period : 0},
        model.arm_params(), q_start,
        RobotSideSensor{.params = scenario_.sensor,
                        .p_SE = kSensorToToolPoint,
                        .seed = scenario_.CalcSeed(Stream::kSensor)});
    auto* truth =
        Add<ContactTruthSystem>("contact_truth", scene_->tool_body, angular);
    RobotSideSystem& side = *robot_side_;
    builder_.Connect(scene_->get_reaction_forces_output_port(),
                     reaction->get_reaction_forces_input_port());
    builder_.Connect(scene_->get_contact_results_output_port(),
                     truth->get_contact_results_input_port());
    builder_.Connect(scene_->get_state_output_port(),
                     side.get_robot_state_input_port());
    builder_.Connect(side.get_torque_output_port(),
                     scene_->get_actuation_input_port());
    builder_.Connect(reaction->get_reaction_output_port(),
                     side.get_reaction_input_port());
    Log(side.get_signals_output_port(), RobotSide::OutputLayout());
    LogScalars(side.get_sensor_counters_output_port(),
               {"sensor_bad_inputs", "sensor_tares_refused"});
    std::vector<SignalSlice> layout{
        {.name = "contact_force", .start = 0, .size = 3},
        {.name = "contact_normal", .start = 3, .size = 3},
        {.name = "contact_dimension", .start = 6, .size = 1}};
    if (angular) {
      layout.push_back(
          {.name = "contact_moment_dimension", .start = 7, .size = 1});
      layout.push_back(
          {.name = "contact_rotation_axis", .start = 8, .size = 3});
    }
    Log(truth->get_truth_output_port(), layout);
    builder_.ExportOutput(scene_->get_state_output_port(), "robot_state");
    builder_.ExportOutput(side.get_sensed_wrench_output_port(),
                          "sensed_wrench");
    builder_.ExportOutput(side.get_torque_output_port(), "torque");
    if (scenario_.scheme == Scheme::kDualProxy) AddFilter();
    if (angular) AddAngularFilter();
  }

  void AddFilter() {
    RobotSideSystem& side = *robot_side_;
    auto* filter = Add<ForceSpaceParticleFilterSystem>(
        "filter", scenario_.filter, scenario_.CalcSeed(Stream::kFilter));
    builder_.Connect(side.get_mean_sensed_force_output_port(),
                     filter->get_sensed_force_input_port());
    builder_.Connect(side.get_mean_velocity_output_port(),
                     filter->get_velocity_input_port());
    builder_.Connect(side.get_mean_motion_force_output_port(),
                     filter->get_motion_force_input_port());
    builder_.Connect(side.get_mean_contact_force_output_port(),
                     filter->get_contact_force_input_port());
    builder_.Connect(filter->get_force_selection_output_port(),
                     side.get_force_selection_input_port());
    Log(filter->get_dimension_output_port(), "dimension");
    Log(filter->get_force_direction_output_port(), "force_direction");
    LogScalars(filter->get_counters_output_port(),
               {"filter_bad_inputs", "filter_all_weights_zero"});
    builder_.ExportOutput(filter->get_dimension_output_port(), "dimension");
    builder_.ExportOutput(filter->get_force_selection_output_port(),
                          "force_selection");
  }

  // A second filter, for moments and rotations.
  void AddAngularFilter() {
    RobotSideSystem& side = *robot_side_;
    auto* filter = Add<ForceSpaceParticleFilterSystem>(
        "angular_filter", scenario_.angular_filter.filter,
        scenario_.CalcSeed(Stream::kAngularFilter));
    builder_.Connect(side.get_mean_sensed_moment_output_port(),
                     filter->get_sensed_force_input_port());
    builder_.Connect(side.get_mean_angular_velocity_output_port(),
                     filter->get_velocity_input_port());
    builder_.Connect(side.get_mean_motion_moment_output_port(),
                     filter->get_motion_force_input_port());
    builder_.Connect(side.get_mean_contact_moment_output_port(),
                     filter->get_contact_force_input_port());
    builder_.Connect(filter->get_force_selection_output_port(),
                     side.get_moment_selection_input_port());
    Log(filter->get_dimension_output_port(), "moment_dimension");
    Log(filter->get_force_selection_output_port(), "moment_selection");
    LogScalars(
        filter->get_counters_output_port(),
        {"angular_filter_bad_inputs", "angular_filter_all_weights_zero"});
    builder_.ExportOutput(filter->get_dimension_output_port(),
                          "moment_dimension");
    builder_.ExportOutput(filter->get_force_selection_output_port(),
                          "moment_selection");
  }

  // The device in the operator's hand, and the haptic side.
  void AddDevice() {
    const WorkspaceMap map(scenario_.map);
    path_ = scenario_.CalcOperatorPath();
    for (auto&& point : path_.points.colwise()) {
      point = map.HapticProxy(point, scenario_.map.R_cw).p;
    }
    path_.rotations = scenario_.map.R_DB * path_.rotations;
    const HapticSideParams params{.proxy = scenario_.haptic_proxy,
                                  .controller = scenario_.haptic_controller,
                                  .sender = scenario_.link.sender};
    if (scenario_.scheme == Scheme::kDualProxy) {
      haptic_side_ = Add<HapticSideSystem>(
          "haptic_side", params,
          HapticSideDevice{.params = scenario_.device, .path = path_});
      builder_.ExportOutput(haptic_side_->get_device_pose_output_port(),
                            "device_pose");
      builder_.ExportOutput(haptic_side_->get_device_wrench_output_port(),
                            "device_wrench");
      Log(haptic_side_->get_signals_output_port(), HapticSide::OutputLayout());
      Log(haptic_side_->get_device_bad_inputs_output_port(),
          "device_bad_inputs");
    } else {
      AddBaselineDevice(params);
    }
  }

  void AddBaselineDevice(const HapticSideParams& params) {
    haptic_side_ = Add<HapticSideSystem>("haptic_side", params);
    auto* device =
        Add<SimulatedHapticDeviceSystem>("device", path_, scenario_.device);
    builder_.Connect(device->get_device_pose_output_port(),
                     haptic_side_->get_device_pose_input_port());
    builder_.Connect(device->get_device_velocity_output_port(),
                     haptic_side_->get_device_velocity_input_port());
    position_force_ = Add<PositionForceHapticSideSystem>(
        "position_force", scenario_.position_force, scenario_.control_period);
    builder_.Connect(position_force_->get_device_wrench_output_port(),
                     device->get_device_wrench_input_port());
    builder_.ExportOutput(device->get_device_pose_output_port(), "device_pose");
    builder_.ExportOutput(position_force_->get_device_wrench_output_port(),
                          "device_wrench");
    // The baseline acts in place of the haptic side, of which only the device's
    // motion counts.
    Log(position_force_->get_device_wrench_output_port(),
        {{.name = "haptic_reference_force", .start = 0, .size = 3},
         {.name = "device_force", .start = 0, .size = 3}});
    Log(position_force_->get_link_status_output_port(),
        {{.name = "haptic_link_status", .start = 0, .size = 1},
         {.name = "haptic_link_age", .start = 1, .size = 1}});
    LogScalars(
        position_force_->get_link_counters_output_port(),
        {"haptic_link_dropped", "haptic_link_bad_messages", "haptic_link_gaps",
         "haptic_link_spikes", "haptic_link_losses"});
    Log(device->get_bad_inputs_output_port(), "device_bad_inputs");
    std::vector<SignalSlice> motion;
    for (const SignalSlice& signal : HapticSide::OutputLayout()) {
      if (!IsLogged(signal.name)) motion.push_back(signal);
    }
    Log(haptic_side_->get_signals_output_port(), motion);
  }

  bool IsLogged(std::string_view name) const {
    for (const SignalSlice& signal : signals_) {
      if (signal.name == name) return true;
    }
    return false;
  }

  // Both directions of the link: all that the two sides share.
  void AddLink() {
    using Poses = CommunicationChannelSystem<PoseMessage>;
    using Forces = CommunicationChannelSystem<ForceMessage>;
    const LinkParams& link = scenario_.link;
    const double step = scenario_.control_period;
    auto* to_robot = Add<Poses>("to_robot", link.channel,
                                scenario_.CalcSeed(Stream::kToRobot),
                                link.rate(), step, true);
    builder_.Connect(haptic_side_->get_message_output_port(),
                     to_robot->get_message_input_port());
    builder_.Connect(to_robot->get_message_output_port(),
                     robot_side_->get_haptic_message_input_port());
    LogScalars(to_robot->get_counters_output_port(),
               {"to_robot_lost", "to_robot_overflow", "to_robot_refused"});
    if (scenario_.scheme == Scheme::kDualProxy) {
      auto* to_device = Add<Poses>("to_device", link.channel,
                                   scenario_.CalcSeed(Stream::kToDevice),
                                   link.rate(), step, true);
      builder_.Connect(robot_side_->get_message_output_port(),
                       to_device->get_message_input_port());
      builder_.Connect(to_device->get_message_output_port(),
                       haptic_side_->get_robot_message_input_port());
      LogToDevice(to_device->get_counters_output_port());
    } else {
      auto* to_device = Add<Forces>("to_device", link.channel,
                                    scenario_.CalcSeed(Stream::kToDevice),
                                    link.rate(), step, true);
      builder_.Connect(robot_side_->get_force_message_output_port(),
                       to_device->get_message_input_port());
      builder_.Connect(to_device->get_message_output_port(),
                       position_force_->get_force_message_input_port());
      LogToDevice(to_device->get_counters_output_port());
    }
  }

  void LogToDevice(const OutputPort<double>& counters) {
    LogScalars(counters,
               {"to_device_lost", "to_device_overflow", "to_device_refused"});
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
    AddColumns("hand_position", 3);
    if (scenario_.scheme != Scheme::kDualProxy) {
      // Without a filter there is no estimate, ever.
      AddColumns("dimension", 1);
      AddColumns("force_direction", 3);
      AddColumns("filter_bad_inputs", 1);
      AddColumns("filter_all_weights_zero", 1);
    }
  }

  void AddColumns(const std::string& name, int size) {
    signals_.push_back({.name = name, .start = logged_size_, .size = size});
    logged_size_ += size;
  }

  DiagramBuilder<double>& builder_;
  const Scenario& scenario_;
  std::optional<PandaScene> scene_;
  OperatorPathParams path_;
  RobotSideSystem* robot_side_{};
  HapticSideSystem* haptic_side_{};
  PositionForceHapticSideSystem* position_force_{};
  std::vector<const OutputPort<double>*> logged_;
  std::vector<SignalSlice> signals_;
  int logged_size_{0};
  drake::systems::VectorLogSink<double>* log_{};
};

// Appends the samples of the sink, with what follows from the time.
void AppendLog(const TeleopStation& station,
               const drake::systems::VectorLog<double>& log,
               RunLogStore* store) {
  const int count = log.num_samples();
  const auto size = static_cast<int>(log.get_input_size());
  Eigen::MatrixXd samples = Eigen::MatrixXd::Zero(station.num_columns, count);
  samples.topRows(size) = log.data();
  for (int i = 0; i < count; ++i) {
    samples.col(i).segment<3>(size) =
        station.path.Calc(log.sample_times()[i]).position;
  }
  store->Append(log.sample_times(), samples);
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
                               const Scenario& scenario) {
  Scenario checked = scenario;
  checked.Validate();
  return StationBuilder(builder, checked).Build();
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
                       .has_filter = scenario.scheme == Scheme::kDualProxy,
                       .control_period = scenario.controller.period};
  if (!scenario.operator_params.recording.empty()) {
    params.recording_scale = scenario.CalcRecordedMotion().scale;
  }
  return params;
}

}  // namespace dual_proxy
