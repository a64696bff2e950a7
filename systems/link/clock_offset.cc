// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/link/clock_offset.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "dual_proxy/common/possible.h"

namespace dual_proxy {

using Sample = ClockOffsetState::Sample;

void ClockOffsetParams::Validate() const {
  ValidateFields("ClockOffsetParams", *this);
}

ClockOffset::ClockOffset(ClockOffsetParams params) : params_(params) {
  params_.Validate();
}

bool ClockOffset::Contradicts(const Sample& sample,
                              const ClockOffsetState& state) const noexcept {
  const double silence = std::max(0.0, sample.time - state.agreed_time);
  const double bound = 0.5 * sample.round_trip + params_.jump_margin +
                       params_.max_slew * silence;
  return std::abs(sample.offset - state.offset) > bound;
}

void ClockOffset::Update(double time, double echo_time, double echo_age,
                         double peer_time,
                         ClockOffsetState* state) const noexcept {
  Sample sample{
      .time = time,
      .offset = 0.5 * ((peer_time - echo_age - echo_time) + (peer_time - time)),
      .round_trip = (time - echo_time) - echo_age};
  // A trip of less than nothing was one during which a clock went back.
  if (!IsWithin(time, kMaxTime) || !IsWithin(echo_time, kMaxTime) ||
      !IsWithin(echo_age, kMaxTime) || !IsWithin(peer_time, kMaxTime) ||
      echo_age < 0 || sample.round_trip < -params_.jump_margin) {
    ++state->bad_inputs;
    return;
  }
  sample.round_trip = std::max(sample.round_trip, 0.0);

  if (state->estimated && Contradicts(sample, *state)) {
    if (++state->contradictions < kContradictions) return;
    ++state->jumps;
    state->estimated = false;
    state->size = state->next = 0;
  }
  state->contradictions = 0;
  state->agreed_time = time;
  const double since = time - state->newest_time;
  if (state->size > 0 && since >= 0 && since < params_.spacing) {
    Sample& newest =
        state->samples[(state->next + params_.samples - 1) % params_.samples];
    if (sample.round_trip < newest.round_trip) newest = sample;
  } else {
    state->newest_time = time;
    state->samples[state->next] = sample;
    state->next = (state->next + 1) % params_.samples;
    state->size = std::min(state->size + 1, params_.samples);
  }

  // The shortest first.
  std::array<Sample, ClockOffsetParams::kMaxSamples> newest;
  const auto end =
      std::copy_if(state->samples.begin(), state->samples.begin() + state->size,
                   newest.begin(), [this, time](const Sample& other) {
                     return std::abs(time - other.time) <= params_.max_age;
                   });
  const auto count = end - newest.begin();
  const auto used = std::max<std::ptrdiff_t>(
      1, static_cast<std::ptrdiff_t>(
             std::ceil(params_.share * static_cast<double>(count))));
  std::nth_element(newest.begin(), newest.begin() + used - 1, end,
                   [](const Sample& a, const Sample& b) {
                     return a.round_trip < b.round_trip;
                   });
  Sample sum;
  std::for_each(newest.begin(), newest.begin() + used,
                [&sum](const Sample& other) {
                  sum.offset += other.offset;
                  sum.round_trip += other.round_trip;
                });
  const double estimate = sum.offset / static_cast<double>(used);
  state->round_trip = sum.round_trip / static_cast<double>(used);
  if (state->estimated) {
    const double most =
        params_.max_slew * std::max(0.0, time - state->last_time);
    state->offset += std::clamp(estimate - state->offset, -most, most);
  } else if (count >= params_.min_samples) {
    state->estimated = true;
    state->offset = estimate;
  }
  state->last_time = time;
}

}  // namespace dual_proxy
