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

// The generators' states are vectors of `kWidth`, the width of the
// instructions, which stay in registers between the steps.
template <int kWidth>
DUAL_PROXY_INLINE void FillGroups(std::uint64_t* __restrict state,
                                  int num_groups, double* __restrict normals) {
  using Words [[gnu::vector_size(8 * kWidth)]] = std::uint64_t;
  constexpr int kParts = kLanes / kWidth;
  Words s[4][kParts];
  std::memcpy(s, state, sizeof(s));
  for (int group = 0; group < num_groups; ++group) {
    std::uint64_t words[2 * kLanes];
    for (int step = 0; step < 2; ++step) {
      for (int part = 0; part < kParts; ++part) {
        const Words sum = s[0][part] + s[3][part];
        const Words result = ((sum << 23) | (sum >> 41)) + s[0][part];
        std::memcpy(words + kLanes * step + kWidth * part, &result,
                    sizeof(result));
        const Words t = s[1][part] << 17;
        s[2][part] ^= s[0][part];
        s[3][part] ^= s[1][part];
        s[1][part] ^= s[2][part];
        s[0][part] ^= s[3][part];
        s[2][part] ^= t;
        s[3][part] = (s[3][part] << 45) | (s[3][part] >> 19);
      }
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
  const auto fill =
      PerInstructionSet<FillGroups<2>, FillGroups<4>, FillGroups<8>>::Run;
  fill(instruction_set, state_.data(), num_groups, normals);
  const int rest = count - num_groups * kGroup;
  if (rest > 0) {
    double group[kGroup];
    fill(instruction_set, state_.data(), 1, group);
    std::copy_n(group, rest, normals + num_groups * kGroup);
  }
}

}  // namespace dual_proxy
