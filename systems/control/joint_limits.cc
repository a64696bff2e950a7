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

template <int kJoints>
void JointLimitsParams<kJoints>::Validate() const {
  constexpr const char* kWho = "JointLimitsParams";
  ValidateFields(kWho, *this);
  for (int i = 0; i < kJoints; ++i) {
    if (lower(i) + 2 * position_margin < upper(i)) continue;
    const std::string field = "upper[" + std::to_string(i) + "]";
    ThrowInvalidField(kWho, field.c_str(),
                      "more than `lower` and twice the position_margin",
                      upper(i));
  }
}

template <int kJoints>
JointLimits<kJoints>::JointLimits(Params params)
    : params_((params.Validate(), params)),
      speed_((1 - params.speed_margin) * params.speed) {}

template <int kJoints>
bool JointLimits<kJoints>::IsNear(const Joints& q,
                                  const Joints& v) const noexcept {
  for (int i = 0; i < kJoints; ++i) {
    const double room =
        std::min(params_.upper(i) - q(i), q(i) - params_.lower(i)) -
        params_.position_margin;
    if (std::abs(v(i)) > 0.5 * speed_(i) || room < kEndTime * speed_(i)) {
      return true;
    }
  }
  return false;
}

template <int kJoints>
JointVector<kJoints> JointLimits<kJoints>::Limit(
    const Joints& q, const Joints& v,
    const Joints& acceleration) const noexcept {
  const Joints margin = Joints::Constant(params_.position_margin);
  const Joints highest = ((params_.upper - margin - q) / kEndTime)
                             .cwiseMin(speed_)
                             .cwiseMax(-speed_);
  const Joints lowest = ((params_.lower + margin - q) / kEndTime)
                            .cwiseMax(-speed_)
                            .cwiseMin(speed_);
  return acceleration.cwiseMin((highest - v) / kSpeedTime)
      .cwiseMax((lowest - v) / kSpeedTime);
}

template struct JointLimitsParams<6>;
template struct JointLimitsParams<7>;
template class JointLimits<6>;
template class JointLimits<7>;

}  // namespace dual_proxy
