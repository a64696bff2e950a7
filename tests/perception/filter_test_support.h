// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include <gtest/gtest.h>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "dual_proxy/perception/force_space_particle_filter.h"

namespace dual_proxy {

/** Angle between two axes, deg, 0 to 90. */
inline double AngleDeg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), std::abs(a.dot(b))) * 180 /
         std::numbers::pi;
}

inline void ExpectSame(const TrackedContact& a, const TrackedContact& b) {
  EXPECT_EQ(a.normal, b.normal);
  EXPECT_EQ(a.covariance, b.covariance);
  EXPECT_EQ(a.force, b.force);
  EXPECT_EQ(a.impulse, b.impulse);
  EXPECT_EQ(a.slid, b.slid);
  EXPECT_EQ(a.loss, b.loss);
  EXPECT_EQ(a.prior, b.prior);
  EXPECT_EQ(a.shape, b.shape);
  EXPECT_EQ(a.give, b.give);
}

inline void ExpectSame(const ContactTrackerState& a,
                       const ContactTrackerState& b) {
  ASSERT_EQ(a.count, b.count);
  for (int i = 0; i < a.count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    ExpectSame(a.contacts[k], b.contacts[k]);
  }
  EXPECT_EQ(a.bias.mean, b.bias.mean);
  EXPECT_EQ(a.bias.covariance, b.bias.covariance);
  EXPECT_EQ(a.unexplained, b.unexplained);
  EXPECT_EQ(a.unexplained_impulse, b.unexplained_impulse);
  EXPECT_EQ(a.evidence, b.evidence);
  EXPECT_EQ(a.friction, b.friction);
  EXPECT_EQ(a.settled_time, b.settled_time);
  EXPECT_EQ(a.entry_speed, b.entry_speed);
  EXPECT_EQ(a.sliding, b.sliding);
  EXPECT_EQ(a.force, b.force);
  EXPECT_EQ(a.sinking_speed, b.sinking_speed);
}

/** Both continue with the same random numbers. */
inline void ExpectSameStreams(const ForceSpaceParticleFilterState& a,
                              const ForceSpaceParticleFilterState& b) {
  RandomStream random_a = a.random;
  RandomStream random_b = b.random;
  EXPECT_EQ(random_a.Uniform(), random_b.Uniform());
  NormalStream normals_a = a.normals;
  NormalStream normals_b = b.normals;
  double normal_a{};
  double normal_b{};
  normals_a.Fill(1, &normal_a);
  normals_b.Fill(1, &normal_b);
  EXPECT_EQ(normal_a, normal_b);
}

/** Everything in the state that an update may change, but the work space. */
inline void ExpectSame(const ForceSpaceParticleFilterState& a,
                       const ForceSpaceParticleFilterState& b) {
  EXPECT_EQ(a.particles, b.particles);
  EXPECT_EQ(a.dimension, b.dimension);
  EXPECT_EQ(a.force_selection, b.force_selection);
  EXPECT_EQ(a.motion_selection, b.motion_selection);
  EXPECT_EQ(a.singular_values, b.singular_values);
  EXPECT_EQ(a.singular_vectors, b.singular_vectors);
  EXPECT_EQ(a.prior, b.prior);
  EXPECT_EQ(a.num_priors, b.num_priors);
  EXPECT_EQ(a.prior_std, b.prior_std);
  EXPECT_EQ(a.direction_uncertainty, b.direction_uncertainty);
  EXPECT_EQ(a.dimension_confidence, b.dimension_confidence);
  EXPECT_EQ(a.updates, b.updates);
  EXPECT_EQ(a.all_weights_zero, b.all_weights_zero);
  ExpectSame(a.tracker, b.tracker);
  ExpectSameStreams(a, b);
}

/** What a filter's documentation promises of its state. */
inline void ExpectInvariants(const ForceSpaceParticleFilterState& state) {
  // Rounding of 3x3 products of projections; the eigenvectors are orthonormal
  // to about 1e-15.
  constexpr double kTolerance = 1e-13;
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d& Omega_f = state.force_selection;
  const Eigen::Matrix3d& Omega_m = state.motion_selection;
  ASSERT_TRUE(Omega_f.allFinite());
  EXPECT_TRUE(Omega_f.isApprox(Omega_f.transpose(), 0) || Omega_f.isZero(0));
  EXPECT_LT((Omega_f * Omega_f - Omega_f).norm(), kTolerance);
  EXPECT_LT((Omega_m * Omega_m - Omega_m).norm(), kTolerance);
  EXPECT_EQ(Eigen::Matrix3d(Omega_f + Omega_m), I);
  EXPECT_NEAR(Omega_f.trace(), state.dimension, kTolerance);
  const Eigen::Matrix3d& U = state.singular_vectors;
  EXPECT_LT((U.transpose() * U - I).norm(), kTolerance);
  EXPECT_GT(U.determinant(), 0);
  double num_on_sphere = 0;
  for (int i = 0; i < state.particles.cols(); ++i) {
    const double norm = state.particles.col(i).norm();
    ASSERT_TRUE(norm == 0 || std::abs(norm - 1) < 1e-14);
    if (norm > 0) ++num_on_sphere;
  }
  EXPECT_NEAR(state.singular_values.squaredNorm(), num_on_sphere,
              1e-12 * (1 + num_on_sphere));
  EXPECT_GE(state.singular_values(0), state.singular_values(1));
  EXPECT_GE(state.singular_values(1), state.singular_values(2));
  EXPECT_EQ(state.dimension == 0,
            num_on_sphere < 0.5 * static_cast<double>(state.particles.cols()));
  EXPECT_GE(state.direction_uncertainty, 0);
  EXPECT_TRUE(std::isfinite(state.direction_uncertainty));
  EXPECT_GE(state.dimension_confidence, 0);
  EXPECT_LE(state.dimension_confidence, 1);
}

}  // namespace dual_proxy
