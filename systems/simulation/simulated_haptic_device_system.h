// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/common/face.h"
#include "dual_proxy/simulation/haptic_device.h"
#include "dual_proxy/simulation/operator.h"

namespace dual_proxy {

/** A simulated Omega.7 in the hand of a simulated operator:
SimulatedHapticDevice and OperatorPath as a system.

@system
name: SimulatedHapticDeviceSystem
input_ports:
- device_wrench
output_ports:
- device_pose
- device_velocity
- hand_position
- bad_inputs
@endsystem

Everything in the device's frame D.

Input port:
- `device_wrench`, 6: [force; moment], N, N m, on the hand (optional, zero).

Output ports:
- `device_pose`, abstract RigidTransformd: X_DH, as the driver reads it.
- `device_velocity`, 6: [linear; angular], m/s, rad/s, as read.
- `hand_position`, 3, m: where the operator wants the handle.
- `bad_inputs`, 1: steps with an intention or a wrench that was refused so far.

Steps every `params.period`; the outputs are those of the last step, the device
at its home before the first, without feedthrough. */
class SimulatedHapticDeviceSystem final
    : public Face<SimulatedHapticDeviceState> {
 public:
  /** @param path points in D: where the operator wants the handle.
  @throws std::invalid_argument if parameters are invalid. */
  explicit SimulatedHapticDeviceSystem(
      const OperatorPathParams& path,
      const SimulatedHapticDeviceParams& params = {});

  const InputPort& get_device_wrench_input_port() const {
    return get_input_port(0);
  }
  const OutputPort& get_device_pose_output_port() const {
    return get_output_port(0);
  }
  const OutputPort& get_device_velocity_output_port() const {
    return get_output_port(1);
  }
  const OutputPort& get_hand_position_output_port() const {
    return get_output_port(2);
  }
  const OutputPort& get_bad_inputs_output_port() const {
    return get_output_port(3);
  }

 private:
  void Step(const Context& context,
            SimulatedHapticDeviceState* state) const override;

  OperatorPath path_;
  SimulatedHapticDevice device_;
};

}  // namespace dual_proxy
