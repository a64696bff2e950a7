// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/run_log.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "dual_proxy/common/validate.h"

namespace dual_proxy {

RunLog RunLog::FromValues(Eigen::VectorXd time,
                          const std::vector<SignalSlice>& signals,
                          Eigen::MatrixXd values) {
  const auto owned = std::make_shared<const Eigen::MatrixXd>(std::move(values));
  RunLog log;
  log.time = std::move(time);
  log.storage = owned;
  for (const SignalSlice& slice : signals) {
    if (slice.start < 0 || slice.size < 1 ||
        slice.start + slice.size > owned->cols()) {
      throw std::invalid_argument(
          "RunLog: signal `" + slice.name + "` expected columns among " +
          std::to_string(owned->cols()) + ", got " +
          std::to_string(slice.size) + " from " + std::to_string(slice.start));
    }
    const auto columns = owned->middleCols(slice.start, slice.size);
    log.signals.push_back(
        {slice.name, Values<>(columns.data(), columns.rows(), columns.cols(),
                              Eigen::OuterStride<>(columns.outerStride()))});
  }
  log.Validate();
  return log;
}

bool RunLog::AllFinite() const {
  return std::all_of(signals.begin(), signals.end(),
                     [this](const auto& signal) {
                       const bool finite = signal.values.allFinite();
                       Release();
                       return finite;
                     });
}

void RunLog::Validate() const {
  constexpr const char* kWho = "RunLog";
  ThrowUnlessIn(kWho, "time", time, Finite());
  for (Eigen::Index i = 1; i < time.size(); ++i) {
    if (time(i) <= time(i - 1)) {
      ThrowInvalidField(kWho, "time", "strictly increasing times", time(i));
    }
  }
  for (const auto& [name, values] : signals) {
    if (values.rows() != time.size()) {
      throw std::invalid_argument("RunLog: signal `" + name +
                                  "` expected one row per time, got " +
                                  std::to_string(values.rows()) + " for " +
                                  std::to_string(time.size()));
    }
  }
}

bool RunLog::Has(std::string_view name) const {
  return std::any_of(
      signals.begin(), signals.end(),
      [name](const auto& signal) { return signal.name == name; });
}

const RunLog::Values<>& RunLog::Find(std::string_view name, int size) const {
  for (const auto& [signal, values] : signals) {
    if (signal != name) continue;
    if (size != Eigen::Dynamic && values.cols() != size) {
      throw std::invalid_argument("RunLog: signal `" + signal +
                                  "` expected size " + std::to_string(size) +
                                  ", got " + std::to_string(values.cols()));
    }
    return values;
  }
  throw std::invalid_argument("RunLog: there is no signal `" +
                              std::string(name) + "`");
}

}  // namespace dual_proxy
