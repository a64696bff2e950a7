// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/ft_sensor/rdt_sequence.h"

namespace dual_proxy {

bool RdtSequence::Take(std::uint32_t sequence, RdtCounts* counts) noexcept {
  std::int64_t step = 1;
  if (started_) {
    step = static_cast<std::int32_t>(sequence - newest_);
    if (step == 0) {
      ++counts->repeated;
      return false;
    }
    if (step < -kLongestJump || step > kLongestJump) {
      ++counts->restarts;
      step = 1;
    }
    if (step < 0) {
      ++counts->late;
      return false;
    }
  }
  started_ = true;
  newest_ = sequence;
  position_ += step;
  counts->lost += step - 1;
  ++counts->taken;
  return true;
}

}  // namespace dual_proxy
