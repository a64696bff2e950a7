// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/contact_surface.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "dual_proxy/common/random.h"
#include "dual_proxy/common/rotation.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;

constexpr SurfaceShape kAll[] = {SurfaceShape::kPlane, SurfaceShape::kCylinder,
                                 SurfaceShape::kBox};

ContactSurfaceParams OfShape(SurfaceShape shape) {
  ContactSurfaceParams params;
  params.shape = shape;
  return params;
}

const Vector3d kZero = Vector3d::Zero();

TEST(ContactSurfaceTest, PlaneAtRest) {
  ContactSurfaceParams params;
  params.position = Vector3d(0, 0, 0.3);
  const ContactSurface dut(params);
  const SurfaceContact contact = dut.Calc({1, 2, 0.31}, kZero, 0.012);
  EXPECT_NEAR(contact.penetration, 0.002, 1e-15);
  EXPECT_EQ(contact.normal, Vector3d(0, 0, -1));
  EXPECT_NEAR(contact.normal_force, 10, 1e-11);
  EXPECT_LT((contact.force - Vector3d(0, 0, -10)).norm(), 1e-11);
}

TEST(ContactSurfaceTest, NoForceWithoutContact) {
  const ContactSurface dut;
  const SurfaceContact contact = dut.Calc({0, 0, 0.02}, {0, 0, -1}, 0.01);
  EXPECT_NEAR(contact.penetration, -0.01, 1e-15);
  EXPECT_EQ(contact.normal, Vector3d(0, 0, -1));
  EXPECT_EQ(contact.normal_force, 0);
  EXPECT_EQ(contact.force, kZero);
}

TEST(ContactSurfaceTest, CylinderPointsToItsAxis) {
  const ContactSurface dut(OfShape(SurfaceShape::kCylinder));
  const double angle = 0.6;
  const Vector3d outward(0, std::sin(angle), std::cos(angle));
  const SurfaceContact contact =
      dut.Calc(Vector3d(7, 0, 0) + 0.099 * outward, kZero, 0);
  EXPECT_NEAR(contact.penetration, 0.001, 1e-15);
  EXPECT_LT((contact.normal + outward).norm(), 1e-14);
  // On the axis every direction is as good; it is still a unit vector.
  EXPECT_EQ(dut.Calc(kZero, kZero, 0).normal.norm(), 1);
}

// From the top over the edge to the side the force turns without a jump.
TEST(ContactSurfaceTest, BoxHasFacesAndAnOuterEdge) {
  const ContactSurface dut(OfShape(SurfaceShape::kBox));
  EXPECT_EQ(dut.Calc({0, 0, 0.115}, kZero, 0.02).normal, Vector3d(0, 0, -1));
  EXPECT_EQ(dut.Calc({0, -0.115, 0}, kZero, 0.02).normal, Vector3d(0, 1, 0));
  const SurfaceContact edge = dut.Calc({0, 0.109, 0.112}, kZero, 0.02);
  EXPECT_NEAR(edge.penetration, 0.005, 1e-15);
  EXPECT_LT((edge.normal - Vector3d(0, -0.6, -0.8)).norm(), 1e-13);
  // Of a point inside the nearest face counts.
  const SurfaceContact inside = dut.Calc({0.01, 0.098, -0.05}, kZero, 0);
  EXPECT_NEAR(inside.penetration, 0.002, 1e-15);
  EXPECT_EQ(inside.normal, Vector3d(0, -1, 0));
}

TEST(ContactSurfaceTest, DissipationActsOnTheNormalForceOnly) {
  ContactSurfaceParams params;
  params.dissipation = 4;
  const ContactSurface dut(params);
  EXPECT_NEAR(dut.Calc({0, 0, -0.001}, {0, 0, -0.1}, 0).normal_force,
              5 * (1 + 4 * 0.1), 1e-12);
  // Leaving fast, the surface does not pull.
  EXPECT_EQ(dut.Calc({0, 0, -0.001}, {0, 0, 1}, 0).normal_force, 0);
  EXPECT_EQ(dut.Calc({0, 0, -0.001}, {0, 0, 1}, 0).force, kZero);
}

TEST(ContactSurfaceTest, FrictionDragsTheSurfaceAlong) {
  ContactSurfaceParams params;
  params.friction = 0.3;
  const ContactSurface dut(params);
  // Robot on surface: in the direction of sliding.
  EXPECT_LT(
      (dut.Calc({0, 0, -0.002}, {0.05, 0, 0}, 0).force - Vector3d(3, 0, -10))
          .norm(),
      1e-12);
  // At a tenth of the stiction speed, a tenth of the friction.
  EXPECT_LT((dut.Calc({0, 0, -0.002}, {0, -0.001, 0}, 0).force -
             Vector3d(0, -0.3, -10))
                .norm(),
            1e-12);
}

TEST(ContactSurfaceTest, InvariantsHoldForRandomContacts) {
  RandomStream random(8);
  const auto draw = [&random](double scale) {
    Vector3d value;
    for (double& entry : value) entry = scale * random.Normal();
    return value;
  };
  int contacts = 0;
  for (int i = 0; i < 10000; ++i) {
    ContactSurfaceParams params = OfShape(kAll[i % 3]);
    params.position = draw(0.1);
    params.rotation = ExpRotation(draw(1));
    params.friction = random.Uniform();
    const ContactSurface dut(params);
    const Vector3d p = draw(0.15);
    const Vector3d v = draw(0.1);
    const SurfaceContact contact = dut.Calc(p, v, 0.02);
    EXPECT_NEAR(contact.normal.norm(), 1, 1e-14);
    EXPECT_GE(contact.normal_force, 0);
    EXPECT_NEAR(contact.force.dot(contact.normal), contact.normal_force,
                1e-12 * (1 + contact.normal_force));
    const Vector3d friction =
        contact.force - contact.normal_force * contact.normal;
    EXPECT_LE(friction.norm(),
              params.friction * contact.normal_force * (1 + 1e-12) + 1e-12);
    EXPECT_GE(friction.dot(v), -1e-12 * (1 + contact.normal_force));
    if (contact.normal_force > 0) ++contacts;
    // The penetration grows along the normal, one for one.
    const double h = 1e-7;
    EXPECT_NEAR((dut.Calc(p + h * contact.normal, v, 0.02).penetration -
                 dut.Calc(p - h * contact.normal, v, 0.02).penetration) /
                    (2 * h),
                1, 1e-6)
        << "contact " << i;
    if (::testing::Test::HasFailure()) FAIL() << "contact " << i;
  }
  EXPECT_GT(contacts, 2000);
}

TEST(ContactSurfaceTest, DoesNotAllocate) {
  const ContactSurface dut(OfShape(SurfaceShape::kBox));
  ScopedNoAlloc guard;
  dut.Calc({0, 0, 0.115}, {0.1, 0, 0}, 0.02);
  EXPECT_EQ(guard.count(), 0);
}

TEST(ContactSurfaceTest, ErrorsNameFieldRangeAndValue) {
  using Params = ContactSurfaceParams;
  EXPECT_EQ(ValidationError(Params{}), "no exception");
  const std::string who = "ContactSurfaceParams: field `";
  for (const auto& [field, member] :
       {std::pair{"radius", &Params::radius},
        {"stiffness", &Params::stiffness},
        {"stiction_speed", &Params::stiction_speed}}) {
    Params params;
    params.*member = 0;
    EXPECT_EQ(ValidationError(params),
              who + field + "` expected a finite value > 0, got 0");
    EXPECT_THROW(ContactSurface{params}, std::invalid_argument);
  }
  for (const auto& [field, member] :
       {std::pair{"dissipation", &Params::dissipation},
        {"friction", &Params::friction}}) {
    Params params;
    params.*member = -1;
    EXPECT_EQ(ValidationError(params),
              who + field + "` expected a finite value >= 0, got -1");
  }
  Params params;
  params.half_size.y() = 0;
  EXPECT_EQ(ValidationError(params),
            who + "half_size[1]` expected a finite value > 0, got 0");
  params = {};
  params.shape = static_cast<SurfaceShape>(5);
  EXPECT_EQ(
      ValidationError(params),
      who + "shape` expected one of \"plane\", \"cylinder\", \"box\", got 5");
  params = {};
  params.rotation *= 2;
  EXPECT_NE(ValidationError(params).find("`rotation` expected a rotation"),
            std::string::npos);
  params = {};
  params.position.z() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(ValidationError(params),
            who + "position` expected finite values, got [0, 0, nan]");
}

}  // namespace
}  // namespace dual_proxy
