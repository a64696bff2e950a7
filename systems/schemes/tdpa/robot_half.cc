// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "dual_proxy/common/rotation.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"
#include "dual_proxy/schemes/tdpa/scheme.h"

namespace dual_proxy {

using Eigen::Vector3d;

TdpaRobotHalf::TdpaRobotHalf(const RobotHalfParams& shared,
                             const TdpaParams& own)
    : params_((own.Validate(), own)),
      period_(shared.proxy.period),
      steps_(std::max(1, static_cast<int>(std::lround(
                             1 / (shared.sender.rate * shared.proxy.period))))),
      workspace_(shared.proxy.workspace),
      monitor_(shared.proxy.link),
      follower_(shared.proxy),
      sender_(shared.sender) {}

TdpaRobotHalfState TdpaRobotHalf::MakeState() const {
  return {.link = monitor_.MakeState(),
          .follower = follower_.MakeState(),
          .sender = sender_.MakeState()};
}

void TdpaRobotHalf::Update(double time, const RobotHalfInput& input,
                           State* state) const noexcept {
  const auto message = FromMessage<TdpaMotionMessage>(input.message);
  if (monitor_.Update(time, message, &state->link)) {
    state->goal = {.p = workspace_.Clamp(message.pose.p), .R = message.pose.R};
    state->received = message.energy;
    state->steps = steps_;
  }
  RobotHalfOutput& output = state->output;
  RobotSetpoint& setpoint = output.setpoint;
  setpoint = {};
  setpoint.force_selection.setIdentity();
  setpoint.force_feedback = false;
  TdpaForceMessage sample;
  if (std::isfinite(time) && IsValidPose(input.X_BE) &&
      input.v_BE.allFinite()) {
    const bool connected = state->link.status == LinkStatus::kConnected;
    follower_.Update(state->goal, input.X_BE, connected && input.MayFollow(),
                     &state->follower);
    setpoint.rotation_error =
        LogRotation(input.X_BE.R * state->follower.target.R.transpose());
    setpoint.reference_force = Control(input, state, &sample.force);
  } else {
    ++output.bad_inputs;
    state->robot_force.setZero();
  }
  sample.energy = state->granted;
  output.proxy_pose = {.p = state->target, .R = state->follower.target.R};
  output.message = ToMessage(sender_.Update(time, sample, &state->sender));
  output.link = state->link;
  output.sender_bad_inputs = state->sender.bad_inputs;
}

Vector3d TdpaRobotHalf::Control(const RobotHalfInput& input, State* state,
                                Vector3d* sent_force) const noexcept {
  const Vector3d& x = input.X_BE.p;
  const Vector3d v = input.v_BE.head<3>();
  const bool follows = state->follower.following;
  if (!follows || !state->observing) Restart(state);
  state->observing = follows;
  const Vector3d v_in = follows ? MoveReference(state) : Vector3d::Zero();

  const bool one_port = params_.observer == TdpaObserver::kOnePort;
  const bool two_port = params_.observer == TdpaObserver::kTwoPort;
  const Vector3d last_target = state->target;
  if (!two_port) state->target = state->reference;
  const Vector3d damping = params_.robot_damping * v;
  Vector3d f_s = params_.robot_stiffness * (state->target - x);
  if (!one_port) f_s += params_.coupling_damping * (v_in - v);
  // As far as it acts.
  Vector3d F_c = Saturate(f_s - damping, params_.max_robot_force);
  f_s = F_c + damping;

  if (follows) {
    if (one_port) {
      state->granted += state->spring_force.dot(state->target - last_target) -
                        state->robot_force.dot(x - state->position);
    } else {
      state->balance += state->received - state->counted;
      state->counted = state->received;
      if (two_port) {
        MoveTarget(f_s, v_in, state);
      } else {
        F_c = Reflect(f_s, v_in, v, F_c, state);
      }
    }
  }
  state->spring_force = f_s;
  state->robot_force = F_c;
  state->position = x;
  *sent_force = one_port ? Vector3d(input.sensed_wrench.head<3>()) : f_s;
  return F_c;
}

void TdpaRobotHalf::Restart(State* state) const noexcept {
  state->reference = state->follower.target.p;
  state->target = state->reference;
  state->balance = params_.initial_energy;
  state->counted = state->received;
  state->spring_force.setZero();
  state->robot_force.setZero();
}

Vector3d TdpaRobotHalf::MoveReference(State* state) const noexcept {
  const Vector3d v_in =
      (state->goal.p - state->reference) / (state->steps * period_);
  state->reference += period_ * v_in;
  state->steps = std::max(1, state->steps - 1);
  return v_in;
}

void TdpaRobotHalf::MoveTarget(const Vector3d& f_s, const Vector3d& v_in,
                               State* state) const noexcept {
  Vector3d v_sd = v_in;
  const Vector3d drift = state->reference - state->target - period_ * v_in;
  const Vector3d back = Saturate(drift / kDriftTime, kDriftSpeed);
  if (period_ * f_s.dot(v_in + back) < state->balance / 2) v_sd += back;

  const double energy = period_ * f_s.dot(v_sd);
  if (energy > 0) {
    state->balance -= energy;
  } else {
    state->granted -= energy;
  }
  if (params_.passivity_control && state->balance < 0) {
    const double force = f_s.norm();
    if (force > kMinForce) {
      const double wanted = -state->balance / (period_ * force);
      const double change = std::min(wanted, kMaxVelocityChange);
      if (change < wanted) ++state->saturated;
      v_sd -= change / force * f_s;
      state->balance += period_ * force * change;
      state->dissipated += period_ * force * change;
    } else {
      ++state->saturated;
    }
  }
  state->target += period_ * v_sd;
}

Vector3d TdpaRobotHalf::Reflect(const Vector3d& f_s, const Vector3d& v_in,
                                const Vector3d& v, const Vector3d& F_c,
                                State* state) const noexcept {
  const double left = period_ * f_s.dot(v_in);
  const double right = period_ * f_s.dot(v);
  state->balance += std::max(0.0, -right);
  const double to_left = std::max(0.0, -left);
  const double to_robot = std::max(0.0, right);
  const double demand = to_left + to_robot;
  // Negative where there is a debt, which both sides then pay.
  double share = 1;
  if (params_.passivity_control && demand > state->balance) {
    if (demand > 0) {
      share = state->balance / demand;
    } else {
      ++state->saturated;
    }
  }
  state->granted += share * to_left;
  state->balance -= share * demand;
  const double lack = (1 - share) * to_robot;
  if (!(lack > 0)) return F_c;
  const double damping =
      std::min(lack / (period_ * v.squaredNorm()), kMaxDamping);
  const Vector3d damped = Saturate(F_c - damping * v, params_.max_robot_force);
  const double taken = period_ * (F_c - damped).dot(v);
  state->balance -= lack - taken;
  state->dissipated += taken;
  constexpr double kRounding = 1e-12;
  if (taken < (1 - kRounding) * lack) ++state->saturated;
  return damped;
}

}  // namespace dual_proxy
