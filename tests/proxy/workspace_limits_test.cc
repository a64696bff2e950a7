// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/workspace_limits.h"

#include <limits>

#include <gtest/gtest.h>

#include "no_alloc.h"
#include "test_support.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;
using Shape = WorkspaceLimitsParams::Shape;

WorkspaceLimits Make(Shape shape) {
  WorkspaceLimitsParams params;
  params.shape = shape;
  params.center = Vector3d(0.5, 0.0, 0.3);
  params.half_size = Vector3d(0.1, 0.2, 0.3);
  params.radius = 0.25;
  params.half_height = 0.15;
  return WorkspaceLimits(params);
}

TEST(WorkspaceLimitsTest, ByHand) {
  const Vector3d far(10.0, 0.0, 0.3);
  EXPECT_EQ(Make(Shape::kNone).Clamp(far), far);
  EXPECT_TRUE(Make(Shape::kBox).Clamp(far).isApprox(Vector3d(0.6, 0, 0.3)));
  EXPECT_TRUE(Make(Shape::kSphere).Clamp(far).isApprox(Vector3d(0.75, 0, 0.3)));
  EXPECT_TRUE(
      Make(Shape::kCylinder).Clamp(far).isApprox(Vector3d(0.75, 0, 0.3)));
  const Vector3d above(0.5, 0.0, 10.0);
  EXPECT_TRUE(Make(Shape::kBox).Clamp(above).isApprox(Vector3d(0.5, 0, 0.6)));
  EXPECT_TRUE(
      Make(Shape::kCylinder).Clamp(above).isApprox(Vector3d(0.5, 0, 0.45)));
}

TEST(WorkspaceLimitsTest, FlatShapesAreAllowed) {
  WorkspaceLimitsParams params;
  params.shape = Shape::kBox;
  params.half_size = Vector3d(1.0, 1.0, 0.0);
  EXPECT_EQ(WorkspaceLimits(params).Clamp({0.5, 5.0, 3.0}),
            Vector3d(0.5, 1.0, 0.0));
}

TEST(WorkspaceLimitsTest, ClampedIsInsideNearestAndNeverFarther) {
  RandomStream random(4);
  for (const Shape shape :
       {Shape::kNone, Shape::kBox, Shape::kSphere, Shape::kCylinder}) {
    const WorkspaceLimits dut = Make(shape);
    int outside = 0;
    for (int i = 0; i < 2000; ++i) {
      const Vector3d p = dut.params().center + RandomVector(0.2, &random);
      const Vector3d q = dut.params().center + RandomVector(0.2, &random);
      const Vector3d p_in = dut.Clamp(p);
      const Vector3d q_in = dut.Clamp(q);
      ASSERT_TRUE(dut.Contains(p_in)) << i;
      if (dut.Contains(p)) {
        ASSERT_LT((p_in - p).norm(), 1e-9) << i;
      } else {
        ++outside;
      }
      // A point of a convex set is the nearest one to p if and only if p is not
      // on the inner side of it, seen from any other point of the set.
      ASSERT_LE((p - p_in).dot(q_in - p_in), 1e-12) << i;
      ASSERT_LE((p_in - q_in).norm(), (p - q).norm() + 1e-15) << i;
    }
    EXPECT_EQ(outside > 100, shape != Shape::kNone);
  }
}

TEST(WorkspaceLimitsTest, InsideTheSameBitsComeBack) {
  RandomStream random(5);
  for (const Shape shape : {Shape::kBox, Shape::kSphere, Shape::kCylinder}) {
    const WorkspaceLimits dut = Make(shape);
    for (int i = 0; i < 1000; ++i) {
      const Vector3d p = dut.params().center + RandomVector(0.01, &random);
      ASSERT_EQ(dut.Clamp(p), p);
    }
  }
}

TEST(WorkspaceLimitsTest, DoesNotAllocate) {
  const WorkspaceLimits dut = Make(Shape::kCylinder);
  Vector3d p(3, 4, 5);
  ScopedNoAlloc guard;
  p = dut.Clamp(p);
  EXPECT_EQ(guard.count(), 0);
  EXPECT_TRUE(dut.Contains(p));
}

TEST(WorkspaceLimitsParamsTest, InvalidParametersAreNamed) {
  const auto message = [](const WorkspaceLimitsParams& params) {
    return InvalidArgument([&] { WorkspaceLimits{params}; });
  };
  WorkspaceLimitsParams params;
  params.half_size.y() = -1.0;
  EXPECT_NE(message(params).find("WorkspaceLimitsParams: field `half_size["),
            std::string::npos);
  params = {};
  params.radius = 0.0;
  EXPECT_NE(message(params).find("`radius`"), std::string::npos);
  params = {};
  params.half_height = -0.1;
  EXPECT_NE(message(params).find("`half_height`"), std::string::npos);
  params = {};
  params.center.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(message(params).find("`center`"), std::string::npos);
}

}  // namespace
}  // namespace dual_proxy
