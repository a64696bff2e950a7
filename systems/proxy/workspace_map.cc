// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/workspace_map.h"

namespace dual_proxy {

void WorkspaceMapParams::Validate() const {
  ValidateFields("WorkspaceMapParams", *this);
}

WorkspaceMap::WorkspaceMap(WorkspaceMapParams params) : params_(params) {
  params_.Validate();
}

Pose WorkspaceMap::RobotProxy(const Eigen::Vector3d& x_h,
                              const Eigen::Matrix3d& R_h) const noexcept {
  const Eigen::Matrix3d& R_DB = params_.R_DB;
  return {params_.p_cw + params_.scale * (R_DB.transpose() * x_h),
          R_DB.transpose() * R_h * R_DB * params_.R_cw};
}

Pose WorkspaceMap::HapticProxy(const Eigen::Vector3d& x_r,
                               const Eigen::Matrix3d& R_r) const noexcept {
  const Eigen::Matrix3d& R_DB = params_.R_DB;
  return {R_DB * (x_r - params_.p_cw) / params_.scale,
          R_DB * R_r * params_.R_cw.transpose() * R_DB.transpose()};
}

Eigen::Matrix3d WorkspaceMap::HapticSelection(
    const Eigen::Matrix3d& Omega) const noexcept {
  return params_.R_DB * Omega * params_.R_DB.transpose();
}

}  // namespace dual_proxy
