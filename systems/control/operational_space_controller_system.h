// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/common/face.h"
#include "dual_proxy/control/arm_model.h"
#include "dual_proxy/control/operational_space_controller.h"

namespace dual_proxy {

/** What an OperationalSpaceControllerSystem remembers. */
struct OperationalSpaceControllerMemory {
  OperationalSpaceControllerState<7> state;
  OperationalSpaceControllerOutput<7> output;  ///< Of the last step.
};

/** Unified force/motion control of the arm: OperationalSpaceController and
ArmModel as a system.

@system
name: OperationalSpaceControllerSystem
input_ports:
- robot_state
- motion_error
- rotation_error
- reference_force
- reference_moment
- force_selection
- moment_selection
- sensed_wrench
- proxy_velocity
- proxy_acceleration
- sensor_ready
output_ports:
- torque
- motion_force
- contact_force
- observed_energy
- injected_damping
@endsystem

Input ports, in the base frame B; all but `robot_state` are optional and zero:
- `robot_state`, 14: [q; v], rad, rad/s.
- `motion_error`, 3, m.
- `rotation_error`, 3, rad.
- `reference_force`, 3, N: F_r.
- `reference_moment`, 3, N m.
- `force_selection`, `moment_selection`, 9 each: row-major.
- `sensed_wrench`, 6: [force; moment] at E, N, N m.
- `proxy_velocity`, 6: [linear; angular], m/s, rad/s.
- `proxy_acceleration`, 6: [linear; angular], m/s^2, rad/s^2.
- `sensor_ready`, 1: whether the force sensor can be relied on, > 0.5 if so
  (and if the port is not connected); without it nothing is force-controlled.

Output ports:
- `torque`, 7, N m: with gravity compensation.
- `motion_force`, 3, in B: F_m, N, or of a unit mass (see the params).
- `contact_force`, 3, N, in B: F_f.
- `observed_energy`, 1, J, of the force loop.
- `injected_damping`, 1, N s/m, of the force loop.

Steps every `params.period`, with feedthrough. */
class OperationalSpaceControllerSystem final
    : public Face<OperationalSpaceControllerMemory> {
 public:
  /** @param arm the model of the arm.
  @throws std::invalid_argument if parameters are invalid. */
  OperationalSpaceControllerSystem(
      const OperationalSpaceControllerParams<7>& params,
      const ArmModelParams<7>& arm);

  const InputPort& get_robot_state_input_port() const {
    return get_input_port(0);
  }
  const InputPort& get_motion_error_input_port() const {
    return get_input_port(1);
  }
  const InputPort& get_rotation_error_input_port() const {
    return get_input_port(2);
  }
  const InputPort& get_reference_force_input_port() const {
    return get_input_port(3);
  }
  const InputPort& get_reference_moment_input_port() const {
    return get_input_port(4);
  }
  const InputPort& get_force_selection_input_port() const {
    return get_input_port(5);
  }
  const InputPort& get_moment_selection_input_port() const {
    return get_input_port(6);
  }
  const InputPort& get_sensed_wrench_input_port() const {
    return get_input_port(7);
  }
  const InputPort& get_proxy_velocity_input_port() const {
    return get_input_port(8);
  }
  const InputPort& get_proxy_acceleration_input_port() const {
    return get_input_port(9);
  }
  const InputPort& get_sensor_ready_input_port() const {
    return get_input_port(10);
  }
  const OutputPort& get_torque_output_port() const {
    return get_output_port(0);
  }
  const OutputPort& get_motion_force_output_port() const {
    return get_output_port(1);
  }
  const OutputPort& get_contact_force_output_port() const {
    return get_output_port(2);
  }
  const OutputPort& get_observed_energy_output_port() const {
    return get_output_port(3);
  }
  const OutputPort& get_injected_damping_output_port() const {
    return get_output_port(4);
  }

 private:
  void Step(const Context& context,
            OperationalSpaceControllerMemory* memory) const override;

  OperationalSpaceController<7> controller_;
  ArmModel<7> arm_;
};

}  // namespace dual_proxy
