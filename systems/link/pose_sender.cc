// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/link/pose_sender.h"

#include <cmath>

#include "dual_proxy/common/rotation.h"

namespace dual_proxy {
namespace {

void Accumulate(const PoseMessage& sample, PoseMessage* sum) noexcept {
  sum->pose.p += sample.pose.p;
  sum->pose.R += sample.pose.R;
  sum->force_selection = sample.force_selection;
  sum->moment_selection = sample.moment_selection;
  sum->contact_normals = sample.contact_normals;
}

void Clear(PoseMessage* sum) noexcept {
  sum->pose.p.setZero();
  sum->pose.R.setZero();
}

void Divide(double samples, PoseMessage* sum) noexcept {
  sum->pose.p /= samples;
  sum->pose.R = ProjectToRotation(sum->pose.R);
}

void Accumulate(const ForceMessage& sample, ForceMessage* sum) noexcept {
  sum->force += sample.force;
}

void Clear(ForceMessage* sum) noexcept { sum->force.setZero(); }

void Divide(double samples, ForceMessage* sum) noexcept {
  sum->force /= samples;
}

}  // namespace

void PoseSenderParams::Validate() const {
  ValidateFields("PoseSenderParams", *this);
}

template <class Message>
MessageSender<Message>::MessageSender(PoseSenderParams params)
    : params_((params.Validate(), params)),
      schedule_(params.rate, params.period) {}

template <class Message>
const Message& MessageSender<Message>::Add(
    double time, const Message& sample,
    MessageSenderState<Message>* state) const noexcept {
  if (!std::isfinite(time)) {
    ++state->bad_inputs;
    return state->message;
  }
  if (!state->schedule.started) Clear(&state->sum);
  if (IsValid(sample)) {
    if (!params_.average) {
      Clear(&state->sum);
      state->samples = 0;
    }
    Accumulate(sample, &state->sum);
    ++state->samples;
  } else {
    ++state->bad_inputs;
  }
  if (!schedule_.IsDue(time, &state->schedule) || state->samples == 0) {
    return state->message;
  }
  const std::int64_t sequence = state->message.sequence + 1;
  Divide(static_cast<double>(state->samples), &state->sum);
  state->message = state->sum;
  state->message.sequence = sequence;
  state->message.send_time = time;
  Clear(&state->sum);
  state->samples = 0;
  return state->message;
}

template class MessageSender<PoseMessage>;
template class MessageSender<ForceMessage>;

const PoseMessage& PoseSender::Update(double time, const PoseMessage& sample,
                                      PoseSenderState* state) const noexcept {
  return Add(time, sample, state);
}

const ForceMessage& ForceSender::Update(
    double time, const Eigen::Vector3d& force,
    ForceSenderState* state) const noexcept {
  ForceMessage sample;
  sample.force = force;
  return Add(time, sample, state);
}

}  // namespace dual_proxy
