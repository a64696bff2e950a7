// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include "dual_proxy/experiment/run_log.h"

namespace dual_proxy {

/** A log that can be changed. */
struct LogTable {
  operator RunLog() const { return RunLog::FromValues(time, signals, values); }

  Eigen::VectorXd time;
  std::vector<SignalSlice> signals;
  Eigen::MatrixXd values;
};

}  // namespace dual_proxy
