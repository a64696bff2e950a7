// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "dual_proxy/common/pose.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/common/signal_layout.h"
#include "dual_proxy/control/haptic_fixtures.h"
#include "dual_proxy/proxy/clutch.h"
#include "dual_proxy/schemes/half.h"

namespace dual_proxy {

/** Parameters of OperatorAids. */
struct OperatorAidsParams {
  bool buttons{false};
  ClutchParams clutch;
  double max_force_scale{2};
  double force_scale_rate{1};
  double max_damping{27};
  HomingParams homing;
  WorkspaceWallParams workspace_wall;
  GuidanceParams guidance;
  double period{0.001};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("buttons", &buttons,
                   "whether clutch, home and force scale act and are logged"));
    a->Visit(Field("clutch", &clutch, "that re-centres the hand"));
    a->Visit(Field("max_force_scale", &max_force_scale, Between(1, 10), "",
                   "most by which the hand may have its force multiplied; the "
                   "loop's gain grows with it"));
    a->Visit(Field("force_scale_rate", &force_scale_rate, Above(0), "1/s",
                   "at which a new force scale takes over"));
    a->Visit(Field("max_damping", &max_damping, AtLeast(0), "N s/m",
                   "with which the hand pays for what a change of the force's "
                   "gain gives it"));
    a->Visit(Field("homing", &homing, "of the handle, before it is engaged"));
    a->Visit(Field("workspace_wall", &workspace_wall,
                   "at the edge of the device's workspace"));
    a->Visit(Field("guidance", &guidance, "virtual fixture for the hand"));
    a->Visit(Field("period", &period, Above(0), "s", "between updates"));
  }
};

/** What the operator asks for beside moving the handle. */
struct OperatorButtons {
  bool clutch{false};     ///< Pressed: the robot holds still, the hand is free.
  bool home{false};       ///< Held: as clutch, and the handle goes home.
  double force_scale{1};  ///< Of F_h, >= 0; one that is no number is ignored.
};

/** Memory of OperatorAids, and its results. */
struct OperatorAidsState {
  ClutchState clutch;
  HomingState homing;
  GuidanceState guidance;
  double force_scale{1};
  double force_gain{1};  ///< What F_h is multiplied by: scale and engagement.
  Eigen::Vector3d fixture_force{Eigen::Vector3d::Zero()};  ///< N, on the hand.

  /** J: what the hand has put into the scheme and not got back, by the force
  that the scheme asked for, and by that which acted. */
  double scheme_energy{0};
  double hand_energy{0};
  /** Of the period before: N, both, and of the latter what pays; m, the
  handle's position from its own home and from the one that the clutch has
  moved. */
  Eigen::Vector3d scheme_force{Eigen::Vector3d::Zero()};
  Eigen::Vector3d hand_force{Eigen::Vector3d::Zero()};
  Eigen::Vector3d paying_force{Eigen::Vector3d::Zero()};
  Eigen::Vector3d handle{Eigen::Vector3d::Zero()};
  Eigen::Vector3d position{Eigen::Vector3d::Zero()};
};

/** What operators of haptic devices expect of every scheme: a clutch, homing, a
force scale, a workspace whose edge is felt, guidance. It stands between the
device and the scheme's half, before the half with poses, behind it with forces.

Force and moment of a scheme are multiplied by the gain before the device's
limits, but for what it injects against its own activity. A gain that never
changes is a choice of units, as a scheme's own force_scale. One that grows in
contact gives the hand back more than it has put in; so both are counted,

    E_s -= F_h . dx       E_h -= gain F_h . dx_handle

with dx zero while the clutch is pressed; when the scheme owes the hand nothing
more (E_s <= 0) no credit is left, and what it gives then is its own matter.
What E_h is below zero the hand pays by damping, of at most max_damping:

    F = -alpha v,   alpha = -E_h / (h |v|^2)

As the half is told what was sent, what it counts of energy is all that. While
the clutch is pressed it is told of a handle at rest.

No method allocates or throws. */
class OperatorAids {
 public:
  /** @throws std::invalid_argument if params are not valid. */
  explicit OperatorAids(const OperatorAidsParams& params);

  /** Whether there is anything to do. */
  bool on() const { return buttons_ || wall_.on() || guidance_.on(); }

  OperatorAidsState MakeState() const { return {}; }

  /** Takes what comes from the device, in D, and makes of it what the half is
  to have, in place. */
  void FilterInput(const OperatorButtons& buttons, Pose* X_DH,
                   Vector6* device_velocity,
                   OperatorAidsState* state) const noexcept;

  /** Scales a half's setpoint. */
  void FilterSetpoint(HapticSetpoint* setpoint,
                      OperatorAidsState* state) const noexcept;

  void VisitSignals(const OperatorAidsState& state, const Pose& X_DH,
                    SignalSink* sink) const;

 private:
  // Counts the period that is over. Returns the force that pays, N.
  Eigen::Vector3d CountEnergy(const Eigen::Vector3d& handle,
                              const Eigen::Vector3d& p,
                              const Eigen::Vector3d& v,
                              OperatorAidsState* state) const noexcept;

  bool buttons_;
  double max_force_scale_;
  double max_scale_step_;
  double max_damping_;
  double period_;
  Clutch clutch_;
  Homing homing_;
  WorkspaceWall wall_;
  Guidance guidance_;
};

}  // namespace dual_proxy
