// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/cycle_statistics.h"

#include <algorithm>

namespace dual_proxy {

void CycleStatistics::Add(double duration) noexcept {
  constexpr auto kOrder = std::memory_order_relaxed;
  if (!(duration > 0)) duration = 0;
  const double bin = duration / kBin;
  std::atomic<std::int64_t>& place =
      bin < kBins ? bins_[static_cast<std::size_t>(bin)] : beyond_;
  // There is one writer.
  place.store(place.load(kOrder) + 1, kOrder);
  if (duration > max_.load(kOrder)) max_.store(duration, kOrder);
}

std::int64_t CycleStatistics::count() const noexcept {
  std::int64_t result = beyond_.load(std::memory_order_relaxed);
  for (const auto& bin : bins_) result += bin.load(std::memory_order_relaxed);
  return result;
}

double CycleStatistics::Quantile(double probability) const noexcept {
  const double wanted = probability * static_cast<double>(count());
  std::int64_t below = 0;
  for (int i = 0; i < kBins; ++i) {
    below += bins_[i].load(std::memory_order_relaxed);
    if (below > 0 && static_cast<double>(below) >= wanted) {
      return std::min((i + 1) * kBin, max());
    }
  }
  return max();
}

double CycleStatistics::max() const noexcept {
  return max_.load(std::memory_order_relaxed);
}

}  // namespace dual_proxy
