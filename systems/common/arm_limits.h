// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace dual_proxy {

/** What an arm must never exceed. The defaults are the manufacturer's for the
Panda (its data sheet and the limits of its control interface), and for the
distance to the proxy this project's. */
struct ArmLimits {
  using Joints = Eigen::Matrix<double, 7, 1>;

  Joints joint_lower{{-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175,
                      -2.8973}};  ///< rad.
  Joints joint_upper{
      {2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973}};  ///< rad.
  Joints joint_speed{
      {2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61}};  ///< rad/s.
  Joints torque{{87, 87, 87, 87, 12, 12, 12}};          ///< N m.
  double torque_rate{1000};  ///< N m/s, each joint's.
  double tool_speed{1.7};    ///< m/s, of the tool point.
  /** m: how far the robot may be from its proxy. */
  double proxy_distance{0.25};
};

}  // namespace dual_proxy
