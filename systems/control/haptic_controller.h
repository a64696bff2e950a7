// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "dual_proxy/common/serialize.h"
#include "dual_proxy/control/selection_blend.h"

namespace dual_proxy {

/** Parameters of HapticController. */
struct HapticControllerParams {
  double force_damping{27};
  double max_force{12};
  double max_moment{0};
  double selection_blend_time{0.03};
  double period{0.001};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("force_damping", &force_damping, AtLeast(0), "N s/m",
                   "Kvf_h: 90 % of the Omega.7's maximum"));
    a->Visit(Field("max_force", &max_force, AtLeast(0), "N",
                   "the device's maximum"));
    a->Visit(Field("max_moment", &max_moment, AtLeast(0), "N m",
                   "0 for a device without moments"));
    a->Visit(Field("selection_blend_time", &selection_blend_time, AtLeast(0),
                   "s",
                   "in which the damping of a new selection takes over; 0 "
                   "switches at once, as printed"));
    a->Visit(
        Field("period", &period, Above(0), "s", "of the device's control"));
  }
};

/** Memory of HapticController. */
struct HapticControllerState {
  SelectionBlendState selection;
  /// In force: those that were given last, until the damping of the selection
  /// that they belong to has gone.
  Eigen::Matrix3d contact_normals{Eigen::Matrix3d::Zero()};
  std::int64_t bad_inputs{0};  ///< Cycles refused.
};

/** Open-loop force control of the haptic device, eq. (18):

    F = F_h - Kvf_h Omega_fh v_h,   M = M_h

on the hand, in D. A new Omega_fh takes over by a SelectionBlend, without which
the damping steps by up to a newton at touch. What would pull the hand into a
surface is left out (RemovePull()): what damps a hand that lifts would do so.
The device compensates its own gravity p_h. Force and moment are saturated last,
on their norms. If an input is not finite, or a normal no unit vector, the
device wrench is zero and state.bad_inputs counts it.

Update() neither allocates nor throws. */
class HapticController {
 public:
  /** @throws std::invalid_argument if params are not valid. */
  explicit HapticController(HapticControllerParams params = {});

  const HapticControllerParams& params() const { return params_; }

  HapticControllerState MakeState() const noexcept {
    return {.selection = blend_.MakeState()};
  }

  /** Computes one cycle.
  @param reference_force   F_h, 3-vector, N, in D: on the hand.
  @param reference_moment  M_h, 3-vector, N m, in D.
  @param device_velocity   [linear; angular], m/s, rad/s, in D.
  @param force_selection   Omega_fh, 3x3, in D.
  @param contact_normals   3x3, in D: unit vectors into surfaces as columns, or
    zero.
  @param[in,out] state     made by MakeState().
  @returns [force; moment], N, N m, in D: on the hand. */
  Eigen::Matrix<double, 6, 1> Update(
      const Eigen::Vector3d& reference_force,
      const Eigen::Vector3d& reference_moment,
      const Eigen::Matrix<double, 6, 1>& device_velocity,
      const Eigen::Matrix3d& force_selection,
      const Eigen::Matrix3d& contact_normals,
      HapticControllerState* state) const noexcept;

 private:
  HapticControllerParams params_;
  SelectionBlend blend_;
};

}  // namespace dual_proxy
