// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/normal_stream.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "dual_proxy/common/per_instruction_set.h"
#include "dual_proxy/common/random.h"
#include "dual_proxy/common/vector_math.h"

namespace dual_proxy {
namespace {

constexpr int kLanes = 8;

// A word of each generator. Compilers split it where vectors are shorter; as
// a vector it stays in registers between the steps.
using Lanes = std::uint64_t __attribute__((vector_size(8 * kLanes)));

// One pair by Box-Muller.
DUAL_PROXY_INLINE void MakeNormals(std::uint64_t a, std::uint64_t b,
                                   double* first, double* second) noexcept {
  // 52 bits as a number in [1, 2), from which one in (0, 1] and one in
  // [-1/2, 1/2) are made.
  constexpr std::uint64_t kOne = 0x3ff0000000000000;
  const double u = 2 - std::bit_cast<double>((a >> 12) | kOne);
  const double t = std::bit_cast<double>((b >> 12) | kOne) - 1.5;
  const double radius = std::sqrt(-2 * LogOfPositive(u));
  // A quarter of the circle; two of the bits that are left choose which.
  double sin{};
  double cos{};
  SinCosOfQuarterTurns(t, &sin, &cos);
  const std::uint64_t sin_bits = std::bit_cast<std::uint64_t>(sin);
  const std::uint64_t cos_bits = std::bit_cast<std::uint64_t>(cos);
  const std::uint64_t swap = (sin_bits ^ cos_bits) & (0 - (b & 1));
  const double signed_radius = std::bit_cast<double>(
      std::bit_cast<std::uint64_t>(radius) ^ ((b & 2) << 62));
  *first = signed_radius * std::bit_cast<double>(cos_bits ^ swap);
  *second = signed_radius * std::bit_cast<double>(sin_bits ^ swap);
}

DUAL_PROXY_INLINE void FillGroups(std::uint64_t* __restrict state,
                                  int num_groups, double* __restrict normals) {
  Lanes s[4];
  std::memcpy(s, state, sizeof(s));
  for (int group = 0; group < num_groups; ++group) {
    std::uint64_t words[2 * kLanes];
    for (int i = 0; i < 2; ++i) {
      const Lanes sum = s[0] + s[3];
      const Lanes result = ((sum << 23) | (sum >> 41)) + s[0];
      std::memcpy(words + kLanes * i, &result, sizeof(result));
      const Lanes t = s[1] << 17;
      s[2] ^= s[0];
      s[3] ^= s[1];
      s[1] ^= s[2];
      s[0] ^= s[3];
      s[2] ^= t;
      s[3] = (s[3] << 45) | (s[3] >> 19);
    }
    for (int i = 0; i < kLanes; ++i) {
      MakeNormals(words[i], words[kLanes + i], normals + i,
                  normals + kLanes + i);
    }
    normals += 2 * kLanes;
  }
  std::memcpy(state, s, sizeof(s));
}

}  // namespace

NormalStream::NormalStream(std::uint64_t seed) noexcept {
  for (std::size_t i = 0; i < state_.size(); ++i) {
    state_[i] = SplitSeed(seed, i);
  }
}

void NormalStream::Fill(int count, double* normals,
                        InstructionSet instruction_set) noexcept {
  static_assert(kGroup == 2 * kLanes);
  const int num_groups = count / kGroup;
  const auto fill = PerInstructionSet<FillGroups>::Run;
  fill(instruction_set, state_.data(), num_groups, normals);
  const int rest = count - num_groups * kGroup;
  if (rest > 0) {
    double group[kGroup];
    fill(instruction_set, state_.data(), 1, group);
    std::copy_n(group, rest, normals + num_groups * kGroup);
  }
}

}  // namespace dual_proxy
