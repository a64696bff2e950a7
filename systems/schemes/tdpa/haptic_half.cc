// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "dual_proxy/common/rotation.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"
#include "dual_proxy/schemes/tdpa/scheme.h"

namespace dual_proxy {
namespace {

DevicePassivityParams MakePassivityParams(const HapticHalfParams& shared,
                                          const TdpaParams& own) {
  const bool one_port = own.observer == TdpaObserver::kOnePort;
  return {.enabled = own.passivity_control,
          .initial_energy = one_port ? 0 : own.initial_energy,
          .counts_input = one_port,
          .max_damping = own.max_device_damping /
                         (own.force_scale * shared.proxy.map.scale),
          .actuation_delay = own.actuation_delay,
          .period = shared.proxy.period};
}

}  // namespace

TdpaHapticHalf::TdpaHapticHalf(const HapticHalfParams& shared,
                               const TdpaParams& own)
    : params_((own.Validate(), own)),
      map_(shared.proxy.map),
      monitor_(shared.proxy.link),
      passivity_(MakePassivityParams(shared, own)),
      sender_(shared.sender),
      max_release_(own.release_rate * shared.proxy.period) {}

TdpaHapticHalfState TdpaHapticHalf::MakeState() const {
  return {.link = monitor_.MakeState(),
          .passivity = passivity_.MakeState(),
          .sender = sender_.MakeState()};
}

void TdpaHapticHalf::Update(double time, const HapticHalfInput& input,
                            State* state) const noexcept {
  const auto message = FromMessage<TdpaForceMessage>(input.message);
  if (monitor_.Update(time, message, &state->link)) {
    state->force = message.force;
    state->received = message.energy;
  }
  const Eigen::Matrix3d& R_DB = map_.params().R_DB;
  const double kappa = params_.force_scale;
  const Pose X_d = map_.RobotProxy(input.X_DH.p, input.X_DH.R);
  const bool connected = state->link.status == LinkStatus::kConnected;
  const bool valid = std::isfinite(time) && IsValidPose(input.X_DH) &&
                     input.device_velocity.allFinite() &&
                     input.device_wrench.allFinite();
  HapticHalfOutput& output = state->output;
  if (!valid) ++output.bad_inputs;
  Eigen::Vector3d& F_h = output.setpoint.reference_force;
  output.setpoint.injected_force.setZero();
  F_h = connected && valid
            ? Eigen::Vector3d(-kappa * (R_DB * state->force))
            : RateLimit(F_h, Eigen::Vector3d::Zero(), max_release_);
  if (valid) {
    const auto to_link = [&](const Eigen::Vector3d& force) {
      return Eigen::Vector3d(-R_DB.transpose() * force / kappa);
    };
    const Eigen::Vector3d injected = passivity_.Update(
        {.connected = connected,
         .received_energy = state->received,
         .position = X_d.p,
         .velocity = map_.params().scale *
                     (R_DB.transpose() * input.device_velocity.head<3>()),
         .sent_force = to_link(input.device_wrench.head<3>()),
         .force = to_link(F_h)},
        &state->passivity);
    output.setpoint.injected_force = -kappa * (R_DB * injected);
    F_h += output.setpoint.injected_force;
  }
  if (valid) output.proxy_pose = input.X_DH;
  output.message = ToMessage(sender_.Update(
      time, {.pose = X_d, .energy = state->passivity.input}, &state->sender));
  output.link = state->link;
  output.sender_bad_inputs = state->sender.bad_inputs;
}

}  // namespace dual_proxy
