// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "dual_proxy/perception/force_torque_adapter.h"
#include "params.h"

namespace dual_proxy {

/** Adds the fields of ForceTorqueAdapterParams to it, or to what is derived
from it. */
template <typename P>
void AddForceTorqueAdapterFields(BindParams<P>* params) {
  params
      ->template Field<double>(
          "tool_mass", &P::tool_mass,
          "kg, >= 0: mass beyond the sensor, whose weight and inertia are "
          "removed, default 0")
      .template Field<Eigen::Vector3d>(
          "tool_com", &P::tool_com,
          "(3,), m, in S: centre of that mass, default 0")
      .template Field<double>("gravity", &P::gravity,
                              "m/s^2, >= 0, along -z of B, default 9.81")
      .template Field<double>(
          "cutoff", &P::cutoff,
          "Hz, >= 0: the sensor's own low-pass (0: none), default 0")
      .template Field<bool>(
          "tare", &P::tare,
          "whether the sensor's bias is learned before anything moves; default "
          "false, in scenarios true")
      .template Field<double>(
          "tare_time", &P::tare_time,
          "s, in (0, 10]: how long the tool has to be at rest, default 0.5")
      .template Field<double>(
          "tare_speed", &P::tare_speed,
          "m/s, > 0: slower than this it is at rest, default 0.005")
      .template Field<double>(
          "tare_max_force", &P::tare_max_force,
          "N, > 0: a larger force on the resting tool is no bias, default 10")
      .template Field<double>("tare_max_noise", &P::tare_max_noise,
                              "N, > 0: noise (std per axis) with which no bias "
                              "is learned, default 1")
      .template Field<double>("period", &P::period, "s, > 0, default 0.001");
}

/** ForceTorqueAdapterInput::v_BE of an argument that may be None. */
inline std::optional<Eigen::Matrix<double, 6, 1>> OptionalVelocity(
    const py::object& robot_velocity) {
  if (robot_velocity.is_none()) return std::nullopt;
  return AsFixed<Eigen::Matrix<double, 6, 1>>(robot_velocity, "robot_velocity");
}

}  // namespace dual_proxy
