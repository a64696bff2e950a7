// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <drake/multibody/math/spatial_algebra.h>
#include <drake/multibody/tree/multibody_tree_indexes.h>
#include <drake/systems/framework/leaf_system.h>
#include <Eigen/Core>

namespace dual_proxy {

/** Of MultibodyPlant's port `reaction_forces`. */
using SpatialForces = std::vector<drake::multibody::SpatialForce<double>>;

/** What the simulated wrist sensor takes, [force; moment about S's origin], N,
N m, in S: the arm's wrench on the tool.
@param sensor_joint PandaScene::sensor_joint. */
Eigen::Matrix<double, 6, 1> ReadSensorReaction(
    const SpatialForces& forces, drake::multibody::JointIndex sensor_joint);

/** ReadSensorReaction() as a system.

@system
name: SensorReactionSystem
input_ports:
- reaction_forces
output_ports:
- reaction
@endsystem

Input port:
- `reaction_forces`, abstract std::vector<SpatialForce<double>>: the plant's.

Output port:
- `reaction`, 6: [force; moment about S's origin], N, N m, in S.

The wrench has the project's sign already: pressing on a table, the arm pushes
the tool (and the tool the table) down. It still holds the tool's weight and
inertia, as a real sensor's reading does: in standstill it is the wrench of the
tool on its environment minus the tool's weight.

No state; the output at t is of the input at t. */
class SensorReactionSystem final : public drake::systems::LeafSystem<double> {
 public:
  /** @param sensor_joint PandaScene::sensor_joint. */
  explicit SensorReactionSystem(drake::multibody::JointIndex sensor_joint);

  const drake::systems::InputPort<double>& get_reaction_forces_input_port()
      const {
    return get_input_port(0);
  }
  const drake::systems::OutputPort<double>& get_reaction_output_port() const {
    return get_output_port(0);
  }

 private:
  void CalcReaction(const drake::systems::Context<double>& context,
                    drake::systems::BasicVector<double>* reaction) const;

  drake::multibody::JointIndex sensor_joint_;
};

}  // namespace dual_proxy
