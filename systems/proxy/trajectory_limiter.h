// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "dual_proxy/common/pose.h"
#include "dual_proxy/common/serialize.h"

namespace dual_proxy {

/** Limits of the motion of the robot proxy; each holds per axis of B. */
struct TrajectoryLimiterParams {
  double max_velocity{0.2};
  double max_acceleration{10.0};
  double max_angular_velocity{1.0};
  double max_angular_acceleration{20.0};
  double max_jerk{0};
  double max_angular_jerk{0};
  double period{0.001};

  /** @throws std::invalid_argument naming the field. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("max_velocity", &max_velocity, Above(0), "m/s",
                   "per axis; the paper's 0.2"));
    a->Visit(Field("max_acceleration", &max_acceleration, Above(0), "m/s^2",
                   "per axis; the paper's 10"));
    a->Visit(Field("max_angular_velocity", &max_angular_velocity, Above(0),
                   "rad/s", "per axis"));
    a->Visit(Field("max_angular_acceleration", &max_angular_acceleration,
                   Above(0), "rad/s^2", "per axis"));
    a->Visit(Field("max_jerk", &max_jerk, AtLeast(0), "m/s^3",
                   "per axis; 0 is none, as in the paper: the acceleration "
                   "steps, and with it the torques that it asks for"));
    a->Visit(Field("max_angular_jerk", &max_angular_jerk, AtLeast(0), "rad/s^3",
                   "per axis; 0 is none"));
    a->Visit(Field("period", &period, Above(0), "s", "between updates"));
  }
};

/** The limited motion: what the robot is to follow. All in B. */
struct TrajectoryLimiterState {
  Pose pose;
  Eigen::Vector3d v{Eigen::Vector3d::Zero()};      ///< Velocity, m/s.
  Eigen::Vector3d a{Eigen::Vector3d::Zero()};      ///< Acceleration, m/s^2.
  Eigen::Vector3d w{Eigen::Vector3d::Zero()};      ///< Angular velocity, rad/s.
  Eigen::Vector3d alpha{Eigen::Vector3d::Zero()};  ///< rad/s^2.
  std::int64_t bad_inputs{0};  ///< Targets refused: not finite, or no pose.
};

/** Online trajectory generator: moves a pose towards a target that may change
every tick, within limits of velocity, acceleration and, if there is one, jerk
(spec section 3, point 1).

Every axis of the position takes the time-optimal way to the target's coordinate
and velocity, on its own (Ruckig, without synchronisation). A target that moves
within the limits is met and then followed with its own velocity and
acceleration. The rotation does the same with the rotation vector that leads
from the current orientation to the target's, in B. Only the next tick of a
trajectory is ever used; so targets that are out of its sight are taken nearer,
which changes nothing but the range of the numbers. */
class TrajectoryLimiter {
 public:
  /** @throws std::invalid_argument for parameters out of range. */
  explicit TrajectoryLimiter(TrajectoryLimiterParams params);

  const TrajectoryLimiterParams& params() const { return params_; }

  /** At rest at `pose`. */
  TrajectoryLimiterState MakeState(const Pose& pose) const;

  /** Advances by one period towards the target. One that is not a valid pose is
  refused and counted, and the motion stops as by Stop().
  @param target where the target is now.
  @param target_velocity [linear m/s; angular rad/s] of the target; cut off at
      99 % of the limits, so that it can be caught up with.
  No heap, no throw. */
  void Update(const Pose& target,
              const Eigen::Matrix<double, 6, 1>& target_velocity,
              TrajectoryLimiterState* state) const noexcept;

  /** The same with a target at rest. */
  void Update(const Pose& target, TrajectoryLimiterState* state) const noexcept;

  /** Advances by one period, braking every axis to rest within the limits. */
  void Stop(TrajectoryLimiterState* state) const noexcept;

 private:
  TrajectoryLimiterParams params_;
};

}  // namespace dual_proxy
