// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "dual_proxy/common/serialize.h"
#include "dual_proxy/control/robot.h"
#include "dual_proxy/link/communication_channel.h"
#include "dual_proxy/sides/haptic_side.h"
#include "dual_proxy/sides/robot_side.h"
#include "dual_proxy/simulation/force_torque_sensor.h"
#include "dual_proxy/simulation/haptic_device.h"
#include "dual_proxy/simulation/input_faults.h"
#include "dual_proxy/simulation/operator.h"

namespace dual_proxy {

/** Of everything random in a TeleopLoop, each a stream of its own. */
struct TeleopLoopSeeds {
  std::uint64_t filter{0};
  std::uint64_t angular_filter{1};
  std::uint64_t sensor{2};
  std::uint64_t to_robot{3};
  std::uint64_t to_device{4};
};

/** A clock that is wrong. */
struct ClockParams {
  double offset{0};
  double drift{0};

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;

  /** What it shows at a time, s. */
  double Read(double time) const { return time + (offset + drift * time); }

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("clock_offset", &offset, Between(-10, 10), "s",
                   "of the device's clock at time 0, ahead of the robot's"));
    a->Visit(Field("clock_drift", &drift, Between(-0.01, 0.01), "",
                   "by how much it goes too fast, in seconds per second"));
  }
};

/** Parameters of TeleopLoop. All control periods must be the same. */
template <typename Robot>
struct TeleopLoopParams {
  RobotSideParams<Robot> robot;
  HapticSideParams haptic;
  CommunicationChannelParams channel;   ///< Both ways alike.
  typename Robot::Model::Params model;  ///< The controller's.
  ForceTorqueSensorParams sensor;
  /** m, in the sensor's frame S: from its origin to the tool point E. */
  Eigen::Vector3d p_SE{Eigen::Vector3d::Zero()};
  SimulatedHapticDeviceParams device;
  OperatorPathParams path;  ///< Of the handle, in D.
  std::vector<InputFault> faults{};
  ClockParams clock;  ///< Of the haptic side, against the robot's.
  TeleopLoopSeeds seeds;

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;
};

/** What the robot, real or simulated, gives to a period. */
template <typename Robot>
struct TeleopLoopInput {
  using Coordinates = Eigen::Matrix<double, Robot::kCoordinates, 1>;

  Coordinates q{Coordinates::Zero()};  ///< rad; of a point m, in B.
  Coordinates v{Coordinates::Zero()};  ///< Their rates.
  /** [force; moment about S], N, N m, in S: of the arm on the tool. */
  Vector6 reaction{Vector6::Zero()};
  /** Whether there is one; a plant has none before its first step. */
  bool has_reaction{false};
};

/** Memory of TeleopLoop, and the results of the last period. */
template <typename Robot>
struct TeleopLoopState {
  RobotSideState<Robot> robot;
  HapticSideState haptic;
  ForceTorqueSensorState sensor;
  SimulatedHapticDeviceState device;
  CommunicationChannelState to_robot;
  CommunicationChannelState to_device;
  InputFaultsState faults{};
  std::int64_t next_look{0};  ///< Of the channels, in messages from time 0.
  bool stepped{false};        ///< Whether there was a period.

  /** For the robot, over the period that has begun: torques, N m, or the force
  on a point, N, in B. */
  const auto& command() const {
    return Robot::GetCommand(robot.output.controller);
  }
};

/** Everything that happens in a control period, in one place and without Drake:
a host gives the robot's state and takes the command.

In the period at time t everything acts on what was there before t: the robot
side on the newest message and the robot's state, the haptic side on the newest
message and the device's pose; the device moves under the force of the period
before; the sensor reads; then the link takes what was sent. So the order of the
sides makes no difference, and both may as well be separate processes.

Update() neither allocates nor throws. */
template <typename Robot>
class TeleopLoop {
 public:
  using Params = TeleopLoopParams<Robot>;
  using Input = TeleopLoopInput<Robot>;
  using State = TeleopLoopState<Robot>;
  using Coordinates = typename Input::Coordinates;

  /** @throws std::invalid_argument if params are not valid. */
  explicit TeleopLoop(Params params);

  const Params& params() const { return params_; }

  /** s: between two calls of Update(). */
  double period() const { return params_.robot.controller.period; }

  /** N m: what holds the arm at rest at `q` until the first period. */
  Coordinates CalcHoldingTorque(const Coordinates& q) const
    requires Robot::kRotates;

  /** Allocates all that it will ever use. */
  State MakeState() const;

  /** Advances by one period.
  @param time s: period() times the number of periods so far. */
  void Update(double time, const Input& input, State* state) const noexcept;

  /** Names and meanings of the signals that WriteSignals() writes. */
  const std::vector<SignalSlice>& layout() const { return layout_; }

  /** Writes all signals of the last period, zero before the first. No heap.
  @pre vector.size() == SizeOf(layout()). */
  void WriteSignals(const State& state,
                    Eigen::Ref<Eigen::VectorXd> vector) const;

 private:
  void UpdateRobotSide(double time, const Input& input,
                       State* state) const noexcept;
  void UpdateHapticSide(double time, State* state) const noexcept;
  void UpdateLink(double time, State* state) const noexcept;
  void VisitSignals(const State& state, SignalSink* sink) const;

  Params params_;
  RobotSide<Robot> robot_;
  HapticSide haptic_;
  CommunicationChannel channel_;
  typename Robot::Model model_;
  ForceTorqueSensor sensor_;
  SimulatedHapticDevice device_;
  OperatorPath path_;
  InputFaults faults_;
  std::vector<SignalSlice> layout_;
};

}  // namespace dual_proxy
