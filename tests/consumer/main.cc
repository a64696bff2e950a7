// SPDX-License-Identifier: BSD-3-Clause
// Finds the direction of a contact from the force on the tool, without Drake.
#include <cstdio>

#include <Eigen/Core>

#include "dual_proxy/perception/force_space_particle_filter.h"

int main() {
  const dual_proxy::ForceSpaceParticleFilter filter;
  dual_proxy::ForceSpaceParticleFilterState state = filter.MakeState();

  // The tool rests on a table, and the controller presses with 8 N.
  const Eigen::Vector3d force(0, 0, -8);
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  for (int i = 0; i < 15; ++i) {
    filter.Update(force, /* velocity = */ zero, /* motion_force = */ force,
                  /* contact_force = */ zero, &state);
  }

  const Eigen::Vector3d normal = state.singular_vectors.col(0);
  std::printf("dimension %d, normal %.2f %.2f %.2f\n", state.dimension,
              normal[0], normal[1], normal[2]);
  return state.dimension == 1 && normal[2] < -0.99 ? 0 : 1;
}
