// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "feeler.h"

// What real contact does to ContactTracker: surfaces that give, sensors with a
// bias, spikes, walls that are pressed at rest.

namespace dual_proxy {
namespace {

constexpr double kPi = std::numbers::pi;

double UncertaintyDeg(const Feeler& dut) {
  return dut.state().direction_uncertainty * 180 / kPi;
}

class RateTest : public ::testing::TestWithParam<double> {};

// A corner that gives moves the tool along its normals as the forces change.
TEST_P(RateTest, CornerThatGivesStaysACorner) {
  const double rate = GetParam();
  for (const double compliance : {5e-5, 1.5e-4, 8e-4}) {
    for (std::uint64_t seed = 0; seed < 4; ++seed) {
      Feeler dut(rate, seed);
      dut.Feel(kZero, 0.1 * kAlong, 0.5);
      dut.Feel(5 * kDown, kZero, 1);
      dut.Feel(5 * kDown, 0.04 * kWall, 0.5);
      dut.Feel(5 * kDown + 7 * kWall, kZero, 0.3);
      ASSERT_EQ(dut.dimension(), 2);
      double wall = 7;
      double floor = 5;
      for (const auto& [to_wall, to_floor] :
           {std::pair{16.0, 4.5}, std::pair{15.0, 11.0}, std::pair{5.0, 6.0},
            std::pair{7.0, 5.0}}) {
        constexpr double kTime = 0.25;
        const auto updates = std::lround(kTime * rate);
        const double wall_rate = (to_wall - wall) / kTime;
        const double floor_rate = (to_floor - floor) / kTime;
        for (long i = 0; i < updates; ++i) {
          wall += wall_rate / rate;
          floor += floor_rate / rate;
          dut.Update(wall * kWall + floor * kDown,
                     compliance * (wall_rate * kWall + floor_rate * kDown));
          ASSERT_EQ(dut.dimension(), 2) << compliance << " " << seed;
        }
      }
      dut.Feel(5 * kDown + 7 * kWall, kZero, 0.5);
      dut.Feel(5 * kDown + 7 * kWall, 0.05 * kAlong, 1);
      EXPECT_EQ(dut.dimension(), 2) << compliance << " " << seed;
      EXPECT_LT(AngleDeg(dut.free_axis(), kAlong), 3);
    }
  }
}

// A constant force in free flight is the sensor's.
TEST_P(RateTest, BiasIsNoContact) {
  for (const double bias : {0.4, 0.8, 1.1}) {
    Feeler dut(GetParam());
    const double rate = GetParam();
    const auto updates = std::lround(4 * rate);
    for (long i = 0; i < updates; ++i) {
      dut.Update(bias * kWall, 0.1 * Turned(kAlong, kWall, 60.0 * i / rate));
      ASSERT_EQ(dut.dimension(), 0) << bias << " N, update " << i;
    }
    // And then it does not tilt a normal.
    dut.Feel(6 * kDown + bias * kWall, kZero, 0.5);
    const Vector3d velocity = 0.05 * kAlong;
    dut.Feel(SlidingForce(6, 0.3, velocity) + bias * kWall, velocity, 1);
    EXPECT_EQ(dut.dimension(), 1);
    EXPECT_LT(AngleDeg(dut.normal(), kDown), 2) << bias;
  }
}

TEST_P(RateTest, BiasThatNobodyLearnedIsInTheUncertainty) {
  for (const double bias : {0.2, 0.6, 0.9}) {
    Feeler dut(GetParam());
    dut.Feel(6 * kDown + bias * kWall, kZero, 0.5);
    const Vector3d velocity = 0.05 * kAlong;
    dut.Feel(SlidingForce(6, 0.3, velocity) + bias * kWall, velocity, 2);
    EXPECT_EQ(dut.dimension(), 1);
    EXPECT_LT(AngleDeg(dut.normal(), kDown), UncertaintyDeg(dut)) << bias;
  }
}

// Once it pushes more than friction could.
TEST_P(RateTest, SecondWallIsFoundAtRest) {
  const double rate = GetParam();
  for (const double floor : {4.0, 7.0}) {
    Feeler dut(rate, 1, 0.1);
    dut.Feel(floor * kDown, kZero, 1.5);
    const double cone = 0.7 * floor;
    const double rise = 6;  // N/s
    double wall = 0;
    while (dut.dimension() == 1 && wall < cone + 3) {
      wall += rise / rate;
      dut.Update(floor * kDown + wall * kWall, kZero);
      if (dut.dimension() == 1) {
        ASSERT_LT(AngleDeg(dut.normal(), kDown), 3) << wall;
      }
    }
    // Within 1 N and 100 ms, or two inputs.
    EXPECT_LT(wall, cone + 1 + rise * std::max(0.1, 3 / rate));
    EXPECT_EQ(dut.dimension(), 2);
  }
}

// Without friction, as is known once it has slid.
TEST_P(RateTest, SecondWallIsFoundAtRestWithoutFriction) {
  const double rate = GetParam();
  Feeler dut(rate, 1, 0.1);
  dut.Feel(kZero, 0.1 * kAlong, 1);
  dut.Feel(6 * kDown, kZero, 0.5);
  dut.Feel(6 * kDown, 0.05 * kAlong, 1.5);
  dut.Feel(6 * kDown, kZero, 0.3);
  EXPECT_LE(dut.Count(2, 6 * kDown + 3 * kWall, kZero) / rate,
            std::max(0.1, 3.01 / rate));
}

// What moves by its noise does not slide.
TEST_P(RateTest, VelocityNoiseIsNoSliding) {
  Feeler dut(GetParam());
  RandomStream random(3);
  const auto updates = std::lround(8 * GetParam());
  for (long i = 0; i < updates; ++i) {
    dut.Update(7 * kDown + 1.5 * kWall, DrawVector(0.0015, &random));
  }
  EXPECT_GT(UncertaintyDeg(dut), 10);
}

// The edge between a cylinder and a wall across it, both without friction.
TEST_P(RateTest, CurvedEdgeIsFollowed) {
  constexpr double kSpeed = 0.03;
  const double rate = GetParam();
  for (const double radius : {0.05, 0.1, 0.2}) {
    // It turns by 2.3 degrees between two inputs.
    if (rate < 100 && radius < 0.1) continue;
    Feeler dut(rate, 3);
    dut.Feel(kZero, 0.1 * kWall, 1);
    dut.Feel(6 * kDown, kZero, 1);
    dut.Feel(6 * kDown, 0.05 * kWall, 1);
    dut.Feel(6 * kDown + 5 * kWall, kZero, 0.5);
    ASSERT_EQ(dut.dimension(), 2);
    const double turn = kSpeed / (radius * rate);
    double sum = 0;
    int count = 0;
    double angle = 0;
    for (const double goal : {0.7, -0.7, 0.7}) {
      const double sign = goal > angle ? 1 : -1;
      while (sign * (goal - angle) > turn) {
        angle += sign * turn;
        const double deg = angle * 180 / kPi;
        const Vector3d axis = Turned(kAlong, Vector3d(-kDown), deg);
        dut.Update(6 * Turned(kDown, kAlong, deg) + 5 * kWall,
                   sign * kSpeed * axis);
        ASSERT_EQ(dut.dimension(), 2) << rate << " " << radius;
        sum += AngleDeg(dut.free_axis(), axis);
        ++count;
      }
    }
    EXPECT_LT(sum / count, 2) << rate << " " << radius;
  }
}

// Friction that is known has tilted the force, and with it the normal, at
// first; then it pulls the other way.
TEST_P(RateTest, FrictionThatTurnsBackIsNoContact) {
  const double rate = GetParam();
  for (const double friction : {0.1, 0.2, 0.25}) {
    Feeler dut(rate, 4);
    dut.Feel(kZero, 0.1 * kAlong, 1);
    dut.Feel(6 * kDown, kZero, 0.5);
    const Vector3d velocity = 0.05 * kAlong;
    dut.Feel(SlidingForce(6, friction, velocity), velocity, 1.5);
    dut.Feel(kZero, 0.1 * kAlong, 1.5);
    ASSERT_EQ(dut.dimension(), 0);
    dut.Feel(SlidingForce(8, friction, kWall), kZero, 1.5);
    EXPECT_EQ(dut.dimension(), 1) << rate << " " << friction;
    const auto updates = std::lround(1.5 * rate);
    for (long i = 0; i < updates; ++i) {
      dut.Update(SlidingForce(8, friction, Vector3d(-kWall)), kZero);
      ASSERT_EQ(dut.dimension(), 1) << rate << " " << friction;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Hz, RateTest, ::testing::Values(15, 100, 200, 1000));

TEST(RealContactTest, OneWildInputDecidesNothing) {
  for (const double rate : {15.0, 100.0, 1000.0}) {
    for (const double size : {2.0, 20.0, 1e4, 1e9}) {
      for (const Vector3d& direction :
           {kWall, kDown, kAlong, Vector3d(-kWall)}) {
        Feeler dut(rate);
        dut.Feel(kZero, 0.1 * kAlong, 1);
        dut.Update(size * direction, 0.1 * kAlong);
        dut.Feel(kZero, 0.1 * kAlong, 0.3);
        EXPECT_EQ(dut.dimension(), 0) << rate << " " << size;

        dut.Feel(6 * kDown, kZero, 1);
        dut.Feel(6 * kDown, 0.05 * kWall, 0.5);
        dut.Feel(6 * kDown + 6 * kWall, kZero, 0.5);
        dut.Feel(6 * kDown + 6 * kWall, 0.05 * kAlong, 0.5);
        ASSERT_EQ(dut.dimension(), 2);
        dut.Update(6 * kDown + 6 * kWall + size * direction, 0.05 * kAlong);
        const auto updates = std::lround(0.2 * rate);
        for (long i = 0; i < updates; ++i) {
          ASSERT_EQ(dut.dimension(), 2) << rate << " " << size << " " << i;
          dut.Update(6 * kDown + 6 * kWall, 0.05 * kAlong);
        }
        EXPECT_LT(AngleDeg(dut.free_axis(), kAlong), 4);
      }
    }
  }
}

TEST(RealContactTest, SpikeInACornerIsNoContact) {
  Feeler dut(1000);
  dut.Feel(kZero, 0.1 * kAlong, 0.5);
  dut.Feel(6 * kDown, kZero, 1);
  dut.Feel(6 * kDown, 0.05 * kWall, 0.5);
  dut.Feel(6 * kDown + 6 * kWall, kZero, 0.5);
  RandomStream random(5);
  for (int i = 0; i < 3000; ++i) {
    Vector3d force = 6 * kDown + 6 * kWall;
    if (i % 331 < 2) force += 50 * DrawVector(1, &random).normalized();
    dut.Update(force, 0.05 * kAlong);
    ASSERT_EQ(dut.dimension(), 2) << i;
  }
}

TEST(RealContactTest, FrictionMayBeMoreThanWasThought) {
  for (const double friction : {0.75, 0.9}) {
    Feeler dut;
    dut.Feel(kZero, 0.1 * kAlong, 1);
    dut.Feel(6 * kDown, kZero, 0.5);
    for (int i = 0; i < 400; ++i) {
      const Vector3d velocity = 0.05 * Turned(kAlong, kWall, 1.0 * i);
      dut.Update(SlidingForce(6, friction, velocity), velocity);
    }
    EXPECT_EQ(dut.dimension(), 1);
    EXPECT_LT(AngleDeg(dut.normal(), kDown), 2) << friction;
  }
}

// Stuck to soft tissue the tool moves as its friction changes.
TEST(RealContactTest, CreepingIsNoSliding) {
  constexpr double kStiffness = 350;  // N/m
  Feeler dut;
  dut.Feel(kZero, 0.1 * kAlong, 1);
  for (int i = 0; i < 80; ++i) {
    dut.Update(0.05 * i * kDown, 5 / kStiffness * kDown);
  }
  dut.Feel(4 * kDown, kZero, 0.3);
  double friction = 0;
  for (const double rise : {1.3, -2.6, 2.6}) {
    for (int i = 0; i < 100; ++i) {
      friction += 0.01 * rise;
      dut.Update(4 * kDown + friction * kWall, rise / kStiffness * kWall);
      ASSERT_EQ(dut.dimension(), 1);
      ASSERT_LT(AngleDeg(dut.normal(), kDown),
                std::max(3.0, UncertaintyDeg(dut)));
    }
  }
}

// On a belt friction is along the motion over it, not along the tool's: the
// normal turns about the motion, which the uncertainty has to hold.
TEST(RealContactTest, BeltIsInTheUncertainty) {
  int covered = 0;
  int updates = 0;
  for (int seed = 0; seed < 6; ++seed) {
    Feeler dut(100, seed);
    dut.Feel(kZero, 0.05 * kWall, 1);
    dut.Feel(5 * kDown, kZero, 0.5);
    const Vector3d belt = (0.02 + 0.02 * seed) * kAlong;
    for (int i = 0; i < 500; ++i) {
      const double angle = 0.015 * i;
      const Vector3d velocity =
          0.05 * (std::cos(angle) * kWall + std::sin(angle) * kAlong);
      dut.Update(SlidingForce(5, 0.3, velocity - belt), velocity);
      if (i < 100 || dut.dimension() != 1) continue;
      ++updates;
      if (AngleDeg(dut.normal(), kDown) < UncertaintyDeg(dut)) ++covered;
    }
  }
  EXPECT_GT(updates, 2300);
  EXPECT_GT(covered, 0.8 * updates);
}

TEST(RealContactTest, SmallCylinderIsFollowed) {
  constexpr double kRadius = 0.02;
  for (const double speed : {0.015, 0.03}) {
    Feeler dut;
    dut.Feel(kZero, 0.1 * kAlong, 1);
    dut.Feel(6 * kDown, kZero, 1);
    double sum = 0;
    int count = 0;
    double angle = 0;
    for (const double goal : {0.7, -0.7, 0.7}) {
      const double turn = speed / kRadius * (goal > angle ? 1 : -1);
      while (std::abs(goal - angle) > 0.01 * std::abs(turn)) {
        angle += 0.01 * turn;
        const double deg = angle * 180 / kPi;
        const Vector3d normal = Turned(kDown, kWall, deg);
        const Vector3d along =
            (turn > 0 ? 1 : -1) * Turned(kWall, Vector3d(-kDown), deg);
        dut.Update(6 * normal + 1.5 * along, speed * along);
        ASSERT_EQ(dut.dimension(), 1);
        sum += AngleDeg(dut.normal(), normal);
        ++count;
      }
    }
    EXPECT_LT(sum / count, 3) << speed;
  }
}

// Two that were foreseen explain the force as one does that was not.
TEST(RealContactTest, ForeseenPairIsTwoContacts) {
  for (const double rate : {15.0, 100.0, 1000.0}) {
    for (const double share : {0.6, 1.0, 1.6}) {
      ForceSpaceParticleFilter dut(MakeParams(rate));
      ForceSpaceParticleFilterState state = dut.MakeState(1);
      Eigen::Matrix3Xd normals(3, 2);
      normals << kDown, kWall;
      ASSERT_EQ(dut.SetPrior(normals, 0.1, &state), FilterStatus::kOk);
      const Vector3d force = 6 * kDown + share * 6 * kWall;
      const auto updates = std::lround(0.5 * rate);
      for (long i = 0; i < updates; ++i) {
        dut.Update(force, kZero, kZero, kZero, &state);
      }
      EXPECT_EQ(state.dimension, 2) << rate << " " << share;
      for (long i = 0; i < updates; ++i) {
        dut.Update(force, 0.05 * kAlong, kZero, kZero, &state);
      }
      EXPECT_EQ(state.dimension, 2) << rate << " " << share;
      EXPECT_LT(AngleDeg(state.singular_vectors.col(2), kAlong), 3);
    }
  }
}

}  // namespace
}  // namespace dual_proxy
