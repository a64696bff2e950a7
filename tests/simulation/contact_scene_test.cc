// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/contact_scene.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "dual_proxy/common/rotation.h"
#include "dual_proxy/simulation/contact_truth.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;

const Vector3d kZero = Vector3d::Zero();

/** A plane through the origin whose normal INTO the surface is -z turned by
`rotation_vector`. */
ContactSurfaceParams Plane(const Vector3d& rotation_vector) {
  ContactSurfaceParams params;
  params.rotation = ExpRotation(rotation_vector);
  return params;
}

/** A floor (z < 0), and a wall that is solid where y > 0. */
ContactSceneParams InnerCorner() {
  ContactSceneParams params;
  params.surfaces = {Plane(kZero), Plane({std::numbers::pi / 2, 0, 0})};
  params.tool_radius = 0.02;
  return params;
}

TEST(ContactSceneTest, EmptySceneIsFreeSpace) {
  const SceneContact contact = ContactScene().Calc(kZero, kZero);
  EXPECT_EQ(contact.count, 0);
  EXPECT_EQ(contact.dimension, 0);
  EXPECT_EQ(contact.force, kZero);
  EXPECT_EQ(contact.normal, kZero);
}

TEST(ContactSceneTest, InnerCornerHasOneThenTwoDimensions) {
  const ContactScene dut(InnerCorner());
  EXPECT_EQ(dut.Calc({0, -0.1, 0.1}, kZero).dimension, 0);

  const SceneContact floor = dut.Calc({0, -0.1, 0.018}, kZero);
  EXPECT_EQ(floor.dimension, 1);
  EXPECT_EQ(floor.count, 1);
  EXPECT_EQ(floor.normal, Vector3d(0, 0, -1));

  const SceneContact corner = dut.Calc({0, -0.0192, 0.0194}, kZero);
  EXPECT_EQ(corner.dimension, 2);
  EXPECT_EQ(corner.count, 2);
  EXPECT_LT((corner.force - Vector3d(0, 4, -3)).norm(), 1e-11);
  EXPECT_LT((corner.normal - Vector3d(0, 0.8, -0.6)).norm(), 1e-11);
  EXPECT_LT((corner.normals.col(0) - Vector3d(0, 0, -1)).norm(), 1e-15);
  EXPECT_LT((corner.normals.col(1) - Vector3d(0, 1, 0)).norm(), 1e-15);
  EXPECT_NEAR(corner.normal_forces(0), 3, 1e-11);
  EXPECT_NEAR(corner.normal_forces(1), 4, 1e-11);
}

TEST(ContactSceneTest, ThreeWallsHaveThreeDimensions) {
  ContactSceneParams params = InnerCorner();
  params.surfaces.push_back(Plane({0, std::numbers::pi / 2, 0}));
  const ContactScene dut(params);
  EXPECT_EQ(dut.Calc({0.019, -0.019, 0.019}, kZero).dimension, 3);
}

TEST(ContactSceneTest, NearlyParallelNormalsAreOneDimension) {
  for (const double share : {0.95, 1.05}) {
    ContactSceneParams params;
    params.surfaces = {Plane(kZero),
                       Plane({share * ContactTruth::kIndependentAngle, 0, 0})};
    const SceneContact contact =
        ContactScene(params).Calc({0, 0, -0.001}, kZero);
    EXPECT_EQ(contact.count, 2);
    EXPECT_EQ(contact.dimension, share < 1 ? 1 : 2);
  }
}

TEST(ContactSceneTest, BadInputIsNoContact) {
  const ContactScene dut(InnerCorner());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(dut.Calc({0, nan, 0}, kZero).count, 0);
  const SceneContact contact = dut.Calc({0, 0, 0}, {nan, 0, 0});
  EXPECT_EQ(contact.count, 0);
  EXPECT_EQ(contact.force, kZero);
}

TEST(ContactSceneTest, DoesNotAllocate) {
  const ContactScene dut(InnerCorner());
  ScopedNoAlloc guard;
  dut.Calc({0, -0.0192, 0.0194}, {0.1, 0, 0});
  EXPECT_EQ(guard.count(), 0);
}

TEST(ContactSceneTest, ErrorsNameFieldRangeAndValue) {
  ContactSceneParams params = InnerCorner();
  EXPECT_EQ(ValidationError(params), "no exception");
  params.surfaces.resize(9);
  EXPECT_EQ(ValidationError(params),
            "ContactSceneParams: field `surfaces` expected at most 8 surfaces, "
            "got 9");
  EXPECT_THROW(ContactScene{params}, std::invalid_argument);
  params = InnerCorner();
  params.tool_radius = -1;
  EXPECT_EQ(ValidationError(params),
            "ContactSceneParams: field `tool_radius` expected a finite value "
            ">= 0, got -1");
  params = InnerCorner();
  params.surfaces[1].stiffness = 0;
  EXPECT_EQ(ValidationError(params),
            "ContactSurfaceParams: field `stiffness` expected a finite value > "
            "0, got 0");
}

}  // namespace
}  // namespace dual_proxy
