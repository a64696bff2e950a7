// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

namespace dual_proxy {

/** A seeded stream of random numbers whose values depend on the seed alone, not
on the compiler, the standard library or the platform: xoshiro256++ (Blackman
and Vigna) seeded by splitmix64, normals by Box-Muller. Copyable; a copy
continues with the same numbers. No allocation. */
class RandomStream {
 public:
  explicit RandomStream(std::uint64_t seed = 0) noexcept;

  /** Uniform on [0, 1), 53 bits. */
  double Uniform() noexcept;

  /** Standard normal. */
  double Normal() noexcept;

 private:
  std::uint64_t Next() noexcept;

  std::array<std::uint64_t, 4> s_{};
  double spare_{0};
  bool has_spare_{false};
};

/** The seed of one of several independent streams that share a seed. */
std::uint64_t SplitSeed(std::uint64_t seed, std::uint64_t stream) noexcept;

}  // namespace dual_proxy
