// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/common/face.h"
#include "dual_proxy/proxy/robot_side_proxy.h"

namespace dual_proxy {

/** Turns the device's poses into motion errors and reference forces:
RobotSideProxy as a system.

@system
name: RobotSideProxySystem
input_ports:
- haptic_message
- robot_pose
- force_selection
- moment_selection
- sensed_wrench
- sensor_ready
output_ports:
- motion_error
- rotation_error
- reference_force
- reference_moment
- proxy_pose
- link_status
- proxy_velocity
- proxy_acceleration
@endsystem

Input ports, in the base frame B unless said:
- `haptic_message`, abstract Message (a PoseMessage), in the device's frame D
(optional: without it the robot waits).
- `robot_pose`, abstract RigidTransformd: X_BE.
- `force_selection`, `moment_selection`, 9 each: row-major (optional, zero).
- `sensed_wrench`, 6: [force; moment] at E, N, N m (optional: without it there
  is no bumpless hand-over).
- `sensor_ready`, 1: whether the force sensor can be relied on, > 0.5 if so
  (optional: it can). Otherwise the robot holds its place.

Output ports, in B:
- `motion_error`, 3, m.
- `rotation_error`, 3, rad.
- `reference_force`, 3, N: F_r.
- `reference_moment`, 3, N m.
- `proxy_pose`, abstract RigidTransformd: the limited robot proxy.
- `link_status`, kLinkStatusSize: LinkStatusVector().
- `proxy_velocity`, 6: [linear; angular], m/s, rad/s.
- `proxy_acceleration`, 6: [linear; angular], m/s^2, rad/s^2.

Steps every `params.period`, with feedthrough. */
class RobotSideProxySystem final : public Face<RobotSideProxyState> {
 public:
  /** @throws std::invalid_argument if `params` is invalid. */
  explicit RobotSideProxySystem(const RobotSideProxyParams& params = {});

  const InputPort& get_haptic_message_input_port() const {
    return get_input_port(0);
  }
  const InputPort& get_robot_pose_input_port() const {
    return get_input_port(1);
  }
  const InputPort& get_force_selection_input_port() const {
    return get_input_port(2);
  }
  const InputPort& get_moment_selection_input_port() const {
    return get_input_port(3);
  }
  const InputPort& get_sensed_wrench_input_port() const {
    return get_input_port(4);
  }
  const InputPort& get_sensor_ready_input_port() const {
    return get_input_port(5);
  }
  const OutputPort& get_motion_error_output_port() const {
    return get_output_port(0);
  }
  const OutputPort& get_rotation_error_output_port() const {
    return get_output_port(1);
  }
  const OutputPort& get_reference_force_output_port() const {
    return get_output_port(2);
  }
  const OutputPort& get_reference_moment_output_port() const {
    return get_output_port(3);
  }
  const OutputPort& get_proxy_pose_output_port() const {
    return get_output_port(4);
  }
  const OutputPort& get_link_status_output_port() const {
    return get_output_port(5);
  }
  const OutputPort& get_proxy_velocity_output_port() const {
    return get_output_port(6);
  }
  const OutputPort& get_proxy_acceleration_output_port() const {
    return get_output_port(7);
  }

 private:
  void Step(const Context& context, RobotSideProxyState* state) const override;

  RobotSideProxy proxy_;
};

}  // namespace dual_proxy
