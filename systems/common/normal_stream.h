// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

#include "dual_proxy/common/instruction_set.h"

namespace dual_proxy {

/** A seeded stream of standard normals, made many at a time: eight xoshiro256++
(see RandomStream) side by side, and Box-Muller. Values depend on the seed
alone, not on the instructions, the compiler or the platform. Copyable; a copy
continues with the same numbers. No allocation. */
class NormalStream {
 public:
  /** Fill() makes them in groups of as many. */
  static constexpr int kGroup = 16;

  explicit NormalStream(std::uint64_t seed = 0) noexcept;

  /** Writes `count` independent standard normals, within 8.5 of zero. The last
  group is drawn whole; what of it is not asked for is dropped. */
  void Fill(int count, double* normals,
            InstructionSet instruction_set = FastestInstructionSet()) noexcept;

 private:
  // Word after word of the generators' states, each for all eight.
  std::array<std::uint64_t, 4 * 8> state_{};
};

}  // namespace dual_proxy
