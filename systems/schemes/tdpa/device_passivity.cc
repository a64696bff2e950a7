// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/schemes/tdpa/device_passivity.h"

#include <algorithm>

namespace dual_proxy {

void DevicePassivity::Observe(const DevicePassivityInput& input,
                              State* state) const noexcept {
  // The device's limits shorten both parts alike, where they act.
  DevicePassivityState::Command& sent = state->commands[0];
  const double size = sent.force.squaredNorm();
  const double share =
      size > 0 ? std::clamp(input.sent_force.dot(sent.force) / size, 0.0, 1.0)
               : 0;
  sent.damping *= share;
  sent.force = input.sent_force;

  const DevicePassivityState::Command& acted =
      state->commands[params_.actuation_delay];
  const Eigen::Vector3d step = input.position - state->position;
  const double energy = (acted.force - acted.damping).dot(step);
  const double taken = acted.damping.dot(step);
  if (energy > 0) state->input += energy;
  if (energy < 0 || params_.counts_input) state->balance += energy;
  state->balance += taken - acted.promised;
  state->dissipated += taken;
  state->balance += input.received_energy - state->received;
}

Eigen::Vector3d DevicePassivity::Update(const DevicePassivityInput& input,
                                        State* state) const noexcept {
  if (state->observing) Observe(input, state);
  if (!input.connected || !state->observing) {
    state->balance = params_.initial_energy;
    for (auto& command : state->commands) command.promised = 0;
  }
  state->observing = input.connected;
  state->received = input.received_energy;
  state->position = input.position;
  std::copy_backward(state->commands.begin(), state->commands.end() - 1,
                     state->commands.end());

  double damping = 0;
  double promised = 0;
  if (params_.enabled && input.connected && state->balance < 0) {
    const double speed2 = input.velocity.squaredNorm();
    if (speed2 > kMinSpeed * kMinSpeed) {
      const double wanted = -state->balance / (params_.period * speed2);
      damping = std::min(wanted, params_.max_damping);
      if (damping < wanted) ++state->saturated;
      promised = damping * speed2 * params_.period;
    } else {
      ++state->saturated;
    }
    state->balance += promised;
  }
  const Eigen::Vector3d injected = damping * input.velocity;
  state->commands[0] = {.force = input.force + injected,
                        .damping = injected,
                        .promised = promised};
  return injected;
}

}  // namespace dual_proxy
