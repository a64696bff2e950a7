// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace dual_proxy {

/** Counts the heap allocations (malloc, calloc, realloc, aligned forms and all
of operator new) of the calling thread while it lives. Link no_alloc.cc into the
test. Use:

    ScopedNoAlloc guard;
    dut.Update(input, &state);
    EXPECT_EQ(guard.count(), 0);
*/
class ScopedNoAlloc {
 public:
  ScopedNoAlloc();
  ~ScopedNoAlloc();
  ScopedNoAlloc(const ScopedNoAlloc&) = delete;
  ScopedNoAlloc& operator=(const ScopedNoAlloc&) = delete;

  /** Allocations since construction. */
  std::int64_t count() const;

 private:
  std::int64_t start_{0};
};

}  // namespace dual_proxy
