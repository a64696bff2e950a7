// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/common/face.h"
#include "dual_proxy/link/pose_sender.h"

namespace dual_proxy {

/** Turns poses at the control rate into messages at the link's rate: PoseSender
as a system.

@system
name: PoseSenderSystem
input_ports:
- pose
- force_selection
- moment_selection
output_ports:
- message
@endsystem

Input ports:
- `pose`, abstract RigidTransformd: X_DH of the device or X_BE of the robot.
- `force_selection`, `moment_selection`, 9 each: row-major, in the base frame B
  (optional, zero).

Output port:
- `message`, abstract Message (a PoseMessage).

Steps every `params.period`; the message is that of the last step, empty
(sequence -1) before the first, without feedthrough. */
class PoseSenderSystem final : public Face<PoseSenderState> {
 public:
  /** @throws std::invalid_argument if `params` is invalid. */
  explicit PoseSenderSystem(const PoseSenderParams& params = {});

  const InputPort& get_pose_input_port() const { return get_input_port(0); }
  const InputPort& get_force_selection_input_port() const {
    return get_input_port(1);
  }
  const InputPort& get_moment_selection_input_port() const {
    return get_input_port(2);
  }
  const OutputPort& get_message_output_port() const {
    return get_output_port(0);
  }

 private:
  void Step(const Context& context, PoseSenderState* state) const override;

  PoseSender sender_;
};

}  // namespace dual_proxy
