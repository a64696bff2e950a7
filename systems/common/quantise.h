// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace dual_proxy {

/** What of `values` something can give that has steps of this size, >= 0: the
nearest multiples; all of them if it is zero, or so fine that their number is
beyond a double's. No heap, no throw. */
template <typename Derived>
typename Derived::PlainObject Quantise(const Eigen::MatrixBase<Derived>& values,
                                       double step) noexcept {
  if (step == 0) return values;
  const typename Derived::PlainObject number = values / step;
  if (!number.allFinite()) return values;
  return step * number.array().round().matrix();
}

}  // namespace dual_proxy
