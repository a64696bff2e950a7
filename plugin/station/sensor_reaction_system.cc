// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/station/sensor_reaction_system.h"

#include <vector>

#include <drake/common/value.h>
#include <drake/multibody/math/spatial_algebra.h>

namespace dual_proxy {

using drake::multibody::SpatialForce;
using Forces = std::vector<SpatialForce<double>>;

SensorReactionSystem::SensorReactionSystem(
    drake::multibody::JointIndex sensor_joint)
    : sensor_joint_(sensor_joint) {
  const auto& input =
      DeclareAbstractInputPort("reaction_forces", drake::Value<Forces>());
  DeclareVectorOutputPort("reaction", 6, &SensorReactionSystem::CalcReaction,
                          {input.ticket()});
}

void SensorReactionSystem::CalcReaction(
    const drake::systems::Context<double>& context,
    drake::systems::BasicVector<double>* reaction) const {
  const SpatialForce<double>& force =
      get_reaction_forces_input_port().Eval<Forces>(context).at(sensor_joint_);
  auto wrench = reaction->get_mutable_value();
  wrench.head<3>() = force.translational();
  wrench.tail<3>() = force.rotational();
}

}  // namespace dual_proxy
