// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "dual_proxy/common/arm_limits.h"
#include "dual_proxy/experiment/run_log.h"

namespace dual_proxy {

/** What may be over a limit, relative to it, from rounding alone. */
inline constexpr double kLimitTolerance = 1e-6;

/** Whether a value is over a limit by more than rounding: by kLimitTolerance of
the limit, or, if that is zero, by kLimitTolerance. */
bool IsOverLimit(double value, double limit);

/** How much of one of the arm's limits a run used. */
struct ArmLimitCheck {
  /** "joint_position", "joint_speed", "tool_speed", "torque", "torque_rate" or
  "proxy_distance". */
  const char* limit;
  /** The key of the metric that tells it, and that metric's value: NaN if one
  of the signal's values is not finite. */
  const char* metric;
  double value;
  bool broken;
  /** Where it was worst: "joint 4 speed 2.31 rad/s at 3.214 s (limit 2.175)".
   */
  std::string worst;
  double time;  ///< Then, s.
  /** How much of the limit that is: 1 is all of it. Of a joint's position it is
  1 more than what it is beyond the limit, rad. NaN does not count. */
  double share;
};

/** Checks a run against the arm's limits, from the signals `joint_position`,
`joint_velocity`, `robot_velocity`, `torque`, `robot_position` and
`robot_proxy_position`. A limit whose signal the log does not have is left out;
so is that of the torque's rate if the log's rows are further apart than control
periods, and all of an empty log.
@param control_period s, > 0. Rates are per control period: between two of them
  the torque is constant. */
std::vector<ArmLimitCheck> CheckArmLimits(const RunLog& log,
                                          const ArmLimits<7>& limits,
                                          double control_period);

}  // namespace dual_proxy
