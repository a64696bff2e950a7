// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <utility>

#include "dual_proxy/common/enum_strings.h"

namespace dual_proxy {

/** For which vector instructions a loop is compiled. Results are the same bits
with all of them; which one is a matter of speed alone. */
enum class InstructionSet {
  kBaseline,  ///< What the target has at least: SSE2 on x86-64.
  kAvx2,      ///< x86-64 from about 2013.
  kAvx512,    ///< x86-64 with AVX-512F.
};

template <>
struct EnumStrings<InstructionSet> {
  static constexpr std::pair<InstructionSet, const char*> kValues[] = {
      {InstructionSet::kBaseline, "baseline"},
      {InstructionSet::kAvx2, "avx2"},
      {InstructionSet::kAvx512, "avx512"}};
};

/** Those that this build and this processor have, slowest first; never empty.
The environment variable DUAL_PROXY_INSTRUCTIONS, `baseline`, `avx2` or
`avx512`, makes do with those up to it; it is read once.
@throws std::invalid_argument if it is none of them. */
std::span<const InstructionSet> AvailableInstructionSets();

/** The fastest of them. */
inline InstructionSet FastestInstructionSet() {
  return AvailableInstructionSets().back();
}

}  // namespace dual_proxy
