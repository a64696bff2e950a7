// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/joint_limits.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "dual_proxy/common/validate.h"

namespace dual_proxy {
namespace {

constexpr double kEndTime = 0.1;     // s: T_q.
constexpr double kSpeedTime = 0.02;  // s: T_v.

}  // namespace

void JointLimitsParams::Validate() const {
  constexpr const char* kWho = "JointLimitsParams";
  ValidateFields(kWho, *this);
  for (int i = 0; i < 7; ++i) {
    if (lower(i) + 2 * position_margin < upper(i)) continue;
    const std::string field = "upper[" + std::to_string(i) + "]";
    ThrowInvalidField(kWho, field.c_str(),
                      "more than `lower` and twice the position_margin",
                      upper(i));
  }
}

JointLimits::JointLimits(JointLimitsParams params)
    : params_((params.Validate(), params)),
      speed_((1 - params.speed_margin) * params.speed) {}

bool JointLimits::IsNear(const Vector7& q, const Vector7& v) const noexcept {
  for (int i = 0; i < 7; ++i) {
    const double room =
        std::min(params_.upper(i) - q(i), q(i) - params_.lower(i)) -
        params_.position_margin;
    if (std::abs(v(i)) > 0.5 * speed_(i) || room < kEndTime * speed_(i)) {
      return true;
    }
  }
  return false;
}

Vector7 JointLimits::Limit(const Vector7& q, const Vector7& v,
                           const Vector7& acceleration) const noexcept {
  const Vector7 margin = Vector7::Constant(params_.position_margin);
  const Vector7 highest = ((params_.upper - margin - q) / kEndTime)
                              .cwiseMin(speed_)
                              .cwiseMax(-speed_);
  const Vector7 lowest = ((params_.lower + margin - q) / kEndTime)
                             .cwiseMax(-speed_)
                             .cwiseMin(speed_);
  return acceleration.cwiseMin((highest - v) / kSpeedTime)
      .cwiseMax((lowest - v) / kSpeedTime);
}

}  // namespace dual_proxy
