// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "dual_proxy/common/face.h"
#include "dual_proxy/simulation/force_torque_sensor.h"

namespace dual_proxy {

/** A simulated wrist force/torque sensor: ForceTorqueSensor as a system.

@system
name: ForceTorqueSensorSystem
input_ports:
- reaction
- robot_pose
- tare
- robot_velocity
output_ports:
- sensed_wrench
- ready
- counters
@endsystem

Input ports:
- `reaction`, 6: [force; moment], N, N m, in the sensor's frame S, of the arm on
  the tool.
- `robot_pose`, abstract RigidTransformd: X_BE.
- `tare`, 1: asks for the bias to be learned anew when it comes to exceed 0.5
  (optional).
- `robot_velocity`, 6: [linear; angular], m/s, rad/s, in B: of the tool point
  (optional: where poses do not come at a whole multiple of the period, the
  tool's inertia can not be told from them).

Output ports:
- `sensed_wrench`, 6: [force; moment] at E, N, N m, in the base frame B, of the
  robot on its environment.
- `ready`, 1: 1 if the bias is known, else 0.
- `counters`, 2: samples refused so far, and times at rest that gave no bias.

Steps every `params.period`, for the first time after one period, as a simulated
plant has no reaction before its first step. The outputs are those of the last
step, zero before the first, without feedthrough. */
class ForceTorqueSensorSystem final : public Face<ForceTorqueSensorState> {
 public:
  /** @param p_SE m: tool point in S, whose axes are E's.
  @param seed of the noise.
  @throws std::invalid_argument if `params` is invalid or p_SE not finite. */
  explicit ForceTorqueSensorSystem(
      const ForceTorqueSensorParams& params = {},
      const Eigen::Vector3d& p_SE = Eigen::Vector3d::Zero(),
      std::uint64_t seed = 0);

  const InputPort& get_reaction_input_port() const { return get_input_port(0); }
  const InputPort& get_robot_pose_input_port() const {
    return get_input_port(1);
  }
  const InputPort& get_tare_input_port() const { return get_input_port(2); }
  const InputPort& get_robot_velocity_input_port() const {
    return get_input_port(3);
  }
  const OutputPort& get_sensed_wrench_output_port() const {
    return get_output_port(0);
  }
  const OutputPort& get_ready_output_port() const { return get_output_port(1); }
  const OutputPort& get_counters_output_port() const {
    return get_output_port(2);
  }

 private:
  void Step(const Context& context,
            ForceTorqueSensorState* state) const override;

  ForceTorqueSensor sensor_;
  Eigen::Vector3d p_SE_;
};

}  // namespace dual_proxy
