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
      if (scene == FilterTrialScene::kBore &&
          drive == FilterTrialDrive::kKinematic) {
        continue;
      }
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

TEST(FilterTrialTest, BetweenPlanesEveryNormalIsOneOfTheirs) {
  using Scene = FilterTrialScene;
  for (const auto& [scene, walls] :
       {std::pair{Scene::kPulled, 0}, std::pair{Scene::kPressedCorner, 1},
        std::pair{Scene::kWallAtRest, 1}, std::pair{Scene::kGroove, 1},
        std::pair{Scene::kSlot, 1}, std::pair{Scene::kChamfer, 2}}) {
    for (const auto& [drive, name] : EnumStrings<FilterTrialDrive>::kValues) {
      for (std::uint64_t seed = 0; seed < 4; ++seed) {
        SCOPED_TRACE(EnumToString(scene) + std::string(", ") + name +
                     ", seed " + std::to_string(seed));
        const FilterTrialParams params = MakeParams(scene, drive, seed);
        const FilterTrialSetting setting = MakeSetting(params);
        const Vector3d along = setting.scene.surfaces[0].rotation.col(1);
        const FilterTrial trial = RunTrial(params);
        EXPECT_GE(trial.second_walls.size(), static_cast<std::size_t>(walls));
        for (const FilterTrialSample& sample : trial.samples) {
          ASSERT_LE(sample.true_dimension, walls > 0 ? 2 : 1);
          if (sample.true_dimension == 2) {
            ASSERT_NEAR(std::abs(sample.true_axis.dot(along)), 1, 1e-9);
          } else if (sample.true_dimension == 1) {
            ASSERT_TRUE(std::ranges::any_of(
                setting.scene.surfaces, [&](const ContactSurfaceParams& s) {
                  return sample.true_axis.isApprox(-s.rotation.col(2), 1e-9);
                }));
          }
        }
      }
    }
  }
}

TEST(FilterTrialTest, ForcesInThePressedCornerChangeAtRest) {
  FilterTrialParams params = MakeParams(FilterTrialScene::kPressedCorner,
                                        FilterTrialDrive::kQuasiStatic);
  for (const double stiffness : {1000.0, 20000.0}) {
    params.stiffness = stiffness;
    double least = 100;
    double most = 0;
    double fastest = 0;
    for (params.seed = 0; params.seed < 6; ++params.seed) {
      const auto surfaces = MakeSetting(params).scene.surfaces;
      ASSERT_EQ(surfaces[0].stiffness, stiffness);
      const FilterTrial trial = RunTrial(params);
      const double begin = trial.second_walls[0].begin + 0.6;
      for (const FilterTrialSample& sample : trial.samples) {
        if (sample.time < begin || sample.time > begin + 1) continue;
        ASSERT_EQ(sample.true_dimension, 2);
        const double wall =
            -sample.true_force.dot(Vector3d(surfaces[1].rotation.col(2)));
        least = std::min(least, wall);
        most = std::max(most, wall);
        fastest = std::max(fastest, sample.velocity.norm());
      }
    }
    EXPECT_LT(least, 8);
    EXPECT_GT(most, 12);
    // By what gives alone: up to 14 N within 0.15 s, 15/8 of that at most.
    EXPECT_LT(fastest, 0.01 + 2 * 175 / stiffness);
  }
}

TEST(FilterTrialTest, InTheBoreTheNormalGoesAround) {
  for (const FilterTrialDrive drive :
       {FilterTrialDrive::kClosedLoop, FilterTrialDrive::kTrueSelection,
        FilterTrialDrive::kQuasiStatic}) {
    SCOPED_TRACE(EnumToString(drive));
    const FilterTrialParams params = MakeParams(FilterTrialScene::kBore, drive);
    const ContactSurfaceParams bore = MakeSetting(params).scene.surfaces[0];
    double turned = 0;
    Vector3d first = Vector3d::Zero();
    for (const FilterTrialSample& sample : RunTrial(params).samples) {
      if (sample.true_dimension == 0) continue;
      ASSERT_EQ(sample.true_dimension, 1);
      ASSERT_NEAR(sample.true_normal.dot(Vector3d(bore.rotation.col(0))), 0,
                  1e-9);
      if (first.isZero()) first = sample.true_normal;
      turned = std::max(turned, std::acos(std::clamp(
                                    first.dot(sample.true_normal), -1.0, 1.0)));
    }
    EXPECT_GT(turned, 100 * kDegree);
  }
}

TEST(FilterTrialTest, ToolGoesUpTheChamferAndPressesBothSidesOfTheSlot) {
  for (const auto& [drive, name] : EnumStrings<FilterTrialDrive>::kValues) {
    SCOPED_TRACE(name);
    FilterTrialParams params = MakeParams(FilterTrialScene::kChamfer, drive);
    auto surfaces = MakeSetting(params).scene.surfaces;
    const Vector3d slope = surfaces[1].rotation.col(2);
    const double flat = slope.dot(Vector3d(surfaces[0].rotation.col(2)));
    EXPECT_GT(flat, std::cos(45 * kDegree));
    EXPECT_LT(flat, std::cos(30 * kDegree));
    double on_slope = 0;
    for (const FilterTrialSample& sample : RunTrial(params).samples) {
      on_slope += sample.true_axis.isApprox(-slope, 1e-9) ? 0.01 : 0;
    }
    EXPECT_GT(on_slope, 1);

    params.scene = FilterTrialScene::kSlot;
    surfaces = MakeSetting(params).scene.surfaces;
    const Vector3d side = surfaces[1].rotation.col(2);
    double left = 0;
    double right = 0;
    for (const FilterTrialSample& sample : RunTrial(params).samples) {
      left = std::min(left, sample.true_force.dot(side));
      right = std::max(right, sample.true_force.dot(side));
    }
    EXPECT_LT(left, -4);
    EXPECT_GT(right, 4);
  }
}

TEST(FilterTrialTest, WhatIsPulledLessThanFrictionHoldsStays) {
  FilterTrialParams params =
      MakeParams(FilterTrialScene::kPulled, FilterTrialDrive::kQuasiStatic);
  params.friction = 0.4;
  params.velocity_noise = 0;
  const Vector3d into = -FloorUp(params);
  const FilterTrial trial = RunTrial(params);
  double most = 0;
  Vector3d way = Vector3d::Zero();
  double farthest = 0;
  for (const FilterTrialSample& sample : trial.samples) {
    if (sample.time < trial.contacts[0].begin + params.hold_time) continue;
    if (sample.time > trial.contacts[0].end - 0.5) break;
    const double normal = sample.true_force.dot(into);
    const double friction = (sample.true_force - normal * into).norm();
    most = std::max(most, friction / normal);
    way += 0.01 * sample.velocity;
    farthest = std::max(farthest, way.norm());
  }
  EXPECT_GT(most, 0.2);
  EXPECT_LE(most, 0.4 + 1e-9);
  EXPECT_LT(farthest, 0.001);
}

TEST(FilterTrialTest, WithStictionTheToolSticksAndSlips) {
  FilterTrialParams params =
      MakeParams(FilterTrialScene::kPlane, FilterTrialDrive::kQuasiStatic);
  params.friction = 0.25;
  params.speed = 0.02;
  params.velocity_noise = 0;
  const auto count_stops = [&params] {
    int stops = 0;
    bool moves = false;
    const FilterTrial trial = RunTrial(params);
    for (const FilterTrialSample& sample : trial.samples) {
      if (!sample.touched) continue;
      const double speed = sample.velocity.norm();
      stops += moves && speed < 0.001;
      moves = speed > 0.05 || (moves && speed >= 0.001);
    }
    return stops;
  };
  EXPECT_EQ(count_stops(), 0);
  params.stiction = 0.2;
  EXPECT_GT(count_stops(), 10);
}

TEST(FilterTrialTest, OnAConveyorARestingToolIsDragged) {
  for (const auto& [drive, name] : EnumStrings<FilterTrialDrive>::kValues) {
    SCOPED_TRACE(name);
    FilterTrialParams params = MakeParams(FilterTrialScene::kStill, drive);
    params.hold_time = 2;
    params.friction = 0.2;
    params.surface_speed = 0.05;
    params.velocity_noise = 0;
    const Vector3d into = -FloorUp(params);
    const FilterTrial trial = RunTrial(params);
    int rests = 0;
    for (const FilterTrialSample& sample : trial.samples) {
      if (sample.time < trial.contacts[0].begin + 0.5) continue;
      if (sample.time > trial.contacts[0].end - 0.5) break;
      const double normal = sample.true_force.dot(into);
      // Against the belt's motion, which is along y.
      const Vector3d friction = sample.true_force - normal * into;
      rests += sample.velocity.norm() < 0.005 &&
               std::abs(friction.norm() / normal - 0.2) < 0.02;
    }
    EXPECT_GT(rests, 100);
  }
}

TEST(FilterTrialTest, OnASurfaceThatBreathesTheToolGoesUpAndDown) {
  for (const auto& [drive, name] : EnumStrings<FilterTrialDrive>::kValues) {
    SCOPED_TRACE(name);
    FilterTrialParams params = MakeParams(FilterTrialScene::kStill, drive);
    params.hold_time = 6;
    params.breathing = 0.005;
    const Vector3d up = FloorUp(params);
    const FilterTrial trial = RunTrial(params);
    EXPECT_EQ(trial.contacts.size(), 1u);
    double height = 0, lowest = 0, highest = 0;
    for (const FilterTrialSample& sample : trial.samples) {
      if (sample.time < trial.contacts[0].begin + 1) continue;
      if (sample.time > trial.contacts[0].begin + 5) break;
      height += 0.01 * sample.velocity.dot(up);
      lowest = std::min(lowest, height);
      highest = std::max(highest, height);
    }
    EXPECT_NEAR(highest - lowest, 0.01, 0.002);
  }
}

TEST(FilterTrialTest, ToolThatGivesMovesAsItsForceChanges) {
  FilterTrialParams params =
      MakeParams(FilterTrialScene::kStill, FilterTrialDrive::kKinematic);
  const FilterTrial stiff = RunTrial(params);
  params.tool_compliance = 0.001;
  const FilterTrial soft = RunTrial(params);
  ASSERT_EQ(stiff.samples.size(), soft.samples.size());
  Vector3d way = Vector3d::Zero();
  for (std::size_t i = 0; i < soft.samples.size(); ++i) {
    way += 0.01 * (soft.samples[i].velocity - stiff.samples[i].velocity);
    EXPECT_TRUE(way.isApprox(0.001 * soft.samples[i].true_force, 1e-6) ||
                way.norm() < 1e-5);
  }
}

TEST(FilterTrialTest, SensorsErrorsAreThoseAskedFor) {
  FilterTrialParams params =
      MakeParams(FilterTrialScene::kFree, FilterTrialDrive::kKinematic);
  params.force_noise = 0;
  const auto sense = [&params] { return RunTrial(params, 1000).samples; };
  for (const FilterTrialSample& sample : sense()) {
    ASSERT_TRUE(sample.sensed_force.isZero(0));
  }

  params.sensor_bias = 0.8;
  const auto biased = sense();
  for (const FilterTrialSample& sample : biased) {
    ASSERT_NEAR(sample.sensed_force.norm(), 0.8, 1e-9);
    ASSERT_EQ(sample.sensed_force, biased.front().sensed_force);
  }
  params.bias_turn = 0.5;
  const auto turning = sense();
  EXPECT_TRUE(
      turning.front().sensed_force.isApprox(biased.front().sensed_force, 1e-2));
  const double rate =
      (turning[1000].sensed_force - turning[999].sensed_force).norm() / 0.001;
  EXPECT_GT(rate, 0.01);
  EXPECT_LE(rate, 0.8 * 0.5 + 1e-6);

  params.sensor_bias = 0;
  params.sensor_hum = 0.1;
  double square = 0;
  for (const FilterTrialSample& sample : sense()) {
    ASSERT_LE(sample.sensed_force.norm(), 0.1 + 1e-9);
    square += sample.sensed_force.squaredNorm();
  }
  const double count = static_cast<double>(biased.size());
  EXPECT_NEAR(std::sqrt(square / count), 0.1 / std::sqrt(2), 1e-3);

  params.sensor_hum = 0;
  params.sensor_noise = 0.2;
  params.sensor_step = 0.02;
  square = 0;
  for (const FilterTrialSample& sample : sense()) {
    const Vector3d steps = sample.sensed_force / 0.02;
    ASSERT_TRUE(steps.isApprox(steps.array().round().matrix(), 1e-9));
    square += sample.sensed_force.squaredNorm() / 3;
  }
  EXPECT_NEAR(std::sqrt(square / count), 0.2, 0.005);

  params.sensor_noise = 0;
  params.spike = 50;
  std::vector<double> spikes;
  for (const FilterTrialSample& sample : sense()) {
    if (sample.sensed_force.norm() > 1) spikes.push_back(sample.time);
  }
  ASSERT_GT(spikes.size(), 50u);
  ASSERT_EQ(spikes.size() % 2, 0u);
  for (std::size_t i = 2; i < spikes.size(); i += 2) {
    EXPECT_NEAR(spikes[i + 1] - spikes[i], 0.001, 1e-9);
    EXPECT_GT(spikes[i] - spikes[i - 2], 0.299);
    EXPECT_LT(spikes[i] - spikes[i - 2], 0.905);
  }
}

TEST(FilterTrialTest, AFilterMayBeginInContact) {
  FilterTrialParams params =
      MakeParams(FilterTrialScene::kPlane, FilterTrialDrive::kQuasiStatic);
  for (const double rate : {15.0, 100.0}) {
    params.filter_start.reset();
    const FilterTrial whole = RunTrial(params, rate);
    params.filter_start = 0.3;
    const FilterTrial trial = RunTrial(params, rate);
    const double begin = trial.samples.front().time - 1 / rate;
    EXPECT_GE(begin, trial.contacts[0].begin + 0.3);
    EXPECT_LT(begin, trial.contacts[0].begin + 0.3 + 1.1 / rate);
    EXPECT_GT(trial.samples.front().true_force.norm(), 3);
    EXPECT_LT(trial.samples.size(), whole.samples.size());
    EXPECT_EQ(trial.samples.back().time, whole.samples.back().time);
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
  const auto follow_bore = [](P* p) {
    p->scene = FilterTrialScene::kBore;
    p->drive = FilterTrialDrive::kKinematic;
  };
  ExpectInvalid([&] { run(follow_bore); }, "drive");
  ExpectInvalid([&] { run([](P* p) { p->stiffness = 0; }); }, "stiffness");
  ExpectInvalid([&] { run([](P* p) { p->stiction = -1; }); }, "stiction");
  ExpectInvalid([&] { run([](P* p) { p->radius = 0; }); }, "radius");
  ExpectInvalid([&] { run([](P* p) { p->spike = -1; }); }, "spike");
  ExpectInvalid([&] { run([](P* p) { p->filter_start = -1; }); },
                "filter_start");
  ExpectInvalid([&] { RunFilterTrial({}, MakeFilter(2000), 0); },
                "filter.period");
}

}  // namespace
}  // namespace dual_proxy
