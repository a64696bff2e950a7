// SPDX-License-Identifier: BSD-3-Clause
#include "benchmarks/textbook_filter.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "dual_proxy/perception/force_space_particle_filter.h"
#include "dual_proxy/perception/particle_kernels.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;

/** What the filters come to over a long run of the same inputs. */
struct Statistics {
  void Add(int dimension, const Eigen::Matrix3d& U, const Vector3d& S,
           const Vector3d& mean) {
    ++updates;
    dimensions[dimension] += 1;
    on_sphere += S.squaredNorm();
    second += S(1) / std::max(S(0), 1e-9);
    if (dimension != 1) return;
    // The singular vector's sign is free.
    Vector3d normal = U.col(0);
    if (normal.dot(mean) < 0) normal *= -1;
    sum += normal;
    spread += normal * normal.transpose();
  }

  double updates{0};
  double dimensions[4] = {};
  double on_sphere{0};
  double second{0};
  Vector3d sum{Vector3d::Zero()};
  Eigen::Matrix3d spread{Eigen::Matrix3d::Zero()};
};

struct Inputs {
  Vector3d force, velocity, motion, contact;
};

/** A tour that repeats itself: free, landing, sliding with friction while the
wall turns, a corner, lifting; with the sensor's noise. */
Inputs Tour(int update, RandomStream* random) {
  const auto noise = [random](double size) {
    return Vector3d(size * random->Normal(), size * random->Normal(),
                    size * random->Normal());
  };
  const int step = update % 60;
  const double angle = 0.01 * step;
  const Vector3d normal(0, std::sin(angle), -std::cos(angle));
  const Vector3d along = Vector3d::UnitX();
  const Vector3d side(0, std::cos(angle), std::sin(angle));
  Inputs inputs{noise(0.2), noise(1e-4), Vector3d::Zero(), Vector3d::Zero()};
  if (step < 10) {
    inputs.velocity += 0.05 * along;
    inputs.motion = 3 * along;
  } else if (step < 15) {
    inputs.force += 6 * normal;
    inputs.motion = 8 * normal;
  } else if (step < 40) {
    inputs.force += 8 * normal - 1.5 * along;
    inputs.velocity += 0.05 * along;
    inputs.motion = 2 * along;
    inputs.contact = 8 * normal;
  } else if (step < 55) {
    inputs.force += 8 * normal + 7 * side;
    inputs.velocity += 0.02 * along;
    inputs.motion = 7 * side;
    inputs.contact = 8 * normal;
  }
  return inputs;
}

TEST(TextbookFilterTest, LongRunsAgree) {
  ForceSpaceParticleFilterParams params;
  params.likelihood = Likelihood::kPaper;
  const ForceSpaceParticleFilter dut(params);
  ForceSpaceParticleFilterState state = dut.MakeState(1);
  TextbookFilter textbook(params, 2);
  RandomStream noise_a(3);
  RandomStream noise_b(3);
  Statistics a, b;
  for (int i = 0; i < 6000; ++i) {
    const Inputs x = Tour(i, &noise_a);
    dut.Update(x.force, x.velocity, x.motion, x.contact, &state);
    a.Add(state.dimension, state.singular_vectors, state.singular_values,
          state.particles.rowwise().sum());
    const Inputs y = Tour(i, &noise_b);
    ASSERT_EQ(x.force, y.force);
    textbook.Update(y.force, y.velocity, y.motion, y.contact);
    Vector3d mean = Vector3d::Zero();
    for (const Vector3d& particle : textbook.particles()) mean += particle;
    b.Add(textbook.dimension(), textbook.singular_vectors(),
          textbook.singular_values(), mean);
  }
  // The inputs are the same; what differs is the scatter. Runs of one and the
  // same filter with six seeds differ by up to a third of these limits.
  for (int d = 0; d <= 3; ++d) {
    EXPECT_NEAR(a.dimensions[d] / a.updates, b.dimensions[d] / b.updates,
                0.0015)
        << d;
  }
  EXPECT_GT(a.dimensions[0] / a.updates, 0.1);
  EXPECT_GT(a.dimensions[1] / a.updates, 0.2);
  EXPECT_GT(a.dimensions[2] / a.updates, 0.1);
  EXPECT_NEAR(a.on_sphere / a.updates, b.on_sphere / b.updates, 0.15);
  EXPECT_NEAR(a.second / a.updates, b.second / b.updates, 0.0007);
  const double count_a = a.dimensions[1];
  const double count_b = b.dimensions[1];
  const double angle =
      std::acos(std::min(1.0, a.sum.normalized().dot(b.sum.normalized())));
  EXPECT_LT(angle * 180 / std::numbers::pi, 0.25);
  EXPECT_LT((a.spread / count_a - b.spread / count_b).norm(), 0.006);
}

TEST(TextbookFilterTest, WeightsCountsAndChoicesAgreeExactly) {
  ForceSpaceParticleFilterParams params;
  params.num_particles = 500;
  // Powers of two, so that dividing and multiplying by the inverse agree.
  params.update_thresholds = {1, 9, 0.001, 0.001 + 0x1p-7};
  params.resampling_thresholds = {0, 4, 0.001, 0.001 + 0x1p-7};
  const ForceSpaceParticleFilterThresholds& t = params.resampling_thresholds;
  TextbookFilter textbook(params);
  RandomStream random(4);
  const auto vector = [&random](double size) {
    return Vector3d(size * random.Normal(), size * random.Normal(),
                    size * random.Normal());
  };
  int num_all_zero = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const int count = 501 + static_cast<int>(500 * random.Uniform());
    const Vector3d force = vector(4);
    const Vector3d velocity = vector(0.004);
    Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor> particles(3,
                                                                        count);
    TextbookFilter::Particles augmented;
    for (int i = 0; i < count; ++i) {
      const bool is_centre = random.Uniform() < 0.2;
      particles.col(i) = is_centre ? Vector3d::Zero() : vector(1).normalized();
      augmented.push_back(particles.col(i));
    }
    const MutableParticleList list{particles.row(0).data(),
                                   particles.row(1).data(),
                                   particles.row(2).data()};
    PaperWeights weights;
    Eigen::Map<Vector3d>(weights.force) = force;
    Eigen::Map<Vector3d>(weights.velocity) = velocity;
    weights.force_low = t.force_low;
    weights.force_slope = 1 / (t.force_high - t.force_low);
    weights.velocity_low = t.velocity_low;
    weights.velocity_slope = 1 / (t.velocity_high - t.velocity_low);
    weights.centre = textbook.Weight(Vector3d::Zero(), force, velocity, t);
    Eigen::VectorXd result(count);
    WeighParticles(FastestInstructionSet(), weights, list, count,
                   result.data());
    for (int i = 0; i < count; ++i) {
      ASSERT_EQ(result(i),
                textbook.Weight(augmented[static_cast<std::size_t>(i)], force,
                                velocity, t))
          << trial << " " << i;
    }

    const double uniform = std::floor(random.Uniform() * 0x1p32) * 0x1p-32;
    textbook.set_augmented(augmented);
    textbook.Resample(force, velocity, uniform);
    Eigen::VectorX<std::int32_t> chosen(501);
    if (!ChooseParticles(FastestInstructionSet(), count, uniform, 500,
                         result.data(), chosen.data())) {
      ++num_all_zero;
      continue;
    }
    Eigen::Matrix<double, 3, 500, Eigen::RowMajor> copied;
    CopyChosen(
        list, chosen.data(), 500,
        {copied.row(0).data(), copied.row(1).data(), copied.row(2).data()});
    for (int i = 0; i < 500; ++i) {
      ASSERT_EQ(Vector3d(copied.col(i)),
                textbook.particles()[static_cast<std::size_t>(i)])
          << trial << " " << i;
    }
  }
  EXPECT_LT(num_all_zero, 20);
}

// Without the scatter, all that is random is where the resampling begins: with
// the added particles alone there is nothing to choose, and the number of them
// is all that counts.
TEST(TextbookFilterTest, NumberOfAddedParticlesAgreesExactly) {
  ForceSpaceParticleFilterParams params;
  params.likelihood = Likelihood::kPaper;
  params.scatter_std = 0;
  params.update_thresholds = {1, 9, 0.001, 0.001 + 0x1p-7};
  const ForceSpaceParticleFilter dut(params);
  const TextbookFilter textbook(params);
  RandomStream random(5);
  int num_some = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const Vector3d force(0, 0, -4 - 6 * random.Uniform());
    const Vector3d velocity(0, 0, 0.006 * random.Uniform());
    const Vector3d motion(0.2 * random.Normal(), 0, -8);
    ForceSpaceParticleFilterState state = dut.MakeState(0);
    dut.Update(force, velocity, motion, Vector3d::UnitX(), &state);
    const int expected = textbook.CountAdded(force, velocity, motion);
    // Behind the moved particles stand the added ones, and then the centre.
    for (int i = 0; i < expected; ++i) {
      ASSERT_NEAR(state.augmented->col(1000 + i).norm(), 1, 1e-14);
    }
    EXPECT_TRUE(state.augmented->col(1000 + expected).isZero(0));
    num_some += expected > 0 && expected < 1000;
  }
  EXPECT_GT(num_some, 100);
}

}  // namespace
}  // namespace dual_proxy
