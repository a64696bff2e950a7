// SPDX-License-Identifier: BSD-3-Clause
// The same in a Drake diagram, simulated for a second.
#include <cstdio>

#include <drake/systems/analysis/simulator.h>
#include <drake/systems/framework/diagram_builder.h>
#include <drake/systems/primitives/constant_vector_source.h>
#include <Eigen/Core>

#include "dual_proxy/faces/systems.h"

int main() {
  drake::systems::DiagramBuilder<double> builder;
  const auto* force =
      builder.AddSystem<drake::systems::ConstantVectorSource<double>>(
          Eigen::Vector3d(0, 0, -8));
  const auto* filter =
      builder.AddSystem<dual_proxy::ForceSpaceParticleFilterSystem>();
  builder.Connect(force->get_output_port(),
                  filter->GetInputPort("sensed_force"));
  builder.Connect(force->get_output_port(),
                  filter->GetInputPort("motion_force"));
  const auto diagram = builder.Build();

  drake::systems::Simulator<double> simulator(*diagram);
  simulator.AdvanceTo(1.0);

  const auto& context = filter->GetMyContextFromRoot(simulator.get_context());
  const double dimension = filter->GetOutputPort("dimension").Eval(context)[0];
  const Eigen::Vector3d normal =
      filter->GetOutputPort("force_direction").Eval(context);
  std::printf("dimension %.0f, normal %.2f %.2f %.2f\n", dimension, normal[0],
              normal[1], normal[2]);
  return dimension == 1 && normal[2] < -0.99 ? 0 : 1;
}
