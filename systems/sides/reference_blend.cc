// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/sides/reference_blend.h"

#include <algorithm>
#include <limits>

#include "dual_proxy/common/possible.h"
#include "dual_proxy/proxy/directions_apart.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"

namespace dual_proxy {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr double kCatchUpTime = 2;  // s
// m, m/s: where the wanted reference is met, and where it is the same.
constexpr double kMet = 1e-3;
constexpr double kMetSpeed = 0.01;
constexpr double kSame = 1e-9;
// N/s: while a hand comes to feel a direction again and yields, which takes up
// to a second and two delays.
constexpr double kReturnRate = 1;
// Squared sine of the angle at which two directions are not the same.
constexpr double kApart = 0.5;
// Above a limit by more than rounding.
constexpr double kRounding = 1 + 1e-6;

const RobotSideProxyParams& Validated(const RobotSideProxyParams& params) {
  params.Validate();
  return params;
}

TrajectoryLimiterParams CatchUpLimits(const RobotSideProxyParams& params) {
  TrajectoryLimiterParams limits = params.limiter;
  // Above zero, however small.
  limits.max_acceleration =
      std::max(limits.max_acceleration * params.catch_up_share,
               std::numeric_limits<double>::min());
  return limits;
}

bool IsValid(const PlannerReference& planner) {
  return IsSelection(planner.selection) &&
         IsWithin(planner.position, kMaxPosition) &&
         IsWithin(planner.velocity, kMaxSpeed) &&
         IsWithin(planner.force, kMaxForce);
}

}  // namespace

ReferenceBlend::ReferenceBlend(const RobotSideProxyParams& params)
    : params_(Validated(params)),
      workspace_(params_.workspace),
      limiter_(params_.limiter),
      catch_up_limiter_(CatchUpLimits(params_)) {}

void ReferenceBlend::TakePlanner(const PlannerReference& planner, bool ready,
                                 State* state) const noexcept {
  const Matrix3d last = state->planner.selection;
  const bool valid = IsValid(planner);
  if (!valid) ++state->bad_inputs;
  if (valid && ready) {
    state->planner = planner;
  } else {
    state->planner.selection.setZero();
  }
  const Matrix3d& Omega_p = state->planner.selection;
  if (Omega_p == last) return;
  state->catch_up_time = 0;
  const Matrix3d returned = DirectionsApart(last, Omega_p, kApart);
  state->returned = returned.isZero(0)
                        ? DirectionsApart(state->returned, Omega_p, kApart)
                        : returned;
}

void ReferenceBlend::MovePosition(const Vector3d& p_BE, const Vector3d& x_pr,
                                  const Vector3d& v_pr,
                                  State* state) const noexcept {
  const PlannerReference& planner = state->planner;
  const Matrix3d& Omega_p = planner.selection;
  TrajectoryLimiterState& limiter = state->limiter;

  // What is faster than the half's own limiter is a step on purpose.
  const Vector3d step = x_pr - state->operator_position;
  const double fastest =
      kRounding * params_.limiter.max_velocity * params_.period;
  const Vector3d jump = step - step.cwiseMax(-fastest).cwiseMin(fastest);
  limiter.pose.p += jump - Omega_p * jump;

  Vector3d wanted = x_pr;
  Vector3d velocity = v_pr;
  if (!Omega_p.isZero(0)) {
    const Vector3d way = Omega_p * (planner.position - p_BE);
    const Vector3d near = Saturate(way, params_.max_distance);
    wanted += Omega_p * (p_BE - x_pr) + near;
    if (near == way) {
      velocity += Omega_p * (planner.velocity - v_pr);
    } else {
      velocity -= Omega_p * v_pr;
    }
    if (!workspace_.Contains(wanted)) {
      wanted = workspace_.Clamp(wanted);
      velocity.setZero();
    }
  }
  Vector6 twist;
  twist << velocity, Vector3d::Zero();
  // A limiter's target is where that is at the start of a period.
  const Vector3d start = wanted - params_.period * velocity;
  const bool catching_up = state->catch_up_time < kCatchUpTime;
  (catching_up ? catch_up_limiter_ : limiter_)
      .Update({.p = start}, twist, &limiter);
  if (!catching_up) return;
  state->catch_up_time += params_.period;
  if ((wanted - limiter.pose.p).norm() < kMet &&
      (velocity - limiter.v).norm() < kMetSpeed) {
    state->catch_up_time = kCatchUpTime;
  }
}

void ReferenceBlend::MoveForce(const RobotSetpoint& setpoint,
                               State* state) const noexcept {
  const Matrix3d& Omega_p = state->planner.selection;
  const Vector3d& F_r = setpoint.reference_force;
  const double most = params_.force_rate * params_.period;

  // What is faster than the half's own rate is a step on purpose.
  const Vector3d step = F_r - state->operator_force;
  state->force += step - Saturate(step, kRounding * most);

  Vector3d wanted = F_r;
  if (!Omega_p.isZero(0)) {
    const Vector3d asked = Saturate(state->planner.force, params_.max_force);
    wanted = setpoint.force_selection * (F_r + Omega_p * (asked - F_r));
  }
  const Matrix3d& returned = state->returned;
  if (!returned.isZero(0)) {
    const Vector3d asked = returned * wanted;
    const Vector3d bounded = Saturate(
        asked, (returned * state->force).norm() + kReturnRate * params_.period);
    wanted += bounded - asked;
    if (bounded == asked) state->returned.setZero();
  }
  state->force = RateLimit(state->force, wanted, most);
}

void ReferenceBlend::Update(const Pose& X_BE, State* state,
                            RobotSetpoint* setpoint,
                            Pose* reference_pose) const noexcept {
  const Vector3d x_pr = reference_pose->p;
  const Vector3d v_pr = setpoint->velocity.head<3>();
  const Vector3d F_r = setpoint->reference_force;
  const bool owned = !state->planner.selection.isZero(0);
  if (owned && state->started && !state->blending) {
    state->blending = true;
    state->limiter = limiter_.MakeState({.p = state->operator_position});
    state->limiter.v = state->operator_velocity;
    state->force = state->operator_force;
  }
  if (state->blending) {
    const Vector3d p_BE =
        X_BE.p.allFinite() ? X_BE.p : Vector3d(state->limiter.pose.p);
    MovePosition(p_BE, x_pr, v_pr, state);
    MoveForce(*setpoint, state);
    const TrajectoryLimiterState& moved = state->limiter;
    state->blending = owned || state->force != F_r ||
                      (moved.pose.p - x_pr).norm() > kSame ||
                      (moved.v - v_pr).norm() > kSame;
    if (state->blending) {
      const Vector3d dx = p_BE - moved.pose.p;
      setpoint->motion_error = SaturateUnlessZero(
          dx - setpoint->force_selection * dx, params_.max_motion_error);
      setpoint->velocity.head<3>() = moved.v;
      setpoint->acceleration.head<3>() = moved.a;
      setpoint->reference_force = state->force;
      reference_pose->p = moved.pose.p;
    }
  }
  state->started = true;
  state->operator_position = x_pr;
  state->operator_velocity = v_pr;
  state->operator_force = F_r;
}

}  // namespace dual_proxy
