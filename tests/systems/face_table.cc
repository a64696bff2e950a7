// SPDX-License-Identifier: BSD-3-Clause
#include "face_table.h"

#include <cstdlib>
#include <fstream>
#include <functional>
#include <sstream>
#include <stdexcept>
#include <utility>

#include <drake/common/yaml/yaml_io.h>

#include "dual_proxy/common/serialize.h"
#include "dual_proxy/common/window_mean_system.h"
#include "dual_proxy/control/arm_kinematics_system.h"
#include "dual_proxy/control/haptic_controller_system.h"
#include "dual_proxy/control/operational_space_controller_system.h"
#include "dual_proxy/link/communication_channel_system.h"
#include "dual_proxy/link/pose_sender_system.h"
#include "dual_proxy/perception/contact_history_system.h"
#include "dual_proxy/perception/force_space_particle_filter_system.h"
#include "dual_proxy/proxy/haptic_side_proxy_system.h"
#include "dual_proxy/proxy/robot_side_proxy_system.h"
#include "dual_proxy/sides/haptic_side_system.h"
#include "dual_proxy/simulation/force_torque_sensor_system.h"
#include "dual_proxy/simulation/simulated_haptic_device_system.h"

namespace dual_proxy {

using drake::AbstractValue;
using drake::math::RigidTransformd;
using drake::math::RotationMatrixd;
using drake::systems::System;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// How Drake reads the YAML files, beside the params that say it themselves.

template <typename Archive>
void Serialize(Archive* a, PortRow* row) {
  a->Visit(NameValue("name", &row->name));
  a->Visit(NameValue("size", &row->size));
  a->Visit(NameValue("type", &row->type));
  a->Visit(NameValue("public", &row->is_public));
  a->Visit(NameValue("optional", &row->optional));
  a->Visit(NameValue("feedthrough", &row->feedthrough));
  a->Visit(NameValue("acting", &row->acting));
}

template <typename Archive>
void Serialize(Archive* a, FaceRow* row) {
  bool simulated{};
  bool angular{};
  a->Visit(NameValue("class", &row->class_name));
  a->Visit(NameValue("simulated", &simulated));
  a->Visit(NameValue("angular", &angular));
  a->Visit(NameValue("inputs", &row->inputs));
  a->Visit(NameValue("outputs", &row->outputs));
}

template <typename Archive>
void Serialize(Archive* a, OperatorPathParams* params) {
  a->Visit(NameValue("times", &params->times));
  a->Visit(NameValue("points", &params->points));
  a->Visit(NameValue("rotations", &params->rotations));
}

template <typename Archive>
void Serialize(Archive* a, ArmModelParams<7>* params) {
  a->Visit(NameValue("p_PJ", &params->p_PJ));
  a->Visit(NameValue("R_PJ", &params->R_PJ));
  a->Visit(NameValue("mass", &params->mass));
  a->Visit(NameValue("com", &params->com));
  a->Visit(NameValue("inertia", &params->inertia));
  a->Visit(NameValue("p_LE", &params->p_LE));
  a->Visit(NameValue("R_LE", &params->R_LE));
  a->Visit(NameValue("gravity", &params->gravity));
}

template <typename Archive>
void Serialize(Archive* a, FaceParams* params) {
  a->Visit(NameValue("map", &params->map));
  a->Visit(NameValue("channel", &params->channel));
  a->Visit(NameValue("channel_seed", &params->channel_seed));
  a->Visit(NameValue("filter", &params->filter));
  a->Visit(NameValue("filter_seed", &params->filter_seed));
  a->Visit(NameValue("history", &params->history));
  a->Visit(NameValue("window", &params->window));
  a->Visit(NameValue("path", &params->path));
  a->Visit(NameValue("device", &params->device));
  a->Visit(NameValue("sensor", &params->sensor));
  a->Visit(NameValue("sensor_seed", &params->sensor_seed));
  a->Visit(NameValue("p_SE", &params->p_SE));
  a->Visit(NameValue("q_start", &params->q_start));
}

namespace {

using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

const std::string kFolder = TEST_DATA;

// What does not stand in the file has its default.
template <typename T>
T Load(const std::string& file) {
  return drake::yaml::LoadYamlFile<T>(kFolder + "/" + file, {}, {},
                                      {{.allow_cpp_with_no_yaml = true}});
}

// Numbers of a value in a trace, where a Matrix3X has one column.
const std::map<std::string, int>& TypeWidths() {
  static const std::map<std::string, int> widths{
      {"PoseMessage", 32}, {"RigidTransform", 12}, {"Matrix3X", 3}};
  return widths;
}

std::vector<std::string> Split(const std::string& line) {
  std::vector<std::string> cells;
  std::stringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) {
    cells.push_back(cell);
  }
  return cells;
}

// The columns of a trace, as record_traces.py names them.
std::vector<std::string> ExpectedColumns(const FaceRow& row) {
  std::vector<std::string> columns{"time"};
  const auto add = [&columns](const std::string& direction,
                              const std::vector<PortRow>& ports) {
    for (const PortRow& port : ports) {
      const std::string name = direction + "." + port.name;
      if (port.Width() == 1) columns.push_back(name);
      for (int i = 0; port.Width() > 1 && i < port.Width(); ++i) {
        columns.push_back(name + "." + std::to_string(i));
      }
    }
  };
  add("in", row.inputs);
  add("out", row.outputs);
  return columns;
}

Matrix3d MatrixFromFlat(const Eigen::Ref<const VectorXd>& rows) {
  return Eigen::Map<const RowMajor3>(rows.data());
}

}  // namespace

int PortRow::Width() const {
  return type.empty() ? size : TypeWidths().at(type);
}

const std::map<std::string, FaceRow>& FaceTable() {
  static const std::map<std::string, FaceRow> table = [] {
    auto rows = Load<std::map<std::string, FaceRow>>("ports.yaml");
    for (auto& [name, row] : rows) {
      if (row.class_name.empty()) row.class_name = name;
    }
    return rows;
  }();
  return table;
}

RobotSideProxyParams FaceParams::robot_side_proxy() const {
  RobotSideProxyParams params;
  params.map = map;
  return params;
}

RobotSideParams<SerialArm<7>> FaceParams::robot_side(
    bool angular_filter) const {
  RobotSideParams<SerialArm<7>> params;
  params.proxy = robot_side_proxy();
  AngularFilterParams& angular = params.perception.angular_filter;
  angular.enabled = angular_filter;
  angular.filter.period = filter.period;
  return params;
}

const FaceParams& GetFaceParams() {
  static const FaceParams params = [] {
    auto result = Load<FaceParams>("params.yaml");
    result.arm = Load<ArmModelParams<7>>("arm.yaml");
    return result;
  }();
  return params;
}

std::unique_ptr<System<double>> MakeFace(const std::string& name) {
  using Maker = std::function<std::unique_ptr<System<double>>()>;
  const FaceParams& p = GetFaceParams();
  static const std::map<std::string, Maker> makers{
      {"RobotSideProxy",
       [&p] {
         return std::make_unique<RobotSideProxySystem>(p.robot_side_proxy());
       }},
      {"HapticSideProxy",
       [] { return std::make_unique<HapticSideProxySystem>(); }},
      {"CommunicationChannel",
       [&p] {
         return std::make_unique<CommunicationChannelSystem>(p.channel,
                                                             p.channel_seed);
       }},
      {"ForceSpaceParticleFilter",
       [&p] {
         return std::make_unique<ForceSpaceParticleFilterSystem>(p.filter,
                                                                 p.filter_seed);
       }},
      {"ContactHistory",
       [&p] { return std::make_unique<ContactHistorySystem>(p.history); }},
      {"OperationalSpaceController",
       [&p] {
         return std::make_unique<OperationalSpaceControllerSystem>(
             OperationalSpaceControllerParams<7>{}, p.arm);
       }},
      {"HapticController",
       [] { return std::make_unique<HapticControllerSystem>(); }},
      {"PoseSender", [] { return std::make_unique<PoseSenderSystem>(); }},
      {"WindowMean",
       [&p] { return std::make_unique<WindowMeanSystem>(p.window); }},
      {"ArmKinematics",
       [&p] { return std::make_unique<ArmKinematicsSystem>(p.arm); }},
      {"ForceTorqueSensor",
       [&p] {
         return std::make_unique<ForceTorqueSensorSystem>(p.sensor, p.p_SE,
                                                          p.sensor_seed);
       }},
      {"SimulatedHapticDevice",
       [&p] {
         return std::make_unique<SimulatedHapticDeviceSystem>(p.path, p.device);
       }},
      {"RobotSide",
       [&p] {
         return std::make_unique<RobotSideSystem>(p.robot_side(), p.arm,
                                                  p.q_start);
       }},
      {"RobotSideWithSensor",
       [&p] {
         return std::make_unique<RobotSideSystem>(
             p.robot_side(), p.arm, p.q_start, p.robot_side_sensor());
       }},
      {"RobotSideWithAngularFilter",
       [&p] {
         return std::make_unique<RobotSideSystem>(p.robot_side(true), p.arm,
                                                  p.q_start);
       }},
      {"HapticSide", [] { return std::make_unique<HapticSideSystem>(); }},
      {"HapticSideWithDevice", [&p] {
         return std::make_unique<HapticSideSystem>(
             HapticSideParams{},
             HapticSideDevice{.params = p.device, .path = p.path});
       }}};
  return makers.at(name)();
}

VectorXd Concatenate(const std::vector<VectorXd>& parts) {
  Eigen::Index size = 0;
  for (const VectorXd& part : parts) size += part.size();
  VectorXd whole(size);
  Eigen::Index start = 0;
  for (const VectorXd& part : parts) {
    whole.segment(start, part.size()) = part;
    start += part.size();
  }
  return whole;
}

VectorXd Flatten(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  VectorXd flat(matrix.size());
  WriteRows(matrix, flat);
  return flat;
}

VectorXd Flatten(const Pose& pose) {
  return Concatenate({pose.p, Flatten(pose.R)});
}

VectorXd Flatten(const PoseMessage& message) {
  return Concatenate({Eigen::Vector2d(static_cast<double>(message.sequence),
                                      message.send_time),
                      Flatten(message.pose), Flatten(message.force_selection),
                      Flatten(message.moment_selection)});
}

VectorXd Flatten(const AbstractValue& value) {
  if (const auto* vector =
          value.maybe_get_value<drake::systems::BasicVector<double>>()) {
    return vector->value();
  }
  if (const auto* message = value.maybe_get_value<Message>()) {
    return Flatten(FromMessage<PoseMessage>(*message));
  }
  if (const auto* normals = value.maybe_get_value<Matrix3Xd>()) {
    return normals->cols() > 0 ? Vector3d(normals->col(0)) : Vector3d::Zero();
  }
  return Flatten(ToPose(value.get_value<RigidTransformd>()));
}

Pose PoseFromFlat(const Eigen::Ref<const VectorXd>& numbers) {
  return {.p = numbers.head<3>(), .R = MatrixFromFlat(numbers.segment<9>(3))};
}

PoseMessage PoseMessageFromFlat(const VectorXd& numbers) {
  return {.sequence = static_cast<std::int64_t>(numbers[0]),
          .send_time = numbers[1],
          .pose = PoseFromFlat(numbers.segment<12>(2)),
          .force_selection = MatrixFromFlat(numbers.segment<9>(14)),
          .moment_selection = MatrixFromFlat(numbers.segment<9>(23))};
}

std::vector<TraceRow> LoadTrace(const std::string& name) {
  const FaceRow& face = FaceTable().at(name);
  const std::string path = kFolder + "/traces/" + name + ".csv";
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  const std::vector<std::string> columns = ExpectedColumns(face);
  if (Split(line) != columns) {
    throw std::runtime_error(path + ": columns are not those of ports.yaml");
  }
  std::vector<TraceRow> rows;
  while (std::getline(file, line)) {
    std::vector<double> numbers;
    for (const std::string& cell : Split(line)) {
      numbers.push_back(std::strtod(cell.c_str(), nullptr));
    }
    if (numbers.size() != columns.size()) {
      throw std::runtime_error(path + ": a row has the wrong length");
    }
    TraceRow row{.time = numbers[0], .inputs = {}, .outputs = {}};
    const double* next = &numbers[1];
    for (const PortRow& port : face.inputs) {
      row.inputs[port.name] = Eigen::Map<const VectorXd>(next, port.Width());
      next += port.Width();
    }
    row.outputs = Eigen::Map<const VectorXd>(next, &numbers.back() + 1 - next);
    rows.push_back(std::move(row));
  }
  return rows;
}

std::vector<TraceRow> LoadTraceWithoutBadInputs(const std::string& name) {
  std::vector<TraceRow> rows = LoadTrace(name);
  for (std::size_t i = 1; i < rows.size(); ++i) {
    for (auto& [port, value] : rows[i].inputs) {
      if (!value.allFinite()) value = rows[i - 1].inputs.at(port);
    }
  }
  return rows;
}

FacePlayer::FacePlayer(const std::string& name)
    : FacePlayer(name, MakeFace(name)) {}

FacePlayer::FacePlayer(const std::string& name,
                       std::unique_ptr<System<double>> system)
    : row_(&FaceTable().at(name)),
      face_(std::move(system)),
      simulator_(std::make_unique<drake::systems::Simulator<double>>(*face_)) {}

FacePlayer::FacePlayer(const FacePlayer& other,
                       std::unique_ptr<drake::systems::Context<double>> context)
    : row_(other.row_),
      face_(other.face_),
      simulator_(std::make_unique<drake::systems::Simulator<double>>(
          *face_, std::move(context))) {}

void FacePlayer::Fix(const FlatInputs& inputs) {
  for (const PortRow& row : row_->inputs) {
    const auto found = inputs.find(row.name);
    if (found == inputs.end()) continue;
    const VectorXd& value = found->second;
    const auto& port = face_->GetInputPort(row.name);
    drake::systems::Context<double>* context = &mutable_context();
    if (row.type.empty()) {
      port.FixValue(context, value);
    } else if (row.type == "PoseMessage") {
      port.FixValue(context, ToMessage(PoseMessageFromFlat(value)));
    } else if (row.type == "RigidTransform") {
      const Pose X = PoseFromFlat(value);
      port.FixValue(context,
                    RigidTransformd(RotationMatrixd::MakeUnchecked(X.R), X.p));
    } else {
      port.FixValue(context, drake::Value<Matrix3Xd>(
                                 Eigen::Map<const Vector3d>(value.data())));
    }
  }
}

void FacePlayer::StepTo(double time) {
  simulator_->AdvanceTo(time);
  simulator_->AdvancePendingEvents();
}

VectorXd FacePlayer::Outputs() const {
  std::vector<VectorXd> values;
  for (int i = 0; i < face_->num_output_ports(); ++i) {
    values.push_back(
        Flatten(face_->get_output_port(i).Eval<AbstractValue>(context())));
  }
  return Concatenate(values);
}

std::vector<VectorXd> FacePlayer::Play(const std::vector<TraceRow>& rows,
                                       std::size_t begin, std::size_t end) {
  std::vector<VectorXd> outputs;
  for (std::size_t i = begin; i < end; ++i) {
    Fix(rows[i].inputs);
    if (i > 0) StepTo(rows[i].time);
    outputs.push_back(Outputs());
  }
  return outputs;
}

}  // namespace dual_proxy
