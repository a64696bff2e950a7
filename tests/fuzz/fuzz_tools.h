// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <limits>
#include <string>
#include <string_view>
#include <typeinfo>

namespace dual_proxy {

/** Ends the process with a line that says what does not hold, which a fuzzer
takes for a finding. */
inline void Require(bool holds, std::string_view what) {
  if (holds) return;
  std::fprintf(stderr, "does not hold: %.*s\n", static_cast<int>(what.size()),
               what.data());
  std::abort();
}

/** Ends it likewise, for an exception of a kind that must not be thrown. */
inline void RequireNoOther(const std::exception& error) {
  Require(false, std::string(typeid(error).name()) + ": " + error.what());
}

/** Takes values from a fuzzer's bytes; zeros when they are used up. */
class FuzzInput {
 public:
  FuzzInput(const std::uint8_t* data, std::size_t size)
      : data_(data), size_(size) {}

  bool empty() const { return size_ == 0; }

  template <typename T>
  T Take() {
    T value{};
    const std::size_t count = std::min(sizeof(T), size_);
    if (count > 0) std::memcpy(&value, data_, count);
    data_ += count;
    size_ -= count;
    return value;
  }

  int Byte() { return Take<std::uint8_t>(); }

  /** 0 to count - 1. */
  int Index(int count) { return Take<std::uint16_t>() % count; }

  /** One that tends to be a border of something, any, or an everyday one. */
  double Number() {
    using Limits = std::numeric_limits<double>;
    constexpr double kSpecial[] = {0,
                                   -0.0,
                                   1,
                                   -1,
                                   0.001,
                                   10,
                                   99.9,
                                   -999.9,
                                   1e4,
                                   -1e6,
                                   1e9,
                                   1e11,
                                   1e100,
                                   -1e160,
                                   1e300,
                                   Limits::max(),
                                   Limits::lowest(),
                                   Limits::min(),
                                   Limits::denorm_min(),
                                   Limits::epsilon(),
                                   Limits::infinity(),
                                   -Limits::infinity(),
                                   Limits::quiet_NaN()};
    const int kind = Byte();
    if (kind < static_cast<int>(std::size(kSpecial))) return kSpecial[kind];
    if (kind < 64) return Take<double>();
    return 1e-4 * Take<std::int16_t>();
  }

 private:
  const std::uint8_t* data_;
  std::size_t size_;
};

}  // namespace dual_proxy
