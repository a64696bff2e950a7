// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/schemes/wave_variables/scheme.h"

#include <algorithm>
#include <cmath>

#include "dual_proxy/common/low_pass.h"
#include "dual_proxy/common/rotation.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"

namespace dual_proxy {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

// Of the wave w, no more than is steady of it.
Vector3d SteadyPart(const Vector3d& w, const Vector3d& steady) noexcept {
  const double power = w.squaredNorm();
  if (!(power > 0)) return Vector3d::Zero();
  return std::clamp(steady.dot(w) / power, 0.0, 1.0) * w;
}

}  // namespace

void WaveToRobot::WriteBody(double* body) const noexcept {
  Eigen::Map<Vector3d>{body} = sums.wave;
  body[3] = sums.energy;
  Eigen::Map<Matrix3d>{body + 4} = orientation;
}

void WaveToRobot::ReadBody(const double* body) noexcept {
  sums.wave = Eigen::Map<const Vector3d>{body};
  sums.energy = body[3];
  orientation = Eigen::Map<const Matrix3d>{body + 4};
}

bool IsValid(const WaveToRobot& message) noexcept {
  return std::isfinite(message.send_time) && IsValid(message.sums) &&
         IsValidPose({.R = message.orientation});
}

WaveVariablesHapticHalf::WaveVariablesHapticHalf(const HapticHalfParams& shared,
                                                 const WaveVariablesParams& own)
    : params_((own.Validate(), own)),
      map_(shared.proxy.map),
      monitor_(shared.proxy.link),
      player_({.interval = 1 / shared.sender.rate,
               .period = shared.proxy.period,
               .reserve = own.energy_reserve,
               .healing_time = own.healing_time,
               .cutoff = own.wave_cutoff}),
      sender_(shared.sender),
      period_(shared.proxy.period),
      steady_gain_(LowPassGain(kSteadyCutoff, period_)),
      max_release_(own.release_rate * period_) {}

WaveVariablesHapticHalfState WaveVariablesHapticHalf::MakeState() const {
  return {.link = monitor_.MakeState(),
          .player = player_.MakeState(),
          .sender = sender_.MakeState()};
}

void WaveVariablesHapticHalf::Update(double time, const HapticHalfInput& input,
                                     State* state) const noexcept {
  const auto message = FromMessage<WaveToDevice>(input.message);
  const bool is_new = monitor_.Update(time, message, &state->link);
  HapticHalfOutput& output = state->output;
  const bool valid = std::isfinite(time) && IsValidPose(input.X_DH) &&
                     input.device_velocity.allFinite();
  if (!valid) ++output.bad_inputs;
  const LinkStatus status = state->link.status;
  if (!valid || status != LinkStatus::kConnected) {
    state->player = player_.MakeState();
  } else if (is_new) {
    player_.Receive(message.sums, message.send_time, &state->player);
  }
  const Matrix3d& R_DB = map_.params().R_DB;
  Vector3d& force = output.setpoint.reference_force;
  if (valid && (state->player.started || status == LinkStatus::kWaiting)) {
    const double b = params_.wave_impedance;
    const double root = std::sqrt(2 * b);
    const Vector3d v_d = map_.params().scale *
                         (R_DB.transpose() * input.device_velocity.head<3>());
    const Vector3d w = player_.Play(&state->player);
    state->steady_wave += steady_gain_ * (w - state->steady_wave);
    if (input.held) {
      state->sent.Add(-SteadyPart(w, state->steady_wave), period_);
    } else {
      state->sent.Add(root * v_d - w, period_);
    }
    force = -params_.force_scale * (R_DB * (b * v_d - root * w));
  } else {
    force = RateLimit(force, Vector3d::Zero(), max_release_);
  }
  if (valid) output.proxy_pose = input.X_DH;
  const Pose X_d = map_.RobotProxy(input.X_DH.p, input.X_DH.R);
  output.message = ToMessage(sender_.Update(
      time, {.sums = state->sent, .orientation = X_d.R}, &state->sender));
  output.link = state->link;
  output.sender_bad_inputs = state->sender.bad_inputs;
}

}  // namespace dual_proxy
