// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/scene_params.h"

#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "validation_error.h"

namespace dual_proxy {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

SurfaceParams Box(const std::string& name) {
  return {.name = name,
          .shape = SurfaceShape::kBox,
          .size = Eigen::Vector3d(0.1, 0.2, 0.3)};
}

TEST(SceneParamsTest, DefaultsAreValid) {
  const SceneParams dut;
  EXPECT_EQ(ValidationError(dut), "no exception");
  EXPECT_EQ(ValidationError(Box("wall")), "no exception");
  EXPECT_EQ(dut.table_height, 0.10);
  EXPECT_EQ(dut.contact_height(), 0.10 + 0.010);
  EXPECT_EQ(dut.tool_mass, 0.2);
  EXPECT_EQ(dut.contact_approximation, ContactApproximation::kLagged);
}

// Corners all around E, as far below it as they are thick: E is in the face.
TEST(SceneParamsTest, AFlatToolHasItsPointInItsFace) {
  SceneParams dut;
  dut.tool = Tool::kFlat;
  dut.tool_size = 0.05;
  EXPECT_EQ(dut.contact_height(), dut.table_height);
  const std::vector<Eigen::Vector3d> corners = dut.Corners();
  ASSERT_EQ(corners.size(), 4u);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& corner : corners) {
    EXPECT_EQ(std::abs(corner.x()), 0.025);
    EXPECT_EQ(std::abs(corner.y()), 0.025);
    EXPECT_EQ(corner.z(), -kCornerRadius);
    sum += corner;
  }
  EXPECT_EQ(sum.head<2>(), Eigen::Vector2d::Zero());
}

TEST(SceneParamsTest, TableComesBeforeTheSurfaces) {
  SceneParams dut;
  dut.table_height = 0.4;
  dut.surfaces = {Box("wall"), Box("step")};
  const std::vector<SurfaceParams> all = dut.AllSurfaces();
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[0].name, "table");
  EXPECT_EQ(all[0].position, Eigen::Vector3d(0.5, 0.0, 0.2));
  EXPECT_EQ(*all[0].size, Eigen::Vector3d(0.6, 0.8, 0.4));
  EXPECT_EQ(ValidationError(all[0]), "no exception");
  EXPECT_EQ(all[1].name, "wall");
  EXPECT_EQ(all[2].name, "step");
  dut.table = false;
  ASSERT_EQ(dut.AllSurfaces().size(), 2u);
  EXPECT_EQ(dut.AllSurfaces()[0].name, "wall");
}

TEST(SceneParamsTest, ASurfaceHasAMaterialOfItsOwnOrTheScenes) {
  SceneParams dut;
  dut.contact_stiffness = 1e4;
  dut.contact_dissipation = 3;
  dut.friction = 0.5;
  dut.surfaces = {Box("wall"), Box("step"), Box("ice")};
  dut.surfaces[1].stiffness = 2e4;
  dut.surfaces[1].dissipation = 0;
  dut.surfaces[2].friction = 0;
  const std::vector<ContactSurfaceParams> all = dut.ContactSurfaces();
  ASSERT_EQ(all.size(), 4u);
  const double stiffness[] = {1e4, 1e4, 2e4, 1e4};
  const double dissipation[] = {3, 3, 0, 3};
  const double friction[] = {0.5, 0.5, 0.5, 0};
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(all[i].stiffness, stiffness[i]);
    EXPECT_EQ(all[i].dissipation, dissipation[i]);
    EXPECT_EQ(all[i].friction, friction[i]);
  }
}

TEST(SceneParamsTest, ASurfacesGeometryIsAsItSays) {
  SceneParams dut;
  dut.table = false;
  const Eigen::Vector3d p(0.4, 0.1, 0.2);
  const Eigen::Vector3d quarter(0, 0, std::numbers::pi / 2);
  dut.surfaces = {{.name = "block",
                   .shape = SurfaceShape::kBox,
                   .position = p,
                   .rotation = quarter,
                   .size = Eigen::Vector3d(0.1, 0.2, 0.4)},
                  {.name = "bore",
                   .shape = SurfaceShape::kCylinder,
                   .radius = 0.05,
                   .length = 0.0,
                   .hollow = true}};
  EXPECT_EQ(ValidationError(dut), "no exception");
  const std::vector<ContactSurfaceParams> all = dut.ContactSurfaces();
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].shape, SurfaceShape::kBox);
  EXPECT_EQ(all[0].position, p);
  EXPECT_TRUE(all[0].rotation.col(0).isApprox(Eigen::Vector3d::UnitY(), 1e-15));
  EXPECT_EQ(all[0].half_size, Eigen::Vector3d(0.05, 0.1, 0.2));
  EXPECT_EQ(all[1].shape, SurfaceShape::kCylinder);
  EXPECT_EQ(all[1].rotation, Eigen::Matrix3d::Identity());
  EXPECT_EQ(all[1].radius, 0.05);
  EXPECT_EQ(all[1].length, 0);
  EXPECT_TRUE(all[1].hollow);
}

TEST(SceneParamsTest, EveryFieldIsChecked) {
  const auto error = [](const auto& change) {
    SceneParams dut;
    change(&dut);
    const std::string message = ValidationError(dut);
    const std::string who = "SceneParams: field `";
    return message.starts_with(who) ? message.substr(who.size()) : message;
  };
  using P = SceneParams;
  EXPECT_EQ(error([](P* p) { p->table_height = 0; }),
            "table_height` expected a number in [0.001, 1.5], got 0");
  EXPECT_EQ(error([](P* p) { p->table_center(1) = kNan; }),
            "table_center` expected finite values, got [0.5, nan]");
  EXPECT_EQ(error([](P* p) { p->table_size(1) = 11; }),
            "table_size[1]` expected a number in [0.001, 10], got 11");
  EXPECT_EQ(error([](P* p) { p->friction = -1; }),
            "friction` expected a number in [0, 5], got -1");
  EXPECT_EQ(error([](P* p) { p->contact_stiffness = 0; }),
            "contact_stiffness` expected a number in [1, 1e+08], got 0");
  EXPECT_EQ(error([](P* p) { p->contact_dissipation = 2000; }),
            "contact_dissipation` expected a number in [0, 1000], got 2000");
  EXPECT_EQ(error([](P* p) { p->relaxation_time = 11; }),
            "relaxation_time` expected a number in [0, 10], got 11");
  EXPECT_EQ(error([](P* p) { p->time_step = 0.1; }),
            "time_step` expected a number in [1e-05, 0.01], got 0.1");
  EXPECT_EQ(error([](P* p) { p->tool_size = 0.3; }),
            "tool_size` expected a number in [0.005, 0.2], got 0.3");
  EXPECT_EQ(error([](P* p) { p->tool_mass = 0; }),
            "tool_mass` expected a number in [0.001, 3], got 0");
  EXPECT_EQ(error([](P* p) { p->gravity = kNan; }),
            "gravity` expected a number in [0, 100], got nan");
  EXPECT_EQ(error([](P* p) { p->start_position(2) = 3; }),
            "start_position[2]` expected a number in [-2, 2], got 3");
}

TEST(SceneParamsTest, SurfacesAreChecked) {
  const auto error = [](const auto& change) {
    SceneParams dut;
    dut.surfaces = {Box("a")};
    change(&dut.surfaces[0]);
    const std::string message = ValidationError(dut);
    const std::string who = "SurfaceParams: field `";
    return message.starts_with(who) ? message.substr(who.size()) : message;
  };
  using S = SurfaceParams;
  using enum SurfaceShape;
  EXPECT_EQ(error([](S* s) { s->position(0) = kNan; }),
            "position` expected finite values, got [nan, 0, 0]");
  EXPECT_EQ(error([](S* s) { (*s->size)(2) = 0; }),
            "size[2]` expected a number in [0.0001, 10], got 0");
  EXPECT_EQ(error([](S* s) { s->rotation(1) = kNan; }),
            "rotation` expected finite values, got [0, nan, 0]");
  EXPECT_EQ(error([](S* s) { s->color(3) = 1.5; }),
            "color[3]` expected a number in [0, 1], got 1.5");
  EXPECT_EQ(error([](S* s) { s->stiffness = 0; }),
            "stiffness` expected a number in [1, 1e+08], got 0");
  EXPECT_EQ(error([](S* s) { s->dissipation = -1; }),
            "dissipation` expected a number in [0, 1000], got -1");
  EXPECT_EQ(error([](S* s) { s->friction = 6; }),
            "friction` expected a number in [0, 5], got 6");
  EXPECT_EQ(error([](S* s) { s->radius = 0.1; }),
            "radius` expected none, as a box has no use for it, got a value");
  EXPECT_EQ(error([](S* s) { s->length = 0.1; }),
            "length` expected none, as a box has no use for it, got a value");
  EXPECT_EQ(error([](S* s) { s->hollow = true; }),
            "hollow` expected false, as this is no cylinder of length 0, got "
            "true");
  EXPECT_EQ(error([](S* s) { s->shape = kHalfSpace; }),
            "size` expected none, as a half_space has no use for it, got a "
            "value");
  EXPECT_EQ(error([](S* s) {
              s->shape = kSphere;
              s->size.reset();
            }),
            "radius` expected a value, as a sphere needs it, got none");
  EXPECT_EQ(error([](S* s) {
              s->shape = kCylinder;
              s->size.reset();
              s->radius = 0.1;
            }),
            "length` expected a value, as a cylinder needs it, got none");
  EXPECT_EQ(error([](S* s) {
              s->shape = kCapsule;
              s->size.reset();
              s->radius = 0.1;
              s->length = 0;
            }),
            "length` expected a finite value > 0, got 0");
}

TEST(SceneParamsTest, SurfacesHaveNamesOfTheirOwn) {
  for (const char* name : {"", "table", "a"}) {
    SceneParams dut;
    dut.surfaces = {Box("a"), Box(name)};
    EXPECT_EQ(ValidationError(dut),
              "SceneParams: field `surfaces` expected names used once, not "
              "empty and not 'table', got ['a', '" +
                  std::string(name) + "']");
  }
}

}  // namespace
}  // namespace dual_proxy
