// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/rotation_truth.h"

#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "no_alloc.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;
using Contacts = std::vector<std::pair<Vector3d, Vector3d>>;

const Vector3d kDown = -Vector3d::UnitZ();

RotationTruth Truth(const Contacts& contacts) {
  RotationTruth truth;
  for (const auto& [p, normal] : contacts) truth.Add(p, normal);
  return truth;
}

// Points on a table 0.4 m high.
Contacts OnTheTable(const std::vector<Eigen::Vector2d>& points) {
  Contacts contacts;
  for (const auto& point : points) {
    contacts.emplace_back(Vector3d(point.x(), point.y(), 0.4), kDown);
  }
  return contacts;
}

TEST(RotationTruthTest, NoContactOrOneBlocksNothing) {
  EXPECT_EQ(RotationTruth().dimension(), 0);
  EXPECT_EQ(RotationTruth().CalcFreeAxis(), Vector3d::Zero());
  const RotationTruth one = Truth(OnTheTable({{0.5, 0.1}}));
  EXPECT_EQ(one.dimension(), 0);
  EXPECT_EQ(one.CalcFreeAxis(), Vector3d::Zero());
}

TEST(RotationTruthTest, AnEdgeBlocksOneRotation) {
  EXPECT_EQ(Truth(OnTheTable({{0.5, 0.1}, {0.5, 0.16}})).dimension(), 1);
  // And so do more points on the same line.
  const RotationTruth line =
      Truth(OnTheTable({{0.5, 0.1}, {0.5, 0.16}, {0.5, 0.13}, {0.5, 0}}));
  EXPECT_EQ(line.dimension(), 1);
  EXPECT_EQ(line.CalcFreeAxis(), Vector3d::Zero());
}

TEST(RotationTruthTest, AFaceLeavesRotationAboutItsNormal) {
  for (const auto& points : std::vector<std::vector<Eigen::Vector2d>>{
           {{0.5, 0.1}, {0.5, 0.16}, {0.56, 0.1}},
           {{0.56, 0.1}, {0.5, 0.16}, {0.5, 0.1}},
           {{0.5, 0.1}, {0.5, 0.16}, {0.56, 0.1}, {0.56, 0.16}}}) {
    const RotationTruth dut = Truth(OnTheTable(points));
    EXPECT_EQ(dut.dimension(), 2);
    // On the side of the normals.
    EXPECT_LT((dut.CalcFreeAxis() - kDown).norm(), 1e-14);
  }
}

TEST(RotationTruthTest, PointsAtOnePlaceCountOnce) {
  EXPECT_EQ(Truth(OnTheTable({{0.5, 0.1}, {0.5, 0.1009}})).dimension(), 0);
  EXPECT_EQ(Truth(OnTheTable({{0.5, 0.1}, {0.5, 0.1011}})).dimension(), 1);
}

// A point on the floor and one at a wall: forces alone do what they can.
TEST(RotationTruthTest, PointsOfDifferentSurfacesBlockNoMoment) {
  Contacts contacts = OnTheTable({{0.5, 0.1}});
  contacts.emplace_back(Vector3d(0.5, 0.2, 0.45), Vector3d::UnitY());
  EXPECT_EQ(Truth(contacts).dimension(), 0);
  // Two more at the wall make it a face.
  contacts.emplace_back(Vector3d(0.53, 0.2, 0.45), Vector3d::UnitY());
  EXPECT_EQ(Truth(contacts).dimension(), 1);
  contacts.emplace_back(Vector3d(0.5, 0.2, 0.48), Vector3d::UnitY());
  const RotationTruth dut = Truth(contacts);
  EXPECT_EQ(dut.dimension(), 2);
  EXPECT_NEAR(std::abs(dut.CalcFreeAxis().y()), 1, 1e-14);
}

// Faces in a corner leave nothing.
TEST(RotationTruthTest, TwoFacesBlockAllRotations) {
  Contacts contacts = OnTheTable({{0.5, 0.1}, {0.5, 0.16}, {0.56, 0.1}});
  for (const auto& [x, z] : {std::pair(0.5, 0.45), {0.53, 0.45}}) {
    contacts.emplace_back(Vector3d(x, 0.2, z), Vector3d::UnitY());
  }
  const RotationTruth dut = Truth(contacts);
  EXPECT_EQ(dut.dimension(), 3);
  EXPECT_EQ(dut.CalcFreeAxis(), Vector3d::Zero());
}

TEST(RotationTruthTest, DoesNotAllocate) {
  const Contacts contacts =
      OnTheTable({{0.5, 0.1}, {0.5, 0.16}, {0.56, 0.1}, {0.56, 0.16}});
  ScopedNoAlloc guard;
  RotationTruth dut;
  for (const auto& [p, normal] : contacts) dut.Add(p, normal);
  EXPECT_EQ(dut.CalcFreeAxis().squaredNorm() > 0, true);
  EXPECT_EQ(guard.count(), 0);
}

}  // namespace
}  // namespace dual_proxy
