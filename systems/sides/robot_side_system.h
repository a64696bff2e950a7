// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "dual_proxy/common/face.h"
#include "dual_proxy/control/arm_model.h"
#include "dual_proxy/sides/robot_side.h"
#include "dual_proxy/simulation/force_torque_sensor.h"

namespace dual_proxy {

/** A simulated wrist sensor inside a RobotSideSystem. */
struct RobotSideSensor {
  ForceTorqueSensorParams params;
  /** m: tool point in the sensor's frame, whose axes are E's. */
  Eigen::Vector3d p_SE{Eigen::Vector3d::Zero()};
  std::uint64_t seed{0};  ///< Of the noise.
};

/** Of the filters in a RobotSideSystem. */
struct RobotSideSeeds {
  std::uint64_t filter{0};
  std::uint64_t angular_filter{1};
};

/** What a RobotSideSystem remembers. */
struct RobotSideMemory {
  RobotSideState<SerialArm<7>> side;
  ForceTorqueSensorState sensor;
  Vector7 torque{Vector7::Zero()};  ///< N m, of the last step.
  bool stepped{false};              ///< Whether there was a step.
};

/** The robot's side as one system: the scheme's half, controller, perception
(RobotSide), and the arm's model.

@system
name: RobotSideSystem
input_ports:
- haptic_message
- robot_state
- sensed_wrench (not with a simulated sensor)
- reaction (only with a simulated sensor)
- force_selection
- moment_selection
- sensor_ready (not with a simulated sensor)
- tare (only with a simulated sensor)
output_ports:
- signals
- torque
- robot_pose
- message
- mean_sensed_force
- mean_velocity
- mean_motion_force
- mean_contact_force
- force_selection
- dimension
- sensed_wrench (only with a simulated sensor)
- sensor_counters (likewise)
- mean_sensed_moment (only with an angular filter)
- mean_angular_velocity (likewise)
- mean_motion_moment (likewise)
- mean_contact_moment (likewise)
- moment_selection (likewise)
- moment_dimension (likewise)
@endsystem

Input ports, in the base frame B unless said:
- `haptic_message`, abstract Message (optional: without it the robot waits).
- `robot_state`, 14: [q; v], rad, rad/s.
- `sensed_wrench`, 6: [force; moment] at E, N, N m.
- `reaction`, 6, in its place with a simulated sensor: [force; moment], N, N m,
  in S, of the arm on the tool.
- `force_selection`, `moment_selection`, 9 each: row-major, the directions of
  contact if somebody else knows them; the side's own filters rest if one of the
  two is connected, the other being zero.
- `sensor_ready`, 1: whether the force sensor can be relied on, > 0.5 if so
  (optional: it can). Otherwise the robot holds its place.
- `tare`, 1, in its place with a simulated sensor: asks for the sensor's bias to
  be learned anew when it comes to exceed 0.5 (optional).

Output ports:
- `signals`: all results, by side().layout().
- `torque`, 7, N m: with gravity compensation.
- `robot_pose`, abstract RigidTransformd: X_BE at the current `robot_state`.
- `message`, abstract Message, to the haptic side.
- `mean_...`, 3 each, N, m/s, N, N: the filter's inputs, means over its current
  period.
- `force_selection`, 9, row-major, and `dimension`, 1: what the filter has
found.
- `sensed_wrench`, 6: as the input of that name (only with a simulated sensor).
- `sensor_counters`, 2: samples that the sensor refused so far, and times at
rest that gave no bias (likewise).
- `mean_sensed_moment`, `mean_angular_velocity`, `mean_motion_moment`,
  `mean_contact_moment`, 3 each, N m, rad/s, N m, N m: the angular filter's
  inputs, likewise (only with the angular filter).
- `moment_selection`, 9, row-major, and `moment_dimension`, 1: what the angular
  filter has found (likewise).

Steps every `params.controller.period`; all outputs but `robot_pose` are those
of the last step. Before the first the torque holds the arm at `q_start`, if
given; the rest is zero.

With a simulated sensor the system does the work of a ForceTorqueSensorSystem,
too, and gives the same bits as with that system in front of it. */
class RobotSideSystem final : public Face<RobotSideMemory> {
 public:
  /** @param arm the model of the arm.
  @param q_start rad, where the arm will be when the run starts.
  @param sensor the simulated sensor, if there is one.
  @param seeds of the filters.
  @throws std::invalid_argument if parameters are invalid, or the sensor's
  period is not the side's. */
  RobotSideSystem(const RobotSideParams<SerialArm<7>>& params,
                  const ArmModelParams<7>& arm,
                  const std::optional<Vector7>& q_start = std::nullopt,
                  const std::optional<RobotSideSensor>& sensor = std::nullopt,
                  const RobotSideSeeds& seeds = {});

  const RobotSide<SerialArm<7>>& side() const { return side_; }

  const InputPort& get_haptic_message_input_port() const {
    return get_input_port(0);
  }
  const InputPort& get_robot_state_input_port() const {
    return get_input_port(1);
  }
  /** @throws std::exception with a simulated sensor. */
  const InputPort& get_sensed_wrench_input_port() const {
    return GetInputPort("sensed_wrench");
  }
  /** @throws std::exception without a simulated sensor. */
  const InputPort& get_reaction_input_port() const {
    return GetInputPort("reaction");
  }
  const InputPort& get_force_selection_input_port() const {
    return get_input_port(3);
  }
  const InputPort& get_moment_selection_input_port() const {
    return get_input_port(4);
  }
  /** @throws std::exception with a simulated sensor. */
  const InputPort& get_sensor_ready_input_port() const {
    return GetInputPort("sensor_ready");
  }
  /** @throws std::exception without a simulated sensor. */
  const InputPort& get_tare_input_port() const { return GetInputPort("tare"); }
  const OutputPort& get_signals_output_port() const {
    return get_output_port(0);
  }
  const OutputPort& get_torque_output_port() const {
    return get_output_port(1);
  }
  const OutputPort& get_robot_pose_output_port() const {
    return get_output_port(2);
  }
  const OutputPort& get_message_output_port() const {
    return get_output_port(3);
  }
  const OutputPort& get_mean_sensed_force_output_port() const {
    return GetOutputPort("mean_sensed_force");
  }
  const OutputPort& get_mean_velocity_output_port() const {
    return GetOutputPort("mean_velocity");
  }
  const OutputPort& get_mean_motion_force_output_port() const {
    return GetOutputPort("mean_motion_force");
  }
  const OutputPort& get_mean_contact_force_output_port() const {
    return GetOutputPort("mean_contact_force");
  }
  const OutputPort& get_force_selection_output_port() const {
    return GetOutputPort("force_selection");
  }
  const OutputPort& get_dimension_output_port() const {
    return GetOutputPort("dimension");
  }
  /** @throws std::exception without a simulated sensor. */
  const OutputPort& get_sensed_wrench_output_port() const {
    return GetOutputPort("sensed_wrench");
  }
  /** @throws std::exception without a simulated sensor. */
  const OutputPort& get_sensor_counters_output_port() const {
    return GetOutputPort("sensor_counters");
  }
  /** @throws std::exception without an angular filter. */
  const OutputPort& get_mean_sensed_moment_output_port() const {
    return GetOutputPort("mean_sensed_moment");
  }
  /** @throws std::exception without an angular filter. */
  const OutputPort& get_mean_angular_velocity_output_port() const {
    return GetOutputPort("mean_angular_velocity");
  }
  /** @throws std::exception without an angular filter. */
  const OutputPort& get_mean_motion_moment_output_port() const {
    return GetOutputPort("mean_motion_moment");
  }
  /** @throws std::exception without an angular filter. */
  const OutputPort& get_mean_contact_moment_output_port() const {
    return GetOutputPort("mean_contact_moment");
  }
  /** @throws std::exception without an angular filter. */
  const OutputPort& get_moment_selection_output_port() const {
    return GetOutputPort("moment_selection");
  }
  /** @throws std::exception without an angular filter. */
  const OutputPort& get_moment_dimension_output_port() const {
    return GetOutputPort("moment_dimension");
  }

 private:
  void Step(const Context& context, RobotSideMemory* memory) const override;
  void CalcRobotPose(const Context& context,
                     drake::math::RigidTransformd* X_BE) const;

  RobotSide<SerialArm<7>> side_;
  ArmModel<7> arm_;
  std::optional<ForceTorqueSensor> sensor_;
  Eigen::Vector3d p_SE_{Eigen::Vector3d::Zero()};
};

}  // namespace dual_proxy
