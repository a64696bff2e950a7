// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "dual_proxy/common/low_pass.h"
#include "dual_proxy/common/serialize.h"

namespace dual_proxy {

/** Parameters of FrictionFeedback. */
struct FrictionFeedbackParams {
  double gain{0};
  double cutoff{1};
  double max_friction{0.5};
  double max_energy{0.01};
  double settling_time{0.2};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const { ValidateFields("FrictionFeedbackParams", *this); }

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("gain", &gain, Between(0, Open(1)), "",
                   "share of the friction that is fed forward; 0 is off, as "
                   "printed; at 1 nothing would be left that dissipates"));
    a->Visit(Field("cutoff", &cutoff, AtLeast(kMinCutoff), "Hz",
                   "low-pass on the sensed friction"));
    a->Visit(Field("max_friction", &max_friction, AtLeast(0), "",
                   "bound on the friction, as a share of the force in force "
                   "space: what else pushes against the tool is no friction"));
    a->Visit(Field("max_energy", &max_energy, AtLeast(0), "J",
                   "of what friction has dissipated, how much may be spent "
                   "later"));
    a->Visit(Field("settling_time", &settling_time, AtLeast(0), "s",
                   "before the friction of a new contact counts: an impact "
                   "pushes sideways and back"));
  }
};

/** Memory of FrictionFeedback. */
struct FrictionFeedbackState {
  Eigen::Vector3d friction{Eigen::Vector3d::Zero()};  ///< N, low-passed.
  double energy{0};        ///< J: dissipated by friction and not spent yet.
  double contact_time{0};  ///< s: since there is a force space.
};

/** What a robot that slides has to push beside what its motion needs: a share
of the friction that its wrist sensor feels,

    F = gain low_pass(Omega_m F_s),   |F| <= gain max_friction |Omega_f F_s|.

Without it the motion controller trails its proxy by as much as its stiffness
takes to overcome friction. It is passive: friction dissipates F_s . v, of which
F . v never spends more than is there, by an account of energy that holds
max_energy at most; where the account is empty F has no part along v.

Update() neither allocates nor throws. */
class FrictionFeedback {
 public:
  using Params = FrictionFeedbackParams;
  using State = FrictionFeedbackState;

  /** @param period  s, > 0.
  @throws std::invalid_argument if params are not valid. */
  FrictionFeedback(const Params& params, double period);

  State MakeState() const noexcept { return {}; }

  /** Advances by one period.
  @param sensed  F_s, N: of the robot on its environment; zero if not known.
  @param v  m/s, of the tool point.
  @param Omega_f  force selection, blended or not.
  @returns N, in motion space. */
  Eigen::Vector3d Update(const Eigen::Vector3d& sensed,
                         const Eigen::Vector3d& v,
                         const Eigen::Matrix3d& Omega_f,
                         State* state) const noexcept;

 private:
  Params params_;
  double low_pass_gain_;
  double period_;
};

}  // namespace dual_proxy
