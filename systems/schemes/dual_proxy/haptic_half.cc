// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/schemes/dual_proxy/scheme.h"

namespace dual_proxy {

DualProxyHapticHalf::DualProxyHapticHalf(const HapticHalfParams& shared,
                                         const NoParams&)
    : proxy_(shared.proxy), sender_(shared.sender) {}

DualProxyHapticHalfState DualProxyHapticHalf::MakeState() const {
  return {.proxy = proxy_.MakeState(), .sender = sender_.MakeState()};
}

void DualProxyHapticHalf::Update(double time, const HapticHalfInput& input,
                                 State* state) const noexcept {
  proxy_.Update(
      time,
      {.message = FromMessage<PoseMessage>(input.message), .X_DH = input.X_DH},
      &state->proxy);
  const HapticSideProxyOutput& proxy = state->proxy.output;
  HapticHalfOutput& output = state->output;
  output.setpoint = {.reference_force = proxy.reference_force,
                     .reference_moment = proxy.reference_moment,
                     .force_selection = proxy.force_selection,
                     .moment_selection = proxy.moment_selection,
                     .contact_normals = proxy.contact_normals};
  output.proxy_pose = proxy.proxy_pose;
  output.message =
      ToMessage(sender_.Update(time, {.pose = input.X_DH}, &state->sender));
  output.link = state->proxy.link;
  output.bad_inputs = state->proxy.bad_inputs;
  output.sender_bad_inputs = state->sender.bad_inputs;
}

}  // namespace dual_proxy
