// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/contact_truth.h"

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "no_alloc.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;
using Contacts = std::vector<std::pair<Vector3d, Vector3d>>;

const Vector3d kDown = -Vector3d::UnitZ();

ContactTruth Truth(const Contacts& contacts) {
  ContactTruth truth;
  for (const auto& [p, normal] : contacts) truth.Add(normal, normal, p);
  return truth;
}

/** A unit vector, turned about y from straight down. */
Vector3d Tilted(double degrees) {
  const double angle = degrees * std::numbers::pi / 180;
  return {std::sin(angle), 0, -std::cos(angle)};
}

TEST(ContactTruthTest, NoContact) {
  ContactTruth dut;
  EXPECT_TRUE(dut.ToVector().isZero(0));
  // Touching without a force, or with one that pulls, is none.
  dut.Add(Vector3d::Zero(), kDown);
  dut.Add(Vector3d(1, 0, 0), kDown);
  dut.Add(-kDown, kDown);
  EXPECT_TRUE(dut.ToVector().isZero(0));
}

TEST(ContactTruthTest, CountsIndependentNormals) {
  ContactTruth dut;
  dut.Add(2 * Tilted(0) + Vector3d(0, 0.5, 0), Tilted(0));
  EXPECT_EQ(dut.dimension(), 1);
  EXPECT_EQ(dut.force(), Vector3d(0, 0.5, -2)) << "friction included";
  EXPECT_EQ(dut.CalcNormal(), kDown);
  // However often the same normal comes.
  for (int i = 0; i < 9; ++i) dut.Add(2 * Tilted(9.9), Tilted(9.9));
  EXPECT_EQ(dut.dimension(), 1);
  dut.Add(2 * Tilted(10.1), Tilted(10.1));
  EXPECT_EQ(dut.dimension(), 2);
  dut.Add(Tilted(60), Tilted(60));
  EXPECT_EQ(dut.dimension(), 2) << "in the plane of the others";
  dut.Add(Vector3d::UnitY(), Vector3d::UnitY());
  EXPECT_EQ(dut.dimension(), 3);
  dut.Add(Vector3d::UnitX(), Vector3d::UnitX());
  EXPECT_EQ(dut.dimension(), 3);
}

TEST(ContactTruthTest, TheNormalIsThatOfTheNormalForces) {
  ContactTruth dut;
  dut.Add(Vector3d(0.3, 0.4, -3), kDown);
  dut.Add(Vector3d(4, 1, -1), Vector3d::UnitX());
  EXPECT_LT((dut.CalcNormal() - Vector3d(0.8, 0, -0.6)).norm(), 1e-15);
  EXPECT_LT((dut.force() - Vector3d(4.3, 1.4, -4)).norm(), 1e-15);
  // Squeezed from both sides there is no such direction.
  ContactTruth between;
  between.Add(kDown, kDown);
  between.Add(-kDown, -kDown);
  EXPECT_EQ(between.CalcNormal(), Vector3d::Zero());
  EXPECT_EQ(between.dimension(), 1);
}

// Points on a table 0.4 m high.
Contacts OnTheTable(const std::vector<Eigen::Vector2d>& points) {
  Contacts contacts;
  for (const auto& point : points) {
    contacts.emplace_back(Vector3d(point.x(), point.y(), 0.4), kDown);
  }
  return contacts;
}

TEST(ContactTruthTest, NoContactOrOneBlocksNothing) {
  EXPECT_EQ(ContactTruth().moment_dimension(), 0);
  EXPECT_EQ(ContactTruth().CalcFreeAxis(), Vector3d::Zero());
  const ContactTruth one = Truth(OnTheTable({{0.5, 0.1}}));
  EXPECT_EQ(one.moment_dimension(), 0);
  EXPECT_EQ(one.CalcFreeAxis(), Vector3d::Zero());
}

TEST(ContactTruthTest, AnEdgeBlocksOneRotation) {
  EXPECT_EQ(Truth(OnTheTable({{0.5, 0.1}, {0.5, 0.16}})).moment_dimension(), 1);
  // And so do more points on the same line.
  const ContactTruth line =
      Truth(OnTheTable({{0.5, 0.1}, {0.5, 0.16}, {0.5, 0.13}, {0.5, 0}}));
  EXPECT_EQ(line.moment_dimension(), 1);
  EXPECT_EQ(line.CalcFreeAxis(), Vector3d::Zero());
}

TEST(ContactTruthTest, AFaceLeavesRotationAboutItsNormal) {
  for (const auto& points : std::vector<std::vector<Eigen::Vector2d>>{
           {{0.5, 0.1}, {0.5, 0.16}, {0.56, 0.1}},
           {{0.56, 0.1}, {0.5, 0.16}, {0.5, 0.1}},
           {{0.5, 0.1}, {0.5, 0.16}, {0.56, 0.1}, {0.56, 0.16}}}) {
    const ContactTruth dut = Truth(OnTheTable(points));
    EXPECT_EQ(dut.moment_dimension(), 2);
    // On the side of the normals.
    EXPECT_LT((dut.CalcFreeAxis() - kDown).norm(), 1e-14);
  }
}

TEST(ContactTruthTest, PointsAtOnePlaceCountOnce) {
  EXPECT_EQ(Truth(OnTheTable({{0.5, 0.1}, {0.5, 0.1009}})).moment_dimension(),
            0);
  EXPECT_EQ(Truth(OnTheTable({{0.5, 0.1}, {0.5, 0.1011}})).moment_dimension(),
            1);
}

// A point on the floor and one at a wall: forces alone do what they can.
TEST(ContactTruthTest, PointsOfDifferentSurfacesBlockNoMoment) {
  Contacts contacts = OnTheTable({{0.5, 0.1}});
  contacts.emplace_back(Vector3d(0.5, 0.2, 0.45), Vector3d::UnitY());
  EXPECT_EQ(Truth(contacts).moment_dimension(), 0);
  // Two more at the wall make it a face.
  contacts.emplace_back(Vector3d(0.53, 0.2, 0.45), Vector3d::UnitY());
  EXPECT_EQ(Truth(contacts).moment_dimension(), 1);
  contacts.emplace_back(Vector3d(0.5, 0.2, 0.48), Vector3d::UnitY());
  const ContactTruth dut = Truth(contacts);
  EXPECT_EQ(dut.moment_dimension(), 2);
  EXPECT_NEAR(std::abs(dut.CalcFreeAxis().y()), 1, 1e-14);
}

// Faces in a corner leave nothing.
TEST(ContactTruthTest, TwoFacesBlockAllRotations) {
  Contacts contacts = OnTheTable({{0.5, 0.1}, {0.5, 0.16}, {0.56, 0.1}});
  for (const auto& [x, z] : {std::pair(0.5, 0.45), {0.53, 0.45}}) {
    contacts.emplace_back(Vector3d(x, 0.2, z), Vector3d::UnitY());
  }
  const ContactTruth dut = Truth(contacts);
  EXPECT_EQ(dut.moment_dimension(), 3);
  EXPECT_EQ(dut.CalcFreeAxis(), Vector3d::Zero());
}

TEST(ContactTruthTest, DoesNotAllocate) {
  const Contacts contacts =
      OnTheTable({{0.5, 0.1}, {0.5, 0.16}, {0.56, 0.1}, {0.56, 0.16}});
  ScopedNoAlloc guard;
  ContactTruth dut;
  for (const auto& [p, normal] : contacts) dut.Add(normal, normal, p);
  EXPECT_EQ(dut.ToVector()(10), 2);
  EXPECT_EQ(guard.count(), 0);
}

}  // namespace
}  // namespace dual_proxy
