// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/workspace_limits.h"

#include <algorithm>

#include "dual_proxy/proxy/vector_rate_limiter.h"

namespace dual_proxy {
namespace {

constexpr double kRounding = 1e-9;  // m

}  // namespace

void WorkspaceLimitsParams::Validate() const {
  ValidateFields("WorkspaceLimitsParams", *this);
}

WorkspaceLimits::WorkspaceLimits(WorkspaceLimitsParams params)
    : params_(params) {
  params_.Validate();
}

Eigen::Vector3d WorkspaceLimits::Clamp(
    const Eigen::Vector3d& p) const noexcept {
  using Shape = WorkspaceLimitsParams::Shape;
  Eigen::Vector3d d = p - params_.center;
  switch (params_.shape) {
    case Shape::kNone:
      return p;
    case Shape::kBox:
      d = d.cwiseMax(-params_.half_size).cwiseMin(params_.half_size);
      break;
    case Shape::kSphere:
      d = Saturate(d, params_.radius);
      break;
    case Shape::kCylinder:
      d.head<2>() = Saturate({d.x(), d.y(), 0.0}, params_.radius).head<2>();
      d.z() = std::clamp(d.z(), -params_.half_height, params_.half_height);
      break;
  }
  // Inside, the same bits come back: centre plus difference may round.
  if (d == p - params_.center) return p;
  return params_.center + d;
}

bool WorkspaceLimits::Contains(const Eigen::Vector3d& p) const noexcept {
  return (p - Clamp(p)).norm() <= kRounding;
}

}  // namespace dual_proxy
