// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "dual_proxy/common/low_pass.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/control/passivity_controller.h"

namespace dual_proxy {

/** Parameters of ForceLoop. The same class closes the loop on forces (N, m/s)
and, with the units in brackets, on moments (N m, rad/s). */
struct ForceLoopParams {
  double gain{2.5};
  double integral_gain{5.5};
  double damping{20};
  double max_proportional_force{0};
  double max_integral_force{10};
  double integral_delay{0};
  double speed_limit{0.1};
  double filter_cutoff{100};
  double release_time{0.03};
  TimeDomainPassivityParams passivity{};
  double period{0.001};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("gain", &gain, AtLeast(0), "", "Kpf"));
    a->Visit(Field("integral_gain", &integral_gain, AtLeast(0), "1/s", "Kif"));
    a->Visit(Field("damping", &damping, AtLeast(0), "N s/m", "Kvf"));
    a->Visit(Field("max_proportional_force", &max_proportional_force,
                   AtLeast(0), "N", "bound on |Kpf e|; 0 is none"));
    a->Visit(Field("max_integral_force", &max_integral_force, AtLeast(0), "N",
                   "bound on |Kif int e|"));
    a->Visit(Field("integral_delay", &integral_delay, AtLeast(0), "s",
                   "before a new contact is integrated"));
    a->Visit(Field("speed_limit", &speed_limit, Above(0), "m/s",
                   "how fast the loop may move the tool"));
    a->Visit(Field("filter_cutoff", &filter_cutoff, CutoffOrNone(), "Hz",
                   "low-pass on the sensed force; 0 is off"));
    a->Visit(Field("release_time", &release_time, AtLeast(0), "s",
                   "in which the force of an integral that a new selection has "
                   "no room for fades to 5 %; 0 drops it at once"));
    a->Visit(Field("passivity", &passivity,
                   "its period is ignored: the loop's own holds"));
    a->Visit(Field("period", &period, Above(0), "s", "between updates"));
  }
};

/** Memory of ForceLoop; 3-vectors in B. */
struct ForceLoopState {
  Eigen::Vector3d sensed{Eigen::Vector3d::Zero()};    ///< Filtered F_s, N.
  Eigen::Vector3d integral{Eigen::Vector3d::Zero()};  ///< int e dt, N s.
  Eigen::Vector3d released{Eigen::Vector3d::Zero()};  ///< Fading force, N.
  /** Omega_f at the last update. */
  Eigen::Matrix3d selection{Eigen::Matrix3d::Zero()};
  double settled{0};  ///< s: since Omega_f has grown.
  TimeDomainPassivityState passivity{};
  bool initialized{false};  ///< The filter starts at the first sensed force.
};

/** The force loop of eq. (13) with its passivity controller:

    e   = F_s - F_r                                  (F_s low-passed)
    F_f = F_r - Kpf Omega_b e - Kif int(Omega_f e) - Kvf Omega_b v + F_inject

- Omega_f is the selection asked for, a projection; Omega_b its blend
  (SelectionBlend). Every feedback term is projected. F_r is not: whoever makes
  it limits its rate, so a component that is no longer selected decays there,
  and projecting it here would turn that decay into a step, while a bumpless
  hand-over that starts F_r at the sensed force would be held back by the blend
  and the contact force would collapse for as long.
- Kpf e is bounded by max_proportional_force, if that is given: what answers a
  phantom force must not be more than an arm can turn round in time.
- The integral lives in the range of Omega_f: it is projected when Omega_f
  changes, zero when Omega_f is zero, bounded by max_integral_force. What is cut
  off fades out within release_time. It waits for integral_delay after Omega_f
  has grown: what an impact leaves in it would lift a light contact off again.
- The speed limit takes the share s from what of F_f drives the motion v_f =
  Omega_b v on, and adds -s 5 Kvf v_f. s goes smoothly from 0 to 1 as the speed
  that the tool will have in 10 ms goes from half the limit to all of it: what
  drives the arm can be taken back only so fast (the torque's rate). It only
ever takes power from the tool.
- With F_fb = F_f - F_r the passivity controller sees all of the feedback. It
  starts anew when Omega_f becomes zero.

Update() neither allocates nor throws. */
class ForceLoop {
 public:
  /** @throws std::invalid_argument if params are not valid. */
  explicit ForceLoop(ForceLoopParams params = {});

  const ForceLoopParams& params() const { return params_; }

  ForceLoopState MakeState() const noexcept;

  /** Advances by one period.
  @param reference   F_r, 3-vector, N, in B.
  @param sensed      F_s, 3-vector, N, in B: robot on environment.
  @param velocity    v_BE, 3-vector, m/s, in B.
  @param selection   Omega_f, 3x3 projection, in B.
  @param blended     Omega_b, 3x3, symmetric, eigenvalues in [0, 1], in B.
  @param[in,out] state  made by MakeState().
  @returns F_f, 3-vector, N, in B.
  @pre All inputs are finite. */
  Eigen::Vector3d Update(const Eigen::Vector3d& reference,
                         const Eigen::Vector3d& sensed,
                         const Eigen::Vector3d& velocity,
                         const Eigen::Matrix3d& selection,
                         const Eigen::Matrix3d& blended,
                         ForceLoopState* state) const noexcept;

 private:
  /** What the speed limit adds to `force` at `velocity`, the one before being
  `last`, all in force space. */
  Eigen::Vector3d CalcBraking(const Eigen::Vector3d& force,
                              const Eigen::Vector3d& velocity,
                              const Eigen::Vector3d& last) const noexcept;

  ForceLoopParams params_;
  TimeDomainPassivity passivity_;
  double filter_gain_{1};
  double release_factor_{0};
};

}  // namespace dual_proxy
