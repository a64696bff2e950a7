// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <limits>

#include <Eigen/Core>

#include "dual_proxy/common/serialize.h"

namespace dual_proxy {

/** What a receiver knows about its link. */
enum class LinkStatus {
  kWaiting = 0,    ///< No message has been accepted yet.
  kConnected = 1,  ///< The last accepted message is not older than the timeout.
  kLost = 2,       ///< Silent for longer than the timeout.
};

struct LinkMonitorParams {
  double timeout{0.5};
  double max_age{5.0};
  double spike_threshold{0.1};

  /** @throws std::invalid_argument naming the field. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field(
        "timeout", &timeout, Above(0), "s",
        "silence since the last accepted message after which the link counts "
        "as lost; several message intervals, or single losses look like that"));
    a->Visit(Field("max_age", &max_age, Above(0), "s",
                   "messages sent longer ago are dropped; needs the two clocks "
                   "to agree, one that is ahead by more is dropped too"));
    a->Visit(Field("spike_threshold", &spike_threshold, Above(0), "s",
                   "a message that is older on arrival than the fastest so far "
                   "by more than this is a latency spike"));
  }
};

/** State and counters of a LinkMonitor. */
struct LinkMonitorState {
  LinkStatus status{LinkStatus::kWaiting};
  std::int64_t last_sequence{-1};  ///< Of the message in use.
  double last_send_time{0};     ///< Of the message in use, sender's clock, s.
  double last_arrival_time{0};  ///< Of the message in use, s.
  double age{0};  ///< Now minus send time of the message in use, s; 0 before.
  std::int64_t received{0};    ///< Messages accepted.
  std::int64_t dropped{0};     ///< Messages refused: too old or out of order.
  std::int64_t gaps{0};        ///< Sequence numbers that were skipped.
  std::int64_t spikes{0};      ///< Accepted messages that came unusually late.
  std::int64_t bad_inputs{0};  ///< Messages refused: not finite or not valid.
  std::int64_t losses{0};      ///< Times the link was lost.
  std::int64_t seen_sequence{-1};  ///< Of the last message looked at.
  double min_age{std::numeric_limits<double>::infinity()};  ///< On arrival, s.
};

/** Number of elements of a LinkStatusVector(). */
inline constexpr int kLinkStatusSize = 7;

/** What a `link_status` port shows of a link: status (the number of
LinkStatus), age of the message in use (s), messages received, dropped (too old
or out of order), sequence numbers skipped, latency spikes, times lost. */
Eigen::Matrix<double, kLinkStatusSize, 1> LinkStatusVector(
    const LinkMonitorState& state) noexcept;

/** Decides, message by message, what may be acted on, and whether the link is
alive (spec section 3, point 4).

A message is accepted if its numbers are valid, its age is within bounds and its
sequence is larger than that of the one in use, whatever its time stamp; of a
restarted sender, which counts from zero, once the link is lost, if it was sent
later. Where a clock goes back, silence and ages are counted from there. */
class LinkMonitor {
 public:
  /** @throws std::invalid_argument for parameters out of range. */
  explicit LinkMonitor(LinkMonitorParams params);

  const LinkMonitorParams& params() const { return params_; }

  LinkMonitorState MakeState() const { return {}; }

  /** Looks at the newest message; call it every tick, also without a new one.
  @param time receiver's clock, s; the call is refused (counted in bad_inputs)
      if it is not finite.
  @param sequence of the newest message; -1 or that of the last call: nothing
      new.
  @param send_time of the newest message, s.
  @param valid whether the content of the message may be acted on.
  @returns true if the message is fresh and is to be used.  No heap, no throw.
  */
  bool Update(double time, std::int64_t sequence, double send_time, bool valid,
              LinkMonitorState* state) const noexcept;

  /** The same for a message of link/message.h, whose content is only checked
  when it is new. */
  template <class Message>
  bool Update(double time, const Message& message,
              LinkMonitorState* state) const noexcept {
    const bool valid =
        message.sequence != state->seen_sequence && IsValid(message);
    return Update(time, message.sequence, message.send_time, valid, state);
  }

 private:
  bool Accept(double time, std::int64_t sequence, double send_time, bool valid,
              LinkMonitorState* state) const noexcept;

  LinkMonitorParams params_;
};

}  // namespace dual_proxy
