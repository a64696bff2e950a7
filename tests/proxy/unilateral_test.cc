// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/unilateral.h"

#include <gtest/gtest.h>

#include "dual_proxy/common/random.h"
#include "no_alloc.h"
#include "test_support.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

TEST(RemovePullTest, LeavesAloneWhatPullsNowhere) {
  Matrix3d normals = Matrix3d::Zero();
  const Vector3d force(1, -2, 3);
  EXPECT_EQ(RemovePull(force, normals), force);
  normals.col(0) = Vector3d::UnitY();
  normals.col(2) = -Vector3d::UnitZ();
  EXPECT_EQ(RemovePull(force, normals), force);
}

TEST(RemovePullTest, RemovesThePullOnly) {
  Matrix3d normals = Matrix3d::Zero();
  normals.col(1) = Vector3d(0.6, 0.8, 0);
  const Vector3d kept = RemovePull({3, 4, 5}, normals);
  EXPECT_LT((kept - Vector3d(0, 0, 5)).norm(), 1e-12);
  // Of two walls one is pulled into: the push from the other stays.
  normals.col(0) = Vector3d::UnitX();
  normals.col(1) = -Vector3d::UnitZ();
  EXPECT_LT((RemovePull({-2, 1, -3}, normals) - Vector3d(-2, 1, 0)).norm(),
            1e-12);
}

// The nearest point of a cone: nothing pulls, what is removed is orthogonal to
// what is kept, and pushes along the normals.
TEST(RemovePullTest, IsTheNearestForceThatPullsNowhere) {
  RandomStream random(3);
  for (int i = 0; i < 5000; ++i) {
    Matrix3d normals = Matrix3d::Zero();
    const int count = 1 + i % 3;
    for (int k = 0; k < count; ++k) {
      normals.col(k) = RandomVector(1, &random).normalized();
    }
    const Vector3d force = RandomVector(5, &random);
    const ScopedNoAlloc guard;
    const Vector3d kept = RemovePull(force, normals);
    ASSERT_EQ(guard.count(), 0);
    const Vector3d removed = force - kept;
    ASSERT_LE((normals.transpose() * kept).maxCoeff(), 1e-8);
    ASSERT_NEAR(removed.dot(kept), 0, 1e-7);
    // Any other force that pulls nowhere is farther.
    for (int k = 0; k < 10; ++k) {
      const Vector3d other = RemovePull(RandomVector(5, &random), normals);
      ASSERT_GE((force - other).norm(), removed.norm() - 1e-8);
    }
  }
}

}  // namespace
}  // namespace dual_proxy
