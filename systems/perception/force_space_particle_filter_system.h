// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "dual_proxy/common/face.h"
#include "dual_proxy/perception/force_space_particle_filter.h"

namespace dual_proxy {

/** Finds the directions of contact: ForceSpaceParticleFilter as a system.

@system
name: ForceSpaceParticleFilterSystem
input_ports:
- sensed_force
- velocity
- motion_force
- contact_force
- prior
output_ports:
- force_selection
- dimension
- particles
- force_direction
- direction_uncertainty
- dimension_confidence
- counters
@endsystem

Input ports, vectors in the base frame B:
- `sensed_force`, 3, N: F_s, mean over the last period.
- `velocity`, 3, m/s: of the tool point, likewise.
- `motion_force`, 3, N: F_m, likewise.
- `contact_force`, 3, N: F_f, likewise.
- `prior`, abstract Eigen::Matrix3Xd, k <= 8 columns: expected normals
  (optional). One that is not as it should be leaves the one before in force.

Output ports:
- `force_selection`, 9: Omega_f, row-major, in B.
- `dimension`, 1: 0 to 3.
- `particles`, 3 num_particles: particle after particle, in B.
- `force_direction`, 3: U1, the main direction, in B; zero at dimension 0.
- `direction_uncertainty`, 1, rad: the true direction is within this angle with
  95 %; see ForceSpaceParticleFilterState.
- `dimension_confidence`, 1: the probability that the dimension is right.
- `counters`, 2: updates refused (kBadInput), updates with kAllWeightsZero.

Inputs that are not connected are zero. Steps every `params.period`; the outputs
are those of the last step, dimension 0 before the first, without feedthrough.
WindowMeanSystem makes the means. An angular filter is a second instance, fed
with moments. */
class ForceSpaceParticleFilterSystem final
    : public Face<ForceSpaceParticleFilterState> {
 public:
  /** @param seed of scatter and resampling.
  @throws std::invalid_argument if `params` is invalid. */
  explicit ForceSpaceParticleFilterSystem(
      const ForceSpaceParticleFilterParams& params = {},
      std::uint64_t seed = 0);

  const InputPort& get_sensed_force_input_port() const {
    return get_input_port(0);
  }
  const InputPort& get_velocity_input_port() const { return get_input_port(1); }
  const InputPort& get_motion_force_input_port() const {
    return get_input_port(2);
  }
  const InputPort& get_contact_force_input_port() const {
    return get_input_port(3);
  }
  const InputPort& get_prior_input_port() const { return get_input_port(4); }
  const OutputPort& get_force_selection_output_port() const {
    return get_output_port(0);
  }
  const OutputPort& get_dimension_output_port() const {
    return get_output_port(1);
  }
  const OutputPort& get_particles_output_port() const {
    return get_output_port(2);
  }
  const OutputPort& get_force_direction_output_port() const {
    return get_output_port(3);
  }
  const OutputPort& get_direction_uncertainty_output_port() const {
    return get_output_port(4);
  }
  const OutputPort& get_dimension_confidence_output_port() const {
    return get_output_port(5);
  }
  const OutputPort& get_counters_output_port() const {
    return get_output_port(6);
  }

 private:
  void Step(const Context& context,
            ForceSpaceParticleFilterState* state) const override;

  ForceSpaceParticleFilter filter_;
};

}  // namespace dual_proxy
