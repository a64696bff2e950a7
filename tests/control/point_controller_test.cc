// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/point_controller.h"

#include <limits>
#include <string>

#include <gtest/gtest.h>
#include <Eigen/Core>

#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
const Matrix3d kAlongZ{Vector3d::UnitZ().asDiagonal()};

PointControllerInput MakeInput() {
  return {.model = {.mass = 2},
          .v = {0.01, -0.02, 0.03},
          .motion_error = {0.004, 0.002, -0.001},
          .proxy_velocity = {0.02, 0.01, -0.01},
          .proxy_acceleration = {0.3, -0.1, 0.2}};
}

TEST(PointControllerTest, DefaultGainsAreThePapers) {
  const PointControllerParams params;
  EXPECT_EQ(params.position_stiffness, 100);
  EXPECT_EQ(params.position_damping, 20);
  EXPECT_EQ(params.force.gain, 1.3);
  EXPECT_EQ(params.force.integral_gain, 1.7);
  EXPECT_EQ(params.force.damping, 20);
}

TEST(PointControllerTest, FreeMotionFollowsTheProxy) {
  const PointController dut;
  PointControllerState state = dut.MakeState();
  const PointControllerInput input = MakeInput();
  const PointControllerOutput output = dut.Update(input, &state);
  const Vector3d acceleration = input.proxy_acceleration -
                                100 * input.motion_error -
                                20 * (input.v - input.proxy_velocity);
  EXPECT_LT((output.motion_force - acceleration).norm(), 1e-14);
  EXPECT_LT((output.force - 2 * acceleration).norm(), 1e-14);
  EXPECT_EQ(output.contact_force, Vector3d::Zero());
}

TEST(PointControllerTest, WithoutFeedForwardItIsEquation12) {
  PointControllerParams params;
  params.feed_forward = false;
  params.unit_mass_motion_force = false;
  const PointController dut(params);
  PointControllerState state = dut.MakeState();
  const PointControllerInput input = MakeInput();
  const PointControllerOutput output = dut.Update(input, &state);
  const Vector3d force = 2 * (-100 * input.motion_error - 20 * input.v);
  EXPECT_LT((output.force - force).norm(), 1e-14);
  EXPECT_EQ(output.motion_force, output.force);
}

TEST(PointControllerTest, TheErrorIsClosedNoFasterThanTheSpeedLimit) {
  PointControllerParams params;
  params.motion_speed_limit = 0.05;
  const PointController dut(params);
  PointControllerState state = dut.MakeState();
  const PointControllerOutput output =
      dut.Update({.motion_error = {0.2, 0, 0}}, &state);
  EXPECT_NEAR(output.force.x(), -20 * 0.05, 1e-14);
}

TEST(PointControllerTest, SpacesShareTheDirections) {
  const PointController dut;
  PointControllerState state = dut.MakeState();
  PointControllerInput input = MakeInput();
  input.force_selection = kAlongZ;
  input.reference_force = {0, 0, 5};
  input.sensed_force = {0.5, 0.5, 4};
  const PointControllerOutput output = dut.Update(input, &state);
  EXPECT_EQ(output.motion_force.z(), 0);
  EXPECT_NE(output.motion_force.x(), 0);
  // The first cycle: no integral yet but that of one period.
  ForceLoop loop(MakeForceLoopParams(dut.params()));
  ForceLoopState loop_state = loop.MakeState();
  const Vector3d expected =
      loop.Update(input.reference_force, input.sensed_force, input.v, kAlongZ,
                  kAlongZ, &loop_state);
  EXPECT_EQ(output.contact_force, expected);
  EXPECT_LT(
      (output.force - 2 * output.motion_force - output.contact_force).norm(),
      1e-14);
}

TEST(PointControllerTest, WithoutForceFeedbackTheReferenceIsCommanded) {
  const PointController dut;
  PointControllerState state = dut.MakeState();
  PointControllerInput input;
  input.force_selection = kAlongZ;
  input.force_feedback = false;
  input.sensor_ready = false;
  input.reference_force = {1, 2, 3};
  EXPECT_EQ(dut.Update(input, &state).force, Vector3d(0, 0, 3));
}

TEST(PointControllerTest, WithoutASensorNothingIsForceControlled) {
  const PointController dut;
  PointControllerState state = dut.MakeState();
  PointControllerInput input = MakeInput();
  const Vector3d free = dut.Update(input, &state).force;
  state = dut.MakeState();
  input.force_selection = kAlongZ;
  input.sensed_force = {0, 0, 50};
  input.sensor_ready = false;
  EXPECT_EQ(dut.Update(input, &state).force, free);
}

TEST(PointControllerTest, ForceIsLimitedInSizeAndRate) {
  PointControllerParams params;
  params.force_limit = 3;
  params.force_rate_limit = 2000;
  const PointController dut(params);
  PointControllerState state = dut.MakeState();
  const PointControllerInput input{.motion_error = {-0.06, 0, 0.08}};
  const Vector3d direction(0.6, 0, -0.8);
  EXPECT_LT((dut.Update(input, &state).force - 2 * direction).norm(), 1e-14);
  EXPECT_LT((dut.Update(input, &state).force - 3 * direction).norm(), 1e-14);
  EXPECT_EQ(state.force_limited, 2);
  EXPECT_EQ(state.rate_limited, 1);
}

TEST(PointControllerTest, RefusedCyclesFadeOut) {
  PointControllerParams params;
  params.force_rate_limit = 500;
  const PointController dut(params);
  PointControllerState state = dut.MakeState();
  const PointControllerInput good{.motion_error = {-0.02, 0, 0}};
  for (int i = 0; i < 4; ++i) dut.Update(good, &state);
  ASSERT_NEAR(state.force.x(), 2, 1e-14);
  const auto refuse = [&](auto&& change) {
    PointControllerInput bad = good;
    change(&bad);
    return dut.Update(bad, &state);
  };
  using I = PointControllerInput;
  const PointControllerOutput output =
      refuse([](I* input) { input->v.x() = kNan; });
  EXPECT_NEAR(output.force.x(), 1.5, 1e-14);
  EXPECT_EQ(output.motion_force, Vector3d::Zero());
  refuse([](I* input) { input->force_selection = 2 * kAlongZ; });
  refuse([](I* input) { input->model.mass = kNan; });
  refuse([](I* input) { input->sensed_force.y() = kNan; });
  EXPECT_EQ(refuse([](I* input) { input->motion_error.z() = kNan; }).force,
            Vector3d::Zero());
  EXPECT_EQ(state.bad_inputs, 5);
}

TEST(PointControllerTest, DoesNotAllocate) {
  const PointController dut;
  PointControllerState state = dut.MakeState();
  const PointControllerInput input = MakeInput();
  const ScopedNoAlloc guard;
  dut.Update(input, &state);
  EXPECT_EQ(guard.count(), 0);
}

TEST(PointControllerTest, ParamsNameTheirErrors) {
  PointControllerParams params;
  params.force_limit = 0;
  EXPECT_EQ(ValidationError(params),
            "PointControllerParams: field `force_limit` expected a finite "
            "value > 0, got 0");
  EXPECT_EQ(ValidationError(PointModelParams{.mass = 0}),
            "PointModelParams: field `mass` expected a finite value > 0, got "
            "0");
}

}  // namespace
}  // namespace dual_proxy
