// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "dual_proxy/experiment/bare_engine.h"
#include "dual_proxy/experiment/run_watch.h"
#include "params.h"

namespace dual_proxy {

/** [(name, unit, value, time, most, detail)] of what was watched. */
inline py::list WatchedList(const std::vector<WatchedValue>& values) {
  py::list result;
  for (const WatchedValue& watched : values) {
    result.append(py::make_tuple(watched.name, watched.unit, watched.value,
                                 watched.time, watched.most, watched.detail));
  }
  return result;
}

}  // namespace dual_proxy
