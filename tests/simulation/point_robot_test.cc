// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/point_robot.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;

ContactSceneParams Floor() {
  ContactSceneParams scene;
  scene.surfaces.resize(1);  // Solid where z < 0; 5000 N/m.
  return scene;
}

// Semi-implicit Euler from rest: after n steps of h, x = F/m h^2 n (n + 1) / 2.
TEST(PointRobotTest, AcceleratesFreely) {
  PointRobotParams params;
  params.mass = 2;
  const PointRobot dut(params);
  PointRobotState state = dut.MakeState({1, 0, 0});
  const Vector3d force(4, -2, 1);
  for (int i = 0; i < 100; ++i) dut.Update(force, &state);
  const double h = 0.001 / 4;
  EXPECT_LT((state.velocity - force / 2 * 0.1).norm(), 1e-13);
  EXPECT_LT(
      (state.position - Vector3d(1, 0, 0) - force / 2 * h * h * 400 * 401 / 2)
          .norm(),
      1e-13);
}

TEST(PointRobotTest, PressesInEquilibrium) {
  const PointRobot dut({}, Floor());
  PointRobotState state = dut.MakeState();
  for (int i = 0; i < 3000; ++i) {
    dut.Update(Vector3d(0, 0, -8) - 40 * state.velocity, &state);
  }
  EXPECT_NEAR(state.position.z(), -8.0 / 5000, 1e-9);
  EXPECT_LT((state.contact.force - Vector3d(0, 0, -8)).norm(), 1e-5);
  EXPECT_EQ(state.contact.dimension, 1);
}

// A drop onto the floor: the bounce never returns more energy than there was,
// up to the integrator's error, which shrinks with the step.
TEST(PointRobotTest, BounceLosesEnergy) {
  ContactSceneParams scene = Floor();
  for (const double dissipation : {0.0, 5.0}) {
    scene.surfaces[0].dissipation = dissipation;
    const PointRobot dut({}, scene);
    PointRobotState state = dut.MakeState({0, 0, 0.005});
    state.velocity.z() = -0.2;
    for (int i = 0; i < 200; ++i) dut.Update(Vector3d::Zero(), &state);
    EXPECT_GT(state.velocity.z(), 0.02);
    EXPECT_LT(state.velocity.z(), dissipation == 0 ? 0.2005 : 0.15);
    EXPECT_EQ(state.contact.count, 0);
  }
}

TEST(PointRobotTest, ContactBelongsToTheCurrentPosition) {
  const PointRobot dut({}, Floor());
  PointRobotState state = dut.MakeState({0, 0, -0.001});
  EXPECT_NEAR(state.contact.force.z(), -5, 1e-12);
  dut.Update({0, 0, -3}, &state);
  EXPECT_EQ(state.contact.force,
            dut.scene().Calc(state.position, state.velocity).force);
}

TEST(PointRobotTest, BadForceActsAsZeroAndIsCounted) {
  const PointRobot dut({}, Floor());
  PointRobotState state = dut.MakeState({0, 0, -0.001});
  PointRobotState expected = state;
  dut.Update(Vector3d::Zero(), &expected);
  dut.Update({0, std::numeric_limits<double>::quiet_NaN(), 0}, &state);
  EXPECT_EQ(state.position, expected.position);
  EXPECT_EQ(state.velocity, expected.velocity);
  EXPECT_EQ(state.bad_inputs, 1);
}

TEST(PointRobotTest, CopyContinuesAlikeAndNothingIsAllocated) {
  const PointRobot dut({}, Floor());
  PointRobotState state = dut.MakeState({0, 0, -0.001});
  PointRobotState copy = state;
  ScopedNoAlloc guard;
  for (int i = 0; i < 10; ++i) dut.Update({1, 0, -8}, &state);
  EXPECT_EQ(guard.count(), 0);
  for (int i = 0; i < 10; ++i) dut.Update({1, 0, -8}, &copy);
  EXPECT_EQ(state.position, copy.position);
}

TEST(PointRobotTest, ErrorsNameFieldRangeAndValue) {
  const std::string who = "PointRobotParams: field `";
  PointRobotParams params;
  EXPECT_EQ(ValidationError(params), "no exception");
  params.mass = 0;
  EXPECT_EQ(ValidationError(params),
            who + "mass` expected a finite value > 0, got 0");
  EXPECT_THROW(PointRobot{params}, std::invalid_argument);
  params = {};
  params.period = -1;
  EXPECT_EQ(ValidationError(params),
            who + "period` expected a finite value > 0, got -1");
  params = {};
  params.substeps = 0;
  EXPECT_EQ(ValidationError(params),
            who + "substeps` expected a number in [1, 1000], got 0");
}

}  // namespace
}  // namespace dual_proxy
