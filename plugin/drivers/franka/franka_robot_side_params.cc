// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/franka/franka_robot_side_params.h"

#include "dual_proxy/control/arm_model.h"

namespace dual_proxy {

void FrankaLoadParams::Validate() const {
  constexpr const char* kWho = "FrankaLoadParams";
  ValidateFields(kWho, *this);
  ThrowUnlessInertia(kWho, "inertia", inertia);
}

void FrankaCollisionParams::Validate() const {
  constexpr const char* kWho = "FrankaCollisionParams";
  ValidateFields(kWho, *this);
  if ((collision_torque.array() < contact_torque.array()).any()) {
    ThrowInvalidField(kWho, "collision_torque", "at least contact_torque",
                      (collision_torque - contact_torque).minCoeff());
  }
  if ((collision_force.array() < contact_force.array()).any()) {
    ThrowInvalidField(kWho, "collision_force", "at least contact_force",
                      (collision_force - contact_force).minCoeff());
  }
}

void FrankaRobotSideParams::Validate() const {
  constexpr const char* kWho = "FrankaRobotSideParams";
  ValidateFields(kWho, *this);
  if (host.empty()) {
    throw InvalidField(kWho, "host", "expected a name or address, got \"\"");
  }
}

}  // namespace dual_proxy
