// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "dual_proxy/common/signal_layout.h"
#include "params.h"

namespace dual_proxy {

/** {name: slice(start, stop)} in the order of the vector. */
inline py::dict LayoutDict(const std::vector<SignalSlice>& layout) {
  py::dict result;
  for (const SignalSlice& signal : layout) {
    result[py::str(signal.name)] =
        py::slice(signal.start, signal.start + signal.size, 1);
  }
  return result;
}

}  // namespace dual_proxy
