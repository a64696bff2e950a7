// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "dual_proxy/perception/force_torque_adapter.h"
#include "params.h"

namespace dual_proxy {

/** ForceTorqueAdapterInput::v_BE of an argument that may be None. */
inline std::optional<Eigen::Matrix<double, 6, 1>> OptionalVelocity(
    const py::object& robot_velocity) {
  if (robot_velocity.is_none()) return std::nullopt;
  return AsFixed<Eigen::Matrix<double, 6, 1>>(robot_velocity, "robot_velocity");
}

}  // namespace dual_proxy
