// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/drake_scene.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "dual_proxy/common/random.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

SurfaceParams Wall(const std::string& name) {
  return {.name = name, .shape = SurfaceShape::kHalfSpace};
}

// The material of a contact, as Drake's documentation has it.
DrakeMaterial Combine(const DrakeMaterial& a, const DrakeMaterial& b) {
  const double stiffness = a.stiffness + b.stiffness;
  const double friction = a.friction + b.friction;
  return {
      .stiffness = a.stiffness * b.stiffness / stiffness,
      .dissipation = b.stiffness / stiffness * a.dissipation +
                     a.stiffness / stiffness * b.dissipation,
      .friction = friction == 0 ? 0 : 2 * a.friction * b.friction / friction,
      .relaxation_time = a.relaxation_time + b.relaxation_time};
}

TEST(DrakeSceneTest, EveryContactHasItsSurfacesMaterial) {
  RandomStream random(3);
  const auto decades = [&random](double low, double high) {
    return low * std::pow(high / low, random.Uniform());
  };
  for (int k = 0; k < 300; ++k) {
    SceneParams params;
    params.tool = k % 2 == 0 ? Tool::kSphere : Tool::kFlat;
    const double share = params.tool == Tool::kSphere ? 1 : 0.25;
    params.contact_stiffness = decades(1, 1e8);
    params.contact_dissipation = decades(1e-3, 1e3);
    params.friction = k % 3 == 0 ? 0 : decades(1e-3, 5);
    for (int i = 0; i < 5; ++i) {
      params.surfaces.push_back(Wall(std::to_string(i)));
      SurfaceParams& surface = params.surfaces.back();
      surface.stiffness = decades(1, 1e8);
      surface.dissipation = i == 0 ? 0 : decades(1e-3, 1e3);
      surface.friction = i == 1 ? 0 : decades(1e-3, 5);
    }
    ASSERT_EQ(ValidationError(params), "no exception");
    const DrakeScene dut = MakeDrakeScene(params);
    const std::vector<ContactSurfaceParams> expected = params.ContactSurfaces();
    ASSERT_EQ(dut.surfaces.size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const DrakeMaterial& material = dut.surfaces[i].material;
      EXPECT_GT(material.stiffness, 0);
      EXPECT_GE(material.dissipation, 0);
      EXPECT_GE(material.friction, 0);
      const DrakeMaterial contact = Combine(dut.ball, material);
      const auto expect_near = [](double value, double right) {
        EXPECT_NEAR(value, right, 1e-14 * right);
      };
      expect_near(contact.stiffness, share * expected[i].stiffness);
      expect_near(contact.dissipation, expected[i].dissipation);
      expect_near(contact.friction, expected[i].friction);
      expect_near(contact.relaxation_time, params.relaxation_time);
    }
    EXPECT_EQ(Combine(dut.ball, dut.surfaces[2].material).friction, 0);
  }
}

// So that scenes of one material are what they always were.
TEST(DrakeSceneTest, SurfacesThatAreAlikeShareTheSceneSMaterial) {
  SceneParams params;
  params.surfaces = {Wall("wall")};
  for (const Tool tool : {Tool::kSphere, Tool::kFlat}) {
    params.tool = tool;
    const DrakeScene dut = MakeDrakeScene(params);
    const double share = tool == Tool::kSphere ? 1 : 0.25;
    EXPECT_EQ(dut.ball.stiffness, 2 * 3e4 * share / (2 - share));
    EXPECT_EQ(dut.ball.dissipation, 10);
    EXPECT_EQ(dut.ball.friction, 0.3);
    for (const DrakeSurface& surface : dut.surfaces) {
      EXPECT_EQ(surface.material.stiffness, 2 * 3e4);
      EXPECT_EQ(surface.material.dissipation, 10);
      EXPECT_EQ(surface.material.friction, 0.3);
      EXPECT_EQ(surface.material.relaxation_time, 0.005);
    }
  }
}

TEST(DrakeSceneTest, CylindersLieAlongZ) {
  SceneParams params;
  params.table = false;
  const Eigen::Vector3d rotation(0.3, -0.2, 0.5);
  params.surfaces = {{.name = "pipe",
                      .shape = SurfaceShape::kCylinder,
                      .position = {1, 2, 3},
                      .rotation = rotation,
                      .radius = 0.1,
                      .length = 0.0},
                     {.name = "rod",
                      .shape = SurfaceShape::kCapsule,
                      .rotation = rotation,
                      .radius = 0.1,
                      .length = 0.3}};
  const Eigen::Vector3d x = params.ContactSurfaces()[0].rotation.col(0);
  const DrakeScene dut = MakeDrakeScene(params);
  ASSERT_EQ(dut.surfaces.size(), 2u);
  for (const DrakeSurface& surface : dut.surfaces) {
    EXPECT_EQ(surface.X_BG.R.col(2), x);
    EXPECT_NEAR(surface.X_BG.R.determinant(), 1, 1e-14);
  }
  EXPECT_EQ(dut.surfaces[0].X_BG.p, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(dut.surfaces[0].length, 20);
  EXPECT_EQ(dut.surfaces[1].length, 0.3);
}

TEST(DrakeSceneTest, SaysWhatDrakeHasNot) {
  SceneParams params;
  params.surfaces = {Wall("wall"),
                     {.name = "bore",
                      .shape = SurfaceShape::kCylinder,
                      .radius = 0.1,
                      .length = 0.0,
                      .hollow = true}};
  EXPECT_EQ(InvalidArgument([&] { MakeDrakeScene(params); }),
            "scene.surfaces[1].hollow: expected false with engine drake, which "
            "has no bore (engine bare has), got true");
  EXPECT_EQ(MakePicture(params).size(), 3u);
  params.surfaces.pop_back();
  params.model_directives = "/no/such/file";
  EXPECT_EQ(InvalidArgument([&] { MakeDrakeScene(params); }),
            "scene.model_directives: expected a file, got \"/no/such/file\"");
}

TEST(DrakeSceneTest, AHalfSpaceIsDrawnAsASlabBelowIt) {
  SceneParams params;
  params.table = false;
  params.surfaces = {Wall("floor")};
  const std::vector<DrakeSurface> picture = MakePicture(params);
  ASSERT_EQ(picture.size(), 1u);
  EXPECT_EQ(picture[0].shape, SurfaceShape::kBox);
  EXPECT_EQ(picture[0].X_BG.p.z() + picture[0].size.z() / 2, 0);
}

}  // namespace
}  // namespace dual_proxy
