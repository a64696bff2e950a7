// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/instruction_set.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <stdexcept>
#include <string>

#include "dual_proxy/common/per_instruction_set.h"

namespace dual_proxy {
namespace {

constexpr InstructionSet kAll[] = {
    InstructionSet::kBaseline, InstructionSet::kAvx2, InstructionSet::kAvx512};

constexpr const char* kVariable = "DUAL_PROXY_INSTRUCTIONS";

std::size_t CountSupported() noexcept {
#if DUAL_PROXY_HAS_X86_VECTORS
  __builtin_cpu_init();
  if (!__builtin_cpu_supports("avx2")) return 1;
  return __builtin_cpu_supports("avx512f") ? 3 : 2;
#else
  return 1;
#endif
}

/** How many the environment allows. */
std::size_t CountAllowed() {
  const char* const name = std::getenv(kVariable);
  if (name == nullptr) return std::size(kAll);
  if (const auto set = EnumFromString<InstructionSet>(name)) {
    return static_cast<std::size_t>(*set) + 1;
  }
  throw std::invalid_argument(std::string(kVariable) + ": expected " +
                              ExpectedEnum<InstructionSet>() + ", got \"" +
                              name + "\"");
}

std::size_t CountAvailable() {
  return std::min(CountSupported(), CountAllowed());
}

}  // namespace

std::span<const InstructionSet> AvailableInstructionSets() {
  static const std::size_t count = CountAvailable();
  return std::span(kAll).first(count);
}

}  // namespace dual_proxy
