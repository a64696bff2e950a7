// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/baselines/position_force.h"
#include "dual_proxy/common/face.h"

namespace dual_proxy {

/** The haptic side of the two-channel baseline, the sensed force sent back:
PositionForceHapticSide as a system.

@system
name: PositionForceHapticSideSystem
input_ports:
- force_message
output_ports:
- device_wrench
- link_status
- link_counters
@endsystem

Input port:
- `force_message`, abstract ForceMessage, in the robot's base frame B.

Output ports:
- `device_wrench`, 6: [force; moment], N, N m, in the device's frame D, of the
  device on the hand.
- `link_status`, kLinkStatusSize: LinkStatusVector().
- `link_counters`, 5: messages refused so far, those of them that were not
  finite or not valid, sequence numbers skipped, latency spikes, times lost.

Steps every `period`; the outputs are those of the last step, zero before the
first, without feedthrough: what it commands acts on the device one step later,
as with every other scheme. */
class PositionForceHapticSideSystem final
    : public Face<PositionForceHapticSideState> {
 public:
  /** @param period s, > 0.
  @throws std::invalid_argument if `params` or `period` is invalid. */
  explicit PositionForceHapticSideSystem(
      const PositionForceHapticSideParams& params = {}, double period = 0.001);

  const InputPort& get_force_message_input_port() const {
    return get_input_port(0);
  }
  const OutputPort& get_device_wrench_output_port() const {
    return get_output_port(0);
  }
  const OutputPort& get_link_status_output_port() const {
    return get_output_port(1);
  }
  const OutputPort& get_link_counters_output_port() const {
    return get_output_port(2);
  }

 private:
  void Step(const Context& context,
            PositionForceHapticSideState* state) const override;

  PositionForceHapticSide side_;
};

}  // namespace dual_proxy
