// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/filter_trial.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "dual_proxy/experiment/filter_trial_setting.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

ForceSpaceParticleFilter MakeFilter(double rate, int num_particles = 100) {
  ForceSpaceParticleFilterParams params;
  params.period = 1 / rate;
  params.num_particles = num_particles;
  return ForceSpaceParticleFilter(params);
}

FilterTrialParams MakeParams(FilterTrialScene scene, FilterTrialDrive drive,
                             std::uint64_t seed = 1) {
  FilterTrialParams params;
  params.scene = scene;
  params.drive = drive;
  params.seed = seed;
  return params;
}

FilterTrial RunTrial(const FilterTrialParams& params, double rate = 100) {
  return RunFilterTrial(params, MakeFilter(rate), 3);
}

/** The scene's own frame in B: RunFilterTrial() draws it first. */
FilterTrialSetting MakeSetting(const FilterTrialParams& params) {
  RandomStream random(params.seed);
  return MakeFilterTrialSetting(params, &random);
}

/** The vertical of the scene's own frame, up. */
Vector3d FloorUp(const FilterTrialParams& params) {
  return MakeSetting(params).scene.surfaces.front().rotation.col(2);
}

template <typename Function>
void ForEachTrial(Function function) {
  for (const auto& [scene, scene_name] :
       EnumStrings<FilterTrialScene>::kValues) {
    for (const auto& [drive, drive_name] :
         EnumStrings<FilterTrialDrive>::kValues) {
      for (std::uint64_t seed = 0; seed < 3; ++seed) {
        SCOPED_TRACE(std::string(scene_name) + ", " + drive_name + ", seed " +
                     std::to_string(seed));
        function(MakeParams(scene, drive, seed));
      }
    }
  }
}

template <typename Action>
void ExpectInvalid(const Action& action, const std::string& field) {
  EXPECT_NE(InvalidArgument(action).find("field `" + field + "`"),
            std::string::npos)
      << InvalidArgument(action);
}

TEST(FilterTrialTest, EverySampleIsConsistent) {
  ForEachTrial([](const FilterTrialParams& params) {
    const FilterTrial trial = RunTrial(params);
    ASSERT_GT(trial.samples.size(), 50u);
    for (const FilterTrialSample& sample : trial.samples) {
      ASSERT_EQ(sample.true_dimension > 0, !sample.true_force.isZero(0));
      ASSERT_TRUE(sample.touched || sample.true_dimension == 0);
      ASSERT_NEAR(sample.true_normal.norm(), sample.true_dimension > 0, 1e-12);
      ASSERT_EQ(std::isnan(sample.direction_error),
                sample.dimension == 0 || sample.true_dimension == 0);
      ASSERT_FALSE(sample.direction_error < 0);
      ASSERT_FALSE(sample.direction_error > 90 * kDegree);
      if (sample.true_dimension == 1) {
        ASSERT_EQ(sample.true_axis, sample.true_normal);
      } else if (sample.true_dimension == 2) {
        ASSERT_NEAR(sample.true_axis.norm(), 1, 1e-12);
        ASSERT_NEAR(sample.true_axis.dot(sample.true_normal), 0, 1e-12);
      }
    }
  });
}

TEST(FilterTrialTest, ATrialEndsInFreeSpaceWithoutHavingJumped) {
  ForEachTrial([](const FilterTrialParams& params) {
    const FilterTrial trial = RunTrial(params);
    EXPECT_EQ(trial.samples.back().true_dimension, 0);
    for (const FilterTrialInterval& contact : trial.contacts) {
      EXPECT_LT(contact.begin, contact.end);
      EXPECT_LT(contact.end, kInfinity);
    }
    for (const FilterTrialSample& sample : trial.samples) {
      EXPECT_LT(sample.velocity.norm(), 1.0);
      EXPECT_LT(sample.true_force.norm(), 60);
    }
  });
}

TEST(FilterTrialTest, ThereIsASampleAtTheEndOfEachPeriod) {
  for (const double rate : {15.0, 60.0, 500.0}) {
    const FilterTrialParams params =
        MakeParams(FilterTrialScene::kPlane, FilterTrialDrive::kKinematic);
    const FilterTrial trial = RunTrial(params, rate);
    const double duration =
        kFilterTrialStep * static_cast<double>(MakeSetting(params).path.size());
    EXPECT_NEAR(static_cast<double>(trial.samples.size()), duration * rate, 1);
    double last = trial.samples.front().time - 1 / rate;
    EXPECT_LE(last, kFilterTrialStep);
    for (const FilterTrialSample& sample : trial.samples) {
      EXPECT_NEAR(sample.time - last, 1 / rate, kFilterTrialStep);
      last = sample.time;
    }
  }
}

TEST(FilterTrialTest, FreeSpaceIsNeverTouched) {
  for (const auto& [drive, name] : EnumStrings<FilterTrialDrive>::kValues) {
    const FilterTrial trial =
        RunTrial(MakeParams(FilterTrialScene::kFree, drive));
    EXPECT_TRUE(trial.contacts.empty());
    double fastest = 0;
    for (const FilterTrialSample& sample : trial.samples) {
      EXPECT_FALSE(sample.touched);
      EXPECT_EQ(sample.true_dimension, 0);
      fastest = std::max(fastest, sample.velocity.norm());
    }
    EXPECT_GT(fastest, 0.1);
  }
}

TEST(FilterTrialTest, OnFlatSurfacesTheNormalIsTheFloors) {
  for (const FilterTrialScene scene :
       {FilterTrialScene::kPlane, FilterTrialScene::kStill,
        FilterTrialScene::kGrazing, FilterTrialScene::kSoft}) {
    for (const auto& [drive, name] : EnumStrings<FilterTrialDrive>::kValues) {
      SCOPED_TRACE(EnumToString(scene) + std::string(", ") + name);
      const FilterTrialParams params = MakeParams(scene, drive);
      const Vector3d into = -FloorUp(params);
      const FilterTrial trial = RunTrial(params);
      EXPECT_FALSE(trial.contacts.empty());
      EXPECT_TRUE(trial.second_walls.empty());
      for (const FilterTrialSample& sample : trial.samples) {
        ASSERT_LE(sample.true_dimension, 1);
        if (sample.true_dimension == 1) {
          ASSERT_TRUE(sample.true_axis.isApprox(into, 1e-9));
        }
      }
    }
  }
}

TEST(FilterTrialTest, PressesWithTheForceAskedForAndSlidesWithTheSpeed) {
  for (const double force : {3.0, 10.0}) {
    for (const FilterTrialDrive drive :
         {FilterTrialDrive::kTrueSelection, FilterTrialDrive::kKinematic}) {
      FilterTrialParams params = MakeParams(FilterTrialScene::kPlane, drive);
      params.force = force;
      params.speed = 0.1;
      const Vector3d into = -FloorUp(params);
      const FilterTrial trial = RunTrial(params);
      // At the end of pressing still. The surface yields, which takes some of
      // the spring's length: at 3000 N/m and more up to a seventh.
      const auto held = std::find_if(
          trial.samples.begin(), trial.samples.end(),
          [&](const FilterTrialSample& sample) {
            return sample.time > trial.contacts[0].begin + params.hold_time;
          });
      EXPECT_LT(held->true_force.dot(into), 1.1 * force);
      EXPECT_GT(held->true_force.dot(into), 0.8 * force);
      // Minimum jerk is at most 15/8 of the mean speed; the rest is dynamics
      // and noise.
      double fastest = 0;
      for (const FilterTrialSample& sample : trial.samples) {
        const Vector3d& v = sample.velocity;
        fastest = std::max(fastest, (v - into * into.dot(v)).norm());
      }
      EXPECT_GT(fastest, 1.5 * params.speed);
      EXPECT_LT(fastest, 2.2 * params.speed);
    }
  }
}

TEST(FilterTrialTest, FrictionIsThatOfCoulombWhileSliding) {
  FilterTrialParams params =
      MakeParams(FilterTrialScene::kPlane, FilterTrialDrive::kTrueSelection);
  params.friction = 0.5;
  const Vector3d into = -FloorUp(params);
  int sliding = 0;
  for (const FilterTrialSample& sample : RunTrial(params).samples) {
    const double normal = sample.true_force.dot(into);
    const double tangential = (sample.true_force - normal * into).norm();
    EXPECT_LE(tangential, 0.5 * normal + 1e-9);
    if (sample.touched && sample.velocity.norm() > 0.03) {
      sliding += tangential > 0.49 * normal;
    }
  }
  EXPECT_GT(sliding, 50);
}

TEST(FilterTrialTest, CylindersNormalTurnsAboutItsAxis) {
  for (const auto& [drive, name] : EnumStrings<FilterTrialDrive>::kValues) {
    SCOPED_TRACE(name);
    const FilterTrialParams params =
        MakeParams(FilterTrialScene::kCylinder, drive);
    const Matrix3d R = MakeSetting(params).scene.surfaces.front().rotation;
    double left = 0;
    double right = 0;
    for (const FilterTrialSample& sample : RunTrial(params).samples) {
      if (sample.true_dimension == 0) continue;
      ASSERT_EQ(sample.true_dimension, 1);
      const Vector3d normal = R.transpose() * sample.true_normal;
      ASSERT_NEAR(normal.x(), 0, 1e-9);
      const double angle = std::atan2(normal.y(), -normal.z()) / kDegree;
      left = std::min(left, angle);
      right = std::max(right, angle);
    }
    EXPECT_LT(left, -20);
    EXPECT_GT(right, 20);
  }
}

TEST(FilterTrialTest, InTheInnerCornerTheWallComesAfterTheFloor) {
  for (const auto& [drive, name] : EnumStrings<FilterTrialDrive>::kValues) {
    for (std::uint64_t seed = 0; seed < 6; ++seed) {
      SCOPED_TRACE(name + std::string(", seed ") + std::to_string(seed));
      const FilterTrialParams params =
          MakeParams(FilterTrialScene::kInnerCorner, drive, seed);
      const auto surfaces = MakeSetting(params).scene.surfaces;
      const Vector3d floor = -surfaces[0].rotation.col(2);
      const Vector3d wall = -surfaces[1].rotation.col(2);
      const FilterTrial trial = RunTrial(params);
      ASSERT_FALSE(trial.second_walls.empty());
      double both = 0;
      for (const auto& [begin, end] : trial.second_walls) {
        EXPECT_GT(begin, trial.contacts[0].begin);
        both += std::min(end, trial.samples.back().time) - begin;
      }
      EXPECT_GT(both, 2.0);
      for (const FilterTrialSample& sample : trial.samples) {
        if (sample.true_dimension == 1) {
          ASSERT_TRUE(sample.true_axis.isApprox(floor, 1e-9) ||
                      sample.true_axis.isApprox(wall, 1e-9));
        } else if (sample.true_dimension == 2) {
          const Vector3d corner = floor.cross(wall).normalized();
          ASSERT_NEAR(std::abs(sample.true_axis.dot(corner)), 1, 1e-9);
        }
      }
    }
  }
}

TEST(FilterTrialTest, StepEdgeHasAnInnerAndAnOuterCorner) {
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    SCOPED_TRACE(seed);
    const FilterTrialParams params = MakeParams(
        FilterTrialScene::kStepEdge, FilterTrialDrive::kKinematic, seed);
    const FilterTrial trial = RunTrial(params, 500);
    const Matrix3d R = MakeSetting(params).scene.surfaces[1].rotation;
    ASSERT_EQ(trial.second_walls.size(), 1u);
    // Tenths of the quarter turn from the step's side (0) to its top (9).
    bool seen[10] = {};
    for (const FilterTrialSample& sample : trial.samples) {
      // Below 0.5 N the second wall is no second_walls, but still touched.
      if (sample.time < trial.second_walls[0].end + 0.02) continue;
      if (sample.true_dimension == 0) continue;
      ASSERT_EQ(sample.true_dimension, 1);
      const Vector3d normal = R.transpose() * sample.true_normal;
      const double angle = std::atan2(-normal.z(), normal.x());
      ASSERT_NEAR(normal.y(), 0, 1e-9);
      ASSERT_GE(angle, -1e-9);
      ASSERT_LE(angle, 90 * kDegree + 1e-9);
      seen[std::clamp(static_cast<int>(angle / (9 * kDegree)), 0, 9)] = true;
    }
    for (const bool tenth : seen) EXPECT_TRUE(tenth);
  }
}

TEST(FilterTrialTest, SameArgumentsGiveTheSameBits) {
  const FilterTrialParams params =
      MakeParams(FilterTrialScene::kInnerCorner, FilterTrialDrive::kClosedLoop);
  const FilterTrial one = RunTrial(params);
  const FilterTrial two = RunTrial(params);
  FilterTrialParams other_params = params;
  other_params.seed = 2;
  ASSERT_EQ(one.samples.size(), two.samples.size());
  for (std::size_t i = 0; i < one.samples.size(); ++i) {
    EXPECT_EQ(one.samples[i].sensed_force, two.samples[i].sensed_force);
    EXPECT_EQ(one.samples[i].singular_vectors, two.samples[i].singular_vectors);
  }
  EXPECT_NE(one.samples[0].sensed_force,
            RunTrial(other_params).samples[0].sensed_force);
}

TEST(FilterTrialTest, OnlyTheClosedLoopDependsOnTheFilter) {
  for (const auto& [drive, name] : EnumStrings<FilterTrialDrive>::kValues) {
    SCOPED_TRACE(name);
    const FilterTrialParams params =
        MakeParams(FilterTrialScene::kPlane, drive);
    const FilterTrial few = RunFilterTrial(params, MakeFilter(100, 100), 3);
    const FilterTrial many = RunFilterTrial(params, MakeFilter(100, 500), 3);
    ASSERT_EQ(few.samples.size(), many.samples.size());
    double difference = 0;
    for (std::size_t i = 0; i < few.samples.size(); ++i) {
      difference +=
          (few.samples[i].true_force - many.samples[i].true_force).norm();
    }
    if (drive == FilterTrialDrive::kClosedLoop) {
      EXPECT_GT(difference, 1);
    } else {
      EXPECT_EQ(difference, 0);
    }
  }
}

TEST(FilterTrialTest, NoiseIsOfTheGivenStandardDeviation) {
  FilterTrialParams params =
      MakeParams(FilterTrialScene::kFree, FilterTrialDrive::kKinematic);
  params.force_noise = 0.4;
  double square = 0;
  const FilterTrial trial = RunTrial(params);
  for (const FilterTrialSample& sample : trial.samples) {
    square += sample.sensed_force.squaredNorm() / 3;
  }
  // Of over 5000 samples of three: to about 1 %.
  ASSERT_GT(trial.samples.size(), 5000u);
  EXPECT_NEAR(std::sqrt(square / static_cast<double>(trial.samples.size())),
              0.4, 0.02);
}

TEST(FilterTrialTest, CostGrowsWithTheNumberOfParticles) {
  FilterTrialParams params =
      MakeParams(FilterTrialScene::kPlane, FilterTrialDrive::kClosedLoop);
  params.force = 10;
  const auto measure = [&params](int num_particles) {
    const ForceSpaceParticleFilter filter = MakeFilter(15, num_particles);
    const FilterTrial trial = RunFilterTrial(params, filter, 3);
    // In free space an update costs the same with any number.
    const auto found = std::count_if(
        trial.samples.begin(), trial.samples.end(),
        [](const FilterTrialSample& sample) { return sample.dimension > 0; });
    EXPECT_GT(found, 0.5 * static_cast<double>(trial.samples.size()));
    return MeasureFilterCost(trial, filter, 3, 3);
  };
  const double few = measure(100);
  EXPECT_GT(few, 0);
  EXPECT_GT(measure(10000), 5 * few);
}

TEST(FilterTrialTest, CostOfNothingIsRefused) {
  const FilterTrial trial = RunTrial(
      MakeParams(FilterTrialScene::kPlane, FilterTrialDrive::kKinematic));
  ExpectInvalid([&] { MeasureFilterCost({}, MakeFilter(100), 0, 1); },
                "trial.samples");
  ExpectInvalid([&] { MeasureFilterCost(trial, MakeFilter(100), 0, 0); },
                "repeats");
}

TEST(FilterTrialTest, BadParamsAreRefused) {
  const auto run = [](auto change) {
    FilterTrialParams params;
    change(&params);
    RunFilterTrial(params, MakeFilter(100), 0);
  };
  using P = FilterTrialParams;
  ExpectInvalid([&] { run([](P* p) { p->friction = 3; }); }, "friction");
  ExpectInvalid([&] { run([](P* p) { p->speed = 0; }); }, "speed");
  ExpectInvalid([&] { run([](P* p) { p->force = -1; }); }, "force");
  ExpectInvalid([&] { run([](P* p) { p->force_noise = -1; }); }, "force_noise");
  ExpectInvalid([&] { run([](P* p) { p->velocity_noise = -1; }); },
                "velocity_noise");
  ExpectInvalid([&] { run([](P* p) { p->hold_time = -1; }); }, "hold_time");
  ExpectInvalid([&] { RunFilterTrial({}, MakeFilter(2000), 0); },
                "filter.period");
}

}  // namespace
}  // namespace dual_proxy
