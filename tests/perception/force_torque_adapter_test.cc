// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/perception/force_torque_adapter.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "dual_proxy/common/random.h"
#include "dual_proxy/common/rotation.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;

class ForceTorqueAdapterTest : public ::testing::Test {
 protected:
  ForceTorqueAdapterTest() {
    params_.tool_mass = 0.4;
    params_.tool_com = Vector3d(0.01, -0.02, 0.06);
    input_.X_BE = {.p = Vector3d(0.4, 0, 0.3),
                   .R = ExpRotation({0.4, -1.2, 0.7})};
    input_.p_SE = Vector3d(0, 0, 0.1);
  }

  /** What the sensor measures while the tool, whose mass accelerates by `a`
  (m/s^2, in B), exerts `force` (N, in B) on something at E. */
  Vector6d Measure(const Vector3d& force, const Vector3d& a) const {
    const Eigen::Matrix3d R_SB = input_.X_BE.R.transpose();
    const Vector3d carried =
        R_SB * (params_.tool_mass * (a + 9.81 * Vector3d::UnitZ()));
    Vector6d measured;
    measured << R_SB * force + carried,
        input_.p_SE.cross(R_SB * force) + params_.tool_com.cross(carried);
    return measured;
  }

  void Rest(const ForceTorqueAdapter& dut, int samples,
            ForceTorqueAdapterState* state) {
    for (int i = 0; i < samples; ++i) dut.Update(input_, state);
  }

  ForceTorqueAdapterParams params_;
  ForceTorqueAdapterInput input_;
};

TEST_F(ForceTorqueAdapterTest, AnAcceleratingToolExertsNothing) {
  const ForceTorqueAdapter dut(params_);
  ForceTorqueAdapterState state = dut.MakeState();
  EXPECT_TRUE(state.ready);
  const Vector3d start = input_.X_BE.p;
  constexpr double kAmplitude = 0.02;
  constexpr double kFrequency = 30;  // rad/s: 18 m/s^2, 7 N.
  for (int i = 0; i < 500; ++i) {
    const double t = 0.001 * i;
    const Vector3d way(1, -0.5, 0.3);
    input_.X_BE.p = start + kAmplitude * std::sin(kFrequency * t) * way;
    // The mean acceleration of the two last periods is that of one before.
    const Vector3d a = -kAmplitude * kFrequency * kFrequency *
                       std::sin(kFrequency * (t - 0.001)) * way;
    input_.measured = Measure(Vector3d(0, 0, -5), a);
    dut.Update(input_, &state);
    if (i < 2) continue;
    EXPECT_LT((state.wrench.head<3>() - Vector3d(0, 0, -5)).norm(), 2e-3) << i;
    EXPECT_LT(state.wrench.tail<3>().norm(), 2e-3) << i;
  }
}

// A simulated plant, or an arm's state, may step less often than the sensor.
TEST_F(ForceTorqueAdapterTest, PosesThatComeInStepsAreNoJolts) {
  const ForceTorqueAdapter dut(params_);
  ForceTorqueAdapterState state = dut.MakeState();
  const double start = input_.X_BE.p.x();
  input_.measured = Measure(Vector3d::Zero(), Vector3d::Zero());
  for (int i = 0; i < 500; ++i) {
    input_.X_BE.p.x() = start + 0.1 * (i / 4) * 0.004;
    dut.Update(input_, &state);
    ASSERT_LT(state.wrench.norm(), 1e-6) << i;
  }
}

// The state of a plant that steps every 1.5 ms, read every 1 ms: the poses are
// 0, 1, 1, 2, ... steps apart, and only the velocity tells how fast that is.
TEST_F(ForceTorqueAdapterTest, TheVelocityTellsWhatUnevenPosesDoNot) {
  constexpr double kSpeed = 0.2;
  constexpr double kAcceleration = 2;
  const ForceTorqueAdapter dut(params_);
  ForceTorqueAdapterState state = dut.MakeState();
  const double start = input_.X_BE.p.x();
  input_.measured =
      Measure(Vector3d::Zero(), kAcceleration * Vector3d::UnitX());
  double worst = 0;
  for (int i = 0; i < 500; ++i) {
    const double t = 0.0015 * std::floor(i / 1.5);
    input_.X_BE.p.x() = start + kSpeed * t + 0.5 * kAcceleration * t * t;
    Vector6d v_BE = Vector6d::Zero();
    v_BE(0) = kSpeed + kAcceleration * t;
    input_.v_BE = v_BE;
    dut.Update(input_, &state);
    if (i > 3) worst = std::max(worst, state.wrench.head<3>().norm());
  }
  // An acceleration is at most half as large again, as it seems to take 1 ms.
  EXPECT_LT(worst, 0.51 * params_.tool_mass * kAcceleration);
}

TEST_F(ForceTorqueAdapterTest, PosesThatAreMissingAreNoJolts) {
  const ForceTorqueAdapter dut(params_);
  ForceTorqueAdapterState state = dut.MakeState();
  const double start = input_.X_BE.p.x();
  input_.measured = Measure(Vector3d::Zero(), Vector3d::Zero());
  for (int i = 0; i < 500; ++i) {
    const bool missing = i % 100 >= 60;  // 40 ms at 0.1 m/s.
    if (!missing) input_.X_BE.p.x() = start + 0.1 * i * 0.001;
    dut.Update(input_, &state);
    ASSERT_LT(state.wrench.norm(), 1e-6) << i;
  }
}

TEST_F(ForceTorqueAdapterTest, AWrenchThatIsTooOldIsNone) {
  const ForceTorqueAdapter dut(params_);
  ForceTorqueAdapterState state = dut.MakeState();
  const Vector6d pressed = Measure(Vector3d(0, 0, -5), Vector3d::Zero());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto outage = [&](int samples) {
    input_.measured.setConstant(nan);
    Rest(dut, samples, &state);
  };
  input_.measured = pressed;
  Rest(dut, 100, &state);
  const Vector6d wrench = state.wrench;
  outage(10);
  EXPECT_TRUE(state.ready);
  EXPECT_EQ(state.wrench, wrench);
  outage(1);
  EXPECT_FALSE(state.ready);
  EXPECT_TRUE(state.wrench.isZero(0));
  input_.measured = pressed;
  Rest(dut, 1, &state);
  EXPECT_TRUE(state.ready);
  EXPECT_LT((state.wrench - wrench).norm(), 1e-9);
}

TEST_F(ForceTorqueAdapterTest, LearnsTheBiasAtRestAndIsBlindUntilThen) {
  params_.tare = true;
  const ForceTorqueAdapter dut(params_);
  ForceTorqueAdapterState state = dut.MakeState();
  Vector6d bias;
  bias << 1.4, -0.4, 1.7, 0.1, 0, -0.2;
  input_.measured = Measure(Vector3d::Zero(), Vector3d::Zero()) + bias;
  Rest(dut, 500, &state);
  EXPECT_FALSE(state.ready);
  EXPECT_TRUE(state.wrench.isZero(0));
  Rest(dut, 1, &state);  // The first sample has none before it to compare with.
  EXPECT_TRUE(state.ready);
  EXPECT_LT((state.bias - bias).norm(), 1e-12);
  EXPECT_LT(state.wrench.norm(), 1e-12);
  input_.measured += Measure(Vector3d(0, 3, 0), Vector3d::Zero()) -
                     Measure(Vector3d::Zero(), Vector3d::Zero());
  Rest(dut, 1, &state);
  EXPECT_LT((state.wrench.head<3>() - Vector3d(0, 3, 0)).norm(), 1e-12);
}

TEST_F(ForceTorqueAdapterTest, WhatMovesIsNotTared) {
  params_.tare = true;
  const ForceTorqueAdapter dut(params_);
  ForceTorqueAdapterState state = dut.MakeState();
  for (int i = 0; i < 3000; ++i) {
    input_.X_BE.p.x() += 1e-5;  // 10 mm/s.
    dut.Update(input_, &state);
  }
  EXPECT_FALSE(state.ready);
  EXPECT_EQ(state.tares_refused, 0);
}

TEST_F(ForceTorqueAdapterTest, AForceOrNoiseThatIsNoBiasIsRefused) {
  params_.tare = true;
  const ForceTorqueAdapter dut(params_);
  ForceTorqueAdapterState state = dut.MakeState();
  input_.measured = Measure(Vector3d(0, 0, -10.5), Vector3d::Zero());
  Rest(dut, 1001, &state);
  EXPECT_FALSE(state.ready);
  EXPECT_EQ(state.tares_refused, 2);
  RandomStream random(1);
  const Vector6d still = Measure(Vector3d::Zero(), Vector3d::Zero());
  for (int i = 0; i < 500; ++i) {
    input_.measured = still;
    input_.measured(1) += 1.2 * random.Normal();
    dut.Update(input_, &state);
  }
  EXPECT_EQ(state.tares_refused, 3);
  input_.measured = still;
  Rest(dut, 500, &state);
  EXPECT_TRUE(state.ready);
}

TEST_F(ForceTorqueAdapterTest, TaresAgainWhenAsked) {
  const ForceTorqueAdapter dut(params_);
  ForceTorqueAdapterState state = dut.MakeState();
  input_.measured = Measure(Vector3d(0, 0, 2), Vector3d::Zero());
  Rest(dut, 10, &state);
  EXPECT_NEAR(state.wrench(2), 2, 1e-12);
  input_.tare = true;
  Rest(dut, 1, &state);
  EXPECT_FALSE(state.ready);
  Rest(dut, 500, &state);
  EXPECT_TRUE(state.ready);
  EXPECT_EQ(state.tares, 1);
  EXPECT_NEAR(state.wrench(2), 0, 1e-12);
  // Asked once, tared once.
  Rest(dut, 1000, &state);
  EXPECT_EQ(state.tares, 1);
}

TEST_F(ForceTorqueAdapterTest, BadInputHoldsTheOutputAndNothingIsAllocated) {
  const ForceTorqueAdapter dut(params_);
  ForceTorqueAdapterState state = dut.MakeState();
  input_.measured = Measure(Vector3d(1, 2, 3), Vector3d::Zero());
  ScopedNoAlloc guard;
  Rest(dut, 5, &state);
  const Vector6d before = state.wrench;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (double* value : {&input_.measured(2), &input_.X_BE.p(0),
                        &input_.X_BE.R(1, 1), &input_.p_SE(0)}) {
    const double good = *value;
    *value = nan;
    Rest(dut, 1, &state);
    *value = good;
  }
  EXPECT_EQ(state.wrench, before);
  EXPECT_EQ(state.bad_inputs, 4);
  // What moved meanwhile is no acceleration.
  input_.X_BE.p.x() += 0.1;
  Rest(dut, 1, &state);
  EXPECT_LT((state.wrench - before).norm(), 1e-12);
  EXPECT_EQ(guard.count(), 0);
}

TEST_F(ForceTorqueAdapterTest, ErrorsNameFieldRangeAndValue) {
  using Params = ForceTorqueAdapterParams;
  for (const auto& [field, member] :
       {std::pair{"tare_speed", &Params::tare_speed},
        {"tare_max_force", &Params::tare_max_force},
        {"tare_max_noise", &Params::tare_max_noise},
        {"period", &Params::period}}) {
    Params params;
    params.*member = 0;
    EXPECT_EQ(ValidationError(params),
              std::string("ForceTorqueAdapterParams: field `") + field +
                  "` expected a finite value > 0, got 0");
  }
  for (const auto& [field, member] :
       {std::pair{"tool_mass", &Params::tool_mass},
        {"gravity", &Params::gravity}}) {
    Params params;
    params.*member = -2;
    EXPECT_EQ(ValidationError(params),
              std::string("ForceTorqueAdapterParams: field `") + field +
                  "` expected a finite value >= 0, got -2");
  }
  for (const double cutoff : {-2.0, 1e-300}) {
    EXPECT_NE(ValidationError(Params{.cutoff = cutoff})
                  .find("`cutoff` expected 0 or a finite value >= 0.01, got "),
              std::string::npos);
  }
  Params params;
  params.tool_com.x() = std::numeric_limits<double>::infinity();
  EXPECT_EQ(ValidationError(params),
            "ForceTorqueAdapterParams: field `tool_com` expected finite "
            "values, got [inf, 0, 0]");
}

}  // namespace
}  // namespace dual_proxy
