// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "dual_proxy/common/possible.h"
#include "dual_proxy/common/rotation.h"
#include "dual_proxy/schemes/model_mediated/scheme.h"

namespace dual_proxy {

using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Vector3d;

void ModelMediatedMotionMessage::WriteBody(double* body) const noexcept {
  Map<Vector3d>{body} = pose.p;
  Map<Matrix3d>{body + 3} = pose.R;
  Map<Vector3d>{body + 12} = force;
}

void ModelMediatedMotionMessage::ReadBody(const double* body) noexcept {
  pose.p = Map<const Vector3d>{body};
  pose.R = Map<const Matrix3d>{body + 3};
  force = Map<const Vector3d>{body + 12};
}

void ModelMediatedSurfaceMessage::WriteBody(double* body) const noexcept {
  body[0] = contact ? 1 : 0;
  Map<Vector3d>{body + 1} = normal;
  Map<Vector3d>{body + 4} = point;
  body[7] = stiffness;
}

void ModelMediatedSurfaceMessage::ReadBody(const double* body) noexcept {
  contact = body[0] > 0.5;
  normal = Map<const Vector3d>{body + 1};
  point = Map<const Vector3d>{body + 4};
  stiffness = body[7];
}

bool IsValid(const ModelMediatedMotionMessage& message) noexcept {
  return std::isfinite(message.send_time) && IsValidPose(message.pose) &&
         IsWithin(message.force, kMaxForce);
}

bool IsValid(const ModelMediatedSurfaceMessage& message) noexcept {
  constexpr double kTolerance = 1e-3;  // Of a unit vector's length.
  const bool has_normal = std::abs(message.normal.norm() - 1) < kTolerance ||
                          (!message.contact && message.normal.isZero(0));
  return std::isfinite(message.send_time) && has_normal &&
         IsWithin(message.point, kMaxPosition) && message.stiffness > 0 &&
         std::isfinite(message.stiffness);
}

}  // namespace dual_proxy
