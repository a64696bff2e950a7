// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/contact_surface.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include <gtest/gtest.h>

#include "dual_proxy/common/random.h"
#include "dual_proxy/common/rotation.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;

ContactSurfaceParams OfShape(SurfaceShape shape, double length = 0) {
  ContactSurfaceParams params;
  params.shape = shape;
  params.length = length;
  return params;
}

ContactSurfaceParams Bore() {
  ContactSurfaceParams params = OfShape(SurfaceShape::kCylinder);
  params.hollow = true;
  return params;
}

// Their sizes are the defaults: 0.1 m.
const ContactSurfaceParams kAll[] = {
    OfShape(SurfaceShape::kHalfSpace),     OfShape(SurfaceShape::kBox),
    OfShape(SurfaceShape::kSphere),        OfShape(SurfaceShape::kCylinder),
    OfShape(SurfaceShape::kCylinder, 0.3), Bore(),
    OfShape(SurfaceShape::kCapsule, 0.3)};

// What the shapes' documentation says, and no more.
bool IsSolid(const ContactSurfaceParams& surface, const Vector3d& p_B) {
  const Vector3d p = surface.rotation.transpose() * (p_B - surface.position);
  const double axis_distance = std::hypot(p.y(), p.z());
  const double half_length = surface.length / 2;
  switch (surface.shape) {
    case SurfaceShape::kHalfSpace:
      return p.z() < 0;
    case SurfaceShape::kBox:
      return (p.cwiseAbs().array() < surface.half_size.array()).all();
    case SurfaceShape::kSphere:
      return p.norm() < surface.radius;
    case SurfaceShape::kCylinder:
      if (surface.hollow) return axis_distance > surface.radius;
      return axis_distance < surface.radius &&
             (half_length == 0 || std::abs(p.x()) < half_length);
    case SurfaceShape::kCapsule:
      return std::hypot(std::max(0.0, std::abs(p.x()) - half_length),
                        axis_distance) < surface.radius;
  }
  return false;
}

Vector3d DrawVector(double scale, RandomStream* random) {
  Vector3d value;
  for (double& entry : value) entry = scale * random->Normal();
  return value;
}

const Vector3d kZero = Vector3d::Zero();

TEST(ContactSurfaceTest, HalfSpaceAtRest) {
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

TEST(ContactSurfaceTest, SphereAndCapsuleAreRound) {
  const ContactSurface sphere(OfShape(SurfaceShape::kSphere));
  const Vector3d outward(0.48, -0.6, 0.64);
  const SurfaceContact contact = sphere.Calc(0.119 * outward, kZero, 0.02);
  EXPECT_NEAR(contact.penetration, 0.001, 1e-15);
  EXPECT_LT((contact.normal + outward).norm(), 1e-14);
  EXPECT_EQ(sphere.CalcDistance(kZero).value, -0.1);
  EXPECT_EQ(sphere.CalcDistance(kZero).normal.norm(), 1);

  const ContactSurface capsule(OfShape(SurfaceShape::kCapsule, 0.3));
  const SurfaceDistance side = capsule.CalcDistance({0.149, 0.03, -0.04});
  EXPECT_NEAR(side.value, -0.05, 1e-15);
  EXPECT_LT((side.normal - Vector3d(0, -0.6, 0.8)).norm(), 1e-13);
  const SurfaceDistance end = capsule.CalcDistance({-0.18, 0, 0.04});
  EXPECT_NEAR(end.value, -0.05, 1e-15);
  EXPECT_LT((end.normal - Vector3d(0.6, 0, -0.8)).norm(), 1e-13);
  EXPECT_EQ(capsule.CalcDistance({0.1, 0, 0}).normal.x(), 0);
}

TEST(ContactSurfaceTest, CylinderHasEnds) {
  const ContactSurface dut(OfShape(SurfaceShape::kCylinder, 0.3));
  const SurfaceDistance end = dut.CalcDistance({-0.17, 0.05, 0});
  EXPECT_NEAR(end.value, 0.02, 1e-15);
  EXPECT_EQ(end.normal, Vector3d(1, 0, 0));
  EXPECT_EQ(dut.CalcDistance({0.14, 0, 0.08}).normal, Vector3d(-1, 0, 0));
  EXPECT_EQ(dut.CalcDistance({0.13, 0, 0.09}).normal, Vector3d(0, 0, -1));
  const SurfaceDistance rim = dut.CalcDistance({0.153, 0, 0.104});
  EXPECT_NEAR(rim.value, 0.005, 1e-15);
  EXPECT_LT((rim.normal - Vector3d(-0.6, 0, -0.8)).norm(), 1e-13);
}

TEST(ContactSurfaceTest, BoreIsSolidOutside) {
  const ContactSurface dut(Bore());
  const SurfaceContact contact = dut.Calc({5, 0, 0.081}, kZero, 0.02);
  EXPECT_NEAR(contact.penetration, 0.001, 1e-15);
  EXPECT_EQ(contact.normal, Vector3d(0, 0, 1));
  EXPECT_LT(dut.Calc({5, 0, 0.079}, kZero, 0.02).penetration, 0);
  EXPECT_NEAR(dut.CalcDistance({0, 0, 0.15}).value, -0.05, 1e-15);
}

// Around each point there is an empty (or full) ball of just that size, and
// where the normal leads from its centre the solid begins (or ends).
TEST(ContactSurfaceTest, DistanceIsToTheNearestPointOfTheBoundary) {
  RandomStream random(3);
  int inside = 0;
  constexpr int kTrials = 7000;
  for (int i = 0; i < kTrials; ++i) {
    ContactSurfaceParams params = kAll[i % std::size(kAll)];
    params.position = DrawVector(0.1, &random);
    params.rotation = ExpRotation(DrawVector(1, &random));
    const Vector3d p = params.position + DrawVector(0.12, &random);
    const SurfaceDistance distance = ContactSurface(params).CalcDistance(p);
    ASSERT_EQ(IsSolid(params, p), distance.value < 0) << "trial " << i;
    if (distance.value < 0) ++inside;
    const Vector3d on_boundary = p + distance.value * distance.normal;
    const Vector3d step = 1e-9 * distance.normal;
    EXPECT_FALSE(IsSolid(params, on_boundary - step)) << "trial " << i;
    EXPECT_TRUE(IsSolid(params, on_boundary + step)) << "trial " << i;
    for (int j = 0; j < 100; ++j) {
      const Vector3d in_ball = p + (std::abs(distance.value) - 1e-9) *
                                       DrawVector(1, &random).normalized();
      EXPECT_EQ(IsSolid(params, in_ball), distance.value < 0) << "trial " << i;
    }
    if (::testing::Test::HasFailure()) FAIL();
  }
  EXPECT_GT(inside, kTrials / 4);
  EXPECT_LT(inside, 3 * kTrials / 4);
}

// From one feature of a shape to the next (face, edge, corner, rim, cap) the
// distance goes on without a jump, and so does, outside, the normal.
TEST(ContactSurfaceTest, NothingJumpsBetweenFeatures) {
  RandomStream random(4);
  for (int i = 0; i < 700; ++i) {
    const ContactSurface dut(kAll[i % std::size(kAll)]);
    const Vector3d start = DrawVector(0.15, &random);
    constexpr double kStep = 1e-4;
    const Vector3d step = kStep * DrawVector(1, &random).normalized();
    SurfaceDistance last = dut.CalcDistance(start);
    for (int j = 1; j < 2000; ++j) {
      const SurfaceDistance next = dut.CalcDistance(start + j * step);
      EXPECT_LE(std::abs(next.value - last.value), kStep * (1 + 1e-9));
      // Round an edge the normal turns by the step over the distance to it.
      constexpr double kClear = 0.01;
      if (last.value > kClear && !dut.params().hollow) {
        EXPECT_LE((next.normal - last.normal).norm(), kStep / kClear);
      }
      last = next;
    }
    if (::testing::Test::HasFailure()) FAIL() << "trial " << i;
  }
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
    return DrawVector(scale, &random);
  };
  int contacts = 0;
  for (int i = 0; i < 10000; ++i) {
    ContactSurfaceParams params = kAll[i % std::size(kAll)];
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
  for (const ContactSurfaceParams& params : kAll) {
    const ContactSurface dut(params);
    ScopedNoAlloc guard;
    dut.Calc({0, 0, 0.095}, {0.1, 0, 0}, 0.02);
    EXPECT_EQ(guard.count(), 0);
  }
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
  params.length = -1;
  EXPECT_EQ(ValidationError(params),
            who + "length` expected a finite value >= 0, got -1");
  EXPECT_EQ(ValidationError(OfShape(SurfaceShape::kCapsule)),
            who + "length` expected a finite value > 0, got 0");
  params = OfShape(SurfaceShape::kCylinder, 0.3);
  params.hollow = true;
  EXPECT_EQ(ValidationError(params),
            who + "hollow` expected 0 but for an endless cylinder, got 1");
  params = OfShape(SurfaceShape::kSphere);
  params.hollow = true;
  EXPECT_EQ(ValidationError(params),
            who + "hollow` expected 0 but for an endless cylinder, got 1");
  params = {};
  params.shape = static_cast<SurfaceShape>(5);
  EXPECT_EQ(ValidationError(params),
            who +
                "shape` expected one of \"half_space\", \"box\", \"sphere\", "
                "\"cylinder\", \"capsule\", got 5");
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
