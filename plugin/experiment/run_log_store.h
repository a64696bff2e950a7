// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "dual_proxy/experiment/run_log.h"

namespace dual_proxy {

/** Takes the rows of a log while they are made and gives them back column by
column: what is read costs memory, the rest does not.

Where they need more than 64 MB they go to a file in TMPDIR, if that is set, or
/var/tmp, or /tmp. It has its full size from the beginning, so that a run does
not end on a full disk; and no name, so that it is gone with the object, however
the process ends. */
class RunLogStore {
 public:
  /** Above this the rows go to a file, bytes. */
  static constexpr std::size_t kMostInMemory = std::size_t{64} << 20;

  /** Makes room.
  @param num_columns >= 0, besides the time.
  @param capacity number of rows, >= 0.
  @throws std::system_error naming the folder if there is no space. */
  RunLogStore(int num_columns, Eigen::Index capacity);
  ~RunLogStore();
  RunLogStore(const RunLogStore&) = delete;
  RunLogStore& operator=(const RunLogStore&) = delete;

  /** Appends those rows whose time is later than last_time(): all of them, or
  none if it throws.
  @param times (n), s, strictly increasing.
  @param samples num_columns x n, as Drake logs them.
  @throws std::invalid_argument if sizes do not fit, times do not increase or
  there are more rows than `capacity`.
  @throws std::system_error if the file cannot be written. */
  void Append(const Eigen::Ref<const Eigen::VectorXd>& times,
              const Eigen::Ref<const Eigen::MatrixXd>& samples);

  int num_columns() const { return num_columns_; }
  Eigen::Index num_rows() const { return num_rows_; }
  bool in_memory() const { return file_ < 0; }

  /** Of the last row; 0 before the first one, as a run starts at 0, where there
  is nothing yet that could be logged. */
  double last_time() const { return last_time_; }

  /** (num_rows()), s; valid as long as this object. */
  RunLog::Values<1> time() const;

  /** num_rows() x size; valid as long as this object. */
  RunLog::Values<> columns(int start, int size) const;

  /** Gives back the memory that a file's rows occupy after they were read; they
  are read again where they are needed. */
  void Release() const;

 private:
  void CopyToMemory(const Eigen::Ref<const Eigen::VectorXd>& times,
                    const Eigen::Ref<const Eigen::MatrixXd>& samples);
  /** To the file. */
  void Write(int column, const Eigen::VectorXd& values);
  const double* column_data(int column) const;

  int num_columns_;
  Eigen::Index capacity_;
  Eigen::Index num_rows_{0};
  double last_time_{0};
  std::size_t num_bytes_;
  int file_{-1};
  double* data_{nullptr};  // Column by column, the time first.
  Eigen::VectorXd buffer_;
};

/** What a store holds, under the names of `signals`; it keeps the store. */
RunLog MakeRunLog(std::shared_ptr<const RunLogStore> store,
                  const std::vector<SignalSlice>& signals);

}  // namespace dual_proxy
