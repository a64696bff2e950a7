// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <drake/math/rigid_transform.h>
#include <drake/systems/framework/leaf_system.h>

#include "dual_proxy/control/arm_model.h"

namespace dual_proxy {

/** Pose and twist of the tool point from the arm's state; no memory.

@system
name: ArmKinematicsSystem
input_ports:
- robot_state
output_ports:
- robot_pose
- robot_velocity
@endsystem

Input port:
- `robot_state`, 14: [q; v], rad, rad/s.

Output ports, in the base frame B; not numbers where the state is none:
- `robot_pose`, abstract RigidTransformd: X_BE.
- `robot_velocity`, 6: [linear; angular] of E, m/s, rad/s. */
class ArmKinematicsSystem final : public drake::systems::LeafSystem<double> {
 public:
  using InputPort = drake::systems::InputPort<double>;
  using OutputPort = drake::systems::OutputPort<double>;

  ArmKinematicsSystem(const ArmKinematicsSystem&) = delete;
  ArmKinematicsSystem& operator=(const ArmKinematicsSystem&) = delete;
  ArmKinematicsSystem(ArmKinematicsSystem&&) = delete;
  ArmKinematicsSystem& operator=(ArmKinematicsSystem&&) = delete;

  /** @param arm the model of the arm.
  @throws std::invalid_argument if it is invalid. */
  explicit ArmKinematicsSystem(const ArmModelParams<7>& arm);

  const InputPort& get_robot_state_input_port() const {
    return get_input_port(0);
  }
  const OutputPort& get_robot_pose_output_port() const {
    return get_output_port(0);
  }
  const OutputPort& get_robot_velocity_output_port() const {
    return get_output_port(1);
  }

 private:
  using Context = drake::systems::Context<double>;

  void CalcPose(const Context& context,
                drake::math::RigidTransformd* X_BE) const;
  void CalcVelocity(const Context& context,
                    drake::systems::BasicVector<double>* velocity) const;

  ArmModel<7> arm_;
};

}  // namespace dual_proxy
