// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/link/link_monitor.h"

#include <algorithm>
#include <cmath>

namespace dual_proxy {

void LinkMonitorParams::Validate() const {
  ValidateFields("LinkMonitorParams", *this);
}

Eigen::Matrix<double, kLinkStatusSize, 1> LinkStatusVector(
    const LinkMonitorState& state) noexcept {
  Eigen::Matrix<double, kLinkStatusSize, 1> vector;
  vector << static_cast<double>(state.status), state.age,
      static_cast<double>(state.received), static_cast<double>(state.dropped),
      static_cast<double>(state.gaps), static_cast<double>(state.spikes),
      static_cast<double>(state.losses);
  return vector;
}

LinkMonitor::LinkMonitor(LinkMonitorParams params) : params_(params) {
  params_.Validate();
}

bool LinkMonitor::Accept(double time, std::int64_t sequence, double send_time,
                         bool valid, LinkMonitorState* state) const noexcept {
  if (sequence == -1 || sequence == state->seen_sequence) return false;
  state->seen_sequence = sequence;
  if (!valid || sequence < 0 || !std::isfinite(send_time)) {
    ++state->bad_inputs;
    return false;
  }
  const double age = time - send_time;
  const bool first = state->received == 0;
  const bool in_order = first || sequence > state->last_sequence;
  const bool restarted = !in_order && state->status == LinkStatus::kLost &&
                         send_time > state->last_send_time;
  if (std::abs(age) > params_.max_age || !(in_order || restarted)) {
    ++state->dropped;
    return false;
  }
  if (!first && in_order) {
    // Saturated: one forged sequence number must not overflow the counter.
    const std::int64_t room =
        std::numeric_limits<std::int64_t>::max() - state->gaps;
    state->gaps += std::min(sequence - state->last_sequence - 1, room);
  }
  // Ages by another clock do not compare.
  if (restarted || send_time < state->last_send_time) {
    state->min_age = std::numeric_limits<double>::infinity();
  }
  if (age > state->min_age + params_.spike_threshold) ++state->spikes;
  state->min_age = std::min(state->min_age, age);
  state->last_sequence = sequence;
  state->last_send_time = send_time;
  state->last_arrival_time = time;
  state->status = LinkStatus::kConnected;
  ++state->received;
  return true;
}

bool LinkMonitor::Update(double time, std::int64_t sequence, double send_time,
                         bool valid, LinkMonitorState* state) const noexcept {
  if (!std::isfinite(time)) {
    ++state->bad_inputs;
    return false;
  }
  // Time that went back has not to pass again before a link is lost.
  state->last_arrival_time = std::min(state->last_arrival_time, time);
  const bool fresh = Accept(time, sequence, send_time, valid, state);
  if (state->status == LinkStatus::kConnected &&
      time - state->last_arrival_time > params_.timeout) {
    state->status = LinkStatus::kLost;
    ++state->losses;
  }
  if (state->received > 0) state->age = time - state->last_send_time;
  return fresh;
}

}  // namespace dual_proxy
