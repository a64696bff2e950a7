// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace dual_proxy {

/** m: how far a robot may be from its proxy. */
inline constexpr double kMaxProxyDistance = 0.25;

/** What an arm with kJoints joints must never exceed. Its limits are zero until
they are set; an arm with seven joints has defaults, below. */
template <int kJoints>
struct ArmLimits {
  using Joints = Eigen::Matrix<double, kJoints, 1>;

  Joints joint_lower{Joints::Zero()};        ///< rad.
  Joints joint_upper{Joints::Zero()};        ///< rad.
  Joints joint_speed{Joints::Zero()};        ///< rad/s.
  Joints torque{Joints::Zero()};             ///< N m.
  double torque_rate{0};                     ///< N m/s, each joint's.
  double tool_speed{0};                      ///< m/s, of the tool point.
  double proxy_distance{kMaxProxyDistance};  ///< m.
};

/** With the defaults of Franka's control interface (FCI), for the Panda. */
template <>
struct ArmLimits<7> {
  using Joints = Eigen::Matrix<double, 7, 1>;

  Joints joint_lower{{-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175,
                      -2.8973}};  ///< rad.
  Joints joint_upper{
      {2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973}};  ///< rad.
  Joints joint_speed{
      {2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61}};  ///< rad/s.
  Joints torque{{87, 87, 87, 87, 12, 12, 12}};          ///< N m.
  double torque_rate{1000};                  ///< N m/s, each joint's.
  double tool_speed{1.7};                    ///< m/s, of the tool point.
  double proxy_distance{kMaxProxyDistance};  ///< m.
};

}  // namespace dual_proxy
