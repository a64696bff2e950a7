// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

#include <Eigen/Core>

#include "dual_proxy/common/pose.h"

namespace dual_proxy {

/** Says what a Message holds. */
using MessageTag = std::uint32_t;

/** A tag from a name: FNV-1a, never 0. Schemes name their messages; no list of
tags has to be kept. */
constexpr MessageTag MakeMessageTag(std::string_view name) {
  MessageTag hash = 2166136261U;
  for (const char c : name) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 16777619U;
  }
  return hash == 0 ? 1 : hash;
}

/** A tag for people: "PoseMessage", "ForceMessage", or its number. */
std::string DescribeTag(MessageTag tag);

/** The opening of a gripper that is not there. */
inline constexpr double kNoGripper = std::numeric_limits<double>::quiet_NaN();

/** What travels over the link, whatever the scheme: a header, up to kMaxSize
numbers, whose meaning the tag tells, and what goes with those of any scheme. A
plain value of fixed size. */
struct Message {
  static constexpr int kMaxSize = 40;

  MessageTag tag{0};          ///< 0: nothing.
  std::int32_t size{0};       ///< Numbers in use.
  std::int64_t sequence{-1};  ///< 0, 1, 2, ...; -1: nothing has come yet.
  double send_time{0};        ///< Sender's clock, s.
  std::array<double, kMaxSize> body{};
  /** m, of the device's gripper, on the way to the robot; not finite: none. */
  double gripper_opening{kNoGripper};
};

/** What the dual proxy sends over the link, in both directions: a pose, the
selections of force and moment space and the contacts' normals, never a force or
a velocity.

From the haptic side: the pose X_DH of the handle in the device base frame D,
measured from the device's home; the rest stays zero. From the robot side: the
pose X_BE of the tool point, both selections and the normals, in the robot base
frame B.
The receiver maps them into its own frame (WorkspaceMap). */
struct PoseMessage {
  static constexpr MessageTag kTag = MakeMessageTag("pose");
  static constexpr int kSize = 39;

  std::int64_t sequence{-1};  ///< 0, 1, 2, ...; -1: nothing has come yet.
  double send_time{0};        ///< Sender's clock, s.
  Pose pose{};                ///< X_DH or X_BE.
  /// Omega_f, orthogonal projection onto force space, in B.
  Eigen::Matrix3d force_selection{Eigen::Matrix3d::Zero()};
  /// Omega_tau, orthogonal projection onto moment space, in B.
  Eigen::Matrix3d moment_selection{Eigen::Matrix3d::Zero()};
  /// Unit vectors INTO the surfaces as columns, in B; zero: none, or not known.
  Eigen::Matrix3d contact_normals{Eigen::Matrix3d::Zero()};
  double gripper_opening{kNoGripper};  ///< See Message; not of the body.

  /** Writes or reads the kSize numbers of the body. */
  void WriteBody(double* body) const noexcept;
  void ReadBody(const double* body) noexcept;
};

/** What the two-channel baseline sends from the robot to the device. */
struct ForceMessage {
  static constexpr MessageTag kTag = MakeMessageTag("force");
  static constexpr int kSize = 3;

  std::int64_t sequence{-1};  ///< 0, 1, 2, ...; -1: nothing has come yet.
  double send_time{0};        ///< Sender's clock, s.
  /// Sensed force, robot on its environment, N, in B.
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};

  /** Writes or reads the kSize numbers of the body. */
  void WriteBody(double* body) const noexcept;
  void ReadBody(const double* body) noexcept;
};

/** `content`, a PoseMessage or the like, as a Message.
@param tag  its own, or that of a scheme that gives it another meaning. */
template <typename Content>
Message ToMessage(const Content& content,
                  MessageTag tag = Content::kTag) noexcept {
  static_assert(Content::kSize <= Message::kMaxSize);
  Message message{.tag = tag,
                  .size = Content::kSize,
                  .sequence = content.sequence,
                  .send_time = content.send_time};
  content.WriteBody(message.body.data());
  if constexpr (requires { content.gripper_opening; }) {
    message.gripper_opening = content.gripper_opening;
  }
  return message;
}

/** The content of a message. One that is of another kind has NaN in place of
its numbers, so that no receiver takes it for valid. */
template <typename Content>
Content FromMessage(const Message& message,
                    MessageTag tag = Content::kTag) noexcept {
  Content content;
  content.sequence = message.sequence;
  content.send_time = message.send_time;
  if constexpr (requires { content.gripper_opening; }) {
    content.gripper_opening = message.gripper_opening;
  }
  if (message.sequence == -1) return content;
  if (message.tag == tag && message.size == Content::kSize) {
    content.ReadBody(message.body.data());
  } else {
    std::array<double, Content::kSize> body;
    body.fill(std::numeric_limits<double>::quiet_NaN());
    content.ReadBody(body.data());
  }
  return content;
}

/** True if every number in the message is finite. */
bool IsFinite(const Message& message) noexcept;

/** True if Omega is an orthogonal projection: finite, symmetric and idempotent
to 1e-3 per entry. */
bool IsSelection(const Eigen::Matrix3d& Omega) noexcept;

/** True if the columns of `normals` are unit vectors, to 1e-3, or zero. */
bool AreNormals(const Eigen::Matrix3d& normals) noexcept;

/** True if the message may be acted on: finite, its pose is a pose, its
selections are orthogonal projections and its normals unit vectors. */
bool IsValid(const PoseMessage& message) noexcept;
/** True if the message may be acted on: finite. */
bool IsValid(const ForceMessage& message) noexcept;

}  // namespace dual_proxy
