// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace dual_proxy {

/** What is believed of a sensor's bias. */
struct ForceBiasState {
  Eigen::Vector3d mean{Eigen::Vector3d::Zero()};        ///< N, in B.
  Eigen::Matrix3d covariance{Eigen::Matrix3d::Zero()};  ///< N^2, in B.
  /** 1/rad^2, in B: how well the velocity has lately shown the normal. */
  Eigen::Matrix3d shown{Eigen::Matrix3d::Zero()};
};

/** A tool that slides on one contact. */
struct SlidingContact {
  Eigen::Vector3d normal;    ///< Unit vector, in B.
  Eigen::Vector3d velocity;  ///< m/s, in B.
  double force{0};           ///< N: its normal force.
};

/** Learns the bias of a force sensor: where nothing touches all of the force is
bias; where the tool slides, what is across the sliding and the normal is bias
as far as the velocity, in turns, has shown the normal. A Kalman filter for a
bias that wanders. No heap, no throw. */
class ForceBias {
 public:
  /** All > 0.
  @param std  N: of a bias that nobody has learned, per axis.
  @param drift  N/sqrt(s): how it wanders.
  @param force_noise  N, of one input.
  @param velocity_noise  m/s, likewise.
  @param period  s, between inputs. */
  ForceBias(double std, double drift, double force_noise, double velocity_noise,
            double period);

  ForceBiasState MakeState() const;

  /** A period has passed. */
  void Drift(ForceBiasState* state) const noexcept;

  /** Nothing touches. @param force  N, in B. */
  void LearnFree(const Eigen::Vector3d& force,
                 ForceBiasState* state) const noexcept;

  /** @param force  N, in B. */
  void LearnSliding(const Eigen::Vector3d& force, const SlidingContact& contact,
                    ForceBiasState* state) const noexcept;

  /** N: standard deviation in the worst direction. */
  static double CalcStd(const ForceBiasState& state) noexcept;

 private:
  double variance_;
  double drift_variance_;
  double force_variance_;
  double velocity_noise_;
  double period_;
};

}  // namespace dual_proxy
