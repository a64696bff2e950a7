// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/random.h"

#include <bit>
#include <cmath>
#include <numbers>

#include "dual_proxy/common/elementary.h"
#include "dual_proxy/common/vector_math.h"

namespace dual_proxy {

namespace {

// One step of splitmix64.
std::uint64_t SplitMix(std::uint64_t* state) noexcept {
  std::uint64_t z = *state += 0x9E3779B97F4A7C15ULL;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31);
}

}  // namespace

std::uint64_t SplitSeed(std::uint64_t seed, std::uint64_t stream) noexcept {
  // Twice, as neighbouring seeds and neighbouring streams must not meet.
  std::uint64_t state = SplitMix(&seed) + stream;
  return SplitMix(&state);
}

RandomStream::RandomStream(std::uint64_t seed) noexcept {
  for (std::uint64_t& word : s_) word = SplitMix(&seed);
}

std::uint64_t RandomStream::Next() noexcept {
  const std::uint64_t result = std::rotl(s_[0] + s_[3], 23) + s_[0];
  const std::uint64_t t = s_[1] << 17;
  s_[2] ^= s_[0];
  s_[3] ^= s_[1];
  s_[1] ^= s_[2];
  s_[0] ^= s_[3];
  s_[2] ^= t;
  s_[3] = std::rotl(s_[3], 45);
  return result;
}

double RandomStream::Uniform() noexcept {
  return static_cast<double>(Next() >> 11) * 0x1.0p-53;
}

double RandomStream::Normal() noexcept {
  if (has_spare_) {
    has_spare_ = false;
    return spare_;
  }
  // 1 - u lies in (0, 1], so the logarithm is finite.
  const double radius = std::sqrt(-2.0 * LogOfPositive(1.0 - Uniform()));
  const auto [sin, cos] = CalcSinCos(2.0 * std::numbers::pi * Uniform());
  spare_ = radius * sin;
  has_spare_ = true;
  return radius * cos;
}

}  // namespace dual_proxy
