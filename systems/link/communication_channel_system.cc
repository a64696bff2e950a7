// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/link/communication_channel_system.h"

#include "dual_proxy/common/validate.h"
#include "dual_proxy/link/message_port.h"

namespace dual_proxy {
CommunicationChannelSystem::CommunicationChannelSystem(
    const CommunicationChannelParams& params, std::uint64_t seed, double rate,
    double period, bool counted, MessageTag tag)
    : Face<CommunicationChannelState>(Feedthrough::kNo),
      channel_(params),
      tag_(tag) {
  const char* const who = "CommunicationChannelSystem";
  ThrowUnlessIn(who, "rate", rate, Above(0));
  ThrowUnlessIn(who, "period", period, Above(0));
  DeclareValueInput<Message>("message");
  DeclareMemory(channel_.MakeState(seed), 1 / rate,
                CommunicationChannel::kLook * period);
  DeclareAbstractOutputPort("message", &CommunicationChannelSystem::CalcMessage,
                            {result_ticket(), time_ticket()});
  if (!counted) return;
  using State = CommunicationChannelState;
  DeclareVectorOutput(
      "counters", 3,
      [](const State& state, Eigen::Ref<Eigen::VectorXd> counters) {
        counters << static_cast<double>(state.lost),
            static_cast<double>(state.overflow),
            static_cast<double>(state.refused);
      });
}

void CommunicationChannelSystem::Step(const Context& context,
                                      CommunicationChannelState* state) const {
  channel_.Send(context.get_time(),
                EvalMessage(get_message_input_port(), context, tag_), state);
}

void CommunicationChannelSystem::CalcMessage(const Context& context,
                                             Message* message) const {
  *message = channel_.Receive(context.get_time(), EvalResult(context));
}

}  // namespace dual_proxy
