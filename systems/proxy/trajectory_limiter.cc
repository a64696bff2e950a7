// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/trajectory_limiter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>
#include <ruckig/ruckig.hpp>

#include "dual_proxy/common/rotation.h"

namespace dual_proxy {
namespace {

// Share of the velocity limit that a target may move at and still be caught up
// with.
constexpr double kTargetVelocity = 0.99;

struct Limits {
  double velocity;
  double acceleration;
  double jerk;  // Infinite: none.
  double period;
};

constexpr double kInfinity = std::numeric_limits<double>::infinity();

double OrNone(double jerk) { return jerk > 0 ? jerk : kInfinity; }

// The displacement of one tick, and the velocity and acceleration after it.
struct Step {
  Eigen::Vector3d displacement;
  Eigen::Vector3d velocity;
  Eigen::Vector3d acceleration;
  bool arrived;  // Where the target is after the tick, with its velocity.
};

// Of one axis, seen from what it is to reach.
ruckig::InputParameter<3> MakeInput(const Eigen::Vector3d& velocity,
                                    const Eigen::Vector3d& acceleration,
                                    const Limits& limits) noexcept {
  ruckig::InputParameter<3> input;
  input.synchronization = ruckig::Synchronization::None;
  for (int i = 0; i < 3; ++i) {
    input.current_position[i] = 0.0;
    input.current_velocity[i] = velocity(i);
    input.current_acceleration[i] =
        limits.jerk < kInfinity ? acceleration(i) : 0.0;
    input.target_position[i] = 0.0;
    input.target_velocity[i] = 0.0;
    input.target_acceleration[i] = 0.0;
    input.max_velocity[i] = limits.velocity;
    input.max_acceleration[i] = limits.acceleration;
    input.max_jerk[i] = limits.jerk;
  }
  return input;
}

// With a limited jerk: the acceleration fades first.
Step BrakeSoftly(const Eigen::Vector3d& velocity,
                 const Eigen::Vector3d& acceleration,
                 const Limits& limits) noexcept {
  ruckig::InputParameter<3> input = MakeInput(velocity, acceleration, limits);
  input.control_interface = ruckig::ControlInterface::Velocity;
  ruckig::Ruckig<3> generator;
  ruckig::Trajectory<3> trajectory;
  std::array<double, 3> p{}, v{}, a{};
  if (generator.calculate(input, trajectory) >= 0) {
    trajectory.at_time(limits.period, p, v, a);
  }
  using Map = Eigen::Map<const Eigen::Vector3d>;
  // Rounding must not leave an axis a shade over its limit.
  return {
      .displacement = Map(p.data()),
      .velocity =
          Map(v.data()).cwiseMin(limits.velocity).cwiseMax(-limits.velocity),
      .acceleration = Map(a.data()),
      .arrived = false};
}

Step Brake(const Eigen::Vector3d& velocity, const Eigen::Vector3d& acceleration,
           const Limits& limits) noexcept {
  if (limits.jerk < kInfinity) {
    return BrakeSoftly(velocity, acceleration, limits);
  }
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

// Whether all axes are clearly where they are to be, at rest relative to the
// target, within a tick, and no velocity limit is in the way: what Ruckig would
// find, at a small part of its cost. False says nothing. This is the usual
// case, a target that moves as the limits allow.
bool ArrivesAtOnce(const Eigen::Vector3d& way, const Eigen::Vector3d& v_target,
                   const Eigen::Vector3d& velocity,
                   const Eigen::Vector3d& acceleration,
                   const Limits& limits) noexcept {
  constexpr double kClearly = 1 - 1e-6;
  const double a = limits.acceleration;
  for (int i = 0; i < 3; ++i) {
    const double v = velocity(i) - v_target(i);
    // The fastest way to accelerate by `a` one way, then the other.
    const double sign = way(i) < v * std::abs(v) / (2 * a) ? -1 : 1;
    const double peak2 = sign * a * way(i) + v * v / 2;
    const double peak = std::sqrt(std::max(peak2, 0.0));
    const double duration = (2 * peak - sign * v) / a;
    const double fastest = std::max(peak, std::abs(v)) + std::abs(v_target(i));
    if (!(duration < kClearly * limits.period &&
          fastest < kClearly * limits.velocity)) {
      return false;
    }
    const double change = -v / limits.period - acceleration(i);
    if (!(std::abs(change) <= limits.jerk * limits.period)) return false;
  }
  return true;
}

Step Approach(const Eigen::Vector3d& way,
              const Eigen::Vector3d& target_velocity,
              const Eigen::Vector3d& velocity,
              const Eigen::Vector3d& acceleration,
              const Limits& limits) noexcept {
  // Seen from the target, which moves on: a point that is a hair ahead of it at
  // its velocity is almost there, and need not turn round.
  const double fastest = kTargetVelocity * limits.velocity;
  const Eigen::Vector3d v_target =
      target_velocity.cwiseMax(-fastest).cwiseMin(fastest);
  if (ArrivesAtOnce(way, v_target, velocity, acceleration, limits)) {
    return {.displacement = way + limits.period * v_target,
            .velocity = v_target,
            .acceleration = (v_target - velocity) / limits.period,
            .arrived = true};
  }
  // Within this distance a trajectory at full speed shows whether the next tick
  // is to accelerate, to cruise or to brake.
  const double sight = 2.0 * limits.velocity *
                       (limits.velocity / limits.acceleration +
                        limits.acceleration / limits.jerk + limits.period);

  ruckig::InputParameter<3> input =
      MakeInput(velocity - v_target, acceleration, limits);
  input.min_velocity.emplace();
  for (int i = 0; i < 3; ++i) {
    input.target_position[i] = std::clamp(way(i), -sight, sight);
    input.max_velocity[i] = limits.velocity - v_target(i);
    (*input.min_velocity)[i] = -limits.velocity - v_target(i);
  }
  ruckig::Ruckig<3> generator;
  ruckig::Trajectory<3> trajectory;
  if (generator.calculate(input, trajectory) < 0) {
    return Brake(velocity, acceleration, limits);
  }
  std::array<double, 3> p{}, v{}, a{};
  trajectory.at_time(limits.period, p, v, a);
  Step step;
  step.displacement =
      Eigen::Map<const Eigen::Vector3d>(p.data()) + limits.period * v_target;
  // Rounding must not leave an axis a shade over its limit.
  step.velocity = (Eigen::Map<const Eigen::Vector3d>(v.data()) + v_target)
                      .cwiseMin(limits.velocity)
                      .cwiseMax(-limits.velocity);
  step.arrived = trajectory.get_duration() <= limits.period;
  if (step.arrived) {
    step.displacement = way + limits.period * v_target;
    step.velocity = v_target;
  }
  step.acceleration =
      limits.jerk < kInfinity && !step.arrived
          ? Eigen::Vector3d(Eigen::Map<const Eigen::Vector3d>(a.data()))
          : Eigen::Vector3d((step.velocity - velocity) / limits.period);
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
  ValidateFields("TrajectoryLimiterParams", *this);
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
  Update(target, Eigen::Matrix<double, 6, 1>::Zero(), state);
}

void TrajectoryLimiter::Update(
    const Pose& target, const Eigen::Matrix<double, 6, 1>& target_velocity,
    TrajectoryLimiterState* state) const noexcept {
  const Eigen::Vector3d way = target.p - state->pose.p;
  if (!IsValidPose(target) || !way.allFinite() ||
      !target_velocity.allFinite()) {
    ++state->bad_inputs;
    Stop(state);
    return;
  }
  const Step linear =
      Approach(way, target_velocity.head<3>(), state->v, state->a,
               {params_.max_velocity, params_.max_acceleration,
                OrNone(params_.max_jerk), params_.period});
  // Rounding in `way` must not keep it from a target at rest.
  state->pose.p = linear.arrived && linear.velocity.isZero(0.0)
                      ? target.p
                      : Eigen::Vector3d(state->pose.p + linear.displacement);
  state->v = linear.velocity;
  state->a = linear.acceleration;

  // Nothing to do at rest, which is where most scenes leave the orientation.
  const bool turns_on =
      params_.max_angular_jerk > 0 && !state->alpha.isZero(0.0);
  if (target.R == state->pose.R && state->w.isZero(0.0) && !turns_on &&
      target_velocity.tail<3>().isZero(0.0)) {
    state->alpha.setZero();
    return;
  }
  const Step angular =
      Approach(LogRotation(target.R * state->pose.R.transpose()),
               target_velocity.tail<3>(), state->w, state->alpha,
               {params_.max_angular_velocity, params_.max_angular_acceleration,
                OrNone(params_.max_angular_jerk), params_.period});
  if (angular.arrived && angular.velocity.isZero(0.0)) {
    state->pose.R = target.R;
  } else {
    Turn(angular.displacement, &state->pose.R);
  }
  state->w = angular.velocity;
  state->alpha = angular.acceleration;
}

void TrajectoryLimiter::Stop(TrajectoryLimiterState* state) const noexcept {
  const Step linear = Brake(state->v, state->a,
                            {params_.max_velocity, params_.max_acceleration,
                             OrNone(params_.max_jerk), params_.period});
  state->pose.p += linear.displacement;
  state->v = linear.velocity;
  state->a = linear.acceleration;

  const Step angular =
      Brake(state->w, state->alpha,
            {params_.max_angular_velocity, params_.max_angular_acceleration,
             OrNone(params_.max_angular_jerk), params_.period});
  Turn(angular.displacement, &state->pose.R);
  state->w = angular.velocity;
  state->alpha = angular.acceleration;
}

}  // namespace dual_proxy
