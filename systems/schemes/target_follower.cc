// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/schemes/target_follower.h"

#include "dual_proxy/common/rotation.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"

namespace dual_proxy {

TargetFollower::TargetFollower(const RobotSideProxyParams& params)
    : max_step_(params.limiter.max_velocity * params.period),
      max_rotation_step_(params.limiter.max_angular_velocity * params.period) {}

void TargetFollower::Update(const Pose& goal, const Pose& X_BE, bool connected,
                            State* state) const noexcept {
  Pose& target = state->target;
  if (!state->started) {
    state->started = true;
    target = X_BE;
  }
  if (!connected) {
    if (state->following) target = X_BE;
    state->following = false;
    return;
  }
  if (state->following) {
    target = goal;
    return;
  }
  target.p = RateLimit(target.p, goal.p, max_step_);
  const Eigen::Vector3d turn = LogRotation(goal.R * target.R.transpose());
  const Eigen::Vector3d step = Saturate(turn, max_rotation_step_);
  target.R = step == turn ? goal.R : ExpRotation(step) * target.R;
  state->following = target.p == goal.p && step == turn;
}

}  // namespace dual_proxy
