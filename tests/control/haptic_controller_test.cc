// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/haptic_controller.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

#include "dual_proxy/common/random.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"
#include "dual_proxy/simulation/haptic_device.h"
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
  const Vector6d wrench = dut_.Update(
      {Vector3d(0, 0, 3), Vector3d::Zero(), velocity, Omega_z_, none_},
      &state_);
  EXPECT_TRUE(wrench.isApprox(
      (Vector6d() << 0, 0, 3 - 27 * 0.05, 0, 0, 0).finished(), 1e-12));
}

TEST_F(HapticControllerTest, FreeMotionIsWithoutForce) {
  Vector6d velocity = Vector6d::Constant(0.3);
  EXPECT_EQ(dut_.Update({Vector3d::Zero(), Vector3d::Zero(), velocity,
                         Matrix3d::Zero(), none_},
                        &state_),
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
    const Vector6d wrench = dut.Update(
        {force, moment, velocity, Matrix3d::Identity(), none_}, &state_);
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
      const Vector6d wrench =
          dut_.Update({Vector3d::Zero(), Vector3d::Zero(), velocity,
                       pressed ? Omega_z_ : Matrix3d(Matrix3d::Zero()), none_},
                      &state_);
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
    return dut_.Update(
        {Vector3d(0.1, 0, force), Vector3d::Zero(), velocity, Omega, n},
        &state_);
  };
  EXPECT_EQ(update(0, Omega_z_, normals), Vector6d::Unit(0) * 0.1);
  EXPECT_NEAR(update(3, Omega_z_, normals)(2), 3 - 27 * 0.05, 1e-12);
  // Nor while the damping fades after the contact is lost.
  for (int i = 0; i < 70; ++i) {
    ASSERT_NEAR(update(0, Matrix3d::Zero(), none_)(2), 0, 1e-12) << i;
  }
  EXPECT_TRUE(state_.contact_normals.isZero(0));
}

// A force that one surface lets be and the next does not, both ways, turned in
// small steps and in large ones, and once more before that is over.
TEST_F(HapticControllerTest, NormalsThatChangeMakeNoStep) {
  const Vector3d force(3, -4, 5);
  const double most = force.norm() * 1.0001 / 30;
  Vector3d last = force;
  const auto update = [&](const Matrix3d& normals) {
    const Vector3d sent = dut_.Update({force, Vector3d::Zero(),
                                       Vector6d::Zero(), Omega_z_, normals},
                                      &state_)
                              .head<3>();
    EXPECT_LE((sent - last).norm(), most);
    last = sent;
  };
  update(none_);
  Matrix3d normals = none_;
  for (int i = 0; i < 300; ++i) {
    if (i % 20 == 0) {
      normals.col(0) = Vector3d(std::sin(i), 0, std::cos(i));
      normals.col(1) = Vector3d(0, i % 3 == 0 ? -1 : 0, 0);
    }
    update(normals);
  }
  for (int i = 0; i < 61; ++i) update(normals);
  EXPECT_LE((normals.transpose() * last).maxCoeff(), 1e-12);
  for (int i = 0; i < 61; ++i) update(none_);
  EXPECT_EQ(last, force);
}

TEST_F(HapticControllerTest, MomentsAreOffByDefault) {
  EXPECT_EQ(dut_.Update({Vector3d::Zero(), Vector3d(1, 2, 3), Vector6d::Zero(),
                         Matrix3d::Identity(), none_},
                        &state_),
            Vector6d::Zero());
}

TEST_F(HapticControllerTest, NotFiniteGivesNoForce) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(dut_.Update({Vector3d(0, nan, 5), Vector3d::Zero(),
                         Vector6d::Zero(), Omega_z_, none_},
                        &state_),
            Vector6d::Zero());
  EXPECT_EQ(dut_.Update({Vector3d(0, 0, 5), Vector3d::Zero(),
                         Vector6d::Constant(nan), Omega_z_, none_},
                        &state_),
            Vector6d::Zero());
  EXPECT_EQ(dut_.Update({Vector3d(0, 0, 5), Vector3d::Zero(), Vector6d::Zero(),
                         Matrix3d::Constant(nan), none_},
                        &state_),
            Vector6d::Zero());
  EXPECT_EQ(state_.bad_inputs, 3);
}

// 4 kg with dry friction, as an arm that is used as a haptic device, in a hand
// that moves it or presses it onto a spring; and how well it is felt.
class HeavyDeviceTest : public ::testing::TestWithParam<double> {
 protected:
  struct Felt {
    double force_error{0};   // N, RMS of the handle's force less F_h.
    double displacement{0};  // m, RMS of x_h - x_ph in force space.
    double swing{0};         // m, peak to peak in the last half second.
  };

  static constexpr double kSpring = 1250;  // N/m, k_vir_h.

  Felt Run(HapticControlMethod method, bool pressed) const {
    HapticControllerParams params;
    params.method = method;
    params.max_force = 40;
    const HapticController controller(params);
    HapticControllerState state = controller.MakeState();
    SimulatedHapticDeviceParams device_params;
    device_params.hand_stiffness = GetParam();
    device_params.hand_damping = GetParam() / 20;
    device_params.device_mass = 4;
    device_params.device_friction = 1.5;
    device_params.max_force = 40;
    const SimulatedHapticDevice device(device_params);
    SimulatedHapticDeviceState hand = device.MakeState();
    const Matrix3d Omega =
        pressed ? Matrix3d(Vector3d::UnitZ().asDiagonal()) : Matrix3d::Zero();
    Vector3d F_h = Vector3d::Zero();
    Felt felt;
    double lowest = 1, highest = -1;
    constexpr int kTicks = 4000;
    for (int i = 0; i < kTicks; ++i) {
      const double t = 0.001 * i;
      // The proxy comes at 50 Hz, 2 mm to and fro in the first three seconds.
      const double sent = std::min(0.02 * (i / 20), 3.0);
      const Vector3d x_ph(0, 0,
                          -0.002 * std::sin(2 * std::numbers::pi * sent / 3));
      const Vector3d dx = hand.read_pose.p - x_ph;
      F_h = RateLimit(F_h, Saturate(-kSpring * (Omega * dx), 12), 0.02);
      Pose intended;
      Vector3d v = Vector3d::Zero();
      if (pressed) {
        intended.p.z() = -0.02;
      } else {
        intended.p.x() = 0.03 * std::sin(std::numbers::pi * t);
        v.x() = 0.03 * std::numbers::pi * std::cos(std::numbers::pi * t);
      }
      const Vector6d wrench =
          controller.Update({.reference_force = F_h,
                             .device_velocity = hand.read_velocity,
                             .force_selection = Omega,
                             .proxy_displacement = dx,
                             .handle_force = hand.handle_force},
                            &state);
      device.Update(intended, v, wrench, &hand);
      // The first second is the way to it.
      if (i >= 1000) {
        felt.force_error +=
            (hand.handle_force - F_h).squaredNorm() / (kTicks - 1000);
        felt.displacement +=
            (Omega * (hand.pose.p - x_ph)).squaredNorm() / (kTicks - 1000);
      }
      if (i >= kTicks - 500) {
        lowest = std::min(lowest, hand.pose.p.z());
        highest = std::max(highest, hand.pose.p.z());
      }
    }
    felt.force_error = std::sqrt(felt.force_error);
    felt.displacement = std::sqrt(felt.displacement);
    felt.swing = highest - lowest;
    return felt;
  }
};

TEST_P(HeavyDeviceTest, FeedbackOfTheForceHidesMassAndFriction) {
  const Felt open = Run(HapticControlMethod::kOpenLoop, false);
  const Felt closed = Run(HapticControlMethod::kForceFeedback, false);
  RecordProperty("open", std::to_string(open.force_error));
  RecordProperty("closed", std::to_string(closed.force_error));
  EXPECT_GT(open.force_error, 1);
  EXPECT_LT(closed.force_error, open.force_error / 4);
}

TEST_P(HeavyDeviceTest, FeedbackOfTheForceGivesTheHandWhatIsMeant) {
  const Felt open = Run(HapticControlMethod::kOpenLoop, true);
  const Felt closed = Run(HapticControlMethod::kForceFeedback, true);
  RecordProperty("open", std::to_string(open.force_error));
  RecordProperty("closed", std::to_string(closed.force_error));
  EXPECT_LT(closed.force_error, open.force_error / 4);
  EXPECT_LT(closed.swing, 5e-5);
}

TEST_P(HeavyDeviceTest, PositionLoopHoldsTheHapticProxy) {
  const Felt open = Run(HapticControlMethod::kOpenLoop, true);
  const Felt held = Run(HapticControlMethod::kPosition, true);
  RecordProperty("open", std::to_string(open.displacement));
  RecordProperty("held", std::to_string(held.displacement));
  EXPECT_LT(held.displacement, open.displacement / 2);
  EXPECT_LT(held.swing, 5e-5);
}

INSTANTIATE_TEST_SUITE_P(Hands, HeavyDeviceTest,
                         ::testing::Values(300.0, 600.0));

// A hand that has let go cannot be felt: the loop stays within its bounds.
TEST(ForceFeedbackTest, IntegralIsBounded) {
  HapticControllerParams params;
  params.method = HapticControlMethod::kForceFeedback;
  params.max_force = 100;
  const HapticController dut(params);
  HapticControllerState state = dut.MakeState();
  Vector6d wrench;
  for (int i = 0; i < 5000; ++i) {
    wrench = dut.Update({.reference_force = Vector3d(0, 0, 2)}, &state);
  }
  EXPECT_NEAR(wrench(2), 2 + 8 * 2 + 10, 1e-9);
}

TEST(PositionLoopTest, SpringIsRateLimitedAndMotionSpaceIsTheSchemes) {
  HapticControllerParams params;
  params.method = HapticControlMethod::kPosition;
  const HapticController dut(params);
  HapticControllerState state = dut.MakeState();
  const Matrix3d Omega = Vector3d::UnitZ().asDiagonal();
  Vector6d last = Vector6d::Zero();
  for (int i = 0; i < 100; ++i) {
    const Vector6d wrench =
        dut.Update({.reference_force = Vector3d(1, 0, 5),
                    .force_selection = Omega,
                    .proxy_displacement = Vector3d(0.01, 0, -0.002)},
                   &state);
    EXPECT_LE(std::abs(wrench(2) - last(2)), 0.3 + 1e-12);
    last = wrench;
  }
  EXPECT_NEAR(last(0), 1, 1e-12);
  EXPECT_NEAR(last(2), 4000 * 0.002, 1e-12);
}

TEST(HapticControlMethodTest, RefusesOnlyWhatItUses) {
  const Vector3d none =
      Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  HapticControllerInput no_force;
  no_force.reference_force.x() = 1;
  no_force.handle_force = none;
  HapticControllerInput no_proxy;
  no_proxy.reference_force.x() = 1;
  no_proxy.proxy_displacement = none;
  const auto refuses = [](HapticControlMethod method,
                          const HapticControllerInput& input) {
    const HapticController dut({.method = method});
    HapticControllerState state = dut.MakeState();
    const Vector6d wrench = dut.Update(input, &state);
    EXPECT_EQ(wrench.isZero(0), state.bad_inputs == 1);
    return state.bad_inputs == 1;
  };
  using enum HapticControlMethod;
  EXPECT_FALSE(refuses(kOpenLoop, no_force));
  EXPECT_FALSE(refuses(kOpenLoop, no_proxy));
  EXPECT_TRUE(refuses(kForceFeedback, no_force));
  EXPECT_FALSE(refuses(kForceFeedback, no_proxy));
  EXPECT_FALSE(refuses(kPosition, no_force));
  EXPECT_TRUE(refuses(kPosition, no_proxy));
}

TEST_F(HapticControllerTest, DoesNotAllocate) {
  ScopedNoAlloc guard;
  dut_.Update(
      {Vector3d(0, 0, 30), Vector3d::Ones(), Vector6d::Ones(), Omega_z_, none_},
      &state_);
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
