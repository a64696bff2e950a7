// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "dual_proxy/common/pose.h"
#include "dual_proxy/proxy/robot_side_proxy.h"
#include "dual_proxy/proxy/trajectory_limiter.h"
#include "dual_proxy/proxy/workspace_limits.h"
#include "dual_proxy/schemes/half.h"
#include "dual_proxy/sides/local_planner.h"

namespace dual_proxy {

/** Memory of ReferenceBlend. */
struct ReferenceBlendState {
  /** In force in this cycle; its selection is zero if it does not count. */
  PlannerReference planner;
  /** Whether the references differ, or come back, from the operator's. */
  bool blending{false};
  bool started{false};         ///< Whether there was a cycle before.
  std::int64_t bad_inputs{0};  ///< Planner's references refused so far.

  /** x, m, and its velocity, while blending; its rotation is not used. */
  TrajectoryLimiterState limiter;
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};  ///< F, N, while blending.
  /** A projection: directions that a planner has handed back, and in which F
  has not met F_r yet. */
  Eigen::Matrix3d returned{Eigen::Matrix3d::Zero()};
  /** s, since Omega_p changed; 2 once x has met what is wanted. */
  double catch_up_time{0};

  /** The operator's x_pr, m, its velocity, and F_r, N, in the cycle before. */
  Eigen::Vector3d operator_position{Eigen::Vector3d::Zero()};
  Eigen::Vector3d operator_velocity{Eigen::Vector3d::Zero()};
  Eigen::Vector3d operator_force{Eigen::Vector3d::Zero()};
};

/** Shared autonomy (the paper's III.A): in the directions Omega_p that a
planner on the robot's side owns its reference counts, in all others the
operator's, which the scheme's half makes:

    x = (1 - Ω_p) x_pr + Ω_p x_planner
    F = Ω_f ((1 - Ω_p) F_r + Ω_p F_planner)

Whether motion or force is controlled in a direction is still perception's to
say. Orientation and moments stay the operator's. Without a link or a sensor
that can be relied on the planner has nothing: the robot does as without one.

Whoever takes a direction over or hands it back, and whatever a planner asks
for, nothing steps. x goes to what is wanted through a TrajectoryLimiter with
the proxy's limits; after each change of Ω_p with catch_up_share of its
accelerations, until it has met it (or for 2 s). F changes at the proxy's
force_rate; in directions that are handed back it grows by 1 N/s at most until
it has met F_r. A hand that feels nothing of a direction sinks to where it means
to be, and what its spring asks for there, until the hand feels the contact
again and yields to it, is a press that nobody means. With no direction in a
planner's hands, and x and F where the operator's are, both are the operator's,
to the bit. What a half lets step on purpose (F_r at a bumpless hand-over, x_pr
where a contact is let go) steps here as well.

x_planner is kept within the proxy's workspace and max_distance of the robot,
F_planner within its max_force. A reference that is not finite, or whose
selection is no projection, is refused and counted: the planner has nothing
then.

What the hand feels. The paper has every agent act through a dual proxy and the
hand feel the task's constraints, F_h = -k Ω_fh (x_h - x_ph), but does not say
who feels what where several share the task. Here the force on the hand is the
constraint on what the hand decides: the half leaves a planner's directions out
of the selection that it sends, so that no spring pulls the hand after a motion
or a force that is not its doing. The pose that it sends is the robot's, planner
or not. */
class ReferenceBlend {
 public:
  using State = ReferenceBlendState;

  /** Takes limits, rates, workspace and period.
  @throws std::invalid_argument if params are not valid. */
  explicit ReferenceBlend(const RobotSideProxyParams& params);

  State MakeState() const { return {}; }

  /** First in a cycle: takes what the planner asks for. No heap, no throw.
  @param ready  false: the planner is to have nothing. */
  void TakePlanner(const PlannerReference& planner, bool ready,
                   State* state) const noexcept;

  /** Then, with what the half has made: advances by one period. No heap, no
  throw.
  @param X_BE  of the tool point.
  @param setpoint  the operator's, made the blended one.
  @param reference_pose  where the tool point is wanted, in B, likewise. */
  void Update(const Pose& X_BE, State* state, RobotSetpoint* setpoint,
              Pose* reference_pose) const noexcept;

 private:
  void MovePosition(const Eigen::Vector3d& p_BE, const Eigen::Vector3d& x_pr,
                    const Eigen::Vector3d& v_pr, State* state) const noexcept;
  void MoveForce(const RobotSetpoint& setpoint, State* state) const noexcept;

  RobotSideProxyParams params_;
  WorkspaceLimits workspace_;
  TrajectoryLimiter limiter_;
  TrajectoryLimiter catch_up_limiter_;
};

}  // namespace dual_proxy
