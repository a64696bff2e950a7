// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <limits>

#include <Eigen/Core>

#include "dual_proxy/common/pose.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/link/message.h"
#include "dual_proxy/link/message_schedule.h"

namespace dual_proxy {

/** Parameters of a sender of messages, whatever is in them. */
struct PoseSenderParams {
  double rate{50.0};
  bool average{true};
  double period{0.001};

  /** @throws std::invalid_argument naming the field. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("rate", &rate, Between(Open(0), {HighestRate(), "1/period"}),
                   "Hz",
                   "of messages; the paper uses 50, and 5 for its remote run"));
    a->Visit(Field("average", &average,
                   "true: a message holds the mean of the samples since the "
                   "last message, which smooths it and delays it by half an "
                   "interval; false: the newest sample"));
    a->Visit(Field("period", &period, Above(0), "s", "between samples"));
  }

 private:
  // One part in 1e9 of slack: 1 / 0.001 is not exactly 1000 for every period.
  // Without a valid period there is no bound.
  double HighestRate() const {
    const double highest =
        period > 0 ? 1 / period : std::numeric_limits<double>::infinity();
    return rate > highest && rate <= (1 + 1e-9) * highest ? rate : highest;
  }
};

/** Memory of a sender; `message` is the newest message to be sent. */
template <class Message>
struct MessageSenderState {
  Message message;          ///< sequence -1 until the first call.
  Message sum;              ///< Sum of the samples since the last message.
  std::int64_t samples{0};  ///< Number of samples in `sum`.
  MessageScheduleState schedule;
  std::int64_t bad_inputs{0};  ///< Samples refused: not finite, or no pose.
};

/** What PoseSender and ForceSender share: when a message is due, and the mean
over the samples since the last one.

A sample that is not valid is left out and counted;
a message that would have no sample is not sent, so that the receiver's
LinkMonitor sees the silence. */
template <class Message>
class MessageSender {
 public:
  /** @throws std::invalid_argument for parameters out of range. */
  explicit MessageSender(PoseSenderParams params);

  const PoseSenderParams& params() const { return params_; }

  MessageSenderState<Message> MakeState() const { return {}; }

 protected:
  ~MessageSender() = default;

  const Message& Add(double time, const Message& sample,
                     MessageSenderState<Message>* state) const noexcept;

 private:
  PoseSenderParams params_;
  MessageSchedule schedule_;
};

using PoseSenderState = MessageSenderState<PoseMessage>;
using ForceSenderState = MessageSenderState<ForceMessage>;

/** Turns 1 kHz poses into messages of a lower rate: mean position and
chordal-mean rotation of the samples since the last message (spec section 4),
with the latest selections and normals. */
class PoseSender final : public MessageSender<PoseMessage> {
 public:
  using MessageSender::MessageSender;

  /** Takes one sample and, when one is due, makes the next message.
  @param time sender's clock, s, not decreasing.
  @param sample pose, selections, normals; its sequence and send_time do not
    count.
  @returns state->message: a new one exactly when its sequence has grown.
  No heap, no throw. */
  const PoseMessage& Update(double time, const PoseMessage& sample,
                            PoseSenderState* state) const noexcept;
};

/** Turns 1 kHz forces into messages of a lower rate; for the two-channel
baseline. */
class ForceSender final : public MessageSender<ForceMessage> {
 public:
  using MessageSender::MessageSender;

  /** Takes one sample and, when one is due, makes the next message.
  @param time sender's clock, s, not decreasing.
  @param force sensed force, robot on its environment, N, in B.
  @returns state->message: a new one exactly when its sequence has grown.
  No heap, no throw. */
  const ForceMessage& Update(double time, const Eigen::Vector3d& force,
                             ForceSenderState* state) const noexcept;
};

}  // namespace dual_proxy
