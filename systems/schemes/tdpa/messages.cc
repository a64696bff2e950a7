// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "dual_proxy/common/possible.h"
#include "dual_proxy/common/rotation.h"
#include "dual_proxy/schemes/tdpa/scheme.h"

namespace dual_proxy {

using Vector3Map = Eigen::Map<Eigen::Vector3d>;
using ConstVector3Map = Eigen::Map<const Eigen::Vector3d>;

void TdpaMotionMessage::WriteBody(double* body) const noexcept {
  Vector3Map{body} = pose.p;
  Eigen::Map<Eigen::Matrix3d>{body + 3} = pose.R;
  body[12] = energy;
}

void TdpaMotionMessage::ReadBody(const double* body) noexcept {
  pose.p = ConstVector3Map{body};
  pose.R = Eigen::Map<const Eigen::Matrix3d>{body + 3};
  energy = body[12];
}

void TdpaForceMessage::WriteBody(double* body) const noexcept {
  Vector3Map{body} = force;
  body[3] = energy;
}

void TdpaForceMessage::ReadBody(const double* body) noexcept {
  force = ConstVector3Map{body};
  energy = body[3];
}

bool IsValid(const TdpaMotionMessage& message) noexcept {
  return std::isfinite(message.send_time) && IsValidPose(message.pose) &&
         IsWithin(message.energy, kMaxSum);
}

bool IsValid(const TdpaForceMessage& message) noexcept {
  return std::isfinite(message.send_time) &&
         IsWithin(message.force, kMaxForce) &&
         IsWithin(message.energy, kMaxSum);
}

}  // namespace dual_proxy
