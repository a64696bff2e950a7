// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/trajectory_limiter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>
#include <ruckig/ruckig.hpp>

#include "dual_proxy/common/rotation.h"
#include "dual_proxy/common/validate.h"

namespace dual_proxy {
namespace {

struct Limits {
  double velocity;
  double acceleration;
  double period;
};

// The displacement of one tick, and the velocity and acceleration after it.
struct Step {
  Eigen::Vector3d displacement;
  Eigen::Vector3d velocity;
  Eigen::Vector3d acceleration;
  bool arrived;  // The displacement is the whole way, and the velocity is 0.
};

Step Brake(const Eigen::Vector3d& velocity, const Limits& limits) noexcept {
  Step step;
  const double change = limits.acceleration * limits.period;
  for (int i = 0; i < 3; ++i) {
    const double v = velocity(i);
    const double v_next = std::copysign(std::max(std::abs(v) - change, 0.0), v);
    // (v^2 - v_next^2) / (2 a) also holds if the axis comes to rest on the way.
    step.displacement(i) = (v * std::abs(v) - v_next * std::abs(v_next)) /
                           (2.0 * limits.acceleration);
    step.velocity(i) = v_next;
    step.acceleration(i) = (v_next - v) / limits.period;
  }
  step.arrived = false;
  return step;
}

Step Approach(const Eigen::Vector3d& way, const Eigen::Vector3d& velocity,
              const Limits& limits) noexcept {
  // Within this distance a trajectory at full speed shows whether the next tick
  // is to accelerate, to cruise or to brake.
  const double sight = 2.0 * limits.velocity *
                       (limits.velocity / limits.acceleration + limits.period);

  ruckig::InputParameter<3> input;
  input.synchronization = ruckig::Synchronization::None;
  for (int i = 0; i < 3; ++i) {
    input.current_position[i] = 0.0;
    input.current_velocity[i] = velocity(i);
    input.current_acceleration[i] = 0.0;
    input.target_position[i] = std::clamp(way(i), -sight, sight);
    input.target_velocity[i] = 0.0;
    input.target_acceleration[i] = 0.0;
    input.max_velocity[i] = limits.velocity;
    input.max_acceleration[i] = limits.acceleration;
    input.max_jerk[i] = std::numeric_limits<double>::infinity();
  }
  ruckig::Ruckig<3> generator;
  ruckig::Trajectory<3> trajectory;
  if (generator.calculate(input, trajectory) < 0) {
    return Brake(velocity, limits);
  }
  std::array<double, 3> p{}, v{}, a{};
  trajectory.at_time(limits.period, p, v, a);
  Step step;
  step.displacement = Eigen::Map<const Eigen::Vector3d>(p.data());
  // Rounding must not leave an axis a shade over its limit.
  step.velocity = Eigen::Map<const Eigen::Vector3d>(v.data())
                      .cwiseMin(limits.velocity)
                      .cwiseMax(-limits.velocity);
  step.arrived = trajectory.get_duration() <= limits.period;
  if (step.arrived) step.velocity.setZero();
  step.acceleration = (step.velocity - velocity) / limits.period;
  return step;
}

// Turns R by a rotation vector in B. Through a unit quaternion, so that
// rounding does not add up; not at all for no displacement, so that rest is
// exact.
void Turn(const Eigen::Vector3d& displacement, Eigen::Matrix3d* R) noexcept {
  if (displacement.isZero(0.0)) return;
  *R = Eigen::Quaterniond(ExpRotation(displacement) * *R)
           .normalized()
           .toRotationMatrix();
}

}  // namespace

void TrajectoryLimiterParams::Validate() const {
  const char* const who = "TrajectoryLimiterParams";
  ThrowUnlessPositive(who, "max_velocity", max_velocity);
  ThrowUnlessPositive(who, "max_acceleration", max_acceleration);
  ThrowUnlessPositive(who, "max_angular_velocity", max_angular_velocity);
  ThrowUnlessPositive(who, "max_angular_acceleration",
                      max_angular_acceleration);
  ThrowUnlessPositive(who, "period", period);
}

TrajectoryLimiter::TrajectoryLimiter(TrajectoryLimiterParams params)
    : params_(params) {
  params_.Validate();
}

TrajectoryLimiterState TrajectoryLimiter::MakeState(const Pose& pose) const {
  TrajectoryLimiterState state;
  state.pose = pose;
  return state;
}

void TrajectoryLimiter::Update(const Pose& target,
                               TrajectoryLimiterState* state) const noexcept {
  const Eigen::Vector3d way = target.p - state->pose.p;
  if (!IsValidPose(target) || !way.allFinite()) {
    ++state->bad_inputs;
    Stop(state);
    return;
  }
  const Step linear = Approach(
      way, state->v,
      {params_.max_velocity, params_.max_acceleration, params_.period});
  if (linear.arrived) {
    state->pose.p = target.p;
  } else {
    state->pose.p += linear.displacement;
  }
  state->v = linear.velocity;
  state->a = linear.acceleration;

  const Step angular =
      Approach(LogRotation(target.R * state->pose.R.transpose()), state->w,
               {params_.max_angular_velocity, params_.max_angular_acceleration,
                params_.period});
  if (angular.arrived) {
    state->pose.R = target.R;
  } else {
    Turn(angular.displacement, &state->pose.R);
  }
  state->w = angular.velocity;
  state->alpha = angular.acceleration;
}

void TrajectoryLimiter::Stop(TrajectoryLimiterState* state) const noexcept {
  const Step linear =
      Brake(state->v,
            {params_.max_velocity, params_.max_acceleration, params_.period});
  state->pose.p += linear.displacement;
  state->v = linear.velocity;
  state->a = linear.acceleration;

  const Step angular =
      Brake(state->w, {params_.max_angular_velocity,
                       params_.max_angular_acceleration, params_.period});
  Turn(angular.displacement, &state->pose.R);
  state->w = angular.velocity;
  state->alpha = angular.acceleration;
}

}  // namespace dual_proxy
