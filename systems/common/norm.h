// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Core>

namespace dual_proxy {

/** The length of a short vector, right to rounding for whatever entries it has:
neither a square that overflows nor one that underflows spoils it. Not finite
exactly if an entry is not, or if the length itself is beyond the largest
double. Always summed in the same order, so that the same entries give the same
bits wherever they lie in memory (Eigen's stableNorm() sums in the order of the
alignment that it finds). No heap, no throw. */
template <typename Derived>
double StableNorm(const Eigen::MatrixBase<Derived>& value) noexcept {
  static_assert(Derived::IsVectorAtCompileTime);
  static_assert(Derived::SizeAtCompileTime != Eigen::Dynamic);
  constexpr int kSize = Derived::SizeAtCompileTime;
  double sum = 0;
  for (int i = 0; i < kSize; ++i) sum += value(i) * value(i);
  // In between, what underflowed of a square is far below the sum's rounding.
  if (sum > 1e-280 && sum < 1e300) return std::sqrt(sum);

  double largest = 0;
  for (int i = 0; i < kSize; ++i) {
    if (!std::isfinite(value(i))) return std::abs(value(i));
    largest = std::max(largest, std::abs(value(i)));
  }
  if (largest == 0) return 0;
  // A power of two, so that scaling rounds nothing.
  const int exponent = std::ilogb(largest);
  sum = 0;
  for (int i = 0; i < kSize; ++i) {
    const double scaled = std::scalbn(value(i), -exponent);
    sum += scaled * scaled;
  }
  return std::scalbn(std::sqrt(sum), exponent);
}

}  // namespace dual_proxy
