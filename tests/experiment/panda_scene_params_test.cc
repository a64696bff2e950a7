// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/panda_scene_params.h"

#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "validation_error.h"

namespace dual_proxy {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

BoxParams Box(const std::string& name) {
  BoxParams box;
  box.name = name;
  return box;
}

TEST(PandaSceneParamsTest, DefaultsAreValid) {
  const PandaSceneParams dut;
  EXPECT_EQ(ValidationError(dut), "no exception");
  EXPECT_EQ(ValidationError(BoxParams()), "no exception");
  EXPECT_EQ(dut.table_height, 0.10);
  EXPECT_EQ(dut.contact_height(), 0.10 + 0.010);
  EXPECT_EQ(dut.tool_mass, 0.2);
  EXPECT_EQ(dut.contact_approximation, ContactApproximation::kLagged);
}

// Corners all around E, as far below it as they are thick: E is in the face.
TEST(PandaSceneParamsTest, AFlatToolHasItsPointInItsFace) {
  PandaSceneParams dut;
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

TEST(PandaSceneParamsTest, TableComesBeforeTheBoxes) {
  PandaSceneParams dut;
  dut.table_height = 0.4;
  dut.boxes = {Box("wall"), Box("step")};
  const std::vector<BoxParams> all = dut.AllBoxes();
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[0].name, "table");
  EXPECT_EQ(all[0].center, Eigen::Vector3d(0.5, 0.0, 0.2));
  EXPECT_EQ(all[0].size, Eigen::Vector3d(0.6, 0.8, 0.4));
  EXPECT_EQ(all[1].name, "wall");
  EXPECT_EQ(all[2].name, "step");
}

TEST(PandaSceneParamsTest, EveryFieldIsChecked) {
  const auto error = [](const auto& change) {
    PandaSceneParams dut;
    change(&dut);
    const std::string message = ValidationError(dut);
    const std::string who = "PandaSceneParams: field `";
    return message.starts_with(who) ? message.substr(who.size()) : message;
  };
  using P = PandaSceneParams;
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

TEST(PandaSceneParamsTest, BoxesAreChecked) {
  const auto error = [](const auto& change) {
    PandaSceneParams dut;
    dut.boxes = {Box("a")};
    change(&dut.boxes[0]);
    return ValidationError(dut);
  };
  EXPECT_EQ(error([](BoxParams* b) { b->center(0) = kNan; }),
            "BoxParams: field `center` expected finite values, got [nan, 0, "
            "0.1]");
  EXPECT_EQ(error([](BoxParams* b) { b->size(2) = 0; }),
            "BoxParams: field `size[2]` expected a number in [0.0001, 10], "
            "got 0");
  EXPECT_EQ(error([](BoxParams* b) { b->yaw = kNan; }),
            "BoxParams: field `yaw` expected a finite value, got nan");
  EXPECT_EQ(error([](BoxParams* b) { b->color(3) = 1.5; }),
            "BoxParams: field `color[3]` expected a number in [0, 1], got "
            "1.5");
}

TEST(PandaSceneParamsTest, BoxesHaveNamesOfTheirOwn) {
  for (const char* name : {"", "table", "a"}) {
    PandaSceneParams dut;
    dut.boxes = {Box("a"), Box(name)};
    EXPECT_EQ(ValidationError(dut),
              "PandaSceneParams: field `boxes` expected names used once, not "
              "empty and not 'table', got ['a', '" +
                  std::string(name) + "']");
  }
}

}  // namespace
}  // namespace dual_proxy
