// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include <drake/multibody/tree/multibody_tree_indexes.h>

#include "dual_proxy/common/face.h"
#include "dual_proxy/loop/teleop_loop.h"

namespace dual_proxy {

/** What a TeleopLoopSystem remembers. */
struct TeleopLoopMemory {
  TeleopLoopState<SerialArm<7>> loop;
  Vector7 torque{Vector7::Zero()};  ///< N m, of the last step.
};

/** Both sides, the link, the simulated sensor, device and operator as one
system: TeleopLoop, for a plant to be connected to.

@system
name: TeleopLoopSystem
input_ports:
- robot_state
- reaction_forces
output_ports:
- torque
- signals
- sensed_wrench
- device_pose
- device_wrench
- force_selection
- dimension
- moment_selection
- moment_dimension
@endsystem

Input ports:
- `robot_state`, 14: [q; v], rad, rad/s.
- `reaction_forces`, abstract std::vector<SpatialForce<double>>: the plant's.

Output ports, in the base frame B unless said:
- `torque`, 7, N m: with gravity compensation.
- `signals`: all results, by loop().layout().
- `sensed_wrench`, 6: [force; moment] at E, N, N m.
- `device_pose`, abstract RigidTransformd: X_DH, in the device's frame D.
- `device_wrench`, 6: [force; moment], N, N m, of the device on the hand, in D.
- `force_selection`, 9, row-major, and `dimension`, 1: what the filter has
found.
- `moment_selection`, `moment_dimension`: the angular filter, likewise.

Steps every period of the control; the outputs are those of the last step.
Before the first the torque holds the arm at `q_start`, if given; the rest is
zero. The same bits as the separate systems RobotSideSystem, HapticSideSystem
and two CommunicationChannelSystems. */
class TeleopLoopSystem final : public Face<TeleopLoopMemory> {
 public:
  /** @param sensor_joint  PandaScene::sensor_joint.
  @param q_start rad, where the arm will be when the run starts.
  @throws std::invalid_argument if parameters are invalid. */
  TeleopLoopSystem(const TeleopLoopParams<SerialArm<7>>& params,
                   drake::multibody::JointIndex sensor_joint,
                   const std::optional<Vector7>& q_start = std::nullopt);

  const TeleopLoop<SerialArm<7>>& loop() const { return loop_; }

  const InputPort& get_robot_state_input_port() const {
    return get_input_port(0);
  }
  const InputPort& get_reaction_forces_input_port() const {
    return get_input_port(1);
  }
  const OutputPort& get_torque_output_port() const {
    return get_output_port(0);
  }
  const OutputPort& get_signals_output_port() const {
    return get_output_port(1);
  }

 private:
  void Step(const Context& context, TeleopLoopMemory* memory) const override;

  TeleopLoop<SerialArm<7>> loop_;
  drake::multibody::JointIndex sensor_joint_;
};

}  // namespace dual_proxy
