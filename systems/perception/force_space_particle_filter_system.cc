// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/perception/force_space_particle_filter_system.h"

namespace dual_proxy {

using State = ForceSpaceParticleFilterState;

ForceSpaceParticleFilterSystem::ForceSpaceParticleFilterSystem(
    const ForceSpaceParticleFilterParams& params, std::uint64_t seed)
    : Face(Feedthrough::kNo), filter_(params) {
  for (const char* name :
       {"sensed_force", "velocity", "motion_force", "contact_force"}) {
    DeclareVectorInputPort(name, 3);
  }
  DeclareValueInput<Eigen::Matrix3Xd>("prior");
  DeclareMemory(filter_.MakeState(seed), params.period);
  DeclareVectorOutput("force_selection", 9,
                      [](const State& state, Vector selection) {
                        WriteRows(state.force_selection, selection);
                      });
  DeclareVectorOutput("dimension", 1, [](const State& state, Vector dimension) {
    dimension[0] = state.dimension;
  });
  DeclareVectorOutput("particles", 3 * params.num_particles,
                      [](const State& state, Vector particles) {
                        WriteRows(state.particles.transpose(), particles);
                      });
  DeclareVectorOutput("force_direction", 3,
                      [](const State& state, Vector direction) {
                        direction.setZero();
                        if (state.dimension > 0) {
                          direction = state.singular_vectors.col(0);
                        }
                      });
  DeclareVectorOutput("direction_uncertainty", 1,
                      [](const State& state, Vector uncertainty) {
                        uncertainty[0] = state.direction_uncertainty;
                      });
  DeclareVectorOutput("dimension_confidence", 1,
                      [](const State& state, Vector confidence) {
                        confidence[0] = state.dimension_confidence;
                      });
  DeclareVectorOutput("counters", 2, [](const State& state, Vector counters) {
    counters << static_cast<double>(state.bad_inputs),
        static_cast<double>(state.all_weights_zero);
  });
}

void ForceSpaceParticleFilterSystem::Step(const Context& context,
                                          State* state) const {
  if (get_prior_input_port().HasValue(context)) {
    filter_.SetPrior(get_prior_input_port().Eval<Eigen::Matrix3Xd>(context),
                     state);
  }
  filter_.Update(EvalVector<3>(get_sensed_force_input_port(), context),
                 EvalVector<3>(get_velocity_input_port(), context),
                 EvalVector<3>(get_motion_force_input_port(), context),
                 EvalVector<3>(get_contact_force_input_port(), context), state);
}

}  // namespace dual_proxy
