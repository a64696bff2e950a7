// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/common/face.h"
#include "dual_proxy/proxy/haptic_side_proxy.h"

namespace dual_proxy {

/** Turns the robot's poses and selections into the force on the hand:
HapticSideProxy as a system.

@system
name: HapticSideProxySystem
input_ports:
- robot_message
- device_pose
output_ports:
- reference_force
- reference_moment
- proxy_pose
- force_selection
- link_status
@endsystem

Input ports:
- `robot_message`, abstract Message (a PoseMessage), in the robot's base frame B
(optional: without it there is no force).
- `device_pose`, abstract RigidTransformd: X_DH, from the device's home.

Output ports, in the device's frame D:
- `reference_force`, 3, N: F_h, on the hand.
- `reference_moment`, 3, N m.
- `proxy_pose`, abstract RigidTransformd: the haptic proxy.
- `force_selection`, 9: row-major.
- `link_status`, kLinkStatusSize: LinkStatusVector().

Steps every `params.period`, with feedthrough. */
class HapticSideProxySystem final : public Face<HapticSideProxyState> {
 public:
  /** @throws std::invalid_argument if `params` is invalid. */
  explicit HapticSideProxySystem(const HapticSideProxyParams& params = {});

  const InputPort& get_robot_message_input_port() const {
    return get_input_port(0);
  }
  const InputPort& get_device_pose_input_port() const {
    return get_input_port(1);
  }
  const OutputPort& get_reference_force_output_port() const {
    return get_output_port(0);
  }
  const OutputPort& get_reference_moment_output_port() const {
    return get_output_port(1);
  }
  const OutputPort& get_proxy_pose_output_port() const {
    return get_output_port(2);
  }
  const OutputPort& get_force_selection_output_port() const {
    return get_output_port(3);
  }
  const OutputPort& get_link_status_output_port() const {
    return get_output_port(4);
  }

 private:
  void Step(const Context& context, HapticSideProxyState* state) const override;

  HapticSideProxy proxy_;
};

}  // namespace dual_proxy
