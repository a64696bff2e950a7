// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>

#include "dual_proxy/common/serialize.h"

namespace dual_proxy {

/** Parameters of TimeDomainPassivity, for a force port (N, m/s) or, with the
units in brackets, for a moment port (N m, rad/s). */
struct TimeDomainPassivityParams {
  bool enabled{true};
  /** The contact of 5 N on 3e4 N/m stores 0.4 mJ; 2 mJ make 7 kg swing by 11 N.
   */
  double initial_energy{0.002};
  double max_energy{0.002};
  /** It must be small against mass over loop delay: 500 is stable with 1 ms of
  actuation delay from 1 kg on. */
  double max_damping{500};
  /** With 0 a lossless oscillation passes as passive and goes on for seconds;
  with more it dies out. */
  double damping_margin{150};
  /** The energy is that of the command that really acted: at 20 Hz, one
  millisecond left out hides enough to keep an oscillation alive. */
  int actuation_delay{1};
  double period{0.001};

  static constexpr int kMaxActuationDelay = 7;

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("enabled", &enabled,
                   "false: the energy is observed, nothing is injected"));
    a->Visit(
        Field("max_energy", &max_energy, Above(0), "J",
              "cap of the observed energy, so that energy absorbed long ago "
              "does not pay for activity now; it stays above minus this"));
    a->Visit(Field("initial_energy", &initial_energy,
                   Between(0, {max_energy, "max_energy"}), "J",
                   "what the feedback may spend before it is damped"));
    a->Visit(Field("max_damping", &max_damping, AtLeast(0), "N s/m",
                   "injected when no energy is left"));
    a->Visit(Field("damping_margin", &damping_margin,
                   Between(0, {max_damping, "max_damping"}), "N s/m",
                   "dissipation that is demanded of the feedback on balance"));
    a->Visit(Field("actuation_delay", &actuation_delay,
                   Between(0, kMaxActuationDelay), "periods",
                   "from computing a command to its acting"));
    a->Visit(Field("period", &period, Above(0), "s", "between updates"));
  }
};

/** Memory of TimeDomainPassivity. */
struct TimeDomainPassivityState {
  double energy{0};      ///< J: observed energy, in +-max_energy.
  double damping{0};     ///< N s/m: damping injected last, in [0, max_damping].
  double dissipated{0};  ///< J: all that was dissipated by injection.
  /** Velocity at the last update, m/s. */
  Eigen::Vector3d velocity{Eigen::Vector3d::Zero()};
  /** Feedback forces of the last updates, newest first, N. */
  std::array<Eigen::Vector3d, TimeDomainPassivityParams::kMaxActuationDelay + 1>
      commands{};
};

/** Time-domain passivity observer and controller for a 3-vector force port
(the paper's [65], [66]; section V.B).

The force loop's command is F_f = F_r + F_fb. F_r, the reference, is a source
that somebody else answers for; the port watched here is that of the feedback
F_fb = F_f - F_r, whose power into the robot is F_fb . v. With v_f = Omega_f v,
each period adds to the observed energy

    E += -(F_fb . v + damping_margin |v_f|^2) period,  |E| <= max_energy

where F_fb is what acted during the period that ends now (actuation_delay) and
v the mean of the velocities at its ends, so that F_fb . v period is the work
done and no estimate of it. The injected damping grows as the energy is spent:

    alpha = max_damping clamp(1 - E / max_energy, 0, 1),   F_inject = -alpha v_f

which has no division by the velocity, does not chatter, and stays where it is
while nothing moves. Since F_inject is a part of F_fb, alpha settles where the
feedback dissipates what damping_margin asks for.

Update() neither allocates nor throws. */
class TimeDomainPassivity {
 public:
  /** @throws std::invalid_argument if params are not valid. */
  explicit TimeDomainPassivity(TimeDomainPassivityParams params = {});

  const TimeDomainPassivityParams& params() const { return params_; }

  /** The state before the first update: initial_energy, at rest. */
  TimeDomainPassivityState MakeState() const noexcept;

  /** Advances by one period.
  @param feedback_force   F_f - F_r without injection, 3-vector, N, in B.
  @param velocity         v_BE, 3-vector, m/s, in B.
  @param force_selection  Omega_f, 3x3, symmetric, eigenvalues in [0, 1], in B.
  @param[in,out] state    made by MakeState().
  @returns F_inject, 3-vector, N, in B, to be added to the command.
  @pre All inputs are finite (the controller refuses the cycle before). */
  Eigen::Vector3d Update(const Eigen::Vector3d& feedback_force,
                         const Eigen::Vector3d& velocity,
                         const Eigen::Matrix3d& force_selection,
                         TimeDomainPassivityState* state) const noexcept;

 private:
  TimeDomainPassivityParams params_;
};

}  // namespace dual_proxy
