// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/station/sensor_reaction_system.h"

#include <drake/common/value.h>

namespace dual_proxy {

Eigen::Matrix<double, 6, 1> ReadSensorReaction(
    const SpatialForces& forces, drake::multibody::JointIndex sensor_joint) {
  const drake::multibody::SpatialForce<double>& force = forces.at(sensor_joint);
  Eigen::Matrix<double, 6, 1> wrench;
  wrench << force.translational(), force.rotational();
  return wrench;
}

SensorReactionSystem::SensorReactionSystem(
    drake::multibody::JointIndex sensor_joint)
    : sensor_joint_(sensor_joint) {
  const auto& input = DeclareAbstractInputPort("reaction_forces",
                                               drake::Value<SpatialForces>());
  DeclareVectorOutputPort("reaction", 6, &SensorReactionSystem::CalcReaction,
                          {input.ticket()});
}

void SensorReactionSystem::CalcReaction(
    const drake::systems::Context<double>& context,
    drake::systems::BasicVector<double>* reaction) const {
  reaction->get_mutable_value() = ReadSensorReaction(
      get_reaction_forces_input_port().Eval<SpatialForces>(context),
      sensor_joint_);
}

}  // namespace dual_proxy
