// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/schemes/wave_variables/scheme.h"

#include <cmath>

#include "dual_proxy/common/rotation.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"

namespace dual_proxy {

using Eigen::Vector3d;
using Mode = WaveVariablesRobotHalfState::Mode;

void WaveToDevice::WriteBody(double* body) const noexcept {
  Eigen::Map<Vector3d>{body} = sums.wave;
  body[3] = sums.energy;
}

void WaveToDevice::ReadBody(const double* body) noexcept {
  sums.wave = Eigen::Map<const Vector3d>{body};
  sums.energy = body[3];
}

bool IsValid(const WaveToDevice& message) noexcept {
  return std::isfinite(message.send_time) && IsValid(message.sums);
}

WaveVariablesRobotHalf::WaveVariablesRobotHalf(const RobotHalfParams& shared,
                                               const WaveVariablesParams& own)
    : params_((own.Validate(), own)),
      workspace_(shared.proxy.workspace),
      monitor_(shared.proxy.link),
      player_({.interval = 1 / shared.sender.rate,
               .period = shared.proxy.period,
               .reserve = own.energy_reserve,
               .healing_time = own.healing_time,
               .cutoff = own.wave_cutoff}),
      follower_(shared.proxy),
      sender_(shared.sender),
      period_(shared.proxy.period) {}

WaveVariablesRobotHalfState WaveVariablesRobotHalf::MakeState() const {
  return {.link = monitor_.MakeState(),
          .player = player_.MakeState(),
          .follower = follower_.MakeState(),
          .sender = sender_.MakeState()};
}

Vector3d WaveVariablesRobotHalf::Follow(const Vector3d& x, const Vector3d& v,
                                        State* state) const noexcept {
  const double b = params_.wave_impedance;
  const double Bs = params_.robot_damping;
  const double Ks = params_.robot_stiffness;
  const double root = std::sqrt(2 * b);
  const Vector3d u = player_.Play(&state->player);
  const Vector3d from = state->target;
  const Vector3d v_unbounded =
      (root * u + Bs * v - Ks * (from - x)) / (b + Bs + Ks * period_);
  const Vector3d force =
      Saturate(root * u - b * v_unbounded, params_.max_robot_force);
  const Vector3d to = from + period_ / b * (root * u - force);
  // No farther out of the workspace than it is.
  const Vector3d inside = workspace_.Clamp(to);
  const double outside = (from - workspace_.Clamp(from)).norm();
  state->target = inside + Saturate(to - inside, outside);
  const Vector3d v_sd = (state->target - from) / period_;
  state->sent.Add(root * v_sd - u, period_);
  return Ks * (state->target - x) + Bs * (v_sd - v);
}

void WaveVariablesRobotHalf::Update(double time, const RobotHalfInput& input,
                                    State* state) const noexcept {
  const auto message = FromMessage<WaveToRobot>(input.message);
  const bool is_new = monitor_.Update(time, message, &state->link);
  if (is_new) state->orientation = message.orientation;
  RobotHalfOutput& output = state->output;
  RobotSetpoint& setpoint = output.setpoint;
  setpoint = {};
  setpoint.force_selection.setIdentity();
  setpoint.force_feedback = false;
  const bool valid =
      std::isfinite(time) && IsValidPose(input.X_BE) && input.v_BE.allFinite();
  const bool connected = valid && input.MayFollow() &&
                         state->link.status == LinkStatus::kConnected;
  if (!connected) {
    state->player = player_.MakeState();
  } else if (is_new) {
    player_.Receive(message.sums, message.send_time, &state->player);
  }
  const Mode last_mode = state->mode;
  if (!valid) {
    state->mode = Mode::kNone;
    ++output.bad_inputs;
  } else {
    const Vector3d& x = input.X_BE.p;
    const Vector3d v = input.v_BE.head<3>();
    state->mode = state->player.started ? Mode::kFollow : Mode::kHold;
    if (state->mode != last_mode) state->target = x;
    const Vector3d force =
        state->mode == Mode::kFollow
            ? Follow(x, v, state)
            : Vector3d(params_.robot_stiffness * (state->target - x) -
                       params_.robot_damping * v);
    setpoint.reference_force = Saturate(force, params_.max_robot_force);
    follower_.Update({.p = x, .R = state->orientation}, input.X_BE, connected,
                     &state->follower);
    setpoint.rotation_error =
        LogRotation(input.X_BE.R * state->follower.target.R.transpose());
  }
  output.proxy_pose = {.p = state->target, .R = state->follower.target.R};
  output.message =
      ToMessage(sender_.Update(time, {.sums = state->sent}, &state->sender));
  output.link = state->link;
  output.sender_bad_inputs = state->sender.bad_inputs;
}

}  // namespace dual_proxy
