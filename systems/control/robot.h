// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "dual_proxy/control/arm_model.h"
#include "dual_proxy/control/operational_space_controller.h"
#include "dual_proxy/control/point_controller.h"

namespace dual_proxy {

/** @file
The robots that the sides, the loop and the engine are made for: each names how
many coordinates it has, whether its tool can turn, the controller's model of it
and its controller, and where these are not called the same, what is what. */

/** An arm with kJoints revolute joints in series. */
template <int kJoints>
struct SerialArm {
  static constexpr int kCoordinates = kJoints;
  static constexpr bool kRotates = true;
  using Model = ArmModel<kJoints>;
  using Controller = OperationalSpaceController<kJoints>;

  /** N m: what is sent to the joints. */
  static const JointVector<kJoints>& GetCommand(
      const typename Controller::Output& output) {
    return output.torque;
  }
};

/** The paper's point robot (section V.C): its coordinates are the position of
its tool point, m, in B. */
struct PointMass {
  static constexpr int kCoordinates = 3;
  static constexpr bool kRotates = false;
  using Model = PointModel;
  using Controller = PointController;

  /** N, in B: what pushes the mass. */
  static const Eigen::Vector3d& GetCommand(
      const PointControllerOutput& output) {
    return output.force;
  }
};

}  // namespace dual_proxy
