// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/link/link_end.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace dual_proxy {

void LinkEndParams::Validate() const { ValidateFields("LinkEndParams", *this); }

LinkEnd::LinkEnd(LinkDirection sends, const LinkMonitorParams& monitor,
                 LinkEndParams params)
    : sends_(sends),
      receives_(sends == LinkDirection::kToRobot ? LinkDirection::kToHaptic
                                                 : LinkDirection::kToRobot),
      timeout_(monitor.timeout),
      max_echo_time_(2 * monitor.max_age),
      params_((params.Validate(), params)),
      clock_(params.clock) {
  monitor.Validate();
}

LinkEndState LinkEnd::MakeState(std::uint64_t session) const {
  LinkEndState state;
  state.session = std::max<std::uint64_t>(session, 1);
  return state;
}

bool LinkEnd::Send(double time, const Message& message, std::uint32_t flags,
                   LinkEndState* state) const noexcept {
  if (!std::isfinite(time)) {
    ++state->bad_inputs;
    return false;
  }
  flags &= kLinkFlags;
  // Time that went back has not to pass again.
  state->sent_time = std::min(state->sent_time, time);
  if (message.sequence == state->sent_sequence && flags == state->sent_flags &&
      time - state->sent_time < params_.interval) {
    return false;
  }
  LinkEcho echo = state->heard;
  if (echo.session != 0) echo.age = std::max(0.0, time - echo.age);
  state->bytes = EncodeFrame({.direction = sends_,
                              .session = state->session,
                              .number = state->number++,
                              .time = time,
                              .echo = echo,
                              .flags = flags,
                              .message = message});
  state->sent_time = time;
  state->sent_sequence = message.sequence;
  state->sent_flags = flags;
  ++state->sent;
  return true;
}

FrameVerdict LinkEnd::Judge(double time, std::span<const std::uint8_t> bytes,
                            LinkEndState* state) const noexcept {
  LinkFrame frame;
  const WireError error = DecodeFrame(bytes, receives_, &frame);
  if (error != WireError::kNone) {
    ++state->malformed[static_cast<std::size_t>(error)];
    return FrameVerdict::kMalformed;
  }
  // Likewise.
  state->heard_time = std::min(state->heard_time, time);
  const bool known = frame.session == state->peer;
  if (known && frame.number <= state->peer_number) {
    return FrameVerdict::kReplayed;
  }
  if (!known && (IsConnected(time, *state) ||
                 std::find(state->replaced.begin(), state->replaced.end(),
                           frame.session) != state->replaced.end())) {
    return FrameVerdict::kOtherSession;
  }
  // Also of what is not accepted yet, so that the other end can prove itself.
  state->heard = {.session = frame.session, .time = frame.time, .age = time};
  if (frame.echo.session != state->session) return FrameVerdict::kUnproven;
  const double since = time - frame.echo.time;
  if (!(since >= 0 && since <= max_echo_time_) || frame.echo.age > timeout_) {
    return FrameVerdict::kStale;
  }
  if (!known) {
    state->replaced[state->replacements++ % state->replaced.size()] =
        state->peer;
    state->peer = frame.session;
    state->clock = clock_.MakeState();
  } else {
    const std::uint64_t skipped = frame.number - state->peer_number - 1;
    const std::int64_t room =
        std::numeric_limits<std::int64_t>::max() - state->lost;
    state->lost += std::cmp_less(skipped, room)
                       ? static_cast<std::int64_t>(skipped)
                       : room;
  }
  state->peer_number = frame.number;
  const bool late = state->clock.estimated &&
                    since - frame.echo.age > state->clock.round_trip + timeout_;
  clock_.Update(time, frame.echo.time, frame.echo.age, frame.time,
                &state->clock);
  if (late) return FrameVerdict::kStale;
  state->heard_time = time;
  state->flags = frame.flags;
  if (!ClockOffset::IsTrusted(state->clock)) return FrameVerdict::kUntimed;
  if (frame.message.sequence >= 0) {
    state->message = frame.message;
    state->message.send_time =
        ClockOffset::ToLocal(frame.message.send_time, state->clock);
  }
  return FrameVerdict::kAccepted;
}

FrameVerdict LinkEnd::Receive(double time, std::span<const std::uint8_t> bytes,
                              LinkEndState* state) const noexcept {
  FrameVerdict verdict = FrameVerdict::kStale;
  if (std::isfinite(time)) {
    verdict = Judge(time, bytes, state);
  } else {
    ++state->bad_inputs;
  }
  ++state->verdicts[static_cast<std::size_t>(verdict)];
  return verdict;
}

}  // namespace dual_proxy
