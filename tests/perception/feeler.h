// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include <gtest/gtest.h>
#include <Eigen/Core>

#include "dual_proxy/perception/force_space_particle_filter.h"
#include "filter_test_support.h"

// A filter that feels its way, for the tests of ContactTracker.

namespace dual_proxy {

using Eigen::Vector3d;

inline const Vector3d kZero = Vector3d::Zero();
inline const Vector3d kDown = -Vector3d::UnitZ();
inline const Vector3d kWall = Vector3d::UnitX();
inline const Vector3d kAlong = Vector3d::UnitY();

inline Vector3d DrawVector(double size, RandomStream* random) {
  Vector3d vector;
  for (double& value : vector) value = size * random->Normal();
  return vector;
}

/** `axis` turned by `deg` towards `to`, which is across it. */
inline Vector3d Turned(const Vector3d& axis, const Vector3d& to, double deg) {
  const double angle = deg * std::numbers::pi / 180;
  return std::cos(angle) * axis + std::sin(angle) * to;
}

inline ForceSpaceParticleFilterParams MakeParams(double rate,
                                                 int num_particles = 1000) {
  ForceSpaceParticleFilterParams params;
  params.period = 1 / rate;
  params.num_particles = num_particles;
  return params;
}

/** A filter with sensors that are as noisy as real ones. */
class Feeler {
 public:
  explicit Feeler(double rate = 100, std::uint64_t seed = 1,
                  double force_noise = 0.2)
      : dut_(MakeParams(rate)),
        state_(dut_.MakeState(seed)),
        random_(seed + 100),
        force_noise_(force_noise) {}

  const ForceSpaceParticleFilterState& state() const { return state_; }
  const ContactTrackerState& tracker() const { return state_.tracker; }
  int dimension() const { return state_.dimension; }
  Vector3d normal() const { return state_.singular_vectors.col(0); }
  Vector3d free_axis() const { return state_.singular_vectors.col(2); }

  void Update(const Vector3d& force, const Vector3d& velocity) {
    const FilterStatus status = dut_.Update(
        force + DrawVector(force_noise_, &random_),
        velocity + DrawVector(0.0005, &random_), kZero, kZero, &state_);
    ASSERT_EQ(status, FilterStatus::kOk);
    if (state_.updates % 10 == 0) ExpectInvariants(state_);
  }

  /** For `time` s. */
  void Feel(const Vector3d& force, const Vector3d& velocity, double time) {
    const long updates = std::lround(time / dut_.params().period);
    for (long i = 0; i < updates; ++i) Update(force, velocity);
  }

  /** Updates until the dimension is `dimension`, or `limit`. */
  int Count(int dimension, const Vector3d& force, const Vector3d& velocity,
            int limit = 1000) {
    for (int i = 1; i <= limit; ++i) {
      Update(force, velocity);
      if (state_.dimension == dimension) return i;
    }
    return limit;
  }

  void SetPrior(const Vector3d& normal, double std) {
    ASSERT_EQ(dut_.SetPrior(normal, std, &state_), FilterStatus::kOk);
  }

 private:
  ForceSpaceParticleFilter dut_;
  ForceSpaceParticleFilterState state_;
  RandomStream random_;
  double force_noise_;
};

/** On a floor, sliding at `velocity` with friction `mu`. */
inline Vector3d SlidingForce(double normal_force, double mu,
                             const Vector3d& velocity) {
  return normal_force * (kDown + mu * velocity.normalized());
}

}  // namespace dual_proxy
