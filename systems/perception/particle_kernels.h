// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "dual_proxy/common/instruction_set.h"
#include "dual_proxy/common/normal_stream.h"

// The loops over particles of the filter, on one array per coordinate. A
// particle is a unit vector, or exactly zero: the centre. Results are the same
// bits with every instruction set. Nothing here allocates or throws; arrays
// that are written overlap no other.

namespace dual_proxy {

/** The coordinates of a list of particles, which belong to someone else. */
struct ParticleList {
  const double* x{};
  const double* y{};
  const double* z{};
};
struct MutableParticleList {
  double* x{};
  double* y{};
  double* z{};

  /** What follows the first `count`. */
  MutableParticleList Skip(int count) const noexcept {
    return {x + count, y + count, z + count};
  }
  operator ParticleList() const noexcept { return {x, y, z}; }
};

/** How particles are moved. */
struct Scatter {
  double mean{};     ///< Per axis.
  double std{};      ///< Standard deviation per axis.
  double epsilon{};  ///< What is no longer than this becomes zero.
};

/** Adds normally distributed numbers to the coordinates of all particles but
those at the centre, and normalises. Three numbers are drawn per particle, also
for the centre's: of each kScatterBlock particles those for x, then for y, for
z, each in whole groups of NormalStream. */
void ScatterParticles(InstructionSet instruction_set, const Scatter& scatter,
                      const ParticleList& particles, int count,
                      NormalStream* normals,
                      const MutableParticleList& moved) noexcept;
inline constexpr int kScatterBlock = 256;

/** Particles on the arc from `from` to `to` (each a unit vector or zero):
number i of `count` at s to + (1 - s) from, s = (i + 1/2) / count, normalised,
or zero if no longer than `epsilon`. */
void MakeArc(InstructionSet instruction_set, const double from[3],
             const double to[3], double epsilon, int count,
             const MutableParticleList& particles) noexcept;

/** The product of a force and a velocity ramp, eq. (6)-(8), each clamped to
[0, 1], with what does not depend on the particle worked out. */
struct PaperWeights {
  double force[3]{};     ///< N, in B.
  double velocity[3]{};  ///< m/s, in B.
  double force_low{};
  double force_slope{};  ///< 1 / (force_high - force_low).
  double velocity_low{};
  double velocity_slope{};
  double centre{};  ///< The weight of the centre.
};

/** The weight of each particle. */
void WeighParticles(InstructionSet instruction_set, const PaperWeights& weights,
                    const ParticleList& particles, int count,
                    double* result) noexcept;

/** The weight of one particle: the same bits. */
double WeighParticle(const PaperWeights& weights, double x, double y,
                     double z) noexcept;

/** Low-variance resampling (Algorithm 2): new particle i is the first whose
cumulative weight exceeds (i + offset) / num_chosen of the total.
@param[in,out] weights  `count` of them, each in [0, 1]; then the cumulative
  ones, scaled.
@param uniform  in [0, 1); the offset is its first 32 bits.
@param[out] chosen  num_chosen + 1 entries for CopyChosen(): new particle i is
  the largest of the entries 0 to i.
@returns false if all weights are zero, when `chosen` is not written. */
bool ChooseParticles(InstructionSet instruction_set, int count, double uniform,
                     int num_chosen, double* weights,
                     std::int32_t* chosen) noexcept;

/** Copies the particles that ChooseParticles() has chosen. */
void CopyChosen(const ParticleList& particles, const std::int32_t* chosen,
                int num_chosen, const MutableParticleList& result) noexcept;

/** Sums over a list of particles. */
struct ParticleMoments {
  double x{}, y{}, z{};
  double xx{}, yy{}, zz{}, xy{}, xz{}, yz{};
};
ParticleMoments CalcMoments(InstructionSet instruction_set,
                            const ParticleList& particles, int count) noexcept;

}  // namespace dual_proxy
