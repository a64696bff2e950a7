// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "dual_proxy/common/pose.h"

namespace dual_proxy {

/** What the dual proxy sends over the link, in both directions: a pose and the
selections of force and moment space, never a force or a velocity.

From the haptic side: the pose X_DH of the handle in the device base frame D,
measured from the device's home; the selections stay zero. From the robot side:
the pose X_BE of the tool point and both selections, in the robot base frame B.
The receiver maps them into its own frame (WorkspaceMap). */
struct PoseMessage {
  std::int64_t sequence{-1};  ///< 0, 1, 2, ...; -1: nothing has come yet.
  double send_time{0};        ///< Sender's clock, s.
  Pose pose;                  ///< X_DH or X_BE.
  /// Omega_f, orthogonal projection onto force space, in B.
  Eigen::Matrix3d force_selection{Eigen::Matrix3d::Zero()};
  /// Omega_tau, orthogonal projection onto moment space, in B.
  Eigen::Matrix3d moment_selection{Eigen::Matrix3d::Zero()};
};

/** What the two-channel baseline sends from the robot to the device. */
struct ForceMessage {
  std::int64_t sequence{-1};  ///< 0, 1, 2, ...; -1: nothing has come yet.
  double send_time{0};        ///< Sender's clock, s.
  /// Sensed force, robot on its environment, N, in B.
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};
};

/** True if every number in the message is finite. */
bool IsFinite(const PoseMessage& message) noexcept;
bool IsFinite(const ForceMessage& message) noexcept;

/** True if Omega is an orthogonal projection: finite, symmetric and idempotent
to 1e-3 per entry. */
bool IsSelection(const Eigen::Matrix3d& Omega) noexcept;

/** True if the message may be acted on: finite, its pose is a pose and its
selections are orthogonal projections. */
bool IsValid(const PoseMessage& message) noexcept;
/** True if the message may be acted on: finite. */
bool IsValid(const ForceMessage& message) noexcept;

}  // namespace dual_proxy
