// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace dual_proxy {

/** How long cycles take, as a histogram of fixed size. One thread adds, any
other may read meanwhile: each number by itself is right. */
class CycleStatistics {
 public:
  /** s: beyond all bins together only the maximum is known. */
  static constexpr double kBin = 0.5e-6;
  static constexpr int kBins = 4000;

  /** Neither allocates nor throws. @param duration  s; below zero is zero. */
  void Add(double duration) noexcept;

  std::int64_t count() const noexcept;

  /** s: the upper end of the bin in which the quantile lies, or the maximum,
  if that is less; zero without any. @param probability  in [0, 1]. */
  double Quantile(double probability) const noexcept;

  double max() const noexcept;

 private:
  std::array<std::atomic<std::int64_t>, kBins> bins_{};
  std::atomic<std::int64_t> beyond_{0};
  std::atomic<double> max_{0};
};

}  // namespace dual_proxy
