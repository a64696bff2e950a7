// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "dual_proxy/common/pose.h"
#include "dual_proxy/common/serialize.h"

namespace dual_proxy {

/** Parameters of PoseInterpolator. */
struct PoseInterpolatorParams {
  double max_interval{0.25};

  /** @throws std::invalid_argument naming the field. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("max_interval", &max_interval, Above(0), "s",
                   "two poses sent further apart are not joined: the target "
                   "starts anew, at rest, at the later one"));
  }
};

/** A pose and how it moves. */
struct MovingPose {
  Pose pose;
  /// [linear m/s; angular rad/s].
  Eigen::Matrix<double, 6, 1> velocity{Eigen::Matrix<double, 6, 1>::Zero()};
};

/** The piece of motion that is under way. */
struct PoseInterpolatorState {
  MovingPose from;           ///< Where it began, at `start`.
  MovingPose to;             ///< Where it ends: the newest pose.
  double start{0};           ///< Receiver's clock, s.
  double duration{0};        ///< s; 0: there is nothing to join.
  double interval{0};        ///< s, between the sending of the last two poses.
  double last_send_time{0};  ///< Of the newest pose, sender's clock, s.
  bool started{false};       ///< A pose has come.
};

/** Joins poses that come at the link's rate to a motion with continuous
velocity, for a controller that runs faster.

From the arrival of a pose on, the motion goes from where it is to that pose, in
the interval that lay between the sending of the last two poses, along a cubic
that ends with the velocity that led from the one to the other. So it trails the
sender by one interval, and jitter changes its speed but never makes it step. If
the next pose is late, the motion goes on at that velocity for one and a half
intervals, but not for longer than 50 ms, and then stops; by what it has gone on
it has less time to the next pose, at least half of that pose's interval. So a
hand that moves evenly is followed evenly where every other pose is lost.
Rotations: the same with the rotation vector from the motion's start.

Without it the target is a staircase, and a time-optimal limiter turns each step
into full acceleration and full braking. */
class PoseInterpolator {
 public:
  /** @throws std::invalid_argument for parameters out of range. */
  explicit PoseInterpolator(PoseInterpolatorParams params = {});

  const PoseInterpolatorParams& params() const { return params_; }

  PoseInterpolatorState MakeState() const { return {}; }

  /** Takes a new pose.
  @param time receiver's clock, s, not decreasing.
  @param pose a valid pose.
  @param send_time sender's clock, s, of the pose.  No heap, no throw. */
  void Add(double time, const Pose& pose, double send_time,
           PoseInterpolatorState* state) const noexcept;

  /** The motion at `time` (s, not before the last Add()).
  @pre a pose has been added.  No heap, no throw. */
  MovingPose Calc(double time,
                  const PoseInterpolatorState& state) const noexcept;

 private:
  PoseInterpolatorParams params_;
};

}  // namespace dual_proxy
