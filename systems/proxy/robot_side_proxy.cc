// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/robot_side_proxy.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dual_proxy/common/rotation.h"
#include "dual_proxy/common/validate.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"

namespace dual_proxy {
namespace {

VirtualSpringParams ForceSpring(const RobotSideProxyParams& params) {
  VirtualSpringParams spring;
  spring.stiffness = params.stiffness;
  spring.max_force = params.max_force;
  spring.leash = params.max_distance;
  spring.rate = params.force_rate;
  spring.handover = params.handover;
  spring.period = params.period;
  return spring;
}

VirtualSpringParams MomentSpring(const RobotSideProxyParams& params) {
  VirtualSpringParams spring = ForceSpring(params);
  spring.stiffness = params.rotational_stiffness;
  spring.max_force = params.max_moment;
  spring.leash = 0;
  spring.rate = params.moment_rate;
  return spring;
}

/** s: for how long at most the proxy catches up, and m, m/s, rad, rad/s: where
it has. */
constexpr double kCatchUpTime = 2;
constexpr double kRecoveryTime = 10;
double CatchUpTime(const RobotSideProxyState& state) {
  return state.recovering ? kRecoveryTime : kCatchUpTime;
}

constexpr double kMet = 1e-3;
constexpr double kMetSpeed = 0.01;
constexpr double kMetAngle = 0.01;
constexpr double kMetAngularSpeed = 0.1;

/** N, N m. */
constexpr double kFaded = 1e-9;

TrajectoryLimiterParams CatchUpLimits(const RobotSideProxyParams& params) {
  TrajectoryLimiterParams limits = params.limiter;
  for (double* limit :
       {&limits.max_acceleration, &limits.max_angular_acceleration}) {
    // Above zero, however small.
    *limit = std::max(*limit * params.catch_up_share,
                      std::numeric_limits<double>::min());
  }
  return limits;
}

TrajectoryLimiterParams RecoveryLimits(const RobotSideProxyParams& params) {
  TrajectoryLimiterParams limits = CatchUpLimits(params);
  limits.max_velocity = std::min(limits.max_velocity, params.recovery_speed);
  return limits;
}

bool HasMet(const MovingPose& target, const TrajectoryLimiterState& limiter) {
  return (target.pose.p - limiter.pose.p).norm() < kMet &&
         (target.velocity.head<3>() - limiter.v).norm() < kMetSpeed &&
         LogRotation(target.pose.R * limiter.pose.R.transpose()).norm() <
             kMetAngle &&
         (target.velocity.tail<3>() - limiter.w).norm() < kMetAngularSpeed;
}

const RobotSideProxyParams& Validated(const RobotSideProxyParams& params) {
  params.Validate();
  return params;
}

}  // namespace

void RobotSideProxyParams::Validate() const {
  const char* const who = "RobotSideProxyParams";
  ValidateFields(who, *this);
  if (limiter.period != period) {
    ThrowInvalidField(who, "limiter.period", "the value of `period`",
                      limiter.period);
  }
}

RobotSideProxy::RobotSideProxy(RobotSideProxyParams params)
    : params_(Validated(params)),
      map_(params_.map),
      workspace_(params_.workspace),
      interpolator_(params_.interpolator),
      limiter_(params_.limiter),
      catch_up_limiter_(CatchUpLimits(params_)),
      recovery_limiter_(RecoveryLimits(params_)),
      monitor_(params_.link),
      force_spring_(ForceSpring(params_)),
      moment_spring_(MomentSpring(params_)) {}

void RobotSideProxy::MoveProxy(double time, const Eigen::Vector3d& p_BE,
                               bool follow,
                               RobotSideProxyState* state) const noexcept {
  const Pose last = state->output.proxy_pose;
  if (follow) {
    MovingPose target = params_.interpolate
                            ? interpolator_.Calc(time, state->interpolator)
                            : MovingPose{.pose = state->interpolator.to.pose};
    const Eigen::Vector3d way = target.pose.p - p_BE;
    if (way.norm() > params_.max_distance) {
      target.pose.p = p_BE + Saturate(way, params_.max_distance);
      target.velocity.head<3>().setZero();
    }
    if (!workspace_.Contains(target.pose.p)) {
      target.pose.p = workspace_.Clamp(target.pose.p);
      target.velocity.head<3>().setZero();
    }
    TrajectoryLimiterState& limiter = state->limiter;
    if (state->catch_up_time < CatchUpTime(*state)) {
      if (!state->recovering) {
        catch_up_limiter_.Update(target.pose, target.velocity, &limiter);
      } else if (limiter.v.cwiseAbs().maxCoeff() > params_.recovery_speed) {
        limiter_.Stop(&limiter);  // It has not braked yet.
      } else {
        recovery_limiter_.Update(target.pose, target.velocity, &limiter);
      }
      state->catch_up_time += params_.period;
      if (HasMet(target, limiter)) state->catch_up_time = CatchUpTime(*state);
    } else {
      limiter_.Update(target.pose, target.velocity, &limiter);
    }
  } else {
    limiter_.Stop(&state->limiter);
    state->catch_up_time = 0;
    state->recovering = state->link.losses > 0;
  }
  RobotSideProxyOutput& output = state->output;
  output.proxy_pose = state->limiter.pose;
  output.proxy_velocity << state->limiter.v, state->limiter.w;
  output.proxy_acceleration << state->limiter.a, state->limiter.alpha;

  // The limiter's axes do not wait for one another, so between two points of a
  // round workspace its way may bulge out of it. The nearest point inside moves
  // no faster than the limiter's own.
  if (workspace_.Contains(last.p) &&
      !workspace_.Contains(output.proxy_pose.p)) {
    output.proxy_pose.p = workspace_.Clamp(output.proxy_pose.p);
    output.proxy_velocity.head<3>() =
        (output.proxy_pose.p - last.p) / params_.period;
    output.proxy_acceleration.head<3>().setZero();
  }
}

void RobotSideProxy::Reclutch(double time,
                              RobotSideProxyState* state) const noexcept {
  const Pose& proxy = state->limiter.pose;
  const Pose hand = state->interpolator.to.pose;
  Pose& offset = state->clutch_offset;
  offset.p += proxy.p - hand.p;
  offset.R = ProjectToRotation(offset.R * hand.R.transpose() * proxy.R);
  // The motion of the hand up to here is not to be followed.
  const double send_time = state->interpolator.last_send_time;
  state->interpolator = interpolator_.MakeState();
  interpolator_.Add(time, proxy, send_time, &state->interpolator);
}

Pose RobotSideProxy::FromRobot(
    const Pose& X_BE, const RobotSideProxyState& state) const noexcept {
  if (!params_.reclutch) return X_BE;
  const Pose& offset = state.clutch_offset;
  return {.p = X_BE.p - offset.p, .R = X_BE.R * offset.R.transpose()};
}

void RobotSideProxy::Release(const Pose& X_BE, const Eigen::Matrix3d& Omega_f,
                             const Eigen::Matrix3d& Omega_tau,
                             RobotSideProxyState* state) const noexcept {
  Pose& proxy = state->limiter.pose;
  const Eigen::Matrix3d& last_f = state->force.selection;
  if (Omega_f != last_f) {
    const Eigen::Vector3d way = last_f * (X_BE.p - proxy.p);
    proxy.p += way - Omega_f * way;
  }
  const Eigen::Matrix3d& last_tau = state->moment.selection;
  if (Omega_tau != last_tau) {
    const Eigen::Vector3d way =
        last_tau * LogRotation(X_BE.R * proxy.R.transpose());
    proxy.R = ExpRotation(way - Omega_tau * way) * proxy.R;
  }
  state->output.proxy_pose = proxy;
}

void RobotSideProxy::Update(double time, const RobotSideProxyInput& input,
                            RobotSideProxyState* state) const noexcept {
  const PoseMessage& message = input.message;
  const bool fresh = monitor_.Update(time, message, &state->link);
  if (fresh) {
    const Pose& offset = state->clutch_offset;
    Pose pose = map_.RobotProxy(message.pose.p, message.pose.R);
    if (params_.reclutch) {
      pose = {.p = pose.p + offset.p, .R = pose.R * offset.R};
    }
    interpolator_.Add(time, pose, message.send_time, &state->interpolator);
  }

  const bool pose_valid = IsValidPose(input.X_BE);
  const bool selections_valid =
      IsSelection(input.force_selection) && IsSelection(input.moment_selection);
  const bool sensed_valid =
      !input.has_sensed ||
      (input.sensed_force.allFinite() && input.sensed_moment.allFinite());
  const bool valid =
      std::isfinite(time) && pose_valid && selections_valid && sensed_valid;
  if (!valid) ++state->bad_inputs;

  RobotSideProxyOutput& output = state->output;
  output.link_status = state->link.status;
  output.link_age = state->link.age;
  if (!state->initialized) {
    if (!pose_valid) return;
    state->initialized = true;
    state->limiter = limiter_.MakeState(input.X_BE);
    output.proxy_pose = input.X_BE;
  }

  const bool guided = input.sensor_ready && !input.hold &&
                      state->link.status == LinkStatus::kConnected;
  const bool active = valid && guided;
  if (params_.reclutch && active && !state->following) Reclutch(time, state);
  state->following = active;
  MoveProxy(time, input.X_BE.p, active, state);

  // A change of the selections that cannot be acted on now is seen again in the
  // next tick.
  const bool usable = pose_valid && selections_valid;
  Eigen::Matrix3d Omega_f = state->force.selection;
  Eigen::Matrix3d Omega_tau = state->moment.selection;
  // A force that has faded holds nothing: left to it the robot would creep.
  const bool faded = params_.reclutch && !guided &&
                     state->force.reference.isZero(kFaded) &&
                     state->moment.reference.isZero(kFaded);
  const bool stays = !input.sensor_ready || faded;
  if (usable && !stays) {
    Omega_f = input.force_selection;
    Omega_tau = input.moment_selection;
  } else if (usable) {
    Omega_f.setZero();
    Omega_tau.setZero();
  }
  if (usable && !guided) {
    Release(input.X_BE, Omega_f, Omega_tau, state);
  }

  Eigen::Vector3d dx = Eigen::Vector3d::Zero();
  Eigen::Vector3d dphi = Eigen::Vector3d::Zero();
  if (pose_valid) {
    dx = input.X_BE.p - output.proxy_pose.p;
    dphi = LogRotation(input.X_BE.R * output.proxy_pose.R.transpose());
  }

  force_spring_.Update(dx, Omega_f,
                       input.has_sensed ? &input.sensed_force : nullptr, active,
                       &state->force);
  moment_spring_.Update(dphi, Omega_tau,
                        input.has_sensed ? &input.sensed_moment : nullptr,
                        active, &state->moment);
  output.reference_force = state->force.reference;
  output.reference_moment = state->moment.reference;
  output.force_selection = Omega_f;
  output.moment_selection = Omega_tau;

  output.motion_error =
      SaturateUnlessZero(dx - Omega_f * dx, params_.max_motion_error);
  output.rotation_error = dphi - Omega_tau * dphi;
}

}  // namespace dual_proxy
