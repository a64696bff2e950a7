// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/common/instruction_set.h"

// One loop, compiled once for each instruction set: for sources whose options
// are set by dual_proxy_vectorised_sources().

// With GCC; clang and other architectures make do with their baseline.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define DUAL_PROXY_HAS_X86_VECTORS 1
#else
#define DUAL_PROXY_HAS_X86_VECTORS 0
#endif

/** Marks what is compiled into its callers, with their instructions. */
#define DUAL_PROXY_INLINE [[gnu::always_inline]] inline

namespace dual_proxy {

/** `Run(instruction_set, arguments...)` calls `kBody(arguments...)`, compiled
for that set. `kBody` is a void DUAL_PROXY_INLINE function of plain numbers and
pointers, without Eigen's types, whose layout depends on the instructions. Its
pointers are __restrict, and it calls nothing that is not inlined. For the same
bits with every set: its sums have a fixed order, it calls no function of the
standard library but sqrt(), and its source is compiled without contraction of
multiplications and additions. Where the compiler's own vectors do not fit,
there is another body for the wider instructions. */
template <auto kBody, auto kAvx2Body = kBody, auto kAvx512Body = kAvx2Body>
struct PerInstructionSet;

template <typename... Arguments, void (*kBody)(Arguments...),
          void (*kAvx2Body)(Arguments...), void (*kAvx512Body)(Arguments...)>
struct PerInstructionSet<kBody, kAvx2Body, kAvx512Body> {
  static void Run(InstructionSet instruction_set, Arguments... arguments) {
    switch (instruction_set) {
#if DUAL_PROXY_HAS_X86_VECTORS
      case InstructionSet::kAvx512:
        return Avx512(arguments...);
      case InstructionSet::kAvx2:
        return Avx2(arguments...);
#endif
      default:
        return kBody(arguments...);
    }
  }

 private:
#if DUAL_PROXY_HAS_X86_VECTORS
  [[gnu::target("avx2")]] static void Avx2(Arguments... arguments) {
    kAvx2Body(arguments...);
  }
  [[gnu::target("avx512f,prefer-vector-width=512")]] static void Avx512(
      Arguments... arguments) {
    kAvx512Body(arguments...);
  }
#endif
};

}  // namespace dual_proxy
