// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <drake/common/value.h>
#include <drake/systems/analysis/simulator.h>
#include <drake/systems/framework/system.h>
#include <Eigen/Core>

#include "dual_proxy/control/arm_model.h"
#include "dual_proxy/link/communication_channel.h"
#include "dual_proxy/perception/contact_history.h"
#include "dual_proxy/perception/force_space_particle_filter.h"
#include "dual_proxy/proxy/workspace_map.h"
#include "dual_proxy/sides/robot_side_system.h"
#include "dual_proxy/simulation/force_torque_sensor.h"
#include "dual_proxy/simulation/haptic_device.h"
#include "dual_proxy/simulation/operator.h"

/** @file
The C++ faces under test: the table of ports that they share with the pydrake
faces, what makes them, and the recorded traces. */

namespace dual_proxy {

/** A port in ports.yaml, where the fields are explained. */
struct PortRow {
  std::string name;
  int size{0};       ///< 0: not a vector.
  std::string type;  ///< Empty: a vector.
  bool is_public{false};
  bool optional{false};
  bool feedthrough{false};
  bool acting{false};

  /** Numbers that a value of the port has in a trace. */
  int Width() const;
};

/** A face in ports.yaml. */
struct FaceRow {
  std::string class_name;  ///< Of the pydrake face.
  std::vector<PortRow> inputs;
  std::vector<PortRow> outputs;
};

/** By name. @throws std::exception if the file is not as it should be. */
const std::map<std::string, FaceRow>& FaceTable();

/** What is in params.yaml and arm.yaml. */
struct FaceParams {
  WorkspaceMapParams map;
  CommunicationChannelParams channel;
  std::uint64_t channel_seed{};
  ForceSpaceParticleFilterParams filter;
  std::uint64_t filter_seed{};
  ContactHistoryParams history;
  double window{};
  OperatorPathParams path;
  SimulatedHapticDeviceParams device;
  ForceTorqueSensorParams sensor;
  std::uint64_t sensor_seed{};
  Eigen::Vector3d p_SE{Eigen::Vector3d::Zero()};
  Vector7 q_start{Vector7::Zero()};
  ArmModelParams<7> arm;

  /** The sensor as a RobotSideSystem takes it. */
  RobotSideSensor robot_side_sensor() const {
    return {.params = sensor, .p_SE = p_SE, .seed = sensor_seed};
  }
  /** Parameters with the map. */
  RobotSideProxyParams robot_side_proxy() const;
  RobotSideParams<SerialArm<7>> robot_side(bool angular_filter = false) const;
};

const FaceParams& GetFaceParams();

/** The face of that name in the table. */
std::unique_ptr<drake::systems::System<double>> MakeFace(
    const std::string& name);

/** One vector after the other. */
Eigen::VectorXd Concatenate(const std::vector<Eigen::VectorXd>& parts);

/** What a trace is flattened to and from: matrices row by row, of a Matrix3X
the first column, zero if there is none. */
Eigen::VectorXd Flatten(const Eigen::Ref<const Eigen::MatrixXd>& matrix);
Eigen::VectorXd Flatten(const Pose& pose);
Eigen::VectorXd Flatten(const PoseMessage& message);
Eigen::VectorXd Flatten(const drake::AbstractValue& value);

/** What was in a pose's 12 numbers, and in a PoseMessage's 32. */
Pose PoseFromFlat(const Eigen::Ref<const Eigen::VectorXd>& numbers);
PoseMessage PoseMessageFromFlat(const Eigen::VectorXd& numbers);

/** Values of a face's input ports, flat, by name. */
using FlatInputs = std::map<std::string, Eigen::VectorXd>;

struct TraceRow {
  double time{0};
  FlatInputs inputs;
  Eigen::VectorXd outputs;  ///< Of all output ports, in a row.
};

/** The recorded trace of a face. Its first row is of the start, before any
step; record_traces.py says how the others came about.
@throws std::exception if it does not have the columns that the table says. */
std::vector<TraceRow> LoadTrace(const std::string& name);

/** The same with its bad inputs replaced by those of the row before. */
std::vector<TraceRow> LoadTraceWithoutBadInputs(const std::string& name);

/** A face, alone, with its simulator. */
class FacePlayer {
 public:
  explicit FacePlayer(const std::string& name);
  /** A system that has the input ports of the face `name`. */
  FacePlayer(const std::string& name,
             std::unique_ptr<drake::systems::System<double>> system);
  /** The same face, from `context` on. */
  FacePlayer(const FacePlayer& other,
             std::unique_ptr<drake::systems::Context<double>> context);

  const drake::systems::System<double>& face() const { return *face_; }
  const drake::systems::Context<double>& context() const {
    return simulator_->get_context();
  }
  drake::systems::Context<double>& mutable_context() {
    return simulator_->get_mutable_context();
  }
  drake::systems::Simulator<double>& simulator() { return *simulator_; }

  /** Fixes the values of these input ports. */
  void Fix(const FlatInputs& inputs);

  /** Goes to that time and takes the step that is due there. */
  void StepTo(double time);

  /** All outputs, in a row. */
  Eigen::VectorXd Outputs() const;

  /** Plays the rows from index `begin` to before `end` and returns the outputs
  of each. Row 0 is that of the start. */
  std::vector<Eigen::VectorXd> Play(const std::vector<TraceRow>& rows,
                                    std::size_t begin, std::size_t end);

 private:
  const FaceRow* row_;
  std::shared_ptr<const drake::systems::System<double>> face_;
  std::unique_ptr<drake::systems::Simulator<double>> simulator_;
};

}  // namespace dual_proxy
