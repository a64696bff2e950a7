// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "dual_proxy/common/face.h"
#include "dual_proxy/link/communication_channel.h"

namespace dual_proxy {

/** A link with delay, jitter, loss and reordering, one way:
CommunicationChannel as a system.

@system
name: CommunicationChannelSystem
input_ports:
- message
output_ports:
- message
- counters (only if asked for)
@endsystem

Input port: `message`, abstract Message: the sender's newest, of the kind that
the channel is made for.

Output ports:
- `message`, abstract Message: the newest that has arrived, the empty one
  (sequence -1) before the first arrival.
- `counters`, 3: messages lost on the way, pushed out of the full channel,
  refused because not finite (only if asked for).

A message that the sender makes in a step at t is there for the receiver's first
step after t + delay: with the delay a multiple of the control period, always
one step later, as if the delay were zero and the two sides were neighbours. For
that the channel looks for a new message between two steps, 0.6 periods after
each multiple of 1/`rate`: the sender, which starts at time 0, has then taken
its step nearest to it. What has arrived is a function of time, so the output
needs no step in between. It is without feedthrough. */
class CommunicationChannelSystem final
    : public Face<CommunicationChannelState> {
 public:
  /** @param params delay and its disturbances.
  @param seed of jitter and loss.
  @param rate Hz, > 0, how often the input is looked at: the sender's rate.
  @param period s, > 0, of the two sides' steps.
  @param counted whether there is the port `counters`.
  @param tag of the messages that it carries, those of another kind being an
  error of the wiring.
  @throws std::invalid_argument if one of them is invalid. */
  explicit CommunicationChannelSystem(
      const CommunicationChannelParams& params = {}, std::uint64_t seed = 0,
      double rate = 50, double period = 0.001, bool counted = false,
      MessageTag tag = PoseMessage::kTag);

  const InputPort& get_message_input_port() const { return get_input_port(0); }
  const OutputPort& get_message_output_port() const {
    return get_output_port(0);
  }
  /** @throws std::exception unless it was asked for. */
  const OutputPort& get_counters_output_port() const {
    return GetOutputPort("counters");
  }

 private:
  void Step(const Context& context,
            CommunicationChannelState* state) const override;
  void CalcMessage(const Context& context, Message* message) const;

  CommunicationChannel channel_;
  MessageTag tag_;
};

}  // namespace dual_proxy
