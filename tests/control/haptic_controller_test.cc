// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/haptic_controller.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "dual_proxy/common/random.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;

class HapticControllerTest : public ::testing::Test {
 protected:
  HapticController dut_;
  HapticControllerState state_ = dut_.MakeState();
  Matrix3d Omega_z_{Vector3d::UnitZ().asDiagonal()};
  Matrix3d none_{Matrix3d::Zero()};
};

TEST_F(HapticControllerTest, DampsForceSpaceOnly) {
  Vector6d velocity;
  velocity << 0.1, 0.2, 0.05, 1, 1, 1;
  const Vector6d wrench = dut_.Update(Vector3d(0, 0, 3), Vector3d::Zero(),
                                      velocity, Omega_z_, none_, &state_);
  EXPECT_TRUE(wrench.isApprox(
      (Vector6d() << 0, 0, 3 - 27 * 0.05, 0, 0, 0).finished(), 1e-12));
}

TEST_F(HapticControllerTest, FreeMotionIsWithoutForce) {
  Vector6d velocity = Vector6d::Constant(0.3);
  EXPECT_EQ(dut_.Update(Vector3d::Zero(), Vector3d::Zero(), velocity,
                        Matrix3d::Zero(), none_, &state_),
            Vector6d::Zero());
}

TEST_F(HapticControllerTest, SaturationIsLast) {
  const HapticController dut({.max_moment = 0.4});
  RandomStream random(2);
  for (int i = 0; i < 1000; ++i) {
    Vector6d velocity;
    Vector3d force, moment;
    for (int j = 0; j < 6; ++j) velocity(j) = random.Normal();
    for (int j = 0; j < 3; ++j) {
      force(j) = 10 * random.Normal();
      moment(j) = random.Normal();
    }
    const Vector6d wrench = dut.Update(force, moment, velocity,
                                       Matrix3d::Identity(), none_, &state_);
    EXPECT_LE(wrench.head<3>().norm(), 12 * (1 + 1e-12));
    EXPECT_LE(wrench.tail<3>().norm(), 0.4 * (1 + 1e-12));
  }
}

TEST_F(HapticControllerTest, TheDampingOfANewSelectionComesAndGoesInItsTime) {
  Vector6d velocity = Vector6d::Zero();
  velocity(2) = -0.05;
  double last = 0;
  for (const bool pressed : {false, true, false}) {
    for (int i = 0; i < 40; ++i) {
      const Vector6d wrench = dut_.Update(
          Vector3d::Zero(), Vector3d::Zero(), velocity,
          pressed ? Omega_z_ : Matrix3d(Matrix3d::Zero()), none_, &state_);
      ASSERT_LE(std::abs(wrench(2) - last), 27 * 0.05 / 30 + 1e-9);
      last = wrench(2);
    }
    EXPECT_NEAR(last, pressed ? 27 * 0.05 : 0, 1e-12);
  }
}

// Damping alone would hold a hand that lifts.
TEST_F(HapticControllerTest, PullsTheHandIntoNoSurface) {
  Vector6d velocity = Vector6d::Zero();
  velocity(2) = 0.05;
  Matrix3d normals = Matrix3d::Zero();
  normals.col(0) = -Vector3d::UnitZ();
  const auto update = [&](double force, const Matrix3d& Omega,
                          const Matrix3d& n) {
    return dut_.Update(Vector3d(0.1, 0, force), Vector3d::Zero(), velocity,
                       Omega, n, &state_);
  };
  EXPECT_EQ(update(0, Omega_z_, normals), Vector6d::Unit(0) * 0.1);
  EXPECT_NEAR(update(3, Omega_z_, normals)(2), 3 - 27 * 0.05, 1e-12);
  // Nor while the damping fades after the contact is lost.
  for (int i = 0; i < 40; ++i) {
    ASSERT_NEAR(update(0, Matrix3d::Zero(), none_)(2), 0, 1e-12) << i;
  }
  EXPECT_TRUE(state_.contact_normals.isZero(0));
}

TEST_F(HapticControllerTest, MomentsAreOffByDefault) {
  EXPECT_EQ(dut_.Update(Vector3d::Zero(), Vector3d(1, 2, 3), Vector6d::Zero(),
                        Matrix3d::Identity(), none_, &state_),
            Vector6d::Zero());
}

TEST_F(HapticControllerTest, NotFiniteGivesNoForce) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(dut_.Update(Vector3d(0, nan, 5), Vector3d::Zero(), Vector6d::Zero(),
                        Omega_z_, none_, &state_),
            Vector6d::Zero());
  EXPECT_EQ(dut_.Update(Vector3d(0, 0, 5), Vector3d::Zero(),
                        Vector6d::Constant(nan), Omega_z_, none_, &state_),
            Vector6d::Zero());
  EXPECT_EQ(dut_.Update(Vector3d(0, 0, 5), Vector3d::Zero(), Vector6d::Zero(),
                        Matrix3d::Constant(nan), none_, &state_),
            Vector6d::Zero());
  EXPECT_EQ(state_.bad_inputs, 3);
}

TEST_F(HapticControllerTest, DoesNotAllocate) {
  ScopedNoAlloc guard;
  dut_.Update(Vector3d(0, 0, 30), Vector3d::Ones(), Vector6d::Ones(), Omega_z_,
              none_, &state_);
  EXPECT_EQ(guard.count(), 0);
}

TEST_F(HapticControllerTest, InvalidParamsNameTheField) {
  EXPECT_EQ(ValidationError(HapticControllerParams{.max_force = -1}),
            "HapticControllerParams: field `max_force` expected a finite value "
            ">= 0, got -1");
  EXPECT_THROW(HapticController({.force_damping = -1}), std::invalid_argument);
  EXPECT_THROW(HapticController({.max_moment = -1}), std::invalid_argument);
  EXPECT_THROW(HapticController({.period = 0}), std::invalid_argument);
}

}  // namespace
}  // namespace dual_proxy
