// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "dual_proxy/common/serialize.h"
#include "dual_proxy/control/arm_model.h"
#include "dual_proxy/simulation/simulated_arm.h"

namespace dual_proxy {

/** What a simulated arm is that its controllers do not know of. */
struct ArmMismatchParams {
  double mass_scale{1};
  double payload{0};
  Eigen::Vector3d tool_offset{Eigen::Vector3d::Zero()};
  double joint_friction{0};
  double torque_step{0};
  int torque_delay{0};

  /** Whether there is none. */
  bool is_none() const;

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("mass_scale", &mass_scale, Between(0.5, 2), "",
                   "by which masses and inertias of all links but the tool are "
                   "multiplied"));
    a->Visit(
        Field("payload", &payload, Between(0, 3), "kg",
              "a point at the tool point, which the wrist sensor carries"));
    a->Visit(Field("tool_offset", &tool_offset, Between(-0.1, 0.1), "m",
                   "in E: from the tool point to where the tool ends"));
    a->Visit(Field("joint_friction", &joint_friction, Between(0, 10), "N m",
                   "Coulomb's in each joint"));
    a->Visit(Field("torque_step", &torque_step, Between(0, 1), "N m",
                   "between the torques that the joints can give"));
    a->Visit(Field("torque_delay", &torque_delay,
                   Between(0, SimulatedArmParams::kMaxTorqueDelay), "periods",
                   "before a torque acts"));
  }
};

/** Makes of an arm as its controllers know it, with its tool, what is
simulated.
@throws std::invalid_argument if `mismatch` is not valid. */
void ApplyMismatch(const ArmMismatchParams& mismatch, ArmModelParams<7>* arm,
                   SimulatedArmParams* params);

}  // namespace dual_proxy
