// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/run_log.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "dual_proxy/common/validate.h"

namespace dual_proxy {

void RunLog::Validate() const {
  constexpr const char* kWho = "RunLog";
  ThrowUnlessFinite(kWho, "time", time);
  for (Eigen::Index i = 1; i < time.size(); ++i) {
    if (time(i) <= time(i - 1)) {
      ThrowInvalidField(kWho, "time", "strictly increasing times", time(i));
    }
  }
  if (values.rows() != time.size()) {
    ThrowInvalidField(kWho, "values", "one row per time",
                      static_cast<double>(values.rows()));
  }
  for (const SignalSlice& slice : signals) {
    if (slice.start < 0 || slice.size < 1 ||
        slice.start + slice.size > values.cols()) {
      throw std::invalid_argument(
          "RunLog: signal `" + slice.name + "` expected columns among " +
          std::to_string(values.cols()) + ", got " +
          std::to_string(slice.size) + " from " + std::to_string(slice.start));
    }
  }
}

bool RunLog::Has(std::string_view name) const {
  return std::any_of(
      signals.begin(), signals.end(),
      [name](const SignalSlice& slice) { return slice.name == name; });
}

const SignalSlice& RunLog::Find(std::string_view name, int size) const {
  for (const SignalSlice& slice : signals) {
    if (slice.name != name) continue;
    if (size != Eigen::Dynamic && slice.size != size) {
      throw std::invalid_argument("RunLog: signal `" + slice.name +
                                  "` expected size " + std::to_string(size) +
                                  ", got " + std::to_string(slice.size));
    }
    return slice;
  }
  throw std::invalid_argument("RunLog: there is no signal `" +
                              std::string(name) + "`");
}

}  // namespace dual_proxy
