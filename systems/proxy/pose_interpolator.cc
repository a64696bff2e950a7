// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/pose_interpolator.h"

#include <algorithm>

#include "dual_proxy/common/rotation.h"

namespace dual_proxy {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;

// For how long the motion goes on when the next pose is late, of the interval,
// and s at most.
constexpr double kExtrapolation = 1.5;
constexpr double kMaxExtrapolation = 0.05;
// Of an interval, in which a pose is reached at least.
constexpr double kMinShare = 0.5;

// For how long it has gone on, s, of which it has reached a pose `late` s ago.
double Extrapolation(const PoseInterpolatorState& state, double late) noexcept {
  return std::clamp(
      late, 0.0, std::min(kExtrapolation * state.interval, kMaxExtrapolation));
}

// [linear; angular] displacement that leads from one pose to another.
Vector6 Displacement(const Pose& from, const Pose& to) noexcept {
  Vector6 result;
  result << to.p - from.p, LogRotation(to.R * from.R.transpose());
  return result;
}

Pose Displaced(const Pose& from, const Vector6& displacement) noexcept {
  return {from.p + displacement.head<3>(),
          ExpRotation(displacement.tail<3>()) * from.R};
}

}  // namespace

void PoseInterpolatorParams::Validate() const {
  ValidateFields("PoseInterpolatorParams", *this);
}

PoseInterpolator::PoseInterpolator(PoseInterpolatorParams params)
    : params_(params) {
  params_.Validate();
}

void PoseInterpolator::Add(double time, const Pose& pose, double send_time,
                           PoseInterpolatorState* state) const noexcept {
  const double interval = send_time - state->last_send_time;
  const bool joined =
      state->started && interval > 0 && interval <= params_.max_interval;
  const MovingPose now = Calc(time, *state);
  const Pose last = state->to.pose;
  state->started = true;
  state->last_send_time = send_time;
  state->to.pose = pose;
  if (joined) {
    const double ahead =
        Extrapolation(*state, time - state->start - state->duration);
    state->from = now;
    state->to.velocity = Displacement(last, pose) / interval;
    state->duration = std::max(interval - ahead, kMinShare * interval);
    state->interval = interval;
  } else {
    state->to.velocity.setZero();
    state->from = state->to;
    state->duration = 0;
    state->interval = 0;
  }
  state->start = time;
}

MovingPose PoseInterpolator::Calc(
    double time, const PoseInterpolatorState& state) const noexcept {
  const double T = state.duration;
  const double t = std::max(0.0, time - state.start);
  if (T == 0) return state.to;
  if (t >= T) {
    const double ahead = Extrapolation(state, t - T);
    MovingPose result = state.to;
    result.pose = Displaced(state.to.pose, ahead * state.to.velocity);
    if (ahead < t - T) result.velocity.setZero();
    return result;
  }
  // Cubic Hermite, displacement from `from`.
  const Vector6 way = Displacement(state.from.pose, state.to.pose);
  const double s = t / T;
  const double h_way = s * s * (3 - 2 * s);
  const double h_from = T * s * (1 - s) * (1 - s);
  const double h_to = T * s * s * (s - 1);
  MovingPose result;
  result.pose =
      Displaced(state.from.pose, h_way * way + h_from * state.from.velocity +
                                     h_to * state.to.velocity);
  result.velocity = 6 * s * (1 - s) / T * way +
                    (1 - s) * (1 - 3 * s) * state.from.velocity +
                    s * (3 * s - 2) * state.to.velocity;
  return result;
}

}  // namespace dual_proxy
