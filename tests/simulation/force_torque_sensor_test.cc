// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/force_torque_sensor.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "dual_proxy/common/rotation.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;

class ForceTorqueSensorTest : public ::testing::Test {
 protected:
  ForceTorqueSensorTest() {
    ideal_.force_noise_std = 0;
    ideal_.moment_noise_std = 0;
    ideal_.tool_mass = 0.4;
    ideal_.tool_com = Vector3d(0.01, -0.02, 0.06);
  }

  /** What the arm exerts on the tool at S, in S, when the tool exerts `force`
  and `moment` at E on its environment (in B) and its weight pulls: what the
  static balance of the tool asks for. */
  Vector6d Reaction(const Vector3d& force, const Vector3d& moment,
                    const Matrix3d& R_BS, const Vector3d& p_SE_B) const {
    const Vector3d weight(0, 0, -ideal_.tool_mass * ideal_.gravity);
    const Vector3d com_B = R_BS * ideal_.tool_com;
    Vector6d reaction;
    reaction.head<3>() = R_BS.transpose() * (force - weight);
    reaction.tail<3>() =
        R_BS.transpose() * (moment + p_SE_B.cross(force) - com_B.cross(weight));
    return reaction;
  }

  /** A sample with the tool point at p_SE_B from the sensor. */
  static ForceTorqueAdapterInput Sample(const Vector6d& reaction,
                                        const Matrix3d& R_BS,
                                        const Vector3d& p_SE_B) {
    return {.measured = reaction,
            .X_BE = {.p = Vector3d(0.4, 0.1, 0.3), .R = R_BS},
            .p_SE = R_BS.transpose() * p_SE_B};
  }

  ForceTorqueSensorParams ideal_;
  const Matrix3d R_BS_{ExpRotation({0.4, -1.2, 0.7})};
  const Vector3d p_SE_B_{0.02, 0.05, -0.1};
};

TEST_F(ForceTorqueSensorTest, HangingToolReadsZeroInAnyOrientation) {
  const ForceTorqueSensor dut(ideal_);
  RandomStream random(1);
  for (int i = 0; i < 100; ++i) {
    const Matrix3d R_BS = ExpRotation(
        {3 * random.Uniform(), 3 * random.Uniform(), 3 * random.Uniform()});
    const Vector3d zero = Vector3d::Zero();
    ForceTorqueSensorState state = dut.MakeState();
    const Vector6d reaction = Reaction(zero, zero, R_BS, p_SE_B_);
    const Vector6d wrench = dut.Update(Sample(reaction, R_BS, p_SE_B_), &state);
    EXPECT_LT(wrench.norm(), 1e-14);
  }
}

// The sign: an upright sensor under which a weightless tool presses down. The
// arm pushes the tool down, and so does the output.
TEST_F(ForceTorqueSensorTest, PressingDownPointsDown) {
  ideal_.tool_mass = 0;
  const ForceTorqueSensor dut(ideal_);
  ForceTorqueSensorState state = dut.MakeState();
  Vector6d reaction = Vector6d::Zero();
  reaction(2) = -8;
  dut.Update(Sample(reaction, Matrix3d::Identity(), Vector3d(0, 0, -0.1)),
             &state);
  EXPECT_EQ(Vector3d(state.adapter.wrench.head<3>()), Vector3d(0, 0, -8));
}

TEST_F(ForceTorqueSensorTest, GivesTheWrenchAtTheToolPoint) {
  const ForceTorqueSensor dut(ideal_);
  ForceTorqueSensorState state = dut.MakeState();
  Vector6d expected;
  expected << 1, -2, 8, 0.1, 0.2, -0.3;
  const Vector6d reaction =
      Reaction(expected.head<3>(), expected.tail<3>(), R_BS_, p_SE_B_);
  const Vector6d wrench = dut.Update(Sample(reaction, R_BS_, p_SE_B_), &state);
  EXPECT_LT((wrench - expected).norm(), 1e-14);
  EXPECT_EQ(wrench, state.adapter.wrench);
}

TEST_F(ForceTorqueSensorTest, NoiseAndBiasAreInTheSensorFrame) {
  ForceTorqueSensorParams params;
  params.force_noise_std = 0.2;
  params.moment_noise_std = 0.005;
  params.force_bias = Vector3d(1, 0, 0);
  params.moment_bias = Vector3d(0, 0, 0.1);
  const ForceTorqueSensor dut(params);
  ForceTorqueSensorState state = dut.MakeState(3);
  constexpr int kSamples = 20000;
  Vector6d mean = Vector6d::Zero();
  Vector6d variance = Vector6d::Zero();
  Vector6d bias;
  bias << R_BS_.col(0), 0.1 * R_BS_.col(2);
  for (int i = 0; i < kSamples; ++i) {
    dut.Update(Sample(Vector6d::Zero(), R_BS_, Vector3d::Zero()), &state);
    mean += state.adapter.wrench / kSamples;
    variance += (state.adapter.wrench - bias).cwiseAbs2() / kSamples;
  }
  for (int i = 0; i < 6; ++i) {
    const double std = i < 3 ? 0.2 : 0.005;
    // Five standard errors.
    EXPECT_NEAR(mean(i), bias(i), 5 * std / std::sqrt(kSamples));
    EXPECT_NEAR(std::sqrt(variance(i)), std, 5 * std / std::sqrt(2 * kSamples));
  }
}

TEST_F(ForceTorqueSensorTest, ASampleComesADelayLater) {
  ideal_.tool_mass = 0;
  ideal_.delay = 0.003;
  const ForceTorqueSensor dut(ideal_);
  ForceTorqueSensorState state = dut.MakeState();
  Vector6d reaction = Vector6d::Zero();
  for (int i = 0; i < 10; ++i) {
    reaction(0) = i;
    dut.Update(Sample(reaction, Matrix3d::Identity(), Vector3d::Zero()),
               &state);
    // Until the first has come, it stands for those before.
    EXPECT_EQ(state.measured(0), std::max(0, i - 3)) << i;
  }
}

TEST_F(ForceTorqueSensorTest, StepsAndDriftAreTheSensors) {
  ideal_.tool_mass = 0;
  ideal_.force_step = 0.5;
  ideal_.moment_step = 0.1;
  ideal_.force_drift = Vector3d(0, 0, 10);  // N/s
  const ForceTorqueSensor dut(ideal_);
  ForceTorqueSensorState state = dut.MakeState();
  Vector6d reaction;
  reaction << 0.7, -0.7, 0, 0.04, 0.06, 0;
  for (int i = 0; i <= 100; ++i) {
    dut.Update(Sample(reaction, Matrix3d::Identity(), Vector3d::Zero()),
               &state);
  }
  Vector6d expected;
  expected << 0.5, -0.5, 1, 0, 0.1, 0;
  EXPECT_TRUE(state.measured.isApprox(expected, 1e-12)) << state.measured;
}

TEST_F(ForceTorqueSensorTest, SamplesDropOutAndSpikesCome) {
  ideal_.tool_mass = 0;
  ideal_.dropout = 0.25;
  ideal_.spike_rate = 20;
  ideal_.spike_force = 100;
  const ForceTorqueSensor dut(ideal_);
  ForceTorqueSensorState state = dut.MakeState(5);
  Vector6d reaction = Vector6d::Zero();
  int held = 0;
  int spikes = 0;
  constexpr int kSamples = 20000;
  for (int i = 0; i < kSamples; ++i) {
    reaction(5) = i;  // A clock, which tells whether the sample came.
    dut.Update(Sample(reaction, Matrix3d::Identity(), Vector3d::Zero()),
               &state);
    held += state.measured(5) != i;
    if (state.measured(5) != i || state.measured.head<3>().isZero(0)) continue;
    ++spikes;
    EXPECT_NEAR(state.measured.head<3>().norm(), 100, 1e-9);
  }
  // Five standard deviations.
  EXPECT_NEAR(held, 5000, 310);
  EXPECT_NEAR(spikes, 0.75 * 400, 90);
}

TEST_F(ForceTorqueSensorTest, LowPassStartsAtTheFirstSampleAndSettles) {
  ideal_.tool_mass = 0;
  ideal_.cutoff = 50;
  const ForceTorqueSensor dut(ideal_);
  ForceTorqueSensorState state = dut.MakeState();
  Vector6d reaction = Vector6d::Zero();
  reaction(0) = 2;
  const auto update = [&] {
    dut.Update(Sample(reaction, Matrix3d::Identity(), Vector3d::Zero()),
               &state);
  };
  update();
  EXPECT_EQ(state.adapter.wrench(0), 2);
  reaction(0) = 3;
  for (int i = 1; i <= 30; ++i) {
    update();
    EXPECT_NEAR(state.adapter.wrench(0),
                3 - std::exp(-2 * std::numbers::pi * 50 * 0.001 * i), 1e-12);
  }
}

TEST_F(ForceTorqueSensorTest, BadInputHoldsTheOutputAndIsCounted) {
  const ForceTorqueSensor dut;
  ForceTorqueSensorState state = dut.MakeState(1);
  dut.Update(Sample(Vector6d::Ones(), R_BS_, p_SE_B_), &state);
  const Vector6d before = state.adapter.wrench;
  Vector6d bad = Vector6d::Ones();
  bad(4) = std::numeric_limits<double>::infinity();
  EXPECT_EQ(dut.Update(Sample(bad, R_BS_, p_SE_B_), &state), before);
  Matrix3d bad_R = R_BS_;
  bad_R(1, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(dut.Update(Sample(Vector6d::Zero(), bad_R, p_SE_B_), &state),
            before);
  EXPECT_EQ(state.adapter.bad_inputs, 2);
}

TEST_F(ForceTorqueSensorTest, SameSeedSameBitsAndNothingIsAllocated) {
  const ForceTorqueSensor dut;
  ForceTorqueSensorState a = dut.MakeState(5);
  ForceTorqueSensorState b = dut.MakeState(5);
  ForceTorqueSensorState other = dut.MakeState(6);
  const ForceTorqueSensorState start = a;
  ScopedNoAlloc guard;
  for (int i = 0; i < 10; ++i) {
    dut.Update(Sample(Vector6d::Ones(), R_BS_, p_SE_B_), &a);
  }
  EXPECT_EQ(guard.count(), 0);
  for (int i = 0; i < 10; ++i) {
    dut.Update(Sample(Vector6d::Ones(), R_BS_, p_SE_B_), &b);
    dut.Update(Sample(Vector6d::Ones(), R_BS_, p_SE_B_), &other);
  }
  EXPECT_EQ(a.adapter.wrench, b.adapter.wrench);
  EXPECT_NE(a.adapter.wrench, other.adapter.wrench);
  a = start;
  for (int i = 0; i < 10; ++i) {
    dut.Update(Sample(Vector6d::Ones(), R_BS_, p_SE_B_), &a);
  }
  EXPECT_EQ(a.adapter.wrench, b.adapter.wrench);
}

TEST_F(ForceTorqueSensorTest, ErrorsNameFieldRangeAndValue) {
  using Params = ForceTorqueSensorParams;
  EXPECT_EQ(ValidationError(Params{}), "no exception");
  const std::string who = "ForceTorqueSensorParams: field `";
  for (const auto& [field, member] :
       {std::pair{"force_noise_std", &Params::force_noise_std},
        {"moment_noise_std", &Params::moment_noise_std}}) {
    Params params;
    params.*member = -2;
    EXPECT_EQ(ValidationError(params),
              who + field + "` expected a finite value >= 0, got -2");
    EXPECT_THROW(ForceTorqueSensor{params}, std::invalid_argument);
  }
  Params params;
  params.force_bias.x() = std::numeric_limits<double>::infinity();
  EXPECT_EQ(ValidationError(params),
            who + "force_bias` expected finite values, got [inf, 0, 0]");
  params = {};
  params.tare_time = 0;
  EXPECT_EQ(ValidationError(params),
            "ForceTorqueSensorParams: field `tare_time` expected a number in "
            "(0, 10], got 0");
}

}  // namespace
}  // namespace dual_proxy
