// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "dual_proxy/common/pose.h"
#include "dual_proxy/control/arm_model.h"

namespace dual_proxy {

/** The posture that reaches a pose, nearest to another one: of the q within
limits whose E is at X_BE the one with the least |q - q_near|, found from there,
to 1e-9 m and rad. The same bits on every processor.

Newton's method on the pose, each step to what is nearest to q_near on the
linearised constraint (sequential least squares); joints that a step would take
beyond a limit stay on it in that step.

@param X_BE  finite; R is a rotation matrix.
@param q_near  rad, finite.
@param lower, upper  rad, of the joints.
@returns rad; none if no posture was found. Not for a control cycle. */
template <int kJoints>
std::optional<JointVector<kJoints>> FindPosture(
    const ArmModel<kJoints>& arm, const Pose& X_BE,
    const JointVector<kJoints>& q_near, const JointVector<kJoints>& lower,
    const JointVector<kJoints>& upper);

}  // namespace dual_proxy
