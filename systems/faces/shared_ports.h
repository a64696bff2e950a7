// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/common/validate.h"
#include "dual_proxy/faces/block.h"
#include "dual_proxy/perception/contact_perception.h"
#include "dual_proxy/proxy/gripper_follower.h"

namespace dual_proxy {

/** @file
What the blocks of several rooms say alike. */

/** The input or the memory of a block that has none. */
struct Nothing {};

inline constexpr PortText kRobotState{"robot_state", "[q; v], rad, rad/s"};

inline constexpr PortText kContactNormals{
    "contact_normals",
    "unit vectors INTO the surfaces, columns of a row-major 3x3; zero: none"};

inline constexpr PortText kHandleForce{
    "handle_force",
    "N, of the handle on the hand, from a force sensor there (used by method "
    "`force_feedback`)"};

/** Checks the index of the joint that stands for a sensor: only its sign, as
nothing is known of the plant.
@throws std::invalid_argument if it is negative. */
inline int CheckedSensorJoint(const char* who, int sensor_joint) {
  if (sensor_joint < 0) {
    ThrowInvalidField(who, "sensor_joint", "an integer >= 0", sensor_joint);
  }
  return sensor_joint;
}

/** The ports that show what a filter has found. */
inline void WriteFound(const ContactPerceptionState& perception,
                       OutputPorts* ports) {
  const ForceSpaceParticleFilterState& filter = perception.force.filter;
  ports->PutMatrix({"force_selection", "Omega_f, as the filter has found it"},
                   filter.force_selection);
  ports->PutScalar({"dimension", "of force space, 0 to 3, likewise"},
                   filter.dimension);
  ports->PutMatrix(kContactNormals, filter.contact_normals);
}

/** Likewise of the angular filter. */
inline void WriteFoundMoments(const ContactPerceptionState& perception,
                              OutputPorts* ports) {
  const ForceSpaceParticleFilterState& filter = perception.moment.filter;
  ports->PutMatrix(
      {"moment_selection", "Omega_tau, as the angular filter has found it"},
      filter.force_selection);
  ports->PutScalar({"moment_dimension", "of moment space, 0 to 3, likewise"},
                   filter.dimension);
}

/** Of a robot that has a gripper. */
inline void WriteGripper(const GripperState& gripper, OutputPorts* ports) {
  ports->PutScalar({"gripper_width_command",
                    "m, for the gripper's driver (only with a gripper)"},
                   gripper.width);
}

}  // namespace dual_proxy
