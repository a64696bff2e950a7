// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace dual_proxy {

/** Parameters of SurfaceEstimator; ModelMediatedParams has them. */
struct SurfaceEstimatorParams {
  double contact_force{1};        ///< N.
  double default_stiffness{500};  ///< N/m.
  double min_stiffness{200};      ///< N/m.
  double max_stiffness{2000};     ///< N/m.
  double min_excursion{0.001};    ///< m.
  double surface_time{0.2};       ///< s.
  double period{0.001};           ///< s.
};

/** What SurfaceEstimator remembers and has found; 3-vectors in B. */
struct SurfaceEstimatorState {
  bool contact{false};  ///< The tool is on the surface.
  /** n, into it; zero before the first contact. */
  Eigen::Vector3d normal{Eigen::Vector3d::Zero()};
  double depth{0};          ///< m: n . x_r - d, of the tool behind it.
  double stiffness{0};      ///< k, N/m, as observed; 0: it could not be.
  bool initialized{false};  ///< There was an update.
  Eigen::Vector3d position{Eigen::Vector3d::Zero()};  ///< x_r, m.
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};     ///< F_s, N.
  Eigen::Vector3d smooth{Eigen::Vector3d::Zero()};    ///< F_s, low-passed, N.
  /** High-passed, of the last period in contact: n . x_r, m, and n . F_s, N;
  the means of their products. */
  Eigen::Vector2d excursion{Eigen::Vector2d::Zero()};
  Eigen::Matrix2d covariance{Eigen::Matrix2d::Zero()};
};

/** A plane n . x = d, with the stiffness k, from what the tool feels on it.

A contact begins when the sensed force within the force space passes
contact_force: its direction is the normal n, which from then on is kept within
the force space. So n follows a single contact's own; when a second one joins
it, as in a corner, the first stays the surface. The contact ends when the force
space does not hold n any more; the plane lasts on.

    d <- n . x_r - F_n / k    through a low-pass, while F_n > contact_force

kept as the tool's depth behind it, so that n turns it about the tool. k is that
of recursive least squares, with forgetting, of F_n = k n . x_r + const, taken
over when the tool has moved by min_excursion (rms) along n, and what it moved
says what the force did. A surface that does not give way so much shows no k: it
counts as rigid, d = n . x_r. Each contact begins without one.

A tool that is free behind the plane shows that there is none: it is pushed on
by the tool. */
class SurfaceEstimator {
 public:
  using Params = SurfaceEstimatorParams;
  using State = SurfaceEstimatorState;

  explicit SurfaceEstimator(const Params& params);

  State MakeState() const { return {}; }

  /** Advances by one period. No heap, no throw.
  @param position         x_r, m, in B.
  @param force            F_s, N, in B: of the robot on its environment.
  @param force_selection  Omega_f, a projection, in B.
  @pre All inputs are finite. */
  void Update(const Eigen::Vector3d& position, const Eigen::Vector3d& force,
              const Eigen::Matrix3d& force_selection,
              State* state) const noexcept;

  /** N/m: k, or what it is taken for. */
  double stiffness(const State& state) const noexcept {
    return state.stiffness > 0 ? state.stiffness : params_.default_stiffness;
  }

 private:
  /** Takes the changes of n . x_r and n . F_s in a period in contact. */
  void ObserveStiffness(const Eigen::Vector2d& change,
                        State* state) const noexcept;

  Params params_;
  double force_gain_;    // Of the low-pass on F_s.
  double surface_gain_;  // Likewise on d.
  double memory_;        // What a period leaves of what is older.
};

}  // namespace dual_proxy
