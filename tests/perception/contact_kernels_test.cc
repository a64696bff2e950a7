// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/perception/contact_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Core>

#include "dual_proxy/common/random.h"

namespace dual_proxy {
namespace {

using Eigen::Map;
using Eigen::Vector3d;
using Particles = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>;

// Around the widths of vectors, and of the blocks of one half.
constexpr int kSizes[] = {1, 2, 3, 15, 16, 17, 33, 511, 512, 513, 1000, 1100};

MutableParticleList ListOf(Particles* particles) {
  return {particles->row(0).data(), particles->row(1).data(),
          particles->row(2).data()};
}

Vector3d DrawVector(double size, RandomStream* random) {
  Vector3d vector;
  for (double& value : vector) value = size * random->Normal();
  return vector;
}

Particles MakeCloud(int size, RandomStream* random) {
  Particles cloud(3, size);
  for (int i = 0; i < size; ++i) {
    cloud.col(i) = DrawVector(1, random).normalized();
  }
  return cloud;
}

Particles Move(InstructionSet set, const ContactMove& move, Particles cloud,
               std::uint64_t seed) {
  Particles moved(3, cloud.cols());
  NormalStream normals(seed);
  MoveContactParticles(set, move, ListOf(&cloud),
                       static_cast<int>(cloud.cols()), &normals,
                       ListOf(&moved));
  return moved;
}

ContactMove MakeMove() {
  ContactMove move;
  Map<Vector3d>(move.normal) = Vector3d(0, 0.6, -0.8);
  Map<Vector3d>(move.centre) = Vector3d(0.05, 0.6, -0.8);
  move.keep = 0.9;
  Map<Vector3d>(move.first) = Vector3d(0.2, 0, 0);
  Map<Vector3d>(move.second) = Vector3d(0.03, 0.08, 0.06);
  return move;
}

TEST(ContactKernelsTest, MoveIsWhatItSaysWithTheSameBits) {
  const ContactMove move = MakeMove();
  for (const int size : kSizes) {
    RandomStream random(1);
    const Particles cloud = MakeCloud(size, &random);
    Particles expected = cloud;
    NormalStream stream(7);
    const int half = (size + 1) / 2;
    for (int begin = 0; begin < half; begin += kScatterBlock) {
      const int end = std::min(begin + kScatterBlock, half);
      const int drawn = (end - begin + 15) / 16 * 16;
      std::vector<double> e(static_cast<std::size_t>(2 * drawn));
      stream.Fill(2 * drawn, e.data());
      for (int i = begin; i < end; ++i) {
        const Vector3d spread = e[static_cast<std::size_t>(i - begin)] *
                                    Map<const Vector3d>(move.first) +
                                e[static_cast<std::size_t>(i - begin + drawn)] *
                                    Map<const Vector3d>(move.second);
        for (const int k : {i, i + half}) {
          if (k >= size) continue;
          const Vector3d moved = Map<const Vector3d>(move.centre) +
                                 move.keep * (Vector3d(cloud.col(k)) -
                                              Map<const Vector3d>(move.normal));
          expected.col(k) = moved + (k == i ? 1 : -1) * spread;
          expected.col(k).normalize();
        }
      }
    }
    const Particles baseline =
        Move(AvailableInstructionSets().front(), move, cloud, 7);
    EXPECT_LT((baseline - expected).cwiseAbs().maxCoeff(), 1e-14) << size;
    for (const InstructionSet set : AvailableInstructionSets()) {
      EXPECT_EQ(Move(set, move, cloud, 7), baseline)
          << size << " " << EnumToString(set);
    }
  }
}

TEST(ContactKernelsTest, SpreadKeepsTheMeanAndHasItsCovariance) {
  constexpr int kSize = 100000;
  ContactMove move;
  Map<Vector3d>(move.normal) = -Vector3d::UnitZ();
  Map<Vector3d>(move.centre) = -Vector3d::UnitZ();
  Map<Vector3d>(move.first) = Vector3d(0.02, 0.01, 0);
  Map<Vector3d>(move.second) = Vector3d(0, 0.03, 0);
  Particles cloud(3, kSize);
  cloud.colwise() = -Vector3d::UnitZ();
  const Particles moved = Move(FastestInstructionSet(), move, cloud, 2);
  // Random numbers alone would leave 0.02 / sqrt(kSize) = 6e-5.
  EXPECT_LT(moved.rowwise().mean().head<2>().norm(), 1e-12);
  const Eigen::Matrix2d covariance =
      moved.topRows<2>() * moved.topRows<2>().transpose() / kSize;
  Eigen::Matrix2d expected;
  expected << 4e-4, 2e-4, 2e-4, 1e-3;
  // Statistics, and what the sphere bends.
  EXPECT_LT((covariance - expected).norm(), 0.02 * expected.norm());
}

/** The same from the text of ContactTracker, with vectors. */
double Weigh(const ContactWeights& w, const Vector3d& rho) {
  const Map<const Vector3d> force(w.force);
  const Map<const Vector3d> other(w.other);
  const double into = rho.dot(Map<const Vector3d>(w.velocity));
  const Vector3d n = (rho - rho.dot(other) * other).normalized();
  const double pressed = n.dot(force);
  const Vector3d tangential = force - pressed * n;
  const double normal_force = std::max(0.0, pressed) + w.other_force;
  const Map<const Vector3d> sliding(w.sliding);
  const Vector3d velocity = sliding - sliding.dot(n) * n;
  const double speed = velocity.norm();
  const double slides =
      std::clamp((speed - w.sliding_low) * w.sliding_slope, 0.0, 1.0);
  double e2 = std::pow(std::min(0.0, pressed), 2);
  const double limit = w.friction * normal_force;
  if (slides > 0) {
    const Vector3d direction = velocity / speed;
    const double along = tangential.dot(direction);
    const double across = (tangential - along * direction).norm();
    const double against = std::max(0.0, -along - 0.05 * normal_force);
    const double above = std::max(0.0, along - limit);
    e2 += slides * (across * across /
                        (1 + w.direction_scale * std::pow(along / speed, 2)) +
                    against * against + above * above);
  }
  e2 += w.sticking_weight * (1 - slides) *
        std::pow(std::max(0.0, tangential.norm() - limit), 2);
  return std::exp(std::max(-30.0, -0.5 * w.force_scale * e2)) /
         (1 + w.velocity_scale * into * into);
}

/** Of the default parameters, for `force` (N) and `velocity` (m/s). */
ContactWeights MakeWeights(const Vector3d& force, const Vector3d& velocity) {
  ContactWeights w;
  Map<Vector3d>(w.force) = force;
  Map<Vector3d>(w.velocity) = velocity;
  Map<Vector3d>(w.sliding) = velocity;
  w.velocity_scale = 1 / (3 * 0.0015 * 0.0015);
  w.force_scale = 1 / (0.25 * 0.25);
  w.direction_scale = std::pow(0.0015 / 0.25, 2);
  w.friction = 0.7;
  w.sliding_low = 0.002;
  w.sliding_slope = 1 / 0.004;
  return w;
}

std::vector<double> WeighAll(InstructionSet set, const ContactWeights& weights,
                             Particles cloud) {
  std::vector<double> result(static_cast<std::size_t>(cloud.cols()));
  WeighContactParticles(set, weights, ListOf(&cloud),
                        static_cast<int>(cloud.cols()), result.data());
  return result;
}

TEST(ContactKernelsTest, WeightsAreWhatTheTextSaysWithTheSameBits) {
  RandomStream random(3);
  int num_in_between = 0;
  for (int trial = 0; trial < 400; ++trial) {
    // Around a normal, as tracked clouds are, and with every term at work.
    const Vector3d normal = DrawVector(1, &random).normalized();
    const Vector3d velocity =
        DrawVector(trial % 4 == 0 ? 0.001 : 0.02, &random);
    ContactWeights w =
        MakeWeights(5 * normal + DrawVector(1, &random), velocity);
    w.sticking_weight = trial % 2;
    if (trial % 3 == 1) {
      const Vector3d other = DrawVector(1, &random).normalized();
      Map<Vector3d> force(w.force);
      Map<Vector3d> sliding(w.sliding);
      Map<Vector3d>(w.other) = other;
      force -= Vector3d(force).dot(other) * other;
      sliding -= Vector3d(sliding).dot(other) * other;
      w.other_force = 2;
    }
    const int size = kSizes[trial % std::size(kSizes)];
    Particles cloud = MakeCloud(size, &random);
    for (int i = 0; i < size; i += 2) {
      cloud.col(i) = (normal + 0.2 * cloud.col(i)).normalized();
    }
    const std::vector<double> baseline =
        WeighAll(AvailableInstructionSets().front(), w, cloud);
    for (int i = 0; i < size; ++i) {
      const double weight = baseline[static_cast<std::size_t>(i)];
      const double expected = Weigh(w, cloud.col(i));
      ASSERT_NEAR(weight, expected, 1e-9 * expected) << trial << " " << i;
      num_in_between += weight > 0.01 && weight < 0.99;
    }
    for (const InstructionSet set : AvailableInstructionSets()) {
      ASSERT_EQ(WeighAll(set, w, cloud), baseline)
          << trial << " " << EnumToString(set);
    }
  }
  EXPECT_GT(num_in_between, 1000);
}

TEST(ContactKernelsTest, NothingToSayIsOneAndWhatIsExcludedIsNotZero) {
  Particles cloud(3, 3);
  cloud.col(0) = -Vector3d::UnitZ();
  cloud.col(1) = Vector3d::UnitZ();
  cloud.col(2) = Vector3d(0.6, 0, -0.8);  // Within the cone: tan < 0.75.
  const Vector3d zero = Vector3d::Zero();
  for (const InstructionSet set : AvailableInstructionSets()) {
    EXPECT_EQ(WeighAll(set, MakeWeights(zero, zero), cloud),
              std::vector<double>(3, 1.0));
    ContactWeights wide = MakeWeights(Vector3d(0, 0, -10), zero);
    wide.friction = 0.76;
    const std::vector<double> pressed = WeighAll(set, wide, cloud);
    EXPECT_EQ(pressed[0], 1);
    EXPECT_NEAR(pressed[1], std::exp(-30.0), 1e-15);
    EXPECT_EQ(pressed[2], 1);
    // As large as the tracker lets them be, and against each other.
    for (const double weight :
         WeighAll(set, MakeWeights(Vector3d(0, 0, -1e6), Vector3d(1e6, 0, 1e6)),
                  cloud)) {
      EXPECT_GT(weight, 0);
      EXPECT_LE(weight, 1);
    }
  }
}

}  // namespace
}  // namespace dual_proxy
