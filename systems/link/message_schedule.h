// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace dual_proxy {

/** Memory of a MessageSchedule. */
struct MessageScheduleState {
  double next_due{0};   ///< Time of the next message, s.
  bool started{false};  ///< True after the first call.
};

/** When a sender's messages are due: the first at the first call, at time t0,
then one with the tick nearest to t0 + k/rate; anew where time goes back. */
class MessageSchedule {
 public:
  /** @param rate  Hz, of messages, > 0.
  @param period  s, between calls, > 0. */
  MessageSchedule(double rate, double period)
      : interval_(1 / rate), half_period_(0.5 * period) {}

  /** Whether a message is due, which it then is no more.
  @param time  s, finite. */
  bool IsDue(double time, MessageScheduleState* state) const noexcept;

 private:
  double interval_;
  double half_period_;
};

}  // namespace dual_proxy
