// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "dual_proxy/common/serialize.h"

namespace dual_proxy {

/** Parameters of HapticController. */
struct HapticControllerParams {
  double force_damping{27};
  double max_force{12};
  double max_moment{0};
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
    a->Visit(
        Field("period", &period, Above(0), "s", "of the device's control"));
  }
};

/** Memory of HapticController. */
struct HapticControllerState {
  std::int64_t bad_inputs{0};  ///< Cycles refused.
};

/** Open-loop force control of the haptic device, eq. (18):

    F = F_h - Kvf_h Omega_fh v_h,   M = M_h

on the hand, in D. The device compensates its own gravity p_h. Force and moment
are saturated last, on their norms. If an input is not finite the device wrench
is zero and state.bad_inputs counts it.

Update() neither allocates nor throws. */
class HapticController {
 public:
  /** @throws std::invalid_argument if params are not valid. */
  explicit HapticController(HapticControllerParams params = {});

  const HapticControllerParams& params() const { return params_; }

  HapticControllerState MakeState() const noexcept { return {}; }

  /** Computes one cycle.
  @param reference_force   F_h, 3-vector, N, in D: on the hand.
  @param reference_moment  M_h, 3-vector, N m, in D.
  @param device_velocity   [linear; angular], m/s, rad/s, in D.
  @param force_selection   Omega_fh, 3x3, in D.
  @param[in,out] state     made by MakeState().
  @returns [force; moment], N, N m, in D: on the hand. */
  Eigen::Matrix<double, 6, 1> Update(
      const Eigen::Vector3d& reference_force,
      const Eigen::Vector3d& reference_moment,
      const Eigen::Matrix<double, 6, 1>& device_velocity,
      const Eigen::Matrix3d& force_selection,
      HapticControllerState* state) const noexcept;

 private:
  HapticControllerParams params_;
};

}  // namespace dual_proxy
