// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "dual_proxy/common/signal_layout.h"

namespace dual_proxy {

/** The log of a run: one row per sample, a signal is a block of columns. It
looks at its values where they are, in memory or in a file (RunLogStore). */
struct RunLog {
  /** Rows x size, column by column. */
  template <int kSize = Eigen::Dynamic>
  using Values = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, kSize>,
                            0, Eigen::OuterStride<>>;

  /** A signal; a 3x3 matrix is nine columns, row by row. */
  struct NamedValues {
    std::string name;
    Values<> values;
  };

  /** A log that owns its values.
  @param values n rows, the signals side by side.
  @throws std::invalid_argument if a slice is not in `values`, and as
  Validate(). */
  static RunLog FromValues(Eigen::VectorXd time,
                           const std::vector<SignalSlice>& signals,
                           Eigen::MatrixXd values);

  /** A view of a signal, n x size.
  @tparam kSize the number of columns that it must have; any by default.
  @throws std::invalid_argument naming the signal if there is none of this name
  or it has another size. */
  template <int kSize = Eigen::Dynamic>
  Values<kSize> Signal(std::string_view name) const {
    const Values<>& values = Find(name, kSize);
    return {values.data(), values.rows(), values.cols(),
            Eigen::OuterStride<>(values.outerStride())};
  }

  /** Whether no value of any signal is NaN or infinite; releases what it has
  read. */
  bool AllFinite() const;

  /** Gives back the memory of what was read, if it can be read again. */
  void Release() const {
    if (release) release();
  }

  /** Whether there is a signal of this name. */
  bool Has(std::string_view name) const;

  /** @throws std::invalid_argument naming the field or the signal. */
  void Validate() const;

  /** (n), s, finite, strictly increasing. */
  Eigen::VectorXd time;
  /** Each has n rows. */
  std::vector<NamedValues> signals;
  /** What the values are in, if the log is to keep it. */
  std::shared_ptr<const void> storage;
  /** What Release() does, if there is something to do. */
  std::function<void()> release;

 private:
  const Values<>& Find(std::string_view name, int size) const;
};

}  // namespace dual_proxy
