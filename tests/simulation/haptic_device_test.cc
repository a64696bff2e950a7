// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/haptic_device.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include "dual_proxy/common/random.h"
#include "dual_proxy/common/rotation.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;

Vector6d Wrench(const Vector3d& force) {
  Vector6d wrench = Vector6d::Zero();
  wrench.head<3>() = force;
  return wrench;
}

class SimulatedHapticDeviceTest : public ::testing::Test {
 protected:
  SimulatedHapticDeviceParams params_;
  const Vector3d zero_{Vector3d::Zero()};
  const Vector6d no_wrench_{Vector6d::Zero()};
};

// The response to a constant force from rest, which an exact discretisation
// gives at every period: K x = F (1 - e^{-ct} (cos wt + c/w sin wt)).
TEST_F(SimulatedHapticDeviceTest, FollowsTheAnalyticStepResponse) {
  const SimulatedHapticDevice dut(params_);
  SimulatedHapticDeviceState state = dut.MakeState();
  const double mass = 0.75;
  const double c = (30 + 1) / (2 * mass);
  const double w = std::sqrt(600 / mass - c * c);
  for (int i = 1; i <= 500; ++i) {
    dut.Update({}, zero_, Wrench({3, -2, 5}), &state);
    const double t = i * params_.period;
    const double share =
        1 - std::exp(-c * t) * (std::cos(w * t) + c / w * std::sin(w * t));
    EXPECT_LT((state.pose.p - Vector3d(3, -2, 5) * share / 600).norm(), 1e-13);
  }
  // Equilibrium: the hand pulls as hard as the device pushes.
  for (int i = 0; i < 1500; ++i) {
    dut.Update({}, zero_, Wrench({3, -2, 5}), &state);
  }
  EXPECT_LT((state.hand_force + Vector3d(3, -2, 5)).norm(), 1e-9);
}

// Once the intention moves steadily the hand keeps up with it, but for what it
// takes to pull the device against its friction.
TEST_F(SimulatedHapticDeviceTest, FollowsAMovingIntention) {
  const SimulatedHapticDevice dut(params_);
  SimulatedHapticDeviceState state = dut.MakeState();
  const Vector3d v(0.02, -0.01, 0.01);
  Pose intended;
  for (int i = 0; i < 2000; ++i) {
    intended.p += v * params_.period;
    dut.Update(intended, v, no_wrench_, &state);
  }
  EXPECT_LT((state.velocity - v).norm(), 1e-12);
  EXPECT_LT((intended.p - state.pose.p - v * 1.0 / 600).norm(), 1e-12);
}

// A hand that gives way goes on from where the handle was led to.
TEST_F(SimulatedHapticDeviceTest, GivesWayAndGoesOnFromThere) {
  const SimulatedHapticDevice dut(params_);
  const Pose start{.p = {0.02, 0, 0}};
  SimulatedHapticDeviceState state = dut.MakeState(start);
  for (int i = 0; i < 500; ++i) {
    dut.Update(start, zero_, Wrench({-0.1, 0, 0}), &state, true);
    ASSERT_LT(state.hand_force.norm(), 0.01);
  }
  // 0.1 N for half a second.
  EXPECT_NEAR(state.pose.p.x(), 0.02 - 0.1 * 0.125 / 0.75, 5e-3);
  const Vector3d led = state.pose.p;
  for (int i = 0; i < 2000; ++i) {
    dut.Update(start, zero_, no_wrench_, &state);
  }
  EXPECT_LT((state.pose.p - led).norm(), 2e-3);
  const Vector3d before = state.pose.p;
  const Pose further{.p = {0.03, 0.01, 0}};
  for (int i = 0; i < 2000; ++i) {
    dut.Update(further, zero_, no_wrench_, &state);
  }
  EXPECT_LT((state.pose.p - before - Vector3d(0.01, 0.01, 0)).norm(), 1e-9);
}

TEST_F(SimulatedHapticDeviceTest, DryFrictionHoldsStillAndSlides) {
  params_.device_friction = 2;
  const SimulatedHapticDevice dut(params_);
  SimulatedHapticDeviceState state = dut.MakeState();
  for (int i = 0; i < 100; ++i) {
    dut.Update({}, zero_, Wrench({0, 1.9, 0}), &state);
  }
  EXPECT_LT(state.pose.p.norm(), 1e-12);
  EXPECT_LT(state.handle_force.norm(), 1e-9);
  // Pulled along it takes the friction, dry and viscous.
  const Vector3d v(0.02, 0, 0);
  Pose intended;
  for (int i = 0; i < 2000; ++i) {
    intended.p += v * params_.period;
    dut.Update(intended, v, no_wrench_, &state);
  }
  EXPECT_LT((state.velocity - v).norm(), 1e-9);
  EXPECT_NEAR(state.handle_force.x(), -(2 + 1 * 0.02), 1e-9);
}

// What the handle does to the hand is what moves the hand, beside its own pull.
TEST_F(SimulatedHapticDeviceTest, HandleForceIsTheHandsBalance) {
  params_.device_mass = 4;
  params_.device_friction = 1;
  params_.period = 1e-4;  // So that a mean of both ends is the mean.
  const SimulatedHapticDevice dut(params_);
  SimulatedHapticDeviceState state = dut.MakeState();
  for (int i = 0; i < 5000; ++i) {
    const double t = params_.period * i;
    const Vector3d pull = state.hand_force;
    const Vector3d before = state.velocity;
    dut.Update({{0.03 * std::sin(5 * t), 0, 0.01}, Matrix3d::Identity()},
               {0.15 * std::cos(5 * t), 0, 0}, Wrench({0, 1, 2 * t}), &state);
    if (i < 5) continue;  // The intention starts with a step.
    const Vector3d balance =
        params_.hand_mass / params_.period * (state.velocity - before) -
        (pull + state.hand_force) / 2;
    ASSERT_LT((state.handle_force - balance).norm(), 2e-2) << i;
  }
  EXPECT_GT(state.handle_force.norm(), 1);
}

// 1250 N/m is the force-matched virtual wall; the proxy behind it comes over a
// link at 50 Hz, one message late, and follows the hand.
TEST_F(SimulatedHapticDeviceTest, IsSteadyAtAVirtualWallOverASlowLink) {
  for (const double hand_stiffness : {300.0, 600.0}) {
    params_.hand_stiffness = hand_stiffness;
    params_.hand_damping = hand_stiffness / 20;
    const SimulatedHapticDevice dut(params_);
    SimulatedHapticDeviceState state = dut.MakeState();
    Pose intended;
    intended.p.z() = -0.03;
    double proxy = 0;
    double robot = 0;
    double lowest = 1;
    double highest = -1;
    double max_force = 0;
    for (int i = 0; i < 4000; ++i) {
      if (i % 20 == 0) {
        proxy = robot;
        robot = std::max(-0.02, state.read_pose.p.z());
      }
      const double force =
          1250 * (proxy - state.read_pose.p.z()) - 27 * state.read_velocity(2);
      dut.Update(intended, zero_, Wrench({0, 0, force}), &state);
      max_force = std::max(max_force, std::abs(force));
      if (i >= 3000) {
        lowest = std::min(lowest, state.pose.p.z());
        highest = std::max(highest, state.pose.p.z());
      }
    }
    EXPECT_LT(highest - lowest, 2e-5) << "hand stiffness " << hand_stiffness;
    const double expected =
        -(hand_stiffness * 0.03 + 1250 * 0.02) / (hand_stiffness + 1250);
    EXPECT_NEAR(highest, expected, 2e-5);
    EXPECT_GT(max_force, 1);
  }
}

TEST_F(SimulatedHapticDeviceTest, IsStableForAnyImpedance) {
  RandomStream random(4);
  for (int trial = 0; trial < 200; ++trial) {
    // Up to the ends of their ranges.
    params_.hand_stiffness = 1e6 * std::pow(10, -6 * random.Uniform());
    params_.hand_damping = 1e5 * std::pow(10, -8 * random.Uniform());
    params_.hand_mass = 500 * std::pow(10, -5.69 * random.Uniform());
    params_.device_mass = params_.hand_mass;
    params_.device_damping = 0;
    const SimulatedHapticDevice dut(params_);
    SimulatedHapticDeviceState state = dut.MakeState({{0.01, 0.02, -0.03}, {}});
    state.pose.R = Matrix3d::Identity();
    const double mass = 2 * params_.hand_mass;
    double energy = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 100; ++i) {
      dut.Update({}, zero_, no_wrench_, &state);
      const double next =
          0.5 * mass * state.velocity.squaredNorm() +
          0.5 * params_.hand_stiffness * state.pose.p.squaredNorm();
      ASSERT_LE(next, energy * (1 + 1e-9) + 1e-15) << "trial " << trial;
      energy = next;
    }
  }
}

TEST_F(SimulatedHapticDeviceTest, ForceIsLimitedAndMomentHasNoEffect) {
  const SimulatedHapticDevice dut(params_);
  SimulatedHapticDeviceState limited = dut.MakeState();
  SimulatedHapticDeviceState at_limit = dut.MakeState();
  Vector6d huge;
  huge << 0, -1e6, 0, 10, 20, 30;
  for (int i = 0; i < 100; ++i) {
    dut.Update({}, zero_, huge, &limited);
    dut.Update({}, zero_, Wrench({0, -12, 0}), &at_limit);
  }
  EXPECT_LT((limited.pose.p - at_limit.pose.p).norm(), 1e-15);
  EXPECT_EQ(limited.pose.R, Matrix3d::Identity());
}

TEST_F(SimulatedHapticDeviceTest, StopsAtTheEndOfItsWorkspace) {
  const SimulatedHapticDevice dut(params_);
  SimulatedHapticDeviceState state = dut.MakeState();
  Pose intended;
  intended.p = Vector3d(-0.2, 0.3, 0.4);
  for (int i = 0; i < 1000; ++i) {
    dut.Update(intended, zero_, no_wrench_, &state);
    ASSERT_LE(std::abs(state.pose.p.x()), 0.055);
    ASSERT_LE(state.pose.p.tail<2>().norm(), 0.08 * (1 + 1e-15));
  }
  EXPECT_LT((state.pose.p - Vector3d(-0.055, 0.048, 0.064)).norm(), 1e-6);
  EXPECT_LT(state.velocity.norm(), 1e-3);
  // Sliding along the stop is free: only what moves into it stops.
  intended.p = Vector3d(0, 0.3, 0.4);
  for (int i = 0; i < 1000; ++i) {
    dut.Update(intended, zero_, no_wrench_, &state);
  }
  EXPECT_NEAR(state.pose.p.x(), 0, 1e-4);
  // A start outside is moved inside.
  EXPECT_EQ(dut.MakeState({{1, 0, 0}, Matrix3d::Identity()}).pose.p,
            Vector3d(0.055, 0, 0));
}

TEST_F(SimulatedHapticDeviceTest, ReadsInStepsAndVelocityOfARamp) {
  params_.resolution = 1e-4;
  const SimulatedHapticDevice dut(params_);
  SimulatedHapticDeviceState state = dut.MakeState();
  const Vector3d v(0.02, 0, 0);
  const Vector3d w(0, 0.3, 0);
  Pose intended;
  double mean = 0;
  for (int i = 0; i < 2000; ++i) {
    intended.p += v * params_.period;
    intended.R = ExpRotation(w * params_.period) * intended.R;
    dut.Update(intended, v, no_wrench_, &state);
    const Vector3d steps = state.read_pose.p / params_.resolution;
    EXPECT_LT((steps - steps.array().round().matrix()).norm(), 1e-9);
    EXPECT_LE((state.read_pose.p - state.pose.p).cwiseAbs().maxCoeff(),
              0.5 * params_.resolution + 1e-15);
    if (i >= 1000) mean += state.read_velocity(0) / 1000;
  }
  EXPECT_NEAR(mean, 0.02, 2e-4);
  EXPECT_LT((state.read_velocity.tail<3>() - w).norm(), 1e-9);
}

TEST_F(SimulatedHapticDeviceTest, WristIsPassive) {
  const SimulatedHapticDevice dut(params_);
  SimulatedHapticDeviceState state = dut.MakeState();
  Pose intended;
  intended.R = ExpRotation({0.1, -0.2, 0.3});
  dut.Update(intended, zero_, no_wrench_, &state);
  EXPECT_EQ(state.pose.R, intended.R);
  EXPECT_EQ(state.read_pose.R, intended.R);
}

TEST_F(SimulatedHapticDeviceTest, BadInputIsReplacedAndCounted) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const SimulatedHapticDevice dut(params_);
  SimulatedHapticDeviceState state = dut.MakeState();
  Pose good;
  good.p = Vector3d(0.01, 0, 0);
  dut.Update(good, zero_, Wrench({1, 0, 0}), &state);

  SimulatedHapticDeviceState expected = state;
  dut.Update(good, zero_, no_wrench_, &expected);
  Pose bad = good;
  bad.p.y() = kNan;
  Vector6d bad_wrench = Vector6d::Ones();
  bad_wrench(5) = kNan;
  dut.Update(bad, Vector3d(1, 1, 1), bad_wrench, &state);
  EXPECT_EQ(state.pose.p, expected.pose.p);
  EXPECT_EQ(state.velocity, expected.velocity);
  EXPECT_EQ(state.intended.p, good.p);
  EXPECT_EQ(state.bad_inputs, 1);

  bad = good;
  bad.R *= 2;  // Finite, but no rotation.
  dut.Update(bad, zero_, no_wrench_, &state);
  dut.Update(good, Vector3d(kNan, 0, 0), no_wrench_, &state);
  EXPECT_EQ(state.bad_inputs, 3);
  EXPECT_TRUE(state.pose.p.allFinite());
  EXPECT_EQ(state.pose.R, Matrix3d::Identity());
}

TEST_F(SimulatedHapticDeviceTest, CopyContinuesAlikeAndNothingIsAllocated) {
  const SimulatedHapticDevice dut(params_);
  SimulatedHapticDeviceState state = dut.MakeState();
  dut.Update({}, Vector3d(0, 0.1, 0), Wrench({1, 2, 3}), &state);
  SimulatedHapticDeviceState copy = state;
  ScopedNoAlloc guard;
  dut.Update({}, zero_, Wrench({100, 2, 3}), &state);
  EXPECT_EQ(guard.count(), 0);
  dut.Update({}, zero_, Wrench({100, 2, 3}), &copy);
  EXPECT_EQ(copy.pose.p, state.pose.p);
  EXPECT_EQ(copy.read_velocity, state.read_velocity);
}

TEST_F(SimulatedHapticDeviceTest, ErrorsNameFieldRangeAndValue) {
  using Params = SimulatedHapticDeviceParams;
  EXPECT_EQ(ValidationError(Params{}), "no exception");
  for (const auto& [field, member, range] :
       {std::tuple{"hand_mass", &Params::hand_mass, "a number in [0.001, 500]"},
        {"hand_stiffness", &Params::hand_stiffness, "a number in [0, 1e+06]"},
        {"hand_damping", &Params::hand_damping, "a number in [0, 100000]"},
        {"device_mass", &Params::device_mass, "a number in [0.0001, 500]"},
        {"device_damping", &Params::device_damping, "a number in [0, 10000]"},
        {"device_friction", &Params::device_friction, "a number in [0, 1000]"},
        {"max_force", &Params::max_force, "a number in [0, 10000]"},
        {"workspace_radius", &Params::workspace_radius,
         "a number in [0.001, 10]"},
        {"workspace_half_length", &Params::workspace_half_length,
         "a number in [0.001, 10]"},
        {"resolution", &Params::resolution, "a number in [0, 0.1]"},
        {"velocity_cutoff", &Params::velocity_cutoff,
         "0 or a finite value >= 0.01"},
        {"period", &Params::period, "a finite value > 0"}}) {
    Params params;
    params.*member = -1;
    EXPECT_EQ(ValidationError(params),
              std::string("SimulatedHapticDeviceParams: field `") + field +
                  "` expected " + range + ", got -1");
    EXPECT_THROW(SimulatedHapticDevice{params}, std::invalid_argument);
  }
}

TEST_F(SimulatedHapticDeviceTest, StepsOfNoSizeLeaveTheReadingAsItIs) {
  params_.resolution = 5e-324;
  const SimulatedHapticDevice dut(params_);
  SimulatedHapticDeviceState state = dut.MakeState();
  for (int i = 0; i < 100; ++i) {
    dut.Update({}, zero_, Wrench({3, -2, 5}), &state);
    EXPECT_EQ(state.read_pose.p, state.pose.p);
  }
  EXPECT_TRUE(state.read_velocity.allFinite());
}

// Wherever in its ranges a hand and a device are, they are where they can be.
TEST_F(SimulatedHapticDeviceTest, EveryCornerOfTheRangesIsFinite) {
  const Vector3d far(10, -10, 10);
  for (int corner = 0; corner < 64; ++corner) {
    const auto pick = [corner](int bit, double low, double high) {
      return (corner >> bit) % 2 == 0 ? low : high;
    };
    const SimulatedHapticDevice dut({.hand_mass = pick(0, 1e-3, 500),
                                     .hand_stiffness = pick(1, 0, 1e6),
                                     .hand_damping = pick(2, 0, 1e5),
                                     .device_mass = pick(3, 1e-4, 500),
                                     .device_damping = pick(4, 0, 1e4),
                                     .workspace_radius = 10,
                                     .workspace_half_length = 10,
                                     .period = pick(5, 1e-5, 0.1)});
    SimulatedHapticDeviceState state = dut.MakeState();
    for (int i = 0; i < 1000; ++i) {
      const double sign = i % 100 < 50 ? 1 : -1;
      dut.Update({.p = 0.001 * sign * far}, zero_, Wrench(sign * far), &state);
      ASSERT_LE(state.pose.p.norm(), 20) << corner << " at " << i;
      ASSERT_TRUE(state.velocity.allFinite() && state.hand_force.allFinite() &&
                  state.handle_force.allFinite())
          << corner << " at " << i;
    }
  }
}

}  // namespace
}  // namespace dual_proxy
