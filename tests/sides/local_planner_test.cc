// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/sides/local_planner.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

LocalPlannerParams Scan() {
  return {.active = {{1, 2}, {3, 4}},
          .directions = {{0, 2, 0}, {0, 1, 1}},
          .force = {0, 0, -5},
          .scan_amplitude = {0, 0.02, 0},
          .scan_frequency = 0.5};
}

TEST(LocalPlannerTest, ScansAboutWhereTheToolWas) {
  const LocalPlanner dut(Scan());
  LocalPlannerState state = dut.MakeState();
  const Vector3d origin(0.4, 0.1, 0.3);
  ScopedNoAlloc guard;
  dut.Update(0.999, origin, true, &state);
  EXPECT_EQ(state.output.selection, Matrix3d::Zero());
  dut.Update(1, origin, true, &state);
  EXPECT_EQ(state.output.position, origin);
  dut.Update(1.25, {9, 9, 9}, true, &state);
  const double phase = std::numbers::pi / 4;
  const PlannerReference& output = state.output;
  EXPECT_TRUE(output.selection.isApprox(
      Matrix3d(Vector3d(0, 1, 1).asDiagonal()), 1e-12));
  EXPECT_NEAR(output.position.y(), 0.1 + 0.02 * std::sin(phase), 1e-12);
  EXPECT_NEAR(output.velocity.y(), 0.02 * std::numbers::pi * std::cos(phase),
              1e-12);
  EXPECT_EQ(output.force, Vector3d(0, 0, -5));
  dut.Update(2, origin, true, &state);
  EXPECT_EQ(state.output.selection, Matrix3d::Zero());
  EXPECT_EQ(guard.count(), 0);
}

TEST(LocalPlannerTest, LetsGoAndStartsAnew) {
  const LocalPlanner dut(Scan());
  LocalPlannerState state = dut.MakeState();
  dut.Update(3, {1, 0, 0}, true, &state);
  dut.Update(3.1, {1, 0, 0}, false, &state);
  EXPECT_EQ(state.output.selection, Matrix3d::Zero());
  dut.Update(3.2, {2, 0, 0}, true, &state);
  EXPECT_EQ(state.output.position, Vector3d(2, 0, 0));
}

TEST(LocalPlannerTest, ParamsAreChecked) {
  EXPECT_EQ(ValidationError(Scan()), "no exception");
  EXPECT_FALSE(LocalPlanner().enabled());
  LocalPlannerParams params = Scan();
  params.active = {{2, 1}};
  EXPECT_EQ(ValidationError(params),
            "LocalPlannerParams: field `active[0][1]` expected a finite "
            "value > its start = 2, got 1");
  params = Scan();
  params.directions = {{0, 0, 0}};
  EXPECT_NE(ValidationError(params).find("`directions[0]`"), std::string::npos);
  params.directions.clear();
  EXPECT_NE(ValidationError(params).find("`directions`"), std::string::npos);
  params.active.clear();
  EXPECT_EQ(ValidationError(params), "no exception");
  params.scan_frequency = -1;
  EXPECT_NE(ValidationError(params).find("`scan_frequency`"),
            std::string::npos);
}

}  // namespace
}  // namespace dual_proxy
