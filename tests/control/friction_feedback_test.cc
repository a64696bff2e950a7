// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/friction_feedback.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "dual_proxy/common/random.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kPeriod = 0.001;
const Matrix3d kOmegaZ{Vector3d::UnitZ().asDiagonal()};

TEST(FrictionFeedbackTest, IsOffAsPrinted) {
  const FrictionFeedback dut({}, kPeriod);
  FrictionFeedbackState state = dut.MakeState();
  EXPECT_EQ(dut.Update({1, 2, -5}, {0.1, 0, 0}, kOmegaZ, &state),
            Vector3d::Zero());
}

TEST(FrictionFeedbackTest, GivesItsShareOfTheFrictionInMotionSpace) {
  const FrictionFeedback dut({.gain = 0.7, .cutoff = 10}, kPeriod);
  FrictionFeedbackState state = dut.MakeState();
  Vector3d force;
  for (int i = 0; i < 2000; ++i) {
    force = dut.Update({1.5, 0.4, -6}, {0.05, 0.01, 0}, kOmegaZ, &state);
    EXPECT_EQ(force.z(), 0);
  }
  EXPECT_LT((force - Vector3d(1.05, 0.28, 0)).norm(), 1e-6);
}

TEST(FrictionFeedbackTest, LeavesAnImpactAlone) {
  const FrictionFeedback dut({.gain = 0.7, .cutoff = 10, .settling_time = 0.2},
                             kPeriod);
  FrictionFeedbackState state = dut.MakeState();
  for (int i = 0; i < 199; ++i) {
    ASSERT_EQ(dut.Update({6, 0, -26}, {0.01, 0, 0}, kOmegaZ, &state),
              Vector3d::Zero());
  }
  Vector3d force;
  for (int i = 0; i < 300; ++i) {
    force = dut.Update({-2, 0, -6}, {-0.01, 0, 0}, kOmegaZ, &state);
    ASSERT_LE(force.x(), 0);
  }
  EXPECT_LT(force.x(), -1);
}

// A wall that the filter has not found pushes against the tool, too.
TEST(FrictionFeedbackTest, NoMoreThanFrictionCanBe) {
  const FrictionFeedback dut({.gain = 0.7, .cutoff = 10, .max_friction = 0.5},
                             kPeriod);
  FrictionFeedbackState state = dut.MakeState();
  Vector3d force;
  for (int i = 0; i < 2000; ++i) {
    force = dut.Update({20, 0, -6}, {0.01, 0, 0}, kOmegaZ, &state);
  }
  EXPECT_NEAR(force.x(), 0.7 * 3, 1e-9);
  // In the air nothing is friction.
  for (int i = 0; i < 2000; ++i) {
    force = dut.Update({20, 0, 0}, {0.01, 0, 0}, Matrix3d::Zero(), &state);
  }
  EXPECT_EQ(force, Vector3d::Zero());
}

// Whatever is sensed, it never gives more than was dissipated.
TEST(FrictionFeedbackTest, IsPassive) {
  const FrictionFeedback dut({.gain = 0.9, .cutoff = 10, .max_energy = 0.02},
                             kPeriod);
  FrictionFeedbackState state = dut.MakeState();
  RandomStream random(5);
  double balance = 0;
  for (int i = 0; i < 200000; ++i) {
    const double t = kPeriod * i;
    // The tool goes to and fro; friction follows, noisily, or is wrong.
    const double speed = 0.05 * std::sin(2 * std::numbers::pi * 3 * t);
    const double friction =
        (i / 20000) % 2 == 0 ? std::copysign(2, speed) : 5 * random.Normal();
    const Vector3d sensed(friction, 0.5 * random.Normal(), -6);
    const Vector3d v(speed, 0.01 * random.Normal(), 0.002 * random.Normal());
    const ScopedNoAlloc guard;
    const Vector3d force = dut.Update(sensed, v, kOmegaZ, &state);
    ASSERT_EQ(guard.count(), 0);
    const Vector3d tangential =
        Saturate(Vector3d(sensed.x(), sensed.y(), 0), 3);
    // Sensed noise may itself give energy; that is no credit.
    balance += kPeriod * (std::max(0.0, tangential.dot(v)) - force.dot(v));
    ASSERT_GE(balance, -1e-12) << i;
    ASSERT_LE(state.energy, 0.02);
  }
}

TEST(FrictionFeedbackParamsTest, ErrorsNameFieldRangeAndValue) {
  FrictionFeedbackParams params;
  params.gain = 1;
  EXPECT_EQ(ValidationError(params),
            "FrictionFeedbackParams: field `gain` expected a number in [0, 1), "
            "got 1");
}

}  // namespace
}  // namespace dual_proxy
