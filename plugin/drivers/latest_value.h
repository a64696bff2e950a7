// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <atomic>

namespace dual_proxy {

/** Hands the newest value from one thread to one other. Neither ever waits:
there are three places, of which the writer owns one, the reader one, and the
third is exchanged. What was written twice before it was read is read once.

Set() and Get() allocate only if T's assignment does. */
template <typename T>
class LatestValue {
 public:
  explicit LatestValue(const T& value = {}) { places_.fill(value); }

  LatestValue(const LatestValue&) = delete;
  LatestValue& operator=(const LatestValue&) = delete;

  /** For the writing thread alone. */
  void Set(const T& value) noexcept {
    places_[written_] = value;
    written_ =
        shared_.exchange(written_ | kNew, std::memory_order_acq_rel) & kPlace;
  }

  /** The newest, again if there is none since. For the reading thread alone. */
  const T& Get() noexcept {
    if (shared_.load(std::memory_order_relaxed) & kNew) {
      read_ = shared_.exchange(read_, std::memory_order_acq_rel) & kPlace;
    }
    return places_[read_];
  }

 private:
  static constexpr unsigned kNew = 4;
  static constexpr unsigned kPlace = 3;

  std::array<T, 3> places_;
  unsigned written_{0};
  std::atomic<unsigned> shared_{1};
  unsigned read_{2};
};

}  // namespace dual_proxy
