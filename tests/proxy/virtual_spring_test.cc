// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/virtual_spring.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "no_alloc.h"
#include "test_support.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kMaxStep = 0.05;  // 50 N/s x 1 ms.
// Rounding of a difference of two forces of up to 20 N.
constexpr double kStepTolerance = 1e-13;

VirtualSpringParams Params(Handover handover) {
  VirtualSpringParams params;
  params.handover = handover;
  return params;
}

class VirtualSpringTest : public ::testing::Test {
 protected:
  void Settle(const Vector3d& displacement, const Matrix3d& selection) {
    for (int i = 0; i < 1000; ++i) {
      printed_.Update(displacement, selection, nullptr, true, &state_);
    }
  }

  const VirtualSpring printed_{Params(Handover::kPrinted)};
  const VirtualSpring bumpless_{Params(Handover::kBumpless)};
  const Matrix3d z_ = Direction(Vector3d::UnitZ());
  const Matrix3d yz_ = Matrix3d::Identity() - Direction(Vector3d::UnitX());
  VirtualSpringState state_{printed_.MakeState()};
};

TEST_F(VirtualSpringTest, SettlesAtTheSpringForceExactlyInForceSpace) {
  // The robot is 1 cm above its proxy: 5 N downwards, and nothing sideways.
  Settle({0.3, -0.2, 0.01}, z_);
  EXPECT_EQ(state_.reference, Vector3d(0, 0, -5));
}

TEST_F(VirtualSpringTest, GrowsAtItsRateAndSaturates) {
  for (int i = 1; i <= 100; ++i) {
    printed_.Update({0, 0, -0.1}, z_, nullptr, true, &state_);
    ASSERT_NEAR(state_.reference.z(), kMaxStep * i, 1e-12);
  }
  Settle({0, 0, -0.1}, z_);
  EXPECT_NEAR(state_.reference.z(), 20.0, 1e-12);
}

TEST_F(VirtualSpringTest, FadesFromADirectionThatIsNoLongerForceSpace) {
  Settle({0, 0, -0.01}, z_);
  double last = state_.reference.z();
  for (int i = 0; i < 100; ++i) {
    printed_.Update({0, 0, -0.01}, Matrix3d::Zero(), nullptr, true, &state_);
    ASSERT_NEAR(last - state_.reference.z(), kMaxStep, kStepTolerance);
    last = state_.reference.z();
    if (i == 98) break;
  }
  printed_.Update({0, 0, -0.01}, Matrix3d::Zero(), nullptr, true, &state_);
  printed_.Update({0, 0, -0.01}, Matrix3d::Zero(), nullptr, true, &state_);
  EXPECT_TRUE(state_.reference.isZero(0.0));
}

TEST_F(VirtualSpringTest, BeyondTheLeashTheMaximumBoundsNoMore) {
  VirtualSpringParams params = Params(Handover::kPrinted);
  params.leash = 0.1;
  const VirtualSpring dut(params);
  for (const bool active : {true, false}) {
    const double pull = active ? 20 : 0;
    for (int i = 0; i < 2000; ++i) {
      dut.Update({0.3, 0, 0.1}, z_, nullptr, active, &state_);
    }
    EXPECT_NEAR(state_.reference.z(), -pull, 1e-12);
    for (int i = 0; i < 2000; ++i) {
      dut.Update({0.3, 0, 0.13}, z_, nullptr, active, &state_);
    }
    EXPECT_NEAR(state_.reference.z(), -pull - 500 * 0.03, 1e-12);
    EXPECT_EQ(state_.reference.x(), 0);
  }
}

TEST_F(VirtualSpringTest, InactiveFadesToZeroWhateverTheDisplacement) {
  Settle({0, 0, -0.01}, z_);
  for (int i = 0; i < 101; ++i) {
    const double before = state_.reference.norm();
    printed_.Update({0, 0, -0.5}, z_, nullptr, false, &state_);
    ASSERT_LE(before - state_.reference.norm(), kMaxStep + kStepTolerance);
  }
  EXPECT_TRUE(state_.reference.isZero(0.0));
}

TEST_F(VirtualSpringTest, HandoverStartsFromTheSensedForceInNewDirections) {
  const Vector3d sensed(4, 3, -8);
  bumpless_.Update({0, 0, 0.016}, z_, &sensed, true, &state_);
  // 500 N/m x 16 mm = 8 N: exactly what is there, so nothing moves.
  EXPECT_NEAR(state_.reference.z(), -8.0, 1e-12);
  EXPECT_NEAR(state_.reference.head<2>().norm(), 0.0, 1e-12);
}

TEST_F(VirtualSpringTest, HandoverLeavesTheDirectionsThatWereThere) {
  Settle({0, 0, 0.01}, z_);
  const Vector3d sensed(4, 3, -9);
  const Vector3d before = state_.reference;
  bumpless_.Update({0, -0.006, 0.01}, yz_, &sensed, true, &state_);
  EXPECT_NEAR(state_.reference.y(), 3.0, 1e-12);  // As sensed.
  EXPECT_NEAR(state_.reference.z(), before.z(), 1e-12);
  EXPECT_NEAR(state_.reference.x(), 0.0, 1e-12);
}

TEST_F(VirtualSpringTest, ThePrintedHandoverStartsFromZero) {
  const Vector3d sensed(0, 0, -8);
  printed_.Update({0, 0, 0.016}, z_, &sensed, true, &state_);
  EXPECT_NEAR(state_.reference.z(), -kMaxStep, 1e-12);
}

TEST_F(VirtualSpringTest, NoHandoverWithoutASensedForceOrALink) {
  bumpless_.Update({0, 0, 0.016}, z_, nullptr, true, &state_);
  EXPECT_NEAR(state_.reference.norm(), kMaxStep, 1e-12);
  state_ = bumpless_.MakeState();
  const Vector3d sensed(0, 0, -8);
  bumpless_.Update({0, 0, 0.016}, z_, &sensed, false, &state_);
  EXPECT_TRUE(state_.reference.isZero(0.0));
  // Nor afterwards, in a direction that was found in between.
  bumpless_.Update({0, 0, 0.016}, z_, &sensed, true, &state_);
  EXPECT_NEAR(state_.reference.norm(), kMaxStep, 1e-12);
}

TEST_F(VirtualSpringTest, ARotationOfForceSpaceIsNoHandover) {
  // One surface that bends away, in turns of up to 50 deg.
  RandomStream random(7);
  Settle({0, 0, 0.01}, z_);
  Matrix3d R = Matrix3d::Identity();
  for (int i = 0; i < 1000; ++i) {
    const double angle =
        (2.0 * random.Uniform() - 1.0) * 50.0 * std::numbers::pi / 180.0;
    R = ExpRotation(angle * RandomVector(1.0, &random).normalized()) * R;
    const Vector3d before = state_.reference;
    const Vector3d sensed = RandomVector(100.0, &random);
    bumpless_.Update(RandomVector(0.02, &random), R * z_ * R.transpose(),
                     &sensed, true, &state_);
    ASSERT_LE((state_.reference - before).norm(), kMaxStep + kStepTolerance)
        << i;
  }
}

TEST_F(VirtualSpringTest, ASurfaceSwappedForAnotherIsAHandover) {
  // The outer corner: the rank stays 1, the normal turns by 90 deg.
  Settle({0, 0, 0.01}, z_);
  const Vector3d sensed(0, 6, -1);
  bumpless_.Update({0, -0.012, 0.01}, Direction(Vector3d::UnitY()), &sensed,
                   true, &state_);
  EXPECT_NEAR(state_.reference.y(), 6.0, kMaxStep);
  EXPECT_NEAR(state_.reference.z(), -5.0, kMaxStep);
}

TEST_F(VirtualSpringTest, HandoverIsSaturatedWithoutAStepElsewhere) {
  Settle({0, 0, 0.032}, z_);  // 16 N of 20.
  const Vector3d sensed(0, 500, 0);
  bumpless_.Update({0, -1.0, 0.032}, yz_, &sensed, true, &state_);
  EXPECT_NEAR(state_.reference.z(), -16.0, kMaxStep);
  EXPECT_NEAR(state_.reference.y(), 12.0, kMaxStep);
  EXPECT_LE(state_.reference.norm(), 20.0 + 1e-9);
}

TEST_F(VirtualSpringTest, NeverStepsAndNeverExceedsItsMaximum) {
  RandomStream random(9);
  for (int i = 0; i < 10'000; ++i) {
    const Vector3d before = state_.reference;
    printed_.Update(
        RandomVector(std::pow(10.0, 3.0 * random.Normal()), &random),
        RandomSelection(&random), nullptr, random.Uniform() < 0.9, &state_);
    ASSERT_LE((state_.reference - before).norm(), kMaxStep + kStepTolerance)
        << i;
    ASSERT_LE(state_.reference.norm(), 20.0 + 1e-9) << i;
  }
}

TEST_F(VirtualSpringTest, HandoverStepsOnlyInNewDirectionsAndUpToTheMaximum) {
  RandomStream random(10);
  for (int i = 0; i < 10'000; ++i) {
    const Matrix3d last = state_.selection;
    const Matrix3d selection = RandomSelection(&random);
    const Vector3d before = state_.reference;
    const Vector3d sensed = RandomVector(15.0, &random);
    bumpless_.Update(RandomVector(0.02, &random), selection, &sensed, true,
                     &state_);
    ASSERT_LE(state_.reference.norm(), 20.0 + kMaxStep) << i;
    // What stepped lies in force space.
    const Vector3d step = state_.reference - before;
    ASSERT_LE((step - selection * step).norm(), kMaxStep + 1e-9) << i;
    if (selection.trace() < 0.5 || (selection - last).norm() < 1e-12) {
      ASSERT_LE(step.norm(), kMaxStep + kStepTolerance) << i;
    }
  }
}

TEST_F(VirtualSpringTest, RotatedInputsGiveRotatedForces) {
  RandomStream random(11);
  for (int k = 0; k < 200; ++k) {
    const Matrix3d R = RandomRotation(2.0, &random);
    VirtualSpringState a, b;
    for (int i = 0; i < 20; ++i) {
      const Vector3d x = RandomVector(0.02, &random);
      const Vector3d sensed = RandomVector(5.0, &random);
      const Vector3d turned_sensed = R * sensed;
      const Matrix3d Omega = RandomSelection(&random);
      bumpless_.Update(x, Omega, &sensed, true, &a);
      bumpless_.Update(R * x, R * Omega * R.transpose(), &turned_sensed, true,
                       &b);
      ASSERT_LT((R * a.reference - b.reference).norm(), 1e-9) << k << " " << i;
    }
  }
}

TEST_F(VirtualSpringTest, ADisplacementThatIsNotFiniteCountsAsNone) {
  Settle({0, 0, 0.01}, z_);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (int i = 0; i < 101; ++i) {
    printed_.Update({nan, 0, 0.01}, z_, nullptr, true, &state_);
    ASSERT_TRUE(state_.reference.allFinite());
  }
  EXPECT_TRUE(state_.reference.isZero(0.0));
}

TEST_F(VirtualSpringTest, AMaximumOfZeroIsOff) {
  VirtualSpringParams params = Params(Handover::kBumpless);
  params.max_force = 0.0;
  const VirtualSpring dut(params);
  const Vector3d sensed(1, 2, 3);
  for (int i = 0; i < 100; ++i) {
    dut.Update({1, 2, 3}, z_, &sensed, true, &state_);
    ASSERT_TRUE(state_.reference.isZero(0.0));
  }
}

TEST_F(VirtualSpringTest, CopiesGoOnAlike) {
  Settle({0, 0, 0.01}, z_);
  VirtualSpringState copy = state_;
  const Vector3d sensed(1, 2, 3);
  bumpless_.Update({0.1, 0.1, 0.1}, yz_, &sensed, true, &state_);
  bumpless_.Update({0.1, 0.1, 0.1}, yz_, &sensed, true, &copy);
  EXPECT_EQ(copy.reference, state_.reference);
  EXPECT_TRUE(bumpless_.MakeState().reference.isZero(0.0));
}

TEST_F(VirtualSpringTest, DoesNotAllocate) {
  const Vector3d sensed(1, 2, 3);
  ScopedNoAlloc guard;
  bumpless_.Update({0, 0, 0.01}, z_, &sensed, true, &state_);
  bumpless_.Update({0, 0, 0.01}, yz_, &sensed, true, &state_);
  EXPECT_EQ(guard.count(), 0);
}

TEST(VirtualSpringParamsTest, InvalidParametersAreNamed) {
  using P = VirtualSpringParams;
  const auto message = [](double P::* field, double value) {
    P params;
    params.*field = value;
    return InvalidArgument([&] { VirtualSpring{params}; });
  };
  EXPECT_NE(message(&P::stiffness, -1.0)
                .find("VirtualSpringParams: field `stiffness`"),
            std::string::npos);
  EXPECT_NE(message(&P::max_force, -1.0).find("`max_force`"),
            std::string::npos);
  EXPECT_NE(message(&P::rate, 0.0).find("`rate`"), std::string::npos);
  EXPECT_NE(message(&P::new_direction_angle, 1.6).find("`new_direction_angle`"),
            std::string::npos);
  EXPECT_NE(message(&P::period, 0.0).find("`period`"), std::string::npos);
}

}  // namespace
}  // namespace dual_proxy
