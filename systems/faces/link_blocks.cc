// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/possible.h"
#include "dual_proxy/common/validate.h"
#include "dual_proxy/faces/blocks.h"
#include "dual_proxy/faces/shared_ports.h"

namespace dual_proxy {

namespace {

class PoseSenderBlock final : public BlockOf<PoseMessage, PoseSenderState> {
 public:
  explicit PoseSenderBlock(const PoseSenderParams& params)
      : BlockOf("PoseSender", {.period = params.period}), sender_(params) {
    set_start(sender_.MakeState());
  }

 private:
  void ReadInputs(InputPorts* ports, PoseMessage* input) const override {
    ports->GetPose({"pose", "X_DH of the device or X_BE of the robot"},
                   &input->pose);
    ports->GetVector({"force_selection", "in B"}, &input->force_selection);
    ports->GetVector({"moment_selection", "in B"}, &input->moment_selection);
    ports->GetVector(kContactNormals, &input->contact_normals);
  }

  void Update(double time, const PoseMessage& input,
              PoseSenderState* state) const override {
    sender_.Update(time, input, state);
  }

  void WriteOutputs(double, const PoseSenderState& state, InputPorts*,
                    OutputPorts* ports) const override {
    ports->PutMessage({"message", "the newest"}, PoseMessage::kTag,
                      [&] { return ToMessage(state.message); });
  }

  PoseSender sender_;
};

class CommunicationChannelBlock final
    : public BlockOf<Message, CommunicationChannelState> {
 public:
  CommunicationChannelBlock(const CommunicationChannelParams& params,
                            std::uint64_t seed, double rate, double period,
                            bool counted, MessageTag tag)
      : BlockOf("CommunicationChannel", CheckedTiming(rate, period)),
        channel_(params),
        counted_(counted),
        tag_(tag) {
    set_start(channel_.MakeState(seed));
  }

 private:
  static BlockTiming CheckedTiming(double rate, double period) {
    const char* who = "CommunicationChannel";
    ThrowUnlessIn(who, "period", period, Between(Open(0), kMaxTime));
    ThrowUnlessIn(who, "rate", rate,
                  Between(Open(0), {1 / period, "1/period"}));
    return {.period = 1 / rate, .offset = CommunicationChannel::kLook * period};
  }

  void ReadInputs(InputPorts* ports, Message* message) const override {
    ports->GetMessage({"message", "of the kind that it is made for"}, tag_,
                      message);
  }

  void Update(double time, const Message& message,
              CommunicationChannelState* state) const override {
    channel_.Send(time, message, state);
  }

  void WriteOutputs(double time, const CommunicationChannelState& state,
                    InputPorts*, OutputPorts* ports) const override {
    ports->PutMessage(
        {"message", "of the same kind: the newest that has arrived"}, tag_,
        [&] { return channel_.Receive(time, state); }, {.time = true});
    if (!counted_) return;
    ports->PutCounts(
        {"counters",
         "messages so far: lost on the way, pushed out of the full "
         "channel, refused because not finite (only if `counted`)"},
        {state.lost, state.overflow, state.refused});
  }

  CommunicationChannel channel_;
  bool counted_;
  MessageTag tag_;
};

}  // namespace

BlockPtr MakePoseSenderBlock(const PoseSenderParams& params) {
  return std::make_shared<PoseSenderBlock>(params);
}

BlockPtr MakeCommunicationChannelBlock(const CommunicationChannelParams& params,
                                       std::uint64_t seed, double rate,
                                       double period, bool counted,
                                       MessageTag tag) {
  return std::make_shared<CommunicationChannelBlock>(params, seed, rate, period,
                                                     counted, tag);
}

}  // namespace dual_proxy
