// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <string>

#include <Eigen/Core>

#include "dual_proxy/control/arm_model.h"
#include "dual_proxy/drivers/driver.h"

namespace dual_proxy {

/** What of libfranka's RobotState the estimate of the external wrench is. */
struct ExternalWrench {
  std::array<double, 6> K_F_ext_hat_K{};
  /** Column by column, 4x4. */
  std::array<double, 16> F_T_EE{};
  std::array<double, 16> EE_T_K{};
};

/** Franka's estimate of the external wrench in the place of a force sensor.

K_F_ext_hat_K is the force of the robot on its environment, in the axes of the
stiffness frame K and about its origin; of the load that the arm was told
(setLoad) weight and inertia are not in it. A sensor in S without anything
beyond it would measure the same force, arm on tool, and

    f_S = R_SK f_K,    m_S = R_SK m_K + p_SK x f_S

so the adapter that takes it has a tool of no mass. (O_F_ext_hat_K is not used:
about which point its moment is, the arm's manual leaves open.)

Near a singularity the arm says zero to all six, which is no estimate: not
valid. */
class ExternalWrenchSensor final : public ForceTorqueSensorDriver {
 public:
  /** @param arm  whose E lies beyond the flange F, that being in the last
      joint's frame where Franka's arms have it.
  @param p_SE  m, in S, whose axes are E's: from its origin to E. */
  ExternalWrenchSensor(const ArmModelParams<7>& arm,
                       const Eigen::Vector3d& p_SE);

  void Open() override {}
  void Close() noexcept override {}
  std::string fault() const override { return {}; }

  /** Takes what the arm said at `time`. Neither allocates nor throws. */
  void Take(double time, const ExternalWrench& wrench) noexcept;

  Reading<Vector6> Read() noexcept override { return reading_; }

 private:
  Eigen::Matrix3d R_SF_;
  Eigen::Vector3d p_SF_;  // In S.
  Reading<Vector6> reading_;
};

}  // namespace dual_proxy
