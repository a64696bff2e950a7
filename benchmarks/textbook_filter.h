// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include "dual_proxy/perception/force_space_particle_filter.h"

namespace dual_proxy {

/** The Force-Space Particle Filter as one would write it down from the paper's
Algorithms 1 to 3: a list of vectors, the standard library's random numbers and
an SVD of the particle matrix. What is compared with it, in speed by
benchmarks/filter_benchmark.cc and in results by tests/perception/, shares no
code with it. It departs from the print only where ForceSpaceParticleFilter says
that the print cannot be meant. No prior. */
class TextbookFilter {
 public:
  using Thresholds = ForceSpaceParticleFilterThresholds;
  using Particles = std::vector<Eigen::Vector3d>;

  explicit TextbookFilter(const ForceSpaceParticleFilterParams& params,
                          unsigned seed = 0)
      : params_(params),
        random_(seed),
        particles_(static_cast<std::size_t>(params.num_particles),
                   Eigen::Vector3d::Zero()) {}

  const Particles& particles() const { return particles_; }
  int dimension() const { return dimension_; }
  const Eigen::Matrix3d& force_selection() const { return force_selection_; }
  const Eigen::Matrix3d& singular_vectors() const { return U_; }
  const Eigen::Vector3d& singular_values() const { return S_; }

  void Update(const Eigen::Vector3d& sensed_force,
              const Eigen::Vector3d& velocity,
              const Eigen::Vector3d& motion_force,
              const Eigen::Vector3d& contact_force) {
    Augment(sensed_force, velocity, motion_force, contact_force);
    std::uniform_real_distribution<double> uniform(0, 1);
    Resample(sensed_force, velocity, uniform(random_));
    CalcSpaces();
  }

  /** Equations (6)-(8). */
  double Weight(const Eigen::Vector3d& particle, const Eigen::Vector3d& force,
                const Eigen::Vector3d& velocity, const Thresholds& t) const {
    if (particle.norm() > params_.epsilon) {
      const double w_f =
          (particle.dot(force) - t.force_low) / (t.force_high - t.force_low);
      const double w_v =
          1 - (std::abs(particle.dot(velocity)) - t.velocity_low) /
                  (t.velocity_high - t.velocity_low);
      return std::clamp(w_f, 0.0, 1.0) * std::clamp(w_v, 0.0, 1.0);
    }
    const double w_f =
        1 - (force.norm() - t.force_low) / (t.force_high - t.force_low);
    return std::clamp(w_f, 0.0, 1.0) * 0.5;
  }

  /** n_add of Algorithm 1. */
  int CountAdded(const Eigen::Vector3d& force, const Eigen::Vector3d& velocity,
                 const Eigen::Vector3d& motion_force) const {
    if (motion_force.norm() <= params_.epsilon) return 0;
    const double weight = Weight(motion_force.normalized(), force, velocity,
                                 params_.update_thresholds);
    return static_cast<int>(std::floor(weight * params_.num_particles + 0.5));
  }

  /** Algorithm 2: the particles become those that are chosen from `augmented`.
  @param uniform  in [0, 1): r times the number of particles. */
  void Resample(const Eigen::Vector3d& force, const Eigen::Vector3d& velocity,
                double uniform) {
    const std::size_t n = particles_.size();
    cumulative_.clear();
    double total = 0;
    for (const Eigen::Vector3d& particle : augmented_) {
      total += Weight(particle, force, velocity, params_.resampling_thresholds);
      cumulative_.push_back(total);
    }
    if (!(total > 0)) {
      std::copy_n(augmented_.begin(), n, particles_.begin());
      particles_.back().setZero();
      return;
    }
    for (double& weight : cumulative_) weight /= total;
    std::size_t k = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const double r =
          (static_cast<double>(i) + uniform) / static_cast<double>(n);
      while (k + 1 < augmented_.size() && cumulative_[k] <= r) ++k;
      particles_[i] = augmented_[k];
    }
  }

  /** Starts Algorithm 2 from a list of the caller's. */
  void set_augmented(const Particles& augmented) { augmented_ = augmented; }

 private:
  Eigen::Vector3d Direction(const Eigen::Vector3d& vector) const {
    return vector.norm() > params_.epsilon
               ? Eigen::Vector3d(vector.normalized())
               : Eigen::Vector3d::Zero();
  }

  // Algorithm 1.
  void Augment(const Eigen::Vector3d& force, const Eigen::Vector3d& velocity,
               const Eigen::Vector3d& motion_force,
               const Eigen::Vector3d& contact_force) {
    augmented_.clear();
    std::normal_distribution<double> normal(params_.scatter_mean,
                                            params_.scatter_std);
    for (const Eigen::Vector3d& particle : particles_) {
      Eigen::Vector3d d = Eigen::Vector3d::Zero();
      if (particle.norm() > params_.epsilon) {
        d = Eigen::Vector3d(normal(random_), normal(random_), normal(random_));
      }
      augmented_.push_back(particle + d);
    }
    const int num_added = CountAdded(force, velocity, motion_force);
    const Eigen::Vector3d tentative = Direction(motion_force);
    const Eigen::Vector3d u_f = Direction(contact_force);
    for (int i = 1; i <= num_added; ++i) {
      const double s = (i - 0.5) / num_added;
      augmented_.push_back(s * u_f + (1 - s) * tentative);
    }
    augmented_.push_back(Eigen::Vector3d::Zero());
    for (Eigen::Vector3d& particle : augmented_) particle = Direction(particle);
  }

  // Algorithm 3.
  void CalcSpaces() {
    const auto n = static_cast<Eigen::Index>(particles_.size());
    Eigen::Matrix3Xd X = Eigen::Matrix3Xd::Zero(3, n + n / 2);
    for (Eigen::Index i = 0; i < n; ++i) {
      X.col(i) = particles_[static_cast<std::size_t>(i)];
    }
    const Eigen::JacobiSVD<Eigen::Matrix3Xd> svd(X, Eigen::ComputeThinU);
    U_ = svd.matrixU();
    S_ = svd.singularValues();
    if (S_.norm() < std::sqrt(static_cast<double>(n) / 2)) {
      dimension_ = 0;
    } else {
      const double add = params_.alpha_add * S_(0);
      const double remove = params_.alpha_remove * S_(0);
      dimension_ = std::clamp(dimension_, 1 + (S_(1) > add) + (S_(2) > add),
                              3 - (S_(1) < remove) - (S_(2) < remove));
    }
    force_selection_.setZero();
    for (int i = 0; i < dimension_; ++i) {
      force_selection_ += U_.col(i) * U_.col(i).transpose();
    }
  }

  ForceSpaceParticleFilterParams params_;
  std::mt19937 random_;
  Particles particles_;
  Particles augmented_;
  std::vector<double> cumulative_;
  int dimension_{0};
  Eigen::Matrix3d U_{Eigen::Matrix3d::Identity()};
  Eigen::Vector3d S_{Eigen::Vector3d::Zero()};
  Eigen::Matrix3d force_selection_{Eigen::Matrix3d::Zero()};
};

}  // namespace dual_proxy
