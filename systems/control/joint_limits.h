// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/common/arm_limits.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/control/model_terms.h"

namespace dual_proxy {

/** Parameters of JointLimits. */
template <int kJoints>
struct JointLimitsParams {
  JointVector<kJoints> lower{ArmLimits<kJoints>{}.joint_lower};
  JointVector<kJoints> upper{ArmLimits<kJoints>{}.joint_upper};
  JointVector<kJoints> speed{ArmLimits<kJoints>{}.joint_speed};
  double position_margin{0.05};
  double speed_margin{0.1};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("lower", &lower, Finite(), "rad", "each joint's lower end"));
    a->Visit(Field("upper", &upper, Finite(), "rad", "each joint's upper end"));
    a->Visit(Field("speed", &speed, Above(0), "rad/s", "each joint's largest"));
    a->Visit(Field("position_margin", &position_margin, AtLeast(0), "rad",
                   "kept free at both ends"));
    a->Visit(Field("speed_margin", &speed_margin, Between(0, Open(1)), "",
                   "share of the speed kept free"));
  }
};

/** Keeps joints within their ends and speeds, with a margin, by damping that
sets in before them: of each joint's acceleration a only what is in

    (v_low(q) - v) / T_v <= a <= (v_high(q) - v) / T_v

is let through, where

    v_high(q) = min((1 - speed_margin) speed, (upper - position_margin - q) /
T_q)

and v_low alike: a joint approaches its end ever more slowly, and one beyond the
margin is led back. T_v = 20 ms, T_q = 0.1 s. No heap, no throw. */
template <int kJoints>
class JointLimits {
 public:
  using Params = JointLimitsParams<kJoints>;
  using Joints = JointVector<kJoints>;

  /** @throws std::invalid_argument if params are not valid. */
  explicit JointLimits(Params params = {});

  const Params& params() const { return params_; }

  /** Whether any joint moves faster than half its speed, or could not go on at
  full speed for its end. Far from all limits nothing is to be limited.
  @param q rad.  @param v rad/s. */
  bool IsNear(const Joints& q, const Joints& v) const noexcept;

  /** The acceleration, rad/s^2, of which each joint's is let through. */
  Joints Limit(const Joints& q, const Joints& v,
               const Joints& acceleration) const noexcept;

 private:
  Params params_;
  Joints speed_;  ///< Less the margin.
};

}  // namespace dual_proxy
