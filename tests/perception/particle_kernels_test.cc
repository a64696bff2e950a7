// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/perception/particle_kernels.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "dual_proxy/common/random.h"

namespace dual_proxy {
namespace {

/** Particles in memory of their own. */
struct Cloud {
  explicit Cloud(int size) : x(static_cast<std::size_t>(size)), y(x), z(x) {}

  int size() const { return static_cast<int>(x.size()); }
  MutableParticleList list() { return {x.data(), y.data(), z.data()}; }
  bool operator==(const Cloud&) const = default;

  std::vector<double> x, y, z;
};

/** Unit vectors all around, and every seventh at the centre. */
Cloud MakeCloud(int size, RandomStream* random) {
  Cloud cloud(size);
  for (std::size_t i = 0; i < cloud.x.size(); ++i) {
    if (i % 7 == 3) continue;
    const double x = random->Normal();
    const double y = random->Normal();
    const double z = random->Normal();
    const double norm = std::sqrt(x * x + y * y + z * z);
    cloud.x[i] = x / norm;
    cloud.y[i] = y / norm;
    cloud.z[i] = z / norm;
  }
  return cloud;
}

// Around the widths of vectors, and of the blocks.
constexpr int kSizes[] = {1,  2,   3,   7,   8,   9,   15,  16,
                          17, 255, 256, 257, 300, 512, 1000};

TEST(ParticleKernelsTest, ScatterMovesAndNormalizes) {
  const Scatter scatter{0.01, 0.3, 1e-6};
  for (const int size : kSizes) {
    RandomStream random(1);
    Cloud cloud = MakeCloud(size, &random);
    NormalStream stream(4);
    std::vector<double> noise;
    Cloud expected(size);
    for (int begin = 0; begin < size; begin += kScatterBlock) {
      const int end = std::min(begin + kScatterBlock, size);
      const int drawn = (end - begin + 15) / 16 * 16;
      noise.resize(static_cast<std::size_t>(3 * drawn));
      stream.Fill(3 * drawn, noise.data());
      for (int i = begin; i < end; ++i) {
        const MutableParticleList from = cloud.list().Skip(i);
        const MutableParticleList to = expected.list().Skip(i);
        if (*from.x == 0 && *from.y == 0 && *from.z == 0) continue;
        const double* n = noise.data() + (i - begin);
        const double x = *from.x + 0.01 + 0.3 * n[0];
        const double y = *from.y + 0.01 + 0.3 * n[drawn];
        const double z = *from.z + 0.01 + 0.3 * n[2 * drawn];
        const double norm = std::sqrt(x * x + y * y + z * z);
        *to.x = x / norm;
        *to.y = y / norm;
        *to.z = z / norm;
      }
    }
    std::vector<Cloud> results;
    for (const InstructionSet set : AvailableInstructionSets()) {
      Cloud& moved = results.emplace_back(size);
      NormalStream normals(4);
      ScatterParticles(set, scatter, cloud.list(), size, &normals,
                       moved.list());
      EXPECT_EQ(moved, results[0]) << size << " " << EnumToString(set);
    }
    for (std::size_t i = 0; i < expected.x.size(); ++i) {
      EXPECT_NEAR(results[0].x[i], expected.x[i], 1e-14);
      EXPECT_NEAR(results[0].y[i], expected.y[i], 1e-14);
      EXPECT_NEAR(results[0].z[i], expected.z[i], 1e-14);
      if (i % 7 == 3) {
        // Not even the sign of the centre's zeros has changed.
        EXPECT_FALSE(std::signbit(results[0].x[i]));
        EXPECT_EQ(results[0].x[i], 0);
      }
    }
  }
}

TEST(ParticleKernelsTest, ScatterToNothingIsTheCentre) {
  // Moved onto the centre, but for the rounding.
  Cloud cloud(1);
  cloud.x[0] = cloud.y[0] = cloud.z[0] = std::sqrt(1 / 3.0);
  for (const InstructionSet set : AvailableInstructionSets()) {
    NormalStream normals;
    Cloud moved(1);
    ScatterParticles(set, {-cloud.x[0] + 1e-9, 0, 1e-6}, cloud.list(), 1,
                     &normals, moved.list());
    EXPECT_EQ(moved, Cloud(1));
  }
}

TEST(ParticleKernelsTest, ArcRunsFromOneToTheOther) {
  const double from[3] = {0.6, 0, 0.8};
  const double to[3] = {0, -1, 0};
  for (const int size : kSizes) {
    for (const InstructionSet set : AvailableInstructionSets()) {
      Cloud dut(size);
      MakeArc(set, from, to, 1e-6, size, dut.list());
      for (std::size_t i = 0; i < dut.x.size(); ++i) {
        const double s = (static_cast<double>(i) + 0.5) / size;
        double expected[3];
        for (int k = 0; k < 3; ++k) expected[k] = s * to[k] + (1 - s) * from[k];
        const double norm =
            std::sqrt(expected[0] * expected[0] + expected[1] * expected[1] +
                      expected[2] * expected[2]);
        EXPECT_EQ(dut.x[i], expected[0] / norm);
        EXPECT_EQ(dut.y[i], expected[1] / norm);
        EXPECT_EQ(dut.z[i], expected[2] / norm);
      }
    }
  }
  // Opposite ends: the one in the middle has no direction.
  const double opposite[3] = {0, 1, 0};
  Cloud dut(3);
  MakeArc(FastestInstructionSet(), opposite, to, 1e-6, 3, dut.list());
  EXPECT_EQ(dut.y, (std::vector<double>{1, 0, -1}));
}

TEST(ParticleKernelsTest, WeightsOfAListAndOfOneAreTheSame) {
  PaperWeights weights;
  weights.force[0] = 3;
  weights.force[2] = -5;
  weights.velocity[1] = 0.01;
  weights.force_low = 1;
  weights.force_slope = 0.25;
  weights.velocity_low = 0.001;
  weights.velocity_slope = 1 / 0.007;
  weights.centre = 0.125;
  RandomStream random(2);
  for (const int size : kSizes) {
    Cloud cloud = MakeCloud(size, &random);
    std::vector<double> result(cloud.x.size());
    for (const InstructionSet set : AvailableInstructionSets()) {
      WeighParticles(set, weights, cloud.list(), size, result.data());
      for (std::size_t i = 0; i < result.size(); ++i) {
        const double x = cloud.x[i], y = cloud.y[i], z = cloud.z[i];
        EXPECT_EQ(result[i], WeighParticle(weights, x, y, z));
        const double w_f = (3 * x - 5 * z - 1) * 0.25;
        const double w_v = 1 - (std::abs(0.01 * y) - 0.001) / 0.007;
        const double expected =
            i % 7 == 3 ? 0.125
                       : std::clamp(w_f, 0.0, 1.0) * std::clamp(w_v, 0.0, 1.0);
        EXPECT_NEAR(result[i], expected, 1e-14);
      }
    }
  }
}

/** The indices of the chosen particles, as CopyChosen() reads them. */
std::vector<std::int32_t> Indices(std::vector<std::int32_t> chosen) {
  chosen.pop_back();
  for (std::size_t i = 1; i < chosen.size(); ++i) {
    chosen[i] = std::max(chosen[i - 1], chosen[i]);
  }
  return chosen;
}

/** Algorithm 2 with its loop; `uniform` has 32 bits. */
std::vector<std::int32_t> ChooseByLoop(const std::vector<double>& weights,
                                       double uniform, int num_chosen) {
  const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
  std::vector<std::int32_t> chosen;
  std::size_t k = 0;
  double cumulative = weights[0];
  for (int i = 0; i < num_chosen; ++i) {
    while (cumulative <= (i + uniform) / num_chosen * total) {
      cumulative += weights[++k];
    }
    chosen.push_back(static_cast<std::int32_t>(k));
  }
  return chosen;
}

TEST(ParticleKernelsTest, ChoosesLikeTheLoop) {
  RandomStream random(3);
  for (int trial = 0; trial < 2000; ++trial) {
    const int count = 1 + static_cast<int>(random.Uniform() * 700);
    const int num_chosen = 2 + static_cast<int>(random.Uniform() * 500);
    const double zeros = random.Uniform();
    std::vector<double> weights(static_cast<std::size_t>(count));
    for (double& weight : weights) {
      weight = random.Uniform() < zeros ? 0 : random.Uniform();
    }
    weights[static_cast<std::size_t>(random.Uniform() * count)] = 1;
    const double uniform = std::floor(random.Uniform() * 0x1p32) * 0x1p-32;
    std::vector<std::int32_t> expected =
        ChooseByLoop(weights, uniform, num_chosen);
    for (const InstructionSet set : AvailableInstructionSets()) {
      std::vector<double> work = weights;
      std::vector<std::int32_t> chosen(expected.size() + 1);
      ASSERT_TRUE(ChooseParticles(set, count, uniform, num_chosen, work.data(),
                                  chosen.data()));
      ASSERT_EQ(Indices(chosen), expected) << trial << " " << EnumToString(set);
    }
  }
}

// What weighs nothing is never chosen: not before, between, nor behind the
// others, for no offset and no scale of the weights.
TEST(ParticleKernelsTest, NeverChoosesWhatWeighsNothing) {
  constexpr int kCount = 100;
  for (const int num_chosen : {2, 1000, 100000}) {
    for (const double scale : {1.0, 0.3, 1e-200, 5e-324}) {
      for (const double uniform : {0.0, 1 - 0x1p-53, 0.3}) {
        for (int period = 1; period < 40; period += 3) {
          std::vector<double> weights(kCount);
          for (int i = period; i < kCount - period; i += period) {
            weights[static_cast<std::size_t>(i)] = scale;
          }
          std::vector<double> work = weights;
          std::vector<std::int32_t> chosen(
              static_cast<std::size_t>(num_chosen) + 1);
          ASSERT_TRUE(ChooseParticles(FastestInstructionSet(), kCount, uniform,
                                      num_chosen, work.data(), chosen.data()));
          std::vector<int> counts(kCount);
          for (const std::int32_t i : Indices(chosen)) {
            ++counts[static_cast<std::size_t>(i)];
          }
          // All others weigh the same: each has its share, to one.
          const double share =
              num_chosen / static_cast<double>(std::count(
                               weights.begin(), weights.end(), scale));
          for (std::size_t i = 0; i < kCount; ++i) {
            ASSERT_NEAR(counts[i], weights[i] == 0 ? 0 : share,
                        weights[i] == 0 ? 0 : 1)
                << num_chosen << " " << scale << " " << i;
          }
        }
      }
    }
  }
  std::vector<double> zeros(kCount);
  std::vector<std::int32_t> chosen(3);
  EXPECT_FALSE(ChooseParticles(FastestInstructionSet(), kCount, 0.5, 2,
                               zeros.data(), chosen.data()));
}

TEST(ParticleKernelsTest, CopiesWhatIsChosen) {
  RandomStream random(5);
  Cloud cloud = MakeCloud(10, &random);
  const std::int32_t chosen[] = {0, 0, 4, 0, 9};
  const std::size_t expected[] = {0, 0, 4, 4, 9};
  Cloud result(5);
  CopyChosen(cloud.list(), chosen, 5, result.list());
  for (std::size_t i = 0; i < 5; ++i) {
    const std::size_t k = expected[i];
    EXPECT_EQ(result.x[i], cloud.x[k]);
    EXPECT_EQ(result.y[i], cloud.y[k]);
    EXPECT_EQ(result.z[i], cloud.z[k]);
  }
}

TEST(ParticleKernelsTest, Moments) {
  RandomStream random(6);
  for (const int size : kSizes) {
    Cloud cloud = MakeCloud(size, &random);
    const auto dot = [size](const std::vector<double>& a,
                            const std::vector<double>& b) {
      long double sum = 0;
      for (int i = 0; i < size; ++i) {
        const auto k = static_cast<std::size_t>(i);
        sum += static_cast<long double>(a[k]) * b[k];
      }
      return static_cast<double>(sum);
    };
    const std::vector<double> one(cloud.x.size(), 1.0);
    const ParticleMoments first =
        CalcMoments(InstructionSet::kBaseline, cloud.list(), size);
    // A rounding of at most half an ulp per addition.
    const double tolerance = 1e-16 * (size + 10);
    EXPECT_NEAR(first.x, dot(cloud.x, one), tolerance);
    EXPECT_NEAR(first.y, dot(cloud.y, one), tolerance);
    EXPECT_NEAR(first.z, dot(cloud.z, one), tolerance);
    EXPECT_NEAR(first.xx, dot(cloud.x, cloud.x), tolerance);
    EXPECT_NEAR(first.yy, dot(cloud.y, cloud.y), tolerance);
    EXPECT_NEAR(first.zz, dot(cloud.z, cloud.z), tolerance);
    EXPECT_NEAR(first.xy, dot(cloud.x, cloud.y), tolerance);
    EXPECT_NEAR(first.xz, dot(cloud.x, cloud.z), tolerance);
    EXPECT_NEAR(first.yz, dot(cloud.y, cloud.z), tolerance);
    for (const InstructionSet set : AvailableInstructionSets()) {
      const ParticleMoments m = CalcMoments(set, cloud.list(), size);
      EXPECT_EQ(m.x, first.x);
      EXPECT_EQ(m.y, first.y);
      EXPECT_EQ(m.z, first.z);
      EXPECT_EQ(m.xx, first.xx);
      EXPECT_EQ(m.yy, first.yy);
      EXPECT_EQ(m.zz, first.zz);
      EXPECT_EQ(m.xy, first.xy);
      EXPECT_EQ(m.xz, first.xz);
      EXPECT_EQ(m.yz, first.yz);
    }
  }
}

}  // namespace
}  // namespace dual_proxy
