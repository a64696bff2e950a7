// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/perception/contact_kernels.h"

#include <algorithm>
#include <cmath>

#include "dual_proxy/common/per_instruction_set.h"
#include "dual_proxy/common/vector_math.h"

namespace dual_proxy {
namespace {

DUAL_PROXY_INLINE void MoveBody(
    ContactMove move, double sign, const double* __restrict x,
    const double* __restrict y, const double* __restrict z, int count,
    const double* __restrict e1, const double* __restrict e2,
    double* __restrict moved_x, double* __restrict moved_y,
    double* __restrict moved_z) {
  const double first_x = sign * move.first[0];
  const double first_y = sign * move.first[1];
  const double first_z = sign * move.first[2];
  const double second_x = sign * move.second[0];
  const double second_y = sign * move.second[1];
  const double second_z = sign * move.second[2];
  for (int i = 0; i < count; ++i) {
    const double px = move.centre[0] + move.keep * (x[i] - move.normal[0]) +
                      (first_x * e1[i] + second_x * e2[i]);
    const double py = move.centre[1] + move.keep * (y[i] - move.normal[1]) +
                      (first_y * e1[i] + second_y * e2[i]);
    const double pz = move.centre[2] + move.keep * (z[i] - move.normal[2]) +
                      (first_z * e1[i] + second_z * e2[i]);
    const double scale = 1 / std::sqrt(px * px + py * py + pz * pz);
    moved_x[i] = px * scale;
    moved_y[i] = py * scale;
    moved_z[i] = pz * scale;
  }
}

DUAL_PROXY_INLINE double Positive(double value) noexcept {
  return value > 0 ? value : 0;
}

// Share of the normal force by which friction may be against the sliding, as
// normals are not exact.
constexpr double kSlack = 0.05;

// Keeps quotients of zero by zero at zero.
constexpr double kTiny = 1e-18;

DUAL_PROXY_INLINE void WeighBody(ContactWeights w, const double* __restrict x,
                                 const double* __restrict y,
                                 const double* __restrict z, int count,
                                 double* __restrict result) {
  for (int i = 0; i < count; ++i) {
    // The velocity into the surface.
    const double into =
        x[i] * w.velocity[0] + y[i] * w.velocity[1] + z[i] * w.velocity[2];
    const double velocity_weight = 1 / (1 + w.velocity_scale * (into * into));

    // The normal without its part along the other contact's, which may push as
    // it likes.
    const double along =
        x[i] * w.other[0] + y[i] * w.other[1] + z[i] * w.other[2];
    double nx = x[i] - along * w.other[0];
    double ny = y[i] - along * w.other[1];
    double nz = z[i] - along * w.other[2];
    const double scale = 1 / std::sqrt(nx * nx + ny * ny + nz * nz + kTiny);
    nx *= scale;
    ny *= scale;
    nz *= scale;

    // Normal force, friction, and the velocity along the surface.
    const double normal = nx * w.force[0] + ny * w.force[1] + nz * w.force[2];
    const double fx = w.force[0] - normal * nx;
    const double fy = w.force[1] - normal * ny;
    const double fz = w.force[2] - normal * nz;
    const double friction2 = fx * fx + fy * fy + fz * fz;
    const double sink =
        nx * w.sliding[0] + ny * w.sliding[1] + nz * w.sliding[2];
    const double vx = w.sliding[0] - sink * nx;
    const double vy = w.sliding[1] - sink * ny;
    const double vz = w.sliding[2] - sink * nz;
    const double speed2 = vx * vx + vy * vy + vz * vz + kTiny;
    const double speed = std::sqrt(speed2);
    const double forward = (fx * vx + fy * vy + fz * vz) / speed;
    const double ramp = Positive((speed - w.sliding_low) * w.sliding_slope);
    const double slides = ramp < 1 ? ramp : 1;

    // What friction cannot be: when it slides, across the velocity, against
    // it, or above the cone; when it sticks, above the cone.
    const double normals = Positive(normal) + w.other_force;
    const double bound = w.friction * normals;
    const double forward2 = forward * forward;
    const double across2 = Positive(friction2 - forward2) /
                           (1 + w.direction_scale * forward2 / speed2);
    const double against = Positive(-forward - kSlack * normals);
    const double above = Positive(forward - bound);
    const double sticks = Positive(std::sqrt(friction2) - bound);
    const double pulls = normal < 0 ? normal : 0;
    const double excess2 =
        slides * (across2 + against * against + above * above) +
        w.sticking_weight * (1 - slides) * (sticks * sticks) + pulls * pulls;
    // Far away from the force all normals are equally unlikely, but not zero.
    const double exponent = -0.5 * w.force_scale * excess2;
    result[i] =
        velocity_weight * ExpOfNonPositive(exponent > -30.0 ? exponent : -30.0);
  }
}

}  // namespace

void MoveContactParticles(InstructionSet instruction_set,
                          const ContactMove& move,
                          const ParticleList& particles, int count,
                          NormalStream* normals,
                          const MutableParticleList& moved) noexcept {
  constexpr int kGroup = NormalStream::kGroup;
  static_assert(kScatterBlock % kGroup == 0);
  double noise[2 * kScatterBlock];
  const int half = (count + 1) / 2;
  for (int i = 0; i < half; i += kScatterBlock) {
    const int size = std::min(kScatterBlock, half - i);
    const int drawn = (size + kGroup - 1) / kGroup * kGroup;
    normals->Fill(2 * drawn, noise, instruction_set);
    const int sizes[2] = {size, std::min(size, count - half - i)};
    for (int part = 0; part < 2; ++part) {
      const int begin = part * half + i;
      PerInstructionSet<MoveBody>::Run(
          instruction_set, move, part == 0 ? 1.0 : -1.0, particles.x + begin,
          particles.y + begin, particles.z + begin, sizes[part], noise,
          noise + drawn, moved.x + begin, moved.y + begin, moved.z + begin);
    }
  }
}

void WeighContactParticles(InstructionSet instruction_set,
                           const ContactWeights& weights,
                           const ParticleList& particles, int count,
                           double* result) noexcept {
  PerInstructionSet<WeighBody>::Run(instruction_set, weights, particles.x,
                                    particles.y, particles.z, count, result);
}

}  // namespace dual_proxy
