// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/link/message_schedule.h"

#include <algorithm>
#include <cmath>

namespace dual_proxy {

bool MessageSchedule::IsDue(double time,
                            MessageScheduleState* state) const noexcept {
  // No message is due later than one interval ahead: time went back.
  const bool went_back = state->next_due - time > interval_ + 2 * half_period_;
  if (!state->started || went_back) {
    state->started = true;
    state->next_due = time;
  }
  // The tick nearest to the due time, whichever way the two round.
  const double late = time - state->next_due + half_period_;
  if (time < state->next_due - half_period_) return false;
  // Rounding can leave `late` a shade below zero.
  state->next_due +=
      interval_ * (std::max(0.0, std::floor(late / interval_)) + 1.0);
  return true;
}

}  // namespace dual_proxy
