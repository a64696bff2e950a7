// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/link/communication_channel_system.h"

#include "dual_proxy/common/validate.h"

namespace dual_proxy {
namespace {

// When the channel looks for a message, in periods after each multiple of its
// interval: more than the half that the sender may be late, and between steps
// for every rate in use.
constexpr double kLook = 0.6;

}  // namespace

template <class Message>
CommunicationChannelSystem<Message>::CommunicationChannelSystem(
    const CommunicationChannelParams& params, std::uint64_t seed, double rate,
    double period, bool counted)
    : Face<CommunicationChannelState<Message>>(Feedthrough::kNo),
      channel_(params) {
  const char* const who = "CommunicationChannelSystem";
  ThrowUnlessIn(who, "rate", rate, Above(0));
  ThrowUnlessIn(who, "period", period, Above(0));
  this->template DeclareValueInput<Message>("message");
  this->DeclareMemory(channel_.MakeState(seed), 1 / rate, kLook * period);
  this->DeclareAbstractOutputPort("message",
                                  &CommunicationChannelSystem::CalcMessage,
                                  {this->result_ticket(), this->time_ticket()});
  if (!counted) return;
  using State = CommunicationChannelState<Message>;
  this->DeclareVectorOutput(
      "counters", 3,
      [](const State& state, Eigen::Ref<Eigen::VectorXd> counters) {
        counters << static_cast<double>(state.lost),
            static_cast<double>(state.overflow),
            static_cast<double>(state.refused);
      });
}

template <class Message>
void CommunicationChannelSystem<Message>::Step(
    const Context& context, CommunicationChannelState<Message>* state) const {
  channel_.Send(context.get_time(),
                get_message_input_port().template Eval<Message>(context),
                state);
}

template <class Message>
void CommunicationChannelSystem<Message>::CalcMessage(const Context& context,
                                                      Message* message) const {
  *message = channel_.Receive(context.get_time(), this->EvalResult(context));
}

template class CommunicationChannelSystem<PoseMessage>;
template class CommunicationChannelSystem<ForceMessage>;

}  // namespace dual_proxy
