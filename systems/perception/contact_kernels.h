// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/common/instruction_set.h"
#include "dual_proxy/common/normal_stream.h"
#include "dual_proxy/perception/particle_kernels.h"

// The loops over the particles of one contact: of ContactTracker. What holds
// for particle_kernels.h holds here.

namespace dual_proxy {

/** How a contact's particles are moved: particle rho becomes

    centre + keep (rho - normal) + e_1 first + e_2 second, normalised,

with standard normals e_1 and e_2. */
struct ContactMove {
  double normal[3]{};
  double centre[3]{};
  double keep{1};
  double first[3]{};
  double second[3]{};
};

/** Moves a contact's particles. The second half of them gets the negatives of
the first half's random numbers, so that these do not move the mean. Of each
kScatterBlock particles of the first half the e_1 are drawn, then the e_2, each
in whole groups of NormalStream. */
void MoveContactParticles(InstructionSet instruction_set,
                          const ContactMove& move,
                          const ParticleList& particles, int count,
                          NormalStream* normals,
                          const MutableParticleList& moved) noexcept;

/** The likelihood of a contact normal; see ContactTracker. */
struct ContactWeights {
  double force[3]{};     ///< N, in B: without the part along `other`.
  double velocity[3]{};  ///< m/s, in B.
  double sliding[3]{};   ///< m/s, in B: `velocity` without the part likewise.
  /** Normal of a second contact, or zero. */
  double other[3]{};
  double velocity_scale{};  ///< s^2/m^2: of the square of <rho, v>.
  double force_scale{};     ///< 1/N^2: 1 / sigma_f^2; zero: force says nothing.
  double direction_scale{};   ///< m^2/s^2/N^2: (sigma_v / sigma_f)^2.
  double friction{};          ///< mu at most.
  double sticking_weight{1};  ///< 0: what sticks says nothing of the normal.
  double other_force{};       ///< N: normal force of the other contacts.
  double sliding_low{};       ///< m/s: sticks up to here.
  double sliding_slope{};     ///< s/m: slides 1 / sliding_slope above that.
};

/** The weight of each particle. */
void WeighContactParticles(InstructionSet instruction_set,
                           const ContactWeights& weights,
                           const ParticleList& particles, int count,
                           double* result) noexcept;

}  // namespace dual_proxy
