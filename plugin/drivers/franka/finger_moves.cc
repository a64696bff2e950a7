// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/franka/finger_moves.h"

#include <algorithm>
#include <cmath>

namespace dual_proxy {

void FrankaGripperParams::Validate() const {
  ValidateFields("FrankaGripperParams", *this);
}

FingerMoves::FingerMoves(const FrankaGripperParams& params)
    : params_((params.Validate(), params)) {}

FingerAction FingerMoves::Next(double command, double width,
                               double max_width) noexcept {
  if (!std::isfinite(command) || !std::isfinite(width)) {
    return FingerAction::kNone;
  }
  command = std::max(command, 0.0);
  if (max_width > 0) command = std::min(command, max_width);
  const double least = params_.least_move;
  if (closing_ && width > target_ + least) {
    closing_ = false;
    holding_ = true;
    return FingerAction::kGrasp;
  }
  closing_ = false;
  const bool fully_open = max_width > 0 && command == max_width;
  if (holding_ ? command < width + least && !fully_open
               : std::abs(command - (std::isnan(target_) ? width : target_)) <
                     least) {
    return FingerAction::kNone;
  }
  holding_ = false;
  closing_ = command < width;
  target_ = command;
  return FingerAction::kMove;
}

FingerTakeover::FingerTakeover(const FrankaGripperParams& params)
    : params_((params.Validate(), params)) {}

bool FingerTakeover::Update(double command, double width) noexcept {
  if (done_ || !std::isfinite(command) || !std::isfinite(width)) return done_;
  const double difference = command - width;
  done_ =
      std::abs(difference) < params_.least_move || difference * difference_ < 0;
  difference_ = difference;
  return done_;
}

}  // namespace dual_proxy
