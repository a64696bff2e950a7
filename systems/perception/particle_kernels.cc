// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/perception/particle_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "dual_proxy/common/per_instruction_set.h"

namespace dual_proxy {
namespace {

DUAL_PROXY_INLINE double Clamp01(double value) noexcept {
  const double positive = value > 0 ? value : 0;
  return positive < 1 ? positive : 1;
}

// (x, y, z) over its norm, or zero if that is at most `epsilon` or `is_zero`.
DUAL_PROXY_INLINE void Normalize(double x, double y, double z, bool is_zero,
                                 double epsilon, double* unit_x, double* unit_y,
                                 double* unit_z) noexcept {
  const double norm = std::sqrt(x * x + y * y + z * z);
  const bool keep = !is_zero && norm > epsilon;
  *unit_x = keep ? x / norm : 0;
  *unit_y = keep ? y / norm : 0;
  *unit_z = keep ? z / norm : 0;
}

DUAL_PROXY_INLINE void ScatterBody(
    double mean, double std, double epsilon, const double* __restrict x,
    const double* __restrict y, const double* __restrict z, int count,
    const double* __restrict noise_x, const double* __restrict noise_y,
    const double* __restrict noise_z, double* __restrict moved_x,
    double* __restrict moved_y, double* __restrict moved_z) {
  for (int i = 0; i < count; ++i) {
    const bool is_centre = x[i] * x[i] + y[i] * y[i] + z[i] * z[i] < 0.5;
    Normalize(x[i] + (mean + std * noise_x[i]),
              y[i] + (mean + std * noise_y[i]),
              z[i] + (mean + std * noise_z[i]), is_centre, epsilon, moved_x + i,
              moved_y + i, moved_z + i);
  }
}

DUAL_PROXY_INLINE void ArcBody(double from_x, double from_y, double from_z,
                               double to_x, double to_y, double to_z,
                               double epsilon, int count, double* __restrict x,
                               double* __restrict y, double* __restrict z) {
  for (int i = 0; i < count; ++i) {
    const double s = (i + 0.5) / count;
    Normalize(s * to_x + (1 - s) * from_x, s * to_y + (1 - s) * from_y,
              s * to_z + (1 - s) * from_z, false, epsilon, x + i, y + i, z + i);
  }
}

DUAL_PROXY_INLINE double Weigh(const PaperWeights& w, double x, double y,
                               double z) noexcept {
  const double force = x * w.force[0] + y * w.force[1] + z * w.force[2];
  const double speed =
      std::abs(x * w.velocity[0] + y * w.velocity[1] + z * w.velocity[2]);
  const double on_sphere =
      Clamp01((force - w.force_low) * w.force_slope) *
      Clamp01(1 - (speed - w.velocity_low) * w.velocity_slope);
  return x * x + y * y + z * z > 0.5 ? on_sphere : w.centre;
}

DUAL_PROXY_INLINE void WeighBody(PaperWeights weights,
                                 const double* __restrict x,
                                 const double* __restrict y,
                                 const double* __restrict z, int count,
                                 double* __restrict result) {
  for (int i = 0; i < count; ++i) result[i] = Weigh(weights, x[i], y[i], z[i]);
}

// Weights are added in as many runs side by side, as each addition waits for
// the one before; a run's sums start at zero and are lifted afterwards.
constexpr int kRuns = 4;

// Weights times 2^200, so that no positive total is too small to divide by.
constexpr double kWeightScale = 0x1p200;

// The index of the first new particle that lies behind each of a run's.
DUAL_PROXY_INLINE void BoundaryBody(double start, double scale, double end,
                                    int num_chosen,
                                    double* __restrict cumulative, int count,
                                    std::int32_t* __restrict boundaries) {
  for (int i = 0; i < count; ++i) {
    cumulative[i] += start;
    boundaries[i] =
        num_chosen - static_cast<std::int32_t>(end - cumulative[i] * scale);
  }
}

// Sums have as many lanes, whatever the width of the instructions, which take
// `kWidth` of them at a time.
constexpr int kLanes = 8;

// Sums of x, x x and x y, kLanes of each.
template <int kWidth>
DUAL_PROXY_INLINE void SumBody(const double* __restrict x,
                               const double* __restrict y, int count,
                               double* __restrict lanes) {
  using Numbers [[gnu::vector_size(8 * kWidth)]] = double;
  constexpr int kParts = kLanes / kWidth;
  Numbers sums[3][kParts] = {};
  for (int i = 0; i < count; i += kLanes) {
    for (int part = 0; part < kParts; ++part) {
      Numbers px, py;
      std::memcpy(&px, x + i + kWidth * part, sizeof(px));
      std::memcpy(&py, y + i + kWidth * part, sizeof(py));
      sums[0][part] += px;
      sums[1][part] += px * px;
      sums[2][part] += px * py;
    }
  }
  std::memcpy(lanes, sums, sizeof(sums));
}

}  // namespace

void ScatterParticles(InstructionSet instruction_set, const Scatter& scatter,
                      const ParticleList& particles, int count,
                      NormalStream* normals,
                      const MutableParticleList& moved) noexcept {
  constexpr int kGroup = NormalStream::kGroup;
  static_assert(kScatterBlock % kGroup == 0);
  double noise[3 * kScatterBlock];
  for (int i = 0; i < count; i += kScatterBlock) {
    const int size = std::min(kScatterBlock, count - i);
    const int drawn = (size + kGroup - 1) / kGroup * kGroup;
    normals->Fill(3 * drawn, noise, instruction_set);
    PerInstructionSet<ScatterBody>::Run(
        instruction_set, scatter.mean, scatter.std, scatter.epsilon,
        particles.x + i, particles.y + i, particles.z + i, size, noise,
        noise + drawn, noise + 2 * drawn, moved.x + i, moved.y + i,
        moved.z + i);
  }
}

void MakeArc(InstructionSet instruction_set, const double from[3],
             const double to[3], double epsilon, int count,
             const MutableParticleList& particles) noexcept {
  PerInstructionSet<ArcBody>::Run(instruction_set, from[0], from[1], from[2],
                                  to[0], to[1], to[2], epsilon, count,
                                  particles.x, particles.y, particles.z);
}

void WeighParticles(InstructionSet instruction_set, const PaperWeights& weights,
                    const ParticleList& particles, int count,
                    double* result) noexcept {
  PerInstructionSet<WeighBody>::Run(instruction_set, weights, particles.x,
                                    particles.y, particles.z, count, result);
}

double WeighParticle(const PaperWeights& weights, double x, double y,
                     double z) noexcept {
  return Weigh(weights, x, y, z);
}

bool ChooseParticles(InstructionSet instruction_set, int count, double uniform,
                     int num_chosen, double* weights,
                     std::int32_t* chosen) noexcept {
  // Runs of equal length; the last one takes what is left.
  const int length = count / kRuns;
  double sums[kRuns] = {};
  for (int i = 0; i < length; ++i) {
    for (int run = 0; run < kRuns; ++run) {
      double& weight = weights[run * length + i];
      weight = sums[run] += kWeightScale * weight;
    }
  }
  for (int i = kRuns * length; i < count; ++i) {
    weights[i] = sums[kRuns - 1] += kWeightScale * weights[i];
  }
  // The first weight of a run is added to the last sum of the run before, so
  // cumulative weights never decrease, and stay the same where a weight is
  // zero.
  double starts[kRuns + 1] = {};
  for (int run = 0; run < kRuns; ++run) {
    starts[run + 1] = starts[run] + sums[run];
  }
  const double total = starts[kRuns];
  if (!(total > 0)) return false;

  // As many new particles lie before the end of a particle's share as there are
  // i >= 0 with i + offset < n share. With 32 bits of the offset n + offset is
  // exact, and rounding cannot move the end of the last share.
  const double offset = std::floor(uniform * 0x1p32) * 0x1p-32;
  const double scale = num_chosen / total;
  const double end = num_chosen + offset;
  std::memset(chosen, 0, sizeof(*chosen) * (num_chosen + 1));
  constexpr int kBlock = 256;
  std::int32_t boundaries[kBlock];
  for (int run = 0; run < kRuns; ++run) {
    const int run_end = run + 1 < kRuns ? (run + 1) * length : count;
    for (int i = run * length; i < run_end; i += kBlock) {
      const int size = std::min(kBlock, run_end - i);
      PerInstructionSet<BoundaryBody>::Run(instruction_set, starts[run], scale,
                                           end, num_chosen, weights + i, size,
                                           boundaries);
      // Where one particle's share ends the next one's begins. Of those that
      // begin at the same place the last one has a share.
      for (int k = 0; k < size; ++k) chosen[boundaries[k]] = i + k + 1;
    }
  }
  return true;
}

void CopyChosen(const ParticleList& particles, const std::int32_t* chosen,
                int num_chosen, const MutableParticleList& result) noexcept {
  std::int32_t current = 0;
  for (int i = 0; i < num_chosen; ++i) {
    current = std::max(current, chosen[i]);
    const double x = particles.x[current];
    const double y = particles.y[current];
    const double z = particles.z[current];
    result.x[i] = x;
    result.y[i] = y;
    result.z[i] = z;
  }
}

ParticleMoments CalcMoments(InstructionSet instruction_set,
                            const ParticleList& particles, int count) noexcept {
  const int whole = count - count % kLanes;
  double result[3][3];
  const double* const axes[3] = {particles.x, particles.y, particles.z};
  for (int i = 0; i < 3; ++i) {
    const double* a = axes[i];
    const double* b = axes[(i + 1) % 3];
    double lanes[3][kLanes];
    PerInstructionSet<SumBody<2>, SumBody<4>, SumBody<8>>::Run(
        instruction_set, a, b, whole, lanes[0]);
    for (int k = 0; k < count - whole; ++k) {
      lanes[0][k] += a[whole + k];
      lanes[1][k] += a[whole + k] * a[whole + k];
      lanes[2][k] += a[whole + k] * b[whole + k];
    }
    for (int k = 0; k < 3; ++k) {
      const double* s = lanes[k];
      result[k][i] =
          ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
    }
  }
  const auto& [sum, square, product] = result;
  return {sum[0],    sum[1],     sum[2],     square[0], square[1],
          square[2], product[0], product[2], product[1]};
}

}  // namespace dual_proxy
