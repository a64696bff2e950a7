// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "dual_proxy/common/random.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/link/message.h"

namespace dual_proxy {

/** Parameters of a simulated link, one way. */
struct CommunicationChannelParams {
  static constexpr double kMaxDelay = 10;  ///< s.

  double delay{0.0};
  double jitter{0.0};
  double loss{0.0};
  bool reordering{true};
  std::vector<Eigen::Vector2d> outages{};

  /** @throws std::invalid_argument naming the field. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("delay", &delay, Between(0, kMaxDelay), "s",
                   "of every message, one way; a scenario refuses one that is "
                   "not a message interval less than max_age"));
    a->Visit(Field("jitter", &jitter, Between(0, kMaxDelay), "s",
                   "standard deviation of the normal whose absolute value is "
                   "added to the delay of each message: none is early"));
    a->Visit(Field("loss", &loss, Between(0, 1), "",
                   "probability that a message is lost; a dead link has 1"));
    a->Visit(Field(
        "reordering", &reordering,
        "true: a message may overtake an earlier one, as with UDP; false: it "
        "arrives no earlier than those sent before it, as with TCP"));
    a->Visit(Field("outages", &outages,
                   "[start, end] each, s: every message sent from start until "
                   "end is lost"));
  }
};

/** The messages under way, in the order sent, in memory that is allocated once.
A copy costs what is in it, not what it can hold: simulators copy states. */
class InFlightMessages {
 public:
  struct Item {
    double arrival_time{0};  ///< s.
    Message message;
  };

  /// Most messages under way at a time.
  static constexpr std::size_t kCapacity = 512;

  InFlightMessages() : items_(kCapacity) {}
  InFlightMessages(const InFlightMessages& other);
  InFlightMessages& operator=(const InFlightMessages& other) noexcept;
  ~InFlightMessages() = default;

  std::size_t size() const noexcept { return size_; }
  const Item& operator[](std::size_t i) const noexcept { return items_[i]; }

  /** Appends an item. If full, first drops the oldest, and returns true. */
  bool Push(double arrival_time, const Message& message) noexcept;

  /** Keeps the items that arrive after `time`, in their order. */
  void EraseArrived(double time) noexcept;

 private:
  std::vector<Item> items_;
  std::size_t size_{0};
};

/** Memory of a channel: what is under way, the generator and counters. Copies
continue with the same random numbers. */
struct CommunicationChannelState {
  RandomStream random;
  InFlightMessages in_flight;
  Message delivered;  ///< The last arrived message, as of the last Send().
  double delivered_time{-std::numeric_limits<double>::infinity()};
  double last_arrival_time{-std::numeric_limits<double>::infinity()};
  std::int64_t last_sequence{-1};  ///< Of the last message sent.
  std::int64_t sent{0};      ///< Messages given to Send(), each counted once.
  std::int64_t lost{0};      ///< Of these, lost on the way.
  std::int64_t overflow{0};  ///< Of these, pushed out of a full channel.
  std::int64_t refused{0};   ///< Messages refused because not finite.
};

/** A link with delay, jitter, loss and reordering, one way.

Draws two random numbers per message whether or not they are used, so that with
one seed the messages lost are the same for every delay and jitter, and the
jitter of a message is the same for every loss; outages change neither. Values
do not depend on the platform. */
class CommunicationChannel {
 public:
  /** When whoever runs a channel looks for the sender's newest message, in
  control periods after each multiple of the message's interval: more than the
  half that the sender may be late, and between two periods. */
  static constexpr double kLook = 0.6;

  /** @throws std::invalid_argument for parameters out of range. */
  explicit CommunicationChannel(CommunicationChannelParams params);

  const CommunicationChannelParams& params() const { return params_; }

  /** An empty channel; allocates all the memory it will ever use. */
  CommunicationChannelState MakeState(std::uint64_t seed) const;

  /** Offers the sender's newest message at `time` (s, not decreasing). One
  whose sequence is -1 or that of the last call is no new message and ignored;
  one that is not finite is refused and counted. Beyond
  InFlightMessages::kCapacity messages under way the oldest is dropped and
  counted. No heap, no throw. */
  void Send(double time, const Message& message,
            CommunicationChannelState* state) const noexcept;

  /** The message with the latest arrival time that is not after `time`, or the
  empty message (sequence -1). Where messages overtake one another, its sequence
  may be smaller than before: LinkMonitor drops these.
  @pre `time` is not before that of the last Send().
  @returns a reference into `state`, valid until the next Send(). */
  const Message& Receive(double time,
                         const CommunicationChannelState& state) const noexcept;

 private:
  bool IsOut(double time) const noexcept;

  CommunicationChannelParams params_;
};

}  // namespace dual_proxy
