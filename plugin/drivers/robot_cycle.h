// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include <Eigen/Core>

#include "dual_proxy/control/arm_model.h"
#include "dual_proxy/drivers/driver.h"
#include "dual_proxy/link/message.h"
#include "dual_proxy/perception/force_torque_adapter.h"
#include "dual_proxy/sides/robot_side.h"

namespace dual_proxy {

/** Parameters of RobotCycle. */
struct RobotCycleParams {
  RobotSideParams<SerialArm<7>> side;
  /** Of the arm with all that is beyond its flange. */
  ArmModelParams<7> model;
  /** Of the sensor's adapter; its period is the side's. */
  ForceTorqueAdapterParams sensor;
  /** m, in the sensor's frame S: from its origin to the tool point E. */
  Eigen::Vector3d p_SE{Eigen::Vector3d::Zero()};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;
};

/** What an arm's driver has read, and what has come over the link. */
struct RobotCycleInput {
  Vector7 q{Vector7::Zero()};  ///< rad.
  Vector7 v{Vector7::Zero()};  ///< rad/s.
  /** N m: the torque that the arm got last, if it says so. */
  std::optional<Vector7> received_torque{};
  Message message{};  ///< The newest, stamped by this machine's clock.
  Reading<Vector6> sensor{};
  bool hold{false};  ///< Somebody asks the robot to hold its place.
  bool tare{false};  ///< The sensor's bias is to be learned anew.
  /** The sensor is read, but not to be relied on yet: the robot holds its place
  as a spring does, whatever pushes it. */
  bool distrust_sensor{false};
};

/** Memory of RobotCycle, and its results. */
struct RobotCycleState {
  RobotSideState<SerialArm<7>> side;
  ForceTorqueAdapterState sensor;
  /** s: of the last reading that was taken. */
  double sensor_time{-std::numeric_limits<double>::infinity()};
  Pose X_BE;  ///< Of the tool point, in this cycle.
  /** What message() gives, and the number of the first since a restart. */
  Message newest_message{};
  std::int64_t first_sequence{0};
  /** Of the newest message that came, and of that before a restart. */
  std::int64_t seen_sequence{-1};
  std::int64_t stale_sequence{-1};

  /** N m, for the arm. */
  const Vector7& torque() const { return side.output.controller.torque; }
  /** For the haptic side. */
  const Message& message() const { return newest_message; }
};

/** All that a process which has a real arm does in a period, but for reading
and writing: the model's terms, the sensor's adapter, the robot side. What
TeleopLoop does for a simulated one.

A reading of the sensor is taken once, whenever there is a new one; the side
gets its age. So a sensor that is silent, or not valid, for longer than
`side.max_sensor_age` makes the robot hold its place, as does one whose bias is
not known yet.

Update() neither allocates nor throws. */
class RobotCycle {
 public:
  /** @throws std::invalid_argument if params are not valid. */
  explicit RobotCycle(const RobotCycleParams& params);

  const RobotCycleParams& params() const { return params_; }

  double period() const { return params_.side.controller.period; }

  /** @param seed, angular_seed  of the filters of forces and of moments. */
  RobotCycleState MakeState(std::uint64_t seed = 0,
                            std::uint64_t angular_seed = 1) const;

  /** As after a start, but that the sensor's bias stays known and messages go
  on counting: the arm has been stopped, and may be somewhere else. The message
  that came last counts no more: where the hand was then, it need not be now.
  Allocates. */
  void Restart(RobotCycleState* state, std::uint64_t seed = 0,
               std::uint64_t angular_seed = 1) const;

  /** Advances by one period.
  @param time s, not decreasing: MonotonicTime(), by which messages and readings
  are stamped. */
  void Update(double time, const RobotCycleInput& input,
              RobotCycleState* state) const noexcept;

 private:
  RobotCycleParams params_;
  RobotSide<SerialArm<7>> side_;
  ArmModel<7> model_;
  ForceTorqueAdapter adapter_;
};

}  // namespace dual_proxy
