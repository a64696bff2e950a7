// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "dual_proxy/common/pose.h"
#include "dual_proxy/common/serialize.h"

namespace dual_proxy {

/** How the device's workspace lies in the robot's. */
struct WorkspaceMapParams {
  Eigen::Matrix3d R_DB{Eigen::Matrix3d::Identity()};
  Eigen::Vector3d p_cw{Eigen::Vector3d::Zero()};
  Eigen::Matrix3d R_cw{Eigen::Matrix3d::Identity()};
  double scale{2.5};

  /** @throws std::invalid_argument naming the field. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("R_DB", &R_DB, Rotation(), "",
                   "maps coordinates in the robot base frame B to the device "
                   "base frame D (the paper's R_{h-r})"));
    a->Visit(Field(
        "p_cw", &p_cw, Finite(), "m",
        "in B: robot position that belongs to the device's home (clutch)"));
    a->Visit(Field("R_cw", &R_cw, Rotation(), "",
                   "robot orientation R_BE that belongs to the device's home"));
    a->Visit(
        Field("scale", &scale, Between(1e-3, 1e3), "",
              "metres of the robot per metre of the device; 2.5 in the paper"));
  }
};

/** The map between the device's and the robot's workspace, eq. (1)-(3):

    x_pr = p_cw + s R_DBᵀ x_h            R_pr = R_DBᵀ R_h R_DB R_cw
    x_ph = R_DB (x_r - p_cw) / s         R_ph = R_DB R_r R_cwᵀ R_DBᵀ
    Ω_h  = R_DB Ω R_DBᵀ

The two maps of poses are exact inverses of each other. Everything that crosses
the link is mapped by the receiver. x_h is measured from the device's home. */
class WorkspaceMap {
 public:
  /** @throws std::invalid_argument if a matrix is no rotation, the position is
  not finite or the scale is not positive. */
  explicit WorkspaceMap(WorkspaceMapParams params);

  const WorkspaceMapParams& params() const { return params_; }

  /** Robot proxy, eq. (1).
  @param x_h device position, m, in D, from home.
  @param R_h device orientation R_DH.
  @returns x_pr (m) and R_pr, in B. */
  Pose RobotProxy(const Eigen::Vector3d& x_h,
                  const Eigen::Matrix3d& R_h) const noexcept;

  /** Haptic proxy, eq. (2).
  @param x_r robot position p_BE, m, in B.
  @param R_r robot orientation R_BE.
  @returns x_ph (m) and R_ph, in D. */
  Pose HapticProxy(const Eigen::Vector3d& x_r,
                   const Eigen::Matrix3d& R_r) const noexcept;

  /** A selection of force or moment space (3x3 projection, in B) for the device
  (in D), eq. (3). */
  Eigen::Matrix3d HapticSelection(const Eigen::Matrix3d& Omega) const noexcept;

 private:
  WorkspaceMapParams params_;
};

}  // namespace dual_proxy
