// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/** Stops a program from being compiled in a way that Drake's library was not,
and which would link all the same, or fail to with thousands of lines. */

#include <cstddef>

// Eigen's alignment and its way to allocate depend on it: memory that one side
// allocates and the other frees is corrupted. The CMake targets see to it.
#ifdef __AVX__
#error "dual_proxy: Drake is built without AVX; compile with -mno-avx"
#endif

// Containers in Drake's interfaces would differ in size.
#ifdef _GLIBCXX_DEBUG
#error "dual_proxy: Drake is built without _GLIBCXX_DEBUG; don't define it"
#endif

// Drake's symbols that take a std::string would not be found.
#if defined(_GLIBCXX_USE_CXX11_ABI) && !_GLIBCXX_USE_CXX11_ABI
#error \
    "dual_proxy: Drake is built with _GLIBCXX_USE_CXX11_ABI=1; don't unset it"
#endif
