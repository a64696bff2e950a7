// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/instruction_set.h"

#include <cstddef>

#include "dual_proxy/common/per_instruction_set.h"

namespace dual_proxy {
namespace {

constexpr InstructionSet kAll[] = {
    InstructionSet::kBaseline, InstructionSet::kAvx2, InstructionSet::kAvx512};

std::size_t CountAvailable() noexcept {
#if DUAL_PROXY_HAS_X86_VECTORS
  __builtin_cpu_init();
  if (!__builtin_cpu_supports("avx2")) return 1;
  return __builtin_cpu_supports("avx512f") ? 3 : 2;
#else
  return 1;
#endif
}

}  // namespace

std::span<const InstructionSet> AvailableInstructionSets() noexcept {
  static const std::size_t count = CountAvailable();
  return std::span(kAll).first(count);
}

}  // namespace dual_proxy
