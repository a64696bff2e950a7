// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/schemes/wave_variables/wave_channel.h"

#include <algorithm>
#include <cmath>

#include "dual_proxy/common/low_pass.h"
#include "dual_proxy/common/possible.h"

namespace dual_proxy {

void WaveSums::Add(const Eigen::Vector3d& u, double period) noexcept {
  wave += period * u;
  energy += period * u.squaredNorm() / 2;
}

bool IsValid(const WaveSums& sums) noexcept {
  return IsWithin(sums.wave, kMaxSum) && IsWithin(sums.energy, kMaxSum) &&
         sums.energy >= 0;
}

WavePlayer::WavePlayer(const WavePlayerParams& params)
    : params_(params), gain_(LowPassGain(params.cutoff, params.period)) {
  params_.healing_time = std::max(params.healing_time, params.interval);
}

void WavePlayer::Receive(const WaveSums& sums, double send_time,
                         State* state) const noexcept {
  const double interval = params_.interval;
  WaveSums& played = state->played;
  if (!state->started) {
    state->started = true;
    state->received = sums;
    played = sums;
  } else {
    const double span = std::max(interval, send_time - state->send_time);
    const Eigen::Vector3d mean = (sums.wave - state->received.wave) / span;
    const Eigen::Vector3d missing = sums.wave - interval * mean - played.wave;
    state->received = sums;
    state->wave = mean + missing / params_.healing_time;
    const double energy = state->wave.squaredNorm() * interval / 2;
    const double budget =
        std::max(0.0, sums.energy + params_.reserve - played.energy);
    if (energy > budget) state->wave *= std::sqrt(budget / energy);
  }
  state->send_time = send_time;
}

const Eigen::Vector3d& WavePlayer::Play(State* state) const noexcept {
  WaveSums next = state->played;
  next.Add(state->wave, params_.period);
  if (next.energy > state->received.energy + params_.reserve) {
    state->wave.setZero();
  } else {
    state->played = next;
  }
  state->output += gain_ * (state->wave - state->output);
  return state->output;
}

}  // namespace dual_proxy
