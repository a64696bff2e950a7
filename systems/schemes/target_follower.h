// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/common/pose.h"
#include "dual_proxy/proxy/robot_side_proxy.h"

namespace dual_proxy {

/** Memory of a TargetFollower. */
struct TargetFollowerState {
  Pose target{};          ///< In B: where the robot's spring is fixed.
  bool started{false};    ///< A robot pose has been seen.
  bool following{false};  ///< The target has met the goal.
};

/** Where the robot's spring is fixed in a scheme whose robot follows the
device's pose as it comes: without a link the robot holds its place; from there
the target goes to the goal no faster than the proxy's limits, and from then on
is the goal. */
class TargetFollower {
 public:
  using State = TargetFollowerState;

  /** Takes the limits of speed and the period. */
  explicit TargetFollower(const RobotSideProxyParams& params);

  State MakeState() const { return {}; }

  /** Advances by one period; the result is state->target. No heap, no throw.
  @param goal  in B: the device's pose, within the workspace.
  @param X_BE  of the tool point, valid.
  @param connected  whether the goal counts; false: hold. */
  void Update(const Pose& goal, const Pose& X_BE, bool connected,
              State* state) const noexcept;

 private:
  double max_step_;  // m, rad: of the target in a period, on its way.
  double max_rotation_step_;
};

}  // namespace dual_proxy
