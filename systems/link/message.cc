// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/link/message.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "dual_proxy/common/possible.h"
#include "dual_proxy/common/rotation.h"

namespace dual_proxy {
namespace {

// Larger than the rounding of single-precision senders, small enough that a
// selection cannot amplify a force noticeably.
constexpr double kSelectionTolerance = 1e-3;
constexpr double kNormalTolerance = 1e-3;

using Matrix3Map = Eigen::Map<Eigen::Matrix3d>;
using ConstMatrix3Map = Eigen::Map<const Eigen::Matrix3d>;

}  // namespace

std::string DescribeTag(MessageTag tag) {
  if (tag == PoseMessage::kTag) return "PoseMessage";
  if (tag == ForceMessage::kTag) return "ForceMessage";
  return "a message with tag " + std::to_string(tag);
}

void PoseMessage::WriteBody(double* body) const noexcept {
  Eigen::Map<Eigen::Vector3d>{body} = pose.p;
  Matrix3Map{body + 3} = pose.R;
  Matrix3Map{body + 12} = force_selection;
  Matrix3Map{body + 21} = moment_selection;
  Matrix3Map{body + 30} = contact_normals;
}

void PoseMessage::ReadBody(const double* body) noexcept {
  pose.p = Eigen::Map<const Eigen::Vector3d>{body};
  pose.R = ConstMatrix3Map{body + 3};
  force_selection = ConstMatrix3Map{body + 12};
  moment_selection = ConstMatrix3Map{body + 21};
  contact_normals = ConstMatrix3Map{body + 30};
}

void ForceMessage::WriteBody(double* body) const noexcept {
  Eigen::Map<Eigen::Vector3d>{body} = force;
}

void ForceMessage::ReadBody(const double* body) noexcept {
  force = Eigen::Map<const Eigen::Vector3d>{body};
}

bool IsFinite(const Message& message) noexcept {
  if (!std::isfinite(message.send_time)) return false;
  if (!(message.size >= 0 && message.size <= Message::kMaxSize)) return false;
  return std::all_of(message.body.begin(), message.body.begin() + message.size,
                     [](double value) { return std::isfinite(value); });
}

bool IsSelection(const Eigen::Matrix3d& Omega) noexcept {
  if (Omega.isZero(0)) return true;
  if (!Omega.allFinite()) return false;
  const double asymmetry = (Omega - Omega.transpose()).cwiseAbs().maxCoeff();
  const double defect = (Omega * Omega - Omega).cwiseAbs().maxCoeff();
  return asymmetry <= kSelectionTolerance && defect <= kSelectionTolerance;
}

bool AreNormals(const Eigen::Matrix3d& normals) noexcept {
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d normal = normals.col(i);
    if (normal.isZero(0)) continue;
    if (!(std::abs(normal.norm() - 1) <= kNormalTolerance)) return false;
  }
  return true;
}

bool IsValid(const PoseMessage& message) noexcept {
  return std::isfinite(message.send_time) && IsValidPose(message.pose) &&
         IsSelection(message.force_selection) &&
         IsSelection(message.moment_selection) &&
         AreNormals(message.contact_normals);
}

bool IsValid(const ForceMessage& message) noexcept {
  return std::isfinite(message.send_time) && IsWithin(message.force, kMaxForce);
}

}  // namespace dual_proxy
