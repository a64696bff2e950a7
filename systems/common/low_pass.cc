// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/low_pass.h"

#include <numbers>

#include "dual_proxy/common/elementary.h"

namespace dual_proxy {

double LowPassGain(double cutoff_hz, double period) noexcept {
  if (cutoff_hz <= 0) return 1.0;
  return -ExpMinusOne(-2.0 * std::numbers::pi * cutoff_hz * period);
}

}  // namespace dual_proxy
