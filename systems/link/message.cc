// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/link/message.h"

#include <cmath>

#include "dual_proxy/common/rotation.h"

namespace dual_proxy {
namespace {

// Larger than the rounding of single-precision senders, small enough that a
// selection cannot amplify a force noticeably.
constexpr double kSelectionTolerance = 1e-3;

}  // namespace

bool IsFinite(const PoseMessage& message) noexcept {
  return std::isfinite(message.send_time) && message.pose.p.allFinite() &&
         message.pose.R.allFinite() && message.force_selection.allFinite() &&
         message.moment_selection.allFinite();
}

bool IsFinite(const ForceMessage& message) noexcept {
  return std::isfinite(message.send_time) && message.force.allFinite();
}

bool IsSelection(const Eigen::Matrix3d& Omega) noexcept {
  if (!Omega.allFinite()) return false;
  const double asymmetry = (Omega - Omega.transpose()).cwiseAbs().maxCoeff();
  const double defect = (Omega * Omega - Omega).cwiseAbs().maxCoeff();
  return asymmetry <= kSelectionTolerance && defect <= kSelectionTolerance;
}

bool IsValid(const PoseMessage& message) noexcept {
  return std::isfinite(message.send_time) && IsValidPose(message.pose) &&
         IsSelection(message.force_selection) &&
         IsSelection(message.moment_selection);
}

bool IsValid(const ForceMessage& message) noexcept { return IsFinite(message); }

}  // namespace dual_proxy
