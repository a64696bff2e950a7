// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "dual_proxy/sides/signal_layout.h"

namespace dual_proxy {

/** The log of a run: one row per sample, a signal is a block of columns. */
struct RunLog {
  /** (n), s, finite, strictly increasing. */
  Eigen::VectorXd time;
  /** Names and columns of the signals. */
  std::vector<SignalSlice> signals;
  /** n rows; a 3x3 matrix is nine columns, row by row. */
  Eigen::MatrixXd values;

  /** A view of a signal, n x size.
  @tparam kSize the number of columns that it must have; any by default.
  @throws std::invalid_argument naming the signal if there is none of this name
  or it has another size. */
  template <int kSize = Eigen::Dynamic>
  auto Signal(std::string_view name) const {
    const SignalSlice& slice = Find(name, kSize);
    return values.middleCols<kSize>(slice.start, slice.size);
  }

  /** Whether there is a signal of this name. */
  bool Has(std::string_view name) const;

  /** @throws std::invalid_argument naming the field or the signal. */
  void Validate() const;

 private:
  const SignalSlice& Find(std::string_view name, int size) const;
};

}  // namespace dual_proxy
