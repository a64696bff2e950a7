// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>

#include "dual_proxy/link/message_schedule.h"
#include "dual_proxy/link/pose_sender.h"

namespace dual_proxy {

/** Memory of a SampleSender. */
template <class Content>
struct SampleSenderState {
  Content message;  ///< The newest to be sent; sequence -1 before the first.
  MessageScheduleState schedule;
  std::int64_t bad_inputs{0};  ///< Samples refused.
};

/** Sends the newest sample of whatever `Content` a scheme has, at the link's
rate. Its samples are not averaged, which would delay them by half a message's
interval.

A sample that is not valid is not sent and counted, so that the receiver's
LinkMonitor sees the silence. */
template <class Content>
class SampleSender {
 public:
  using State = SampleSenderState<Content>;

  /** @throws std::invalid_argument for parameters out of range. */
  explicit SampleSender(const PoseSenderParams& params)
      : schedule_((params.Validate(), params.rate), params.period) {}

  State MakeState() const { return {}; }

  /** Takes one sample and, when one is due, makes a message of it.
  @param time sender's clock, s, not decreasing.
  @param sample its sequence and send_time do not count.
  @returns state->message: a new one exactly when its sequence has grown.
  No heap, no throw. */
  const Content& Update(double time, const Content& sample,
                        State* state) const noexcept {
    const bool valid = std::isfinite(time) && IsValid(sample);
    if (!valid) ++state->bad_inputs;
    if (!std::isfinite(time)) return state->message;
    if (schedule_.IsDue(time, &state->schedule) && valid) {
      const std::int64_t sequence = state->message.sequence + 1;
      state->message = sample;
      state->message.sequence = sequence;
      state->message.send_time = time;
    }
    return state->message;
  }

 private:
  MessageSchedule schedule_;
};

}  // namespace dual_proxy
