// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/link/communication_channel.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "dual_proxy/common/validate_entries.h"

namespace dual_proxy {

void CommunicationChannelParams::Validate() const {
  const char* who = "CommunicationChannelParams";
  ValidateFields(who, *this);
  ThrowUnlessSpans(who, "outages", outages);
}

InFlightMessages::InFlightMessages(const InFlightMessages& other)
    : InFlightMessages() {
  *this = other;
}

InFlightMessages& InFlightMessages::operator=(
    const InFlightMessages& other) noexcept {
  if (this != &other) {
    std::copy_n(other.items_.begin(), other.size_, items_.begin());
    size_ = other.size_;
  }
  return *this;
}

bool InFlightMessages::Push(double arrival_time,
                            const Message& message) noexcept {
  const bool full = size_ == kCapacity;
  if (full) {
    std::copy(items_.begin() + 1, items_.end(), items_.begin());
    --size_;
  }
  items_[size_] = {arrival_time, message};
  ++size_;
  return full;
}

void InFlightMessages::EraseArrived(double time) noexcept {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < size_; ++i) {
    if (items_[i].arrival_time <= time) continue;
    if (kept != i) items_[kept] = items_[i];
    ++kept;
  }
  size_ = kept;
}

CommunicationChannel::CommunicationChannel(CommunicationChannelParams params)
    : params_((params.Validate(), std::move(params))) {}

bool CommunicationChannel::IsOut(double time) const noexcept {
  return std::any_of(params_.outages.begin(), params_.outages.end(),
                     [time](const Eigen::Vector2d& outage) {
                       return time >= outage(0) && time < outage(1);
                     });
}

CommunicationChannelState CommunicationChannel::MakeState(
    std::uint64_t seed) const {
  CommunicationChannelState state;
  state.random = RandomStream(seed);
  return state;
}

void CommunicationChannel::Send(
    double time, const Message& message,
    CommunicationChannelState* state) const noexcept {
  if (message.sequence == -1 || message.sequence == state->last_sequence) {
    return;
  }
  state->last_sequence = message.sequence;
  if (!std::isfinite(time) || !IsFinite(message)) {
    ++state->refused;
    return;
  }
  ++state->sent;
  const bool lost = state->random.Uniform() < params_.loss || IsOut(time);
  const double extra = params_.jitter * std::abs(state->random.Normal());
  if (lost) {
    ++state->lost;
    return;
  }

  // Everything that has arrived leaves the channel; only the last is kept.
  const Message& arrived = Receive(time, *state);
  for (std::size_t i = 0; i < state->in_flight.size(); ++i) {
    const double arrival_time = state->in_flight[i].arrival_time;
    if (arrival_time <= time && arrival_time > state->delivered_time) {
      state->delivered_time = arrival_time;
    }
  }
  if (&arrived != &state->delivered) state->delivered = arrived;
  state->in_flight.EraseArrived(time);

  double arrival_time = time + params_.delay + extra;
  if (!params_.reordering) {
    arrival_time = std::max(arrival_time, state->last_arrival_time);
  }
  state->last_arrival_time = arrival_time;
  if (state->in_flight.Push(arrival_time, message)) ++state->overflow;
}

const Message& CommunicationChannel::Receive(
    double time, const CommunicationChannelState& state) const noexcept {
  const Message* latest = &state.delivered;
  double latest_time = state.delivered_time;
  for (std::size_t i = 0; i < state.in_flight.size(); ++i) {
    const auto& item = state.in_flight[i];
    if (item.arrival_time <= time && item.arrival_time >= latest_time) {
      latest_time = item.arrival_time;
      latest = &item.message;
    }
  }
  return *latest;
}

}  // namespace dual_proxy
