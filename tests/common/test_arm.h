// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <numbers>

#include <Eigen/Geometry>

#include "dual_proxy/control/arm_model.h"

namespace dual_proxy {

/** An arm of a Panda's build, rounded; the tool is 0.5 kg of its last link. */
inline ArmModelParams<7> MakeTestArm() {
  constexpr double kHalfPi = std::numbers::pi / 2;
  const double rolls[] = {0,        -kHalfPi, kHalfPi, kHalfPi,
                          -kHalfPi, kHalfPi,  kHalfPi};
  ArmModelParams<7> arm;
  arm.p_PJ.col(0) = Eigen::Vector3d(0, 0, 0.333);
  arm.p_PJ.col(2) = Eigen::Vector3d(0, -0.316, 0);
  arm.p_PJ.col(3) = Eigen::Vector3d(0.0825, 0, 0);
  arm.p_PJ.col(4) = Eigen::Vector3d(-0.0825, 0.384, 0);
  arm.p_PJ.col(6) = Eigen::Vector3d(0.088, 0, 0);
  arm.mass << 5, 0.7, 3.2, 3.6, 1.2, 1.7, 1.2;
  for (int i = 0; i < 7; ++i) {
    arm.R_PJ[i] =
        Eigen::AngleAxisd(rolls[i], Eigen::Vector3d::UnitX()).matrix();
    arm.com.col(i) = Eigen::Vector3d(0.01, -0.02 * (i % 2), 0.03);
    arm.inertia[i] = 0.005 * arm.mass(i) * Eigen::Matrix3d::Identity();
  }
  arm.p_LE = Eigen::Vector3d(0, 0, 0.207);
  return arm;
}

/** rad: E at about (0.45, 0, 0.18) m, pointing straight down. */
inline const Vector7 kTestArmAtRest{{0, -0.0339, 0, -2.5555, 0, 2.5216, 0}};

/** An arm with six joints of a UR's build, its numbers made up; the tool is 0.5
kg of its last link. */
inline ArmModelParams<6> MakeSixJointArm() {
  constexpr double kHalfPi = std::numbers::pi / 2;
  const double rolls[] = {0, -kHalfPi, 0, 0, -kHalfPi, kHalfPi};
  ArmModelParams<6> arm;
  arm.p_PJ.col(0) = Eigen::Vector3d(0, 0, 0.16);
  arm.p_PJ.col(2) = Eigen::Vector3d(0.42, 0, 0);
  arm.p_PJ.col(3) = Eigen::Vector3d(0.39, 0, 0.13);
  arm.p_PJ.col(4) = Eigen::Vector3d(0, 0.1, 0);
  arm.p_PJ.col(5) = Eigen::Vector3d(0, -0.1, 0);
  arm.mass << 4, 9, 3, 1.5, 1.5, 1;
  for (int i = 0; i < 6; ++i) {
    arm.R_PJ[i] =
        Eigen::AngleAxisd(rolls[i], Eigen::Vector3d::UnitX()).matrix();
    arm.com.col(i) = Eigen::Vector3d(0.05 * (i == 1 || i == 2), 0, 0.02);
    arm.inertia[i] = 0.005 * arm.mass(i) * Eigen::Matrix3d::Identity();
  }
  arm.p_LE = Eigen::Vector3d(0, 0, 0.1);
  return arm;
}

/** rad: elbow up, E in front of the arm, far from any singularity. */
inline const JointVector<6> kSixJointArmAtRest{{0.1, -1.3, 1.7, -2, -1.5, 0.3}};

}  // namespace dual_proxy
