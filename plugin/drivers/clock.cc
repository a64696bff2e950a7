// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/clock.h"

#include <chrono>

namespace dual_proxy {

double MonotonicTime() noexcept {
  return std::chrono::duration<double>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace dual_proxy
