// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/common/serialize.h"

namespace dual_proxy {

/** Parameters of GripperFollower. */
struct GripperParams {
  bool enabled{false};
  /** A Panda's hand opens by 80 mm, an Omega.7's gripper by about 27 mm. */
  double scale{3};
  double max_width{0.08};
  double max_speed{0.1};
  double start_width{0.08};
  double period{0.001};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("enabled", &enabled, "whether the robot has a gripper"));
    a->Visit(Field("scale", &scale, Above(0), "",
                   "width over the opening of the device's gripper"));
    a->Visit(Field("max_width", &max_width, Above(0), "m", "between fingers"));
    a->Visit(Field("max_speed", &max_speed, Above(0), "m/s",
                   "bound on the change of the width"));
    a->Visit(Field("start_width", &start_width,
                   Between(0, {max_width, "max_width"}), "m",
                   "until the operator's gripper is known"));
    a->Visit(Field("period", &period, Above(0), "s", "between updates"));
  }
};

/** Memory of GripperFollower. */
struct GripperState {
  double target{0};  ///< m: what is asked for, within the gripper's range.
  double width{0};   ///< m: the command.
};

/** The robot's gripper follows that of the device:

    w -> clamp(scale opening, 0, max_width)   at max_speed

An opening that is not finite is none: the last target is kept.

Update() neither allocates nor throws. */
class GripperFollower {
 public:
  /** @throws std::invalid_argument if params are not valid. */
  explicit GripperFollower(const GripperParams& params);

  bool enabled() const { return params_.enabled; }

  GripperState MakeState() const {
    return {params_.start_width, params_.start_width};
  }

  /** Advances by one period.
  @param connected  false: the command stays where it is.
  @param opening  of the device's gripper, m.
  @returns state->width. */
  double Update(bool connected, double opening,
                GripperState* state) const noexcept;

 private:
  GripperParams params_;
};

}  // namespace dual_proxy
