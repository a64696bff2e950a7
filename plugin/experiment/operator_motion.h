// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace dual_proxy {

/** Where the operator means the robot's tool to go. */
struct OperatorMotion {
  /** n times, s, strictly increasing from 0. */
  Eigen::VectorXd times;
  /** 3 x n, m, in B. */
  Eigen::Matrix3Xd positions;
  /** True: a densely sampled path. False: waypoints, a minimum-jerk move
  between each and the next. */
  bool sampled{false};
};

}  // namespace dual_proxy
