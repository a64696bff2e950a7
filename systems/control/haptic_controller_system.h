// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/common/face.h"
#include "dual_proxy/control/haptic_controller.h"

namespace dual_proxy {

/** What a HapticControllerSystem remembers. */
struct HapticControllerMemory {
  HapticControllerState state;
  /** Of the last step: [force; moment], N, N m, in D. */
  Eigen::Matrix<double, 6, 1> device_wrench{
      Eigen::Matrix<double, 6, 1>::Zero()};
};

/** The device's controller, the force on the hand with damping:
HapticController as a system.

@system
name: HapticControllerSystem
input_ports:
- reference_force
- reference_moment
- device_velocity
- force_selection
output_ports:
- device_wrench
@endsystem

Input ports, in the device's frame D; those that are not connected are zero:
- `reference_force`, 3, N: F_h.
- `reference_moment`, 3, N m.
- `device_velocity`, 6: [linear; angular], m/s, rad/s.
- `force_selection`, 9: row-major.

Output port:
- `device_wrench`, 6: [force; moment], N, N m, in D, of the device on the hand.

Steps every `params.period`, with feedthrough. */
class HapticControllerSystem final : public Face<HapticControllerMemory> {
 public:
  /** @throws std::invalid_argument if `params` is invalid. */
  explicit HapticControllerSystem(const HapticControllerParams& params = {});

  const InputPort& get_reference_force_input_port() const {
    return get_input_port(0);
  }
  const InputPort& get_reference_moment_input_port() const {
    return get_input_port(1);
  }
  const InputPort& get_device_velocity_input_port() const {
    return get_input_port(2);
  }
  const InputPort& get_force_selection_input_port() const {
    return get_input_port(3);
  }
  const OutputPort& get_device_wrench_output_port() const {
    return get_output_port(0);
  }

 private:
  void Step(const Context& context,
            HapticControllerMemory* memory) const override;

  HapticController controller_;
};

}  // namespace dual_proxy
