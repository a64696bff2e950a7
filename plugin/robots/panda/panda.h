// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "dual_proxy/control/model_terms.h"

namespace dual_proxy {

/** @file
What is the Franka Panda's alone, beside panda.urdf, which has its links and
joints up to the flange. The limits of its joints are the defaults of ArmLimits
with seven joints, the controller's gains those of
OperationalSpaceControllerParams. */

/** Rest posture, rad: E at (0.45, 0, 0.18) m, the tool pointing straight down,
no joint within 0.5 rad of its limits. */
inline const Vector7 kPandaQRest{{0, -0.0339, 0, -2.5555, 0, 2.5216, 0}};
/** R_BE that points the tool straight down. */
inline const Eigen::Matrix3d kToolPointingDown{
    Eigen::Vector3d(1, -1, -1).asDiagonal()};
/** p_7S: the flange, where the wrist sensor's frame S is, m, in panda_link7. */
inline const Eigen::Vector3d kPandaFlange{0, 0, 0.107};

}  // namespace dual_proxy
