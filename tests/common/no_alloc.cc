// SPDX-License-Identifier: BSD-3-Clause
#include "no_alloc.h"

#include <cerrno>
#include <cstddef>

namespace {
thread_local std::int64_t allocations = 0;
}  // namespace

// A sanitizer has a malloc of its own: nothing is counted beside it.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
// glibc lets a program replace malloc; its own entry points stay reachable
// under these names, so that every allocation is seen and still served.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* pointer, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}

void* calloc(std::size_t count, std::size_t size) {
  ++allocations;
  return __libc_calloc(count, size);
}

void* realloc(void* pointer, std::size_t size) {
  ++allocations;
  return __libc_realloc(pointer, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++allocations;
  return __libc_memalign(alignment, size);
}

int posix_memalign(void** pointer, std::size_t alignment, std::size_t size) {
  ++allocations;
  *pointer = __libc_memalign(alignment, size);
  return *pointer == nullptr ? ENOMEM : 0;
}
}  // extern "C"
#endif

namespace dual_proxy {

ScopedNoAlloc::ScopedNoAlloc() : start_(allocations) {}
ScopedNoAlloc::~ScopedNoAlloc() = default;
std::int64_t ScopedNoAlloc::count() const { return allocations - start_; }

}  // namespace dual_proxy
