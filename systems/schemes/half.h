// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "dual_proxy/common/pose.h"
#include "dual_proxy/control/model_terms.h"
#include "dual_proxy/link/link_monitor.h"
#include "dual_proxy/link/message.h"
#include "dual_proxy/link/pose_sender.h"
#include "dual_proxy/proxy/haptic_side_proxy.h"
#include "dual_proxy/proxy/robot_side_proxy.h"

namespace dual_proxy {

/** @file
What a scheme of teleoperation is made of: two halves, one on each side, and the
message between them. A half turns the newest message and the state of its side
into a setpoint for its side's controller, and into the message back.
Controllers, limits, link and latency are the sides' and the same for every
scheme. See schemes.h for the list, dual_proxy/ for an example. */

/** What a side gives to the robot half of every scheme. */
struct RobotHalfParams {
  /** Period, map, link monitor, workspace and limits of the proxy. */
  RobotSideProxyParams proxy;
  PoseSenderParams sender;
};

/** One period's inputs of a robot half; in B. */
struct RobotHalfInput {
  Message message{};              ///< The newest from the haptic half.
  Pose X_BE{};                    ///< Of the tool point.
  Vector6 v_BE{Vector6::Zero()};  ///< [linear; angular], m/s, rad/s.
  /** Omega_f and Omega_tau, projections: what perception has found. */
  Eigen::Matrix3d force_selection{Eigen::Matrix3d::Zero()};
  Eigen::Matrix3d moment_selection{Eigen::Matrix3d::Zero()};
  /** Unit vectors INTO the surfaces as columns; zero: none, or not known. */
  Eigen::Matrix3d contact_normals{Eigen::Matrix3d::Zero()};
  /** [F_s; M_s about E], N, N m: of the robot on its environment. */
  Vector6 sensed_wrench{Vector6::Zero()};
  /** Whether the force sensor can be relied on; without it the robot is to hold
  its place. */
  bool sensor_ready{true};
  /** Whether the robot is to hold its place, as without a link. */
  bool hold{false};
  /** Omega_p, a projection: the directions that a planner owns. The hand is to
  feel no contact there. */
  Eigen::Matrix3d planner_selection{Eigen::Matrix3d::Zero()};

  /** Whether the robot may follow the hand, if there is a link. */
  bool MayFollow() const { return sensor_ready && !hold; }
};

/** What the robot's controller is to do, in B. */
struct RobotSetpoint {
  /** dx_m, m, and dphi_m, rad: robot minus reference, in motion space. */
  Eigen::Vector3d motion_error{Eigen::Vector3d::Zero()};
  Eigen::Vector3d rotation_error{Eigen::Vector3d::Zero()};
  /** Of the motion reference, [linear; angular]. */
  Vector6 velocity{Vector6::Zero()};
  Vector6 acceleration{Vector6::Zero()};
  /** F_r, N, and M_r, N m, in force space. */
  Eigen::Vector3d reference_force{Eigen::Vector3d::Zero()};
  Eigen::Vector3d reference_moment{Eigen::Vector3d::Zero()};
  /** The directions in which force and moment are controlled, not motion. */
  Eigen::Matrix3d force_selection{Eigen::Matrix3d::Zero()};
  Eigen::Matrix3d moment_selection{Eigen::Matrix3d::Zero()};
  /** Whether the force loop closes on the sensed force. Without it
  reference_force is the commanded force as it is. */
  bool force_feedback{true};
};

/** One period's results of a robot half. */
struct RobotHalfOutput {
  RobotSetpoint setpoint;
  Pose proxy_pose;             ///< In B: where the scheme wants the tool point.
  Message message{};           ///< Newest message to the haptic half.
  LinkMonitorState link;       ///< Of the way from the haptic half.
  std::int64_t bad_inputs{0};  ///< Periods refused so far.
  std::int64_t limiter_bad_inputs{0};  ///< Targets that the limiter refused.
  std::int64_t sender_bad_inputs{0};   ///< Samples that the sender refused.
};

/** What a side gives to the haptic half of every scheme. */
struct HapticHalfParams {
  /** Period, map, link monitor and rates. */
  HapticSideProxyParams proxy;
  PoseSenderParams sender;
};

/** One period's inputs of a haptic half; in D unless said. */
struct HapticHalfInput {
  Message message{};  ///< The newest from the robot half, in B.
  Pose X_DH{};        ///< Of the handle, from home.
  /** [linear; angular], m/s, rad/s. */
  Vector6 device_velocity{Vector6::Zero()};
  /** [force; moment] on the hand, N, N m: what the device's controller sent in
  the period before, after all its limits. */
  Vector6 device_wrench{Vector6::Zero()};
  /** Whether a clutch holds X_DH; the hand is somewhere else. */
  bool held{false};
};

/** What the device's controller is to do, in D. */
struct HapticSetpoint {
  /** F_h, N, and M_h, N m: on the hand. */
  Eigen::Vector3d reference_force{Eigen::Vector3d::Zero()};
  Eigen::Vector3d reference_moment{Eigen::Vector3d::Zero()};
  /** N: the part of F_h that only takes energy, which no force scale changes.
   */
  Eigen::Vector3d injected_force{Eigen::Vector3d::Zero()};
  /** Omega_fh: where the device is damped. */
  Eigen::Matrix3d force_selection{Eigen::Matrix3d::Zero()};
  Eigen::Matrix3d moment_selection{Eigen::Matrix3d::Zero()};
  /** Unit vectors as columns, or zero: into surfaces, where the device is never
  to pull the hand. */
  Eigen::Matrix3d contact_normals{Eigen::Matrix3d::Zero()};
};

/** One period's results of a haptic half. */
struct HapticHalfOutput {
  HapticSetpoint setpoint;
  Pose proxy_pose;        ///< In D: where the robot is, as the hand has it.
  Message message{};      ///< Newest message to the robot half.
  LinkMonitorState link;  ///< Of the way from the robot half.
  std::int64_t bad_inputs{0};         ///< Periods refused so far.
  std::int64_t sender_bad_inputs{0};  ///< Samples that the sender refused.
};

/** Parameters of a scheme that has none of its own. */
struct NoParams {
  void Validate() const {}

  template <typename Archive>
  void Serialize(Archive*) {}
};

}  // namespace dual_proxy
