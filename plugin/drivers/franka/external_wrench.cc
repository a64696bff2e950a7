// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/franka/external_wrench.h"

#include <Eigen/Geometry>

#include "dual_proxy/robots/panda/panda.h"

namespace dual_proxy {

using Eigen::Matrix4d;
using Eigen::Vector3d;

ExternalWrenchSensor::ExternalWrenchSensor(const ArmModelParams<7>& arm,
                                           const Vector3d& p_SE)
    : R_SF_(arm.R_LE.transpose()),
      p_SF_(p_SE + R_SF_ * (kPandaFlange - arm.p_LE)) {}

void ExternalWrenchSensor::Take(double time,
                                const ExternalWrench& wrench) noexcept {
  const Eigen::Map<const Vector6> in_K(wrench.K_F_ext_hat_K.data());
  const Eigen::Map<const Matrix4d> F_T_EE(wrench.F_T_EE.data());
  const Eigen::Map<const Matrix4d> EE_T_K(wrench.EE_T_K.data());
  const Matrix4d F_T_K = F_T_EE * EE_T_K;
  const Eigen::Matrix3d R_SK = R_SF_ * F_T_K.topLeftCorner<3, 3>();
  const Vector3d p_SK = p_SF_ + R_SF_ * F_T_K.topRightCorner<3, 1>();
  Vector6 in_S;
  in_S.head<3>() = R_SK * in_K.head<3>();
  in_S.tail<3>() = R_SK * in_K.tail<3>() + p_SK.cross(in_S.head<3>());
  reading_.valid = in_S.allFinite() && !in_K.isZero(0);
  if (!reading_.valid) return;
  reading_.time = time;
  reading_.value = in_S;
}

}  // namespace dual_proxy
