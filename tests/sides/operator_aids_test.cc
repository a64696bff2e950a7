// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/sides/operator_aids.h"

#include <algorithm>

#include <gtest/gtest.h>

namespace dual_proxy {
namespace {

using Eigen::Vector3d;

constexpr double kPeriod = 0.001;
constexpr double kStiffness = 500;  // N/m: a scheme that gives back all.
constexpr double kDepth = 0.01;     // m.
constexpr double kStored = kStiffness * kDepth * kDepth / 2;

// J: what a hand has put in by the force that acted, after it pressed, asked
// for another scale while it was at rest, went back and moved on
// above the surface.
double PutIn(const OperatorAidsParams& params, double first, double then) {
  const OperatorAids dut(params);
  OperatorAidsState state = dut.MakeState();
  double put_in = 0;
  double before = 0;
  Vector3d force = Vector3d::Zero();
  for (int i = 0; i < 8000; ++i) {
    const double t = i * kPeriod;
    double z = 0;
    if (t > 2) z = -kDepth * std::min(1.0, t - 2);
    if (t > 5) z = std::min(0.08, -kDepth + 4 * kDepth * (t - 5));
    put_in -= force.z() * (z - before);
    Pose X_DH{.p = {0, 0, z}};
    Vector6 velocity = Vector6::Zero();
    velocity(2) = (z - before) / kPeriod;
    dut.FilterInput({.force_scale = t < 4 ? first : then}, &X_DH, &velocity,
                    &state);
    HapticSetpoint setpoint;
    setpoint.reference_force.z() = kStiffness * std::max(0.0, -z);
    dut.FilterSetpoint(&setpoint, &state);
    force = setpoint.reference_force + state.fixture_force;
    before = z;
  }
  return put_in;
}

TEST(OperatorAidsTest, HandPaysForWhatAGrowingForceGivesIt) {
  OperatorAidsParams params;
  params.buttons = true;
  params.max_damping = 0;
  EXPECT_NEAR(PutIn(params, 1, 2), -kStored, 0.02 * kStored);
  EXPECT_NEAR(PutIn(params, 0.5, 1), -kStored / 2, 0.02 * kStored);
  params.max_damping = 27;
  EXPECT_NEAR(PutIn(params, 1, 2), 0, 0.02 * kStored);
  EXPECT_NEAR(PutIn(params, 0.5, 1), 0, 0.02 * kStored);
}

// A gain that stays or falls takes nothing that a hand would have to pay for.
TEST(OperatorAidsTest, OtherwiseItPaysNothing) {
  OperatorAidsParams params;
  params.buttons = true;
  for (const double scale : {0.0, 0.5, 1.0, 2.0}) {
    EXPECT_NEAR(PutIn(params, scale, scale), 0, 0.02 * kStored) << scale;
  }
  EXPECT_NEAR(PutIn(params, 2, 1), kStored, 0.02 * kStored);
}

// The part that a scheme injects to stay passive is never made larger or less.
TEST(OperatorAidsTest, InjectionIsNotScaled) {
  OperatorAidsParams params;
  params.buttons = true;
  params.force_scale_rate = 1000;
  const OperatorAids dut(params);
  OperatorAidsState state = dut.MakeState();
  Pose X_DH;
  Vector6 velocity = Vector6::Zero();
  dut.FilterInput({.force_scale = 2}, &X_DH, &velocity, &state);
  HapticSetpoint setpoint;
  setpoint.reference_force = {3, 0, 0};
  setpoint.injected_force = {1, 0, 0};
  dut.FilterSetpoint(&setpoint, &state);
  EXPECT_EQ(setpoint.reference_force, Vector3d(5, 0, 0));
}

}  // namespace
}  // namespace dual_proxy
