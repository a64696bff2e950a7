// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "dual_proxy/common/serialize.h"
#include "dual_proxy/link/link_monitor.h"
#include "dual_proxy/link/message.h"
#include "dual_proxy/proxy/workspace_map.h"

namespace dual_proxy {

/** Parameters of PositionForceHapticSide. */
struct PositionForceHapticSideParams {
  /// Only its R_DB matters: it turns the force into the device's frame.
  WorkspaceMapParams map;
  LinkMonitorParams link;
  /// Share of the robot's force that the hand feels, >= 0. 1/s = 0.4 keeps
  /// stiffness per metre of hand; at 1 a soft hand oscillates without delay.
  double force_scale{0.4};
  /// Bound on the force on the hand, N, >= 0.
  double max_force{12};

  /** @throws std::invalid_argument naming the field. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("map", &map, "only its R_DB matters"));
    a->Visit(Field("link", &link, "what counts as a good message"));
    a->Visit(Field("force_scale", &force_scale, AtLeast(0), "",
                   "share of the robot's force that the hand feels"));
    a->Visit(Field("max_force", &max_force, AtLeast(0), "N",
                   "bound on the force on the hand"));
  }
};

/** State and output of PositionForceHapticSide. */
struct PositionForceHapticSideState {
  /// F_h, N, in D: on the hand.
  Eigen::Vector3d reference_force{Eigen::Vector3d::Zero()};
  /// F_s of the message in use, N, in B: robot on environment.
  Eigen::Vector3d sensed_force{Eigen::Vector3d::Zero()};
  LinkMonitorState link;
};

/** The haptic side of the classic two-channel scheme, with which the paper
compares: position goes to the robot, the force sensed there comes straight
back,

    F_h = -force_scale R_DB F_s,

bounded by max_force; the hand feels the reaction of what the robot exerts. No
rate limit, no selection, no damping: it closes the loop over the link, and is
the worse the longer that takes.

Zero before the first message and while the link is lost. A message that is not
finite, too old or out of order is counted by the link monitor, and the last
good one stays in use. */
class PositionForceHapticSide {
 public:
  using Params = PositionForceHapticSideParams;
  using State = PositionForceHapticSideState;

  /** @throws std::invalid_argument if `params` is invalid. */
  explicit PositionForceHapticSide(const Params& params = {});

  const Params& params() const { return params_; }

  State MakeState() const { return {}; }

  /** Looks at the newest message, which may be the last one again.
  @param time  receiver's clock, s.
  @param message  with the sensed force, N, in B.
  @param[in,out] state  made by MakeState(); its `reference_force` is the
  output. No heap, no throw. */
  void Update(double time, const ForceMessage& message,
              State* state) const noexcept;

 private:
  Params params_;
  LinkMonitor monitor_;
};

}  // namespace dual_proxy
