// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "dual_proxy/proxy/vector_rate_limiter.h"
#include "dual_proxy/schemes/model_mediated/scheme.h"

namespace dual_proxy {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

// What comes is in B already.
RobotSideProxyParams MakeProxyParams(const RobotHalfParams& shared) {
  RobotSideProxyParams params = shared.proxy;
  params.map = {.scale = 1};
  return params;
}

SurfaceEstimatorParams MakeEstimatorParams(const ModelMediatedParams& own,
                                           double period) {
  return {.contact_force = own.contact_force,
          .default_stiffness = own.default_stiffness,
          .min_stiffness = own.min_stiffness,
          .max_stiffness = own.max_stiffness,
          .min_excursion = own.min_excursion,
          .surface_time = own.surface_time,
          .period = period};
}

// Takes a force for a displacement.
VirtualSpringParams MakeLimiterParams(const RobotSideProxyParams& proxy) {
  return {.stiffness = 1,
          .max_force = proxy.max_force,
          .rate = proxy.force_rate,
          .handover = proxy.handover,
          .period = proxy.period};
}

}  // namespace

ModelMediatedRobotHalf::ModelMediatedRobotHalf(const RobotHalfParams& shared,
                                               const ModelMediatedParams& own)
    : params_((own.Validate(), own)),
      proxy_(MakeProxyParams(shared)),
      estimator_(MakeEstimatorParams(own, shared.proxy.period)),
      limiter_(MakeLimiterParams(shared.proxy)),
      other_stiffness_(shared.proxy.stiffness),
      sender_(shared.sender) {}

ModelMediatedRobotHalfState ModelMediatedRobotHalf::MakeState() const {
  return {.proxy = proxy_.MakeState(),
          .surface = estimator_.MakeState(),
          .force = limiter_.MakeState(),
          .sender = sender_.MakeState()};
}

Vector3d ModelMediatedRobotHalf::CalcForce(const Vector3d& way,
                                           const Matrix3d& force_selection,
                                           const State& state) const noexcept {
  Vector3d n = Vector3d::Zero();
  if (state.surface.contact) n = state.surface.normal;
  const double stiffness = estimator_.stiffness(state.surface);
  const double commanded = n.dot(state.commanded);
  const double own =
      std::min(params_.holding_force,
               stiffness * (n.dot(way) + state.surface.depth) - commanded);
  const double force = commanded > 0 ? std::max(commanded, own) : own;
  const Vector3d beside = force_selection * way - n * n.dot(way);
  return force * n + Saturate(other_stiffness_ * beside, params_.holding_force);
}

void ModelMediatedRobotHalf::Update(double time, const RobotHalfInput& input,
                                    State* state) const noexcept {
  const auto message = FromMessage<ModelMediatedMotionMessage>(input.message);
  PoseMessage pose{.sequence = message.sequence,
                   .send_time = message.send_time,
                   .pose = message.pose};
  pose.pose.p += message.force / estimator_.stiffness(state->surface);
  const std::int64_t refused = state->proxy.bad_inputs;
  const std::int64_t received = state->proxy.link.received;
  proxy_.Update(time,
                {.message = pose,
                 .X_BE = input.X_BE,
                 .force_selection = input.force_selection,
                 .moment_selection = input.moment_selection,
                 .has_sensed = true,
                 .sensed_force = input.sensed_wrench.head<3>(),
                 .sensed_moment = input.sensed_wrench.tail<3>(),
                 .sensor_ready = input.sensor_ready,
                 .hold = input.hold},
                &state->proxy);
  if (state->proxy.link.received != received) state->commanded = message.force;

  const RobotSideProxyOutput& proxy = state->proxy.output;
  const Matrix3d& Omega_f = state->proxy.force.selection;
  const Vector3d sensed = input.sensed_wrench.head<3>();
  const bool valid = state->proxy.bad_inputs == refused;
  const bool guided =
      input.MayFollow() && state->proxy.link.status == LinkStatus::kConnected;
  if (valid && guided) {
    estimator_.Update(input.X_BE.p, sensed, Omega_f, &state->surface);
    const Vector3d force =
        CalcForce(proxy.proxy_pose.p - input.X_BE.p, Omega_f, *state);
    limiter_.Update(-force, Omega_f, &sensed, true, &state->force);
  } else {
    if (!guided) state->surface = estimator_.MakeState();
    limiter_.Update(Vector3d::Zero(), Omega_f, nullptr, false, &state->force);
  }

  RobotHalfOutput& output = state->output;
  output.setpoint = {.motion_error = proxy.motion_error,
                     .rotation_error = proxy.rotation_error,
                     .velocity = proxy.proxy_velocity,
                     .acceleration = proxy.proxy_acceleration,
                     .reference_force = state->force.reference,
                     .reference_moment = proxy.reference_moment,
                     .force_selection = proxy.force_selection,
                     .moment_selection = proxy.moment_selection};
  output.proxy_pose = proxy.proxy_pose;
  const SurfaceEstimatorState& surface = state->surface;
  const Pose point{.p = input.X_BE.p - surface.depth * surface.normal};
  output.message = ToMessage(
      sender_.Update(time,
                     {.contact = surface.contact,
                      .normal = surface.normal,
                      .point = proxy_.FromRobot(point, state->proxy).p,
                      .stiffness = estimator_.stiffness(surface)},
                     &state->sender));
  output.link = state->proxy.link;
  output.bad_inputs = state->proxy.bad_inputs;
  output.limiter_bad_inputs = state->proxy.limiter.bad_inputs;
  output.sender_bad_inputs = state->sender.bad_inputs;
}

}  // namespace dual_proxy
