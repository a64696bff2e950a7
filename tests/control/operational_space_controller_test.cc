// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/operational_space_controller.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include "dual_proxy/common/random.h"
#include "dual_proxy/control/arm_model.h"
#include "no_alloc.h"
#include "test_arm.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

const Matrix3d kAlongZ{Vector3d::UnitZ().asDiagonal()};
const double kNan = std::numeric_limits<double>::quiet_NaN();

// A random arm: any full-rank Jacobian and any positive definite mass matrix.
ModelTerms<7> RandomModel(RandomStream* random) {
  const auto fill = [random](auto&& matrix, double size) {
    for (int i = 0; i < matrix.size(); ++i) {
      matrix.data()[i] = size * random->Normal();
    }
  };
  ModelTerms<7> model;
  fill(model.J_BE, 0.5);
  Matrix7 root;
  fill(root, 0.3);
  model.mass = root * root.transpose() + 0.3 * Matrix7::Identity();
  fill(model.bias, 1);
  fill(model.gravity, 10);
  fill(model.Jdot_v, 0.3);
  return model;
}

template <typename Vector>
Vector RandomVector(RandomStream* random, double size) {
  Vector result;
  for (int i = 0; i < result.size(); ++i) result(i) = size * random->Normal();
  return result;
}

class OperationalSpaceControllerTest : public ::testing::Test {
 protected:
  OperationalSpaceControllerTest() {
    params_.torque_limit.setConstant(1e6);
    params_.torque_rate_limit = 1e12;
    params_.torque_margin = 0;
    params_.force_speed_limit = params_.moment_speed_limit = 1e9;
    // Random joints are anywhere.
    params_.joint_limits.lower.setConstant(-1e9);
    params_.joint_limits.upper.setConstant(1e9);
    params_.joint_limits.speed.setConstant(1e9);
    params_.max_mass = 1e6;
  }

  // With any gains but the defaults.
  void UseImpedance() {
    params_.motion = MotionLaw::kCartesianImpedance;
    params_.impedance = {.stiffness = 400,
                         .damping = 60,
                         .rotational_stiffness = 20,
                         .rotational_damping = 2};
  }

  static Matrix6 Lambda(const OperationalSpaceControllerInput<7>& input) {
    return (input.model.J_BE * input.model.mass.inverse() *
            input.model.J_BE.transpose())
        .inverse();
  }

  OperationalSpaceControllerInput<7> RandomInput() {
    OperationalSpaceControllerInput<7> input;
    input.model = RandomModel(&random_);
    input.q = RandomVector<Vector7>(&random_, 1);
    input.v = RandomVector<Vector7>(&random_, 0.3);
    input.motion_error = RandomVector<Vector3d>(&random_, 0.01);
    input.rotation_error = RandomVector<Vector3d>(&random_, 0.1);
    input.proxy_velocity = RandomVector<Vector6>(&random_, 0.1);
    input.proxy_acceleration = RandomVector<Vector6>(&random_, 1);
    return input;
  }

  // A^-1 (tau + g - C v - J^T F): what the arm does with a torque while its
  // tool exerts F.
  static Vector6 TipAcceleration(const ModelTerms<7>& model,
                                 const Vector7& torque,
                                 const Vector6& wrench = Vector6::Zero()) {
    const Vector7 acceleration = model.mass.ldlt().solve(
        torque + model.gravity - model.bias - model.J_BE.transpose() * wrench);
    return model.J_BE * acceleration + model.Jdot_v;
  }

  OperationalSpaceControllerParams<7> params_;
  RandomStream random_{7};
};

TEST_F(OperationalSpaceControllerTest, InertiaIsTheInverse) {
  for (int i = 0; i < 200; ++i) {
    const ModelTerms<7> model = RandomModel(&random_);
    const OperationalSpaceInertia dut =
        CalcOperationalSpaceInertia(model.J_BE, model.mass, 1e6, 0.2);
    ASSERT_TRUE(dut.valid);
    EXPECT_FALSE(dut.singular);
    const Matrix6 mobility =
        model.J_BE * model.mass.inverse() * model.J_BE.transpose();
    EXPECT_LT((dut.Lambda * mobility - Matrix6::Identity()).norm(), 1e-8);
  }
}

// Along a straight way into a singularity the mass is exact, then bounded, then
// zero, and never jumps.
TEST_F(OperationalSpaceControllerTest, InertiaIsBoundedAndContinuous) {
  constexpr double kMaxMass = 50;
  Matrix67 J = Matrix67::Zero();
  J.leftCols<6>().setIdentity();
  double last = -1;
  bool bounded = false;
  for (int i = 0; i <= 4000; ++i) {
    const double s = 0.3 * (1 - i / 4000.0);
    J(2, 2) = s;  // mobility s^2
    const OperationalSpaceInertia dut =
        CalcOperationalSpaceInertia<7>(J, Matrix7::Identity(), kMaxMass, 1);
    ASSERT_TRUE(dut.valid);
    const double mass = dut.Lambda(2, 2);
    if (s * s > 1 / kMaxMass) {
      EXPECT_FALSE(dut.singular);
      EXPECT_NEAR(mass, 1 / (s * s), 1e-9);
    } else {
      bounded = true;
      EXPECT_LE(mass, 1.125 * kMaxMass * (1 + 1e-9));
    }
    if (last >= 0) {
      EXPECT_LT(std::abs(mass - last), 0.1);
    }
    last = mass;
    EXPECT_NEAR(dut.Lambda(0, 0), 1, 1e-12);
  }
  EXPECT_TRUE(bounded);
  EXPECT_NEAR(last, 0, 1e-9);
}

TEST_F(OperationalSpaceControllerTest, InertiaRejectsAnIndefiniteMassMatrix) {
  Matrix7 mass = Matrix7::Identity();
  mass(3, 3) = -1;
  EXPECT_FALSE(
      CalcOperationalSpaceInertia<7>(Matrix67::Zero(), mass, 50, 1).valid);
}

// Without force space the tool accelerates by the command, whatever velocity,
// gravity, posture and Jdot v are: mu and p are accounted for exactly.
TEST_F(OperationalSpaceControllerTest, MotionIsDecoupledAndExact) {
  const OperationalSpaceController<7> dut(params_);
  for (int i = 0; i < 200; ++i) {
    const OperationalSpaceControllerInput<7> input = RandomInput();
    OperationalSpaceControllerState<7> state = dut.MakeState();
    const auto output = dut.Update(input, &state);
    const Vector6 error = input.model.J_BE * input.v - input.proxy_velocity;
    Vector6 expected = input.proxy_acceleration;
    expected.head<3>() -= 500 * input.motion_error + 40 * error.head<3>();
    expected.tail<3>() -= 600 * input.rotation_error + 38 * error.tail<3>();
    EXPECT_LT((TipAcceleration(input.model, output.torque) - expected).norm(),
              1e-7);
    EXPECT_LT((output.motion_force - expected.head<3>()).norm(), 1e-12);
    EXPECT_LT(
        (output.motion_moment - (Lambda(input) * expected).tail<3>()).norm(),
        1e-7);
    EXPECT_EQ(output.contact_force, Vector3d::Zero());
  }
}

TEST_F(OperationalSpaceControllerTest, PrintedLawHasNoFeedForward) {
  params_.feed_forward = false;
  params_.unit_mass_motion_force = false;
  const OperationalSpaceController<7> dut(params_);
  const OperationalSpaceControllerInput<7> input = RandomInput();
  OperationalSpaceControllerState<7> state = dut.MakeState();
  const auto output = dut.Update(input, &state);
  const Vector6 twist = input.model.J_BE * input.v;
  Vector6 unit;
  unit << -500 * input.motion_error - 40 * twist.head<3>(),
      -600 * input.rotation_error - 38 * twist.tail<3>();
  const Vector6 wrench = Lambda(input) * unit;
  EXPECT_LT((output.motion_force - wrench.head<3>()).norm(), 1e-7);
  EXPECT_LT((output.motion_moment - wrench.tail<3>()).norm(), 1e-7);
}

TEST_F(OperationalSpaceControllerTest, CommandOfAUnitInertia) {
  params_.feed_forward = false;
  params_.unit_inertia_motion_moment = true;
  const OperationalSpaceController<7> dut(params_);
  const OperationalSpaceControllerInput<7> input = RandomInput();
  OperationalSpaceControllerState<7> state = dut.MakeState();
  const Vector3d w = (input.model.J_BE * input.v).tail<3>();
  EXPECT_LT((dut.Update(input, &state).motion_moment +
             600 * input.rotation_error + 38 * w)
                .norm(),
            1e-12);
}

// Pushed aside and held there: by what the spring exerts, whatever the posture,
// the arm's null space and its weight.
TEST_F(OperationalSpaceControllerTest, ImpedanceIsTheSameSpringInEveryPosture) {
  UseImpedance();
  const OperationalSpaceController<7> dut(params_);
  for (int i = 0; i < 200; ++i) {
    OperationalSpaceControllerInput<7> input = RandomInput();
    input.v.setZero();
    input.model.Jdot_v.setZero();
    input.proxy_velocity.setZero();
    input.proxy_acceleration.setZero();
    Vector6 spring;
    spring << -400 * input.motion_error, -20 * input.rotation_error;
    OperationalSpaceControllerState<7> state = dut.MakeState();
    const auto output = dut.Update(input, &state);
    EXPECT_LT(TipAcceleration(input.model, output.torque, spring).norm(), 1e-7);
    EXPECT_LT((output.motion_force - spring.head<3>()).norm(), 1e-12);
    EXPECT_LT((output.motion_moment - spring.tail<3>()).norm(), 1e-12);
  }
}

// Free, the tool moves as its own inertia lets it, and with its proxy.
TEST_F(OperationalSpaceControllerTest, ImpedanceLeavesTheToolItsInertia) {
  UseImpedance();
  const OperationalSpaceController<7> dut(params_);
  for (int i = 0; i < 200; ++i) {
    const OperationalSpaceControllerInput<7> input = RandomInput();
    const Vector6 error = input.model.J_BE * input.v - input.proxy_velocity;
    Vector6 pull;
    pull << -400 * input.motion_error - 60 * error.head<3>(),
        -20 * input.rotation_error - 2 * error.tail<3>();
    OperationalSpaceControllerState<7> state = dut.MakeState();
    const Vector6 expected =
        input.proxy_acceleration + Lambda(input).ldlt().solve(pull);
    EXPECT_LT((TipAcceleration(input.model, dut.Update(input, &state).torque) -
               expected)
                  .norm(),
              1e-7 * (1 + expected.norm()));
  }
}

TEST_F(OperationalSpaceControllerTest, ImpedanceLeavesForceSpaceToTheLoop) {
  const OperationalSpaceController<7> other(params_);
  UseImpedance();
  const OperationalSpaceController<7> dut(params_);
  OperationalSpaceControllerInput<7> input = RandomInput();
  input.force_selection = kAlongZ;
  input.moment_selection = Vector3d::UnitX().asDiagonal();
  input.reference_force = Vector3d(0, 0, 5);
  input.sensed_wrench << 1, 2, 3, 0.1, 0.2, 0.3;
  OperationalSpaceControllerState<7> a = dut.MakeState();
  OperationalSpaceControllerState<7> b = other.MakeState();
  for (int i = 0; i < 50; ++i) {
    const auto output = dut.Update(input, &a);
    const auto expected = other.Update(input, &b);
    EXPECT_EQ(output.contact_force, expected.contact_force);
    EXPECT_EQ(output.contact_moment, expected.contact_moment);
  }
  input.motion_error = Vector3d(0.01, 0, 0.02);
  input.rotation_error = Vector3d(0.1, 0.2, 0);
  input.v.setZero();
  input.proxy_velocity.setZero();
  input.proxy_acceleration.setZero();
  const auto output = dut.Update(input, &a);
  EXPECT_LT((output.motion_force - Vector3d(-4, 0, 0)).norm(), 1e-12);
  EXPECT_LT((output.motion_moment - Vector3d(0, -4, 0)).norm(), 1e-12);
}

// In steady contact with a frictionless wall: F_s = F_r, the wall takes F_f.
TEST_F(OperationalSpaceControllerTest, ContactForceIsCommanded) {
  params_.position_stiffness = params_.position_damping = 0;
  const OperationalSpaceController<7> dut(params_);
  for (int i = 0; i < 50; ++i) {
    OperationalSpaceControllerInput<7> input = RandomInput();
    input.v.setZero();
    input.model.Jdot_v.setZero();
    input.rotation_error.setZero();
    input.proxy_velocity.setZero();
    input.proxy_acceleration.setZero();
    input.force_selection = kAlongZ;
    input.reference_force = Vector3d(0, 0, 6);
    input.sensed_wrench << 0, 0, 6, 0, 0, 0;
    OperationalSpaceControllerState<7> state = dut.MakeState();
    const auto output = dut.Update(input, &state);
    EXPECT_LT((output.contact_force - Vector3d(0, 0, 6)).norm(), 1e-12);
    EXPECT_LT(
        TipAcceleration(input.model, output.torque, input.sensed_wrench).norm(),
        1e-7);
  }
}

TEST_F(OperationalSpaceControllerTest, SelectionsSplitForceAndMotion) {
  params_.unit_inertia_motion_moment = true;
  params_.passivity = false;
  params_.force_filter_cutoff = 0;
  const OperationalSpaceController<7> dut(params_);
  OperationalSpaceControllerInput<7> input = RandomInput();
  input.force_selection = kAlongZ;
  input.moment_selection = Vector3d::UnitX().asDiagonal();
  input.reference_force = Vector3d(0, 0, 5);
  input.reference_moment = Vector3d(0.3, 0, 0);
  input.sensed_wrench << 1, 2, 3, 0.1, 0.2, 0.3;
  OperationalSpaceControllerState<7> state = dut.MakeState();
  const auto output = dut.Update(input, &state);
  const Vector6 twist = input.model.J_BE * input.v;
  EXPECT_EQ(output.motion_force.z(), 0);
  EXPECT_NE(output.motion_force.x(), 0);
  EXPECT_EQ(output.motion_moment.x(), 0);
  EXPECT_NE(output.motion_moment.y(), 0);
  EXPECT_EQ(output.contact_force.head<2>(), Eigen::Vector2d::Zero());
  EXPECT_NEAR(output.contact_force.z(),
              5 + 2.5 * 2 + 5.5 * 2e-3 - 20 * twist(2), 1e-9);
  EXPECT_NEAR(output.contact_moment.x(),
              0.3 + 2.5 * 0.2 + 5.5 * 0.2e-3 - 0.8 * twist(3), 1e-9);
}

// A change of selection must not step the torque: in static contact under
// motion control, F_s = Lambda Kpm dx; the bumpless reference takes over.
TEST_F(OperationalSpaceControllerTest, HandOverDoesNotStepTheTorque) {
  params_.force_integral_gain = 0;
  const OperationalSpaceController<7> dut(params_);
  OperationalSpaceControllerInput<7> input;
  input.model.J_BE.leftCols<6>().setIdentity();
  input.model.mass = 7 * Matrix7::Identity();
  input.q = params_.q_rest;
  input.motion_error = Vector3d(0, 0, -0.002);
  const double push = 7 * 500 * 0.002;
  input.sensed_wrench(2) = push;
  OperationalSpaceControllerState<7> state = dut.MakeState();
  const Vector7 before = dut.Update(input, &state).torque;
  EXPECT_NEAR(before(2), push, 1e-9);
  input.motion_error.setZero();
  input.force_selection = kAlongZ;
  input.reference_force = Vector3d(0, 0, push);
  for (int i = 0; i < 60; ++i) {
    EXPECT_NEAR(dut.Update(input, &state).torque(2), push, 1e-9);
  }
  // And back, after a release: motion takes over within the blend.
  input.reference_force.setZero();
  input.sensed_wrench.setZero();
  for (int i = 0; i < 60; ++i) dut.Update(input, &state);
  double last = dut.Update(input, &state).torque(2);
  EXPECT_NEAR(last, 0, 1e-6);
  input.force_selection.setZero();
  input.motion_error = Vector3d(0, 0, -0.002);
  for (int i = 0; i < 40; ++i) {
    const double now = dut.Update(input, &state).torque(2);
    EXPECT_LE(std::abs(now - last), 1.001 * push / 30);
    last = now;
  }
  EXPECT_NEAR(last, push, 1e-6);
}

TEST_F(OperationalSpaceControllerTest, PostureGivesNoTaskAcceleration) {
  params_.posture_stiffness = 0;
  params_.posture_damping = 0;
  const OperationalSpaceController<7> without(params_);
  params_.posture_stiffness = 25;
  params_.posture_damping = 10;
  const OperationalSpaceController<7> with(params_);
  for (int i = 0; i < 100; ++i) {
    const OperationalSpaceControllerInput<7> input = RandomInput();
    OperationalSpaceControllerState<7> a = with.MakeState();
    OperationalSpaceControllerState<7> b = without.MakeState();
    const Vector7 null_torque =
        with.Update(input, &a).torque - without.Update(input, &b).torque;
    EXPECT_GT(null_torque.norm(), 1e-3);
    EXPECT_LT(
        (input.model.J_BE * input.model.mass.ldlt().solve(null_torque)).norm(),
        1e-7);
  }
}

class OperationalSpaceControllerLawTest
    : public OperationalSpaceControllerTest,
      public ::testing::WithParamInterface<MotionLaw> {};

INSTANTIATE_TEST_SUITE_P(Laws, OperationalSpaceControllerLawTest,
                         ::testing::Values(MotionLaw::kOperationalSpace,
                                           MotionLaw::kCartesianImpedance));

TEST_P(OperationalSpaceControllerLawTest, StartsAtGravityAndLimitsTheRateLast) {
  params_.motion = GetParam();
  params_.torque_limit = OperationalSpaceControllerParams<7>{}.torque_limit;
  params_.torque_rate_limit = 1000;
  params_.torque_margin = 0.05;
  const OperationalSpaceController<7> dut(params_);
  OperationalSpaceControllerState<7> state = dut.MakeState();
  OperationalSpaceControllerInput<7> input = RandomInput();
  Vector7 last = (-input.model.gravity)
                     .cwiseMax(-0.95 * params_.torque_limit)
                     .cwiseMin(0.95 * params_.torque_limit);
  for (int i = 0; i < 2000; ++i) {
    if (i > 0) input = RandomInput();
    input.force_selection = i % 70 < 35 ? kAlongZ : Matrix3d::Zero();
    input.motion_error *= 100;
    const Vector7 torque = dut.Update(input, &state).torque;
    EXPECT_LE((torque - last).cwiseAbs().maxCoeff(), 0.95 + 1e-9);
    EXPECT_TRUE(
        ((0.95 * params_.torque_limit - torque.cwiseAbs()).array() >= -1e-9)
            .all());
    last = torque;
  }
  EXPECT_GT(state.torque_limited, 0);
  EXPECT_GT(state.rate_limited, 0);
}

// A command that would break a joint's speed or end is cut for that joint, and
// the others make up for it: the tool point accelerates as it would.
TEST_P(OperationalSpaceControllerLawTest,
       OneJointAtItsLimitLeavesTheToolItsPlace) {
  params_.motion = GetParam();
  const OperationalSpaceController<7> free(params_);
  params_.joint_limits.speed(3) = 1;
  params_.joint_limits.speed_margin = 0.1;
  const OperationalSpaceController<7> dut(params_);
  for (int i = 0; i < 100; ++i) {
    OperationalSpaceControllerInput<7> input = RandomInput();
    input.v(3) = i % 2 == 0 ? 0.95 : -0.95;
    const auto accelerate = [&](const OperationalSpaceController<7>& controller,
                                OperationalSpaceControllerState<7>* state) {
      const Vector7 torque = controller.Update(input, state).torque;
      return Vector7(input.model.mass.ldlt().solve(
          torque + input.model.gravity - input.model.bias));
    };
    OperationalSpaceControllerState<7> a = free.MakeState();
    OperationalSpaceControllerState<7> b = dut.MakeState();
    const Vector7 wanted = accelerate(free, &a);
    const Vector7 limited = accelerate(dut, &b);
    const double low = (-0.9 - input.v(3)) / 0.02;
    const double high = (0.9 - input.v(3)) / 0.02;
    const double change = std::clamp(wanted(3), low, high) - wanted(3);
    EXPECT_NEAR(limited(3) - wanted(3), change, 1e-5 * (1 + std::abs(change)));
    EXPECT_EQ(b.joint_limited, change != 0 ? 1 : 0);
    const auto J_v = input.model.J_BE.topRows<3>();
    EXPECT_LE((J_v * (limited - wanted)).norm(),
              0.05 * J_v.col(3).norm() * std::abs(change) + 1e-6);
  }
}

// The pull of an error is at most what the damping answers at the limit;
// without damping there is no such speed.
TEST_F(OperationalSpaceControllerTest, ErrorsAreClosedNoFasterThanTheLimits) {
  params_.motion_speed_limit = 0.5;
  params_.rotation_speed_limit = 1;
  OperationalSpaceControllerInput<7> input = RandomInput();
  input.v.setZero();
  input.proxy_velocity.setZero();
  input.proxy_acceleration.setZero();
  input.motion_error = Vector3d(0.3, 0, 0.4);
  input.rotation_error = Vector3d(0, 0.5, 0);
  const auto pull = [&] {
    const OperationalSpaceController<7> dut(params_);
    OperationalSpaceControllerState<7> state = dut.MakeState();
    return dut.Update(input, &state).motion_force;
  };
  EXPECT_LT((pull() + 40 * 0.5 * Vector3d(0.6, 0, 0.8)).norm(), 1e-9);
  params_.position_damping = 0;
  EXPECT_LT((pull() + 500 * input.motion_error).norm(), 1e-9);
  UseImpedance();
  EXPECT_LT((pull() + 60 * 0.5 * Vector3d(0.6, 0, 0.8)).norm(), 1e-9);
}

// Franka's arms hold their weight themselves.
TEST_F(OperationalSpaceControllerTest, LeavesTheWeightToAnArmThatHoldsIt) {
  const OperationalSpaceController<7> with(params_);
  params_.gravity_compensation = false;
  const OperationalSpaceController<7> without(params_);
  OperationalSpaceControllerInput<7> input = RandomInput();
  auto state_with = with.MakeState();
  auto state_without = without.MakeState();
  const Vector7 torque = with.Update(input, &state_with).torque;
  const Vector7 rest = without.Update(input, &state_without).torque;
  EXPECT_TRUE((torque + input.model.gravity).isApprox(rest, 1e-12));
  // Also when it holds and brakes.
  input.motion_error(0) = kNan;
  const Vector7 braking = with.Update(input, &state_with).torque;
  EXPECT_TRUE(
      (braking + input.model.gravity)
          .isApprox(without.Update(input, &state_without).torque, 1e-12));
  // The first torque starts at none.
  params_.torque_rate_limit = 1;
  const OperationalSpaceController<7> slow(params_);
  auto state = slow.MakeState();
  EXPECT_LE(slow.Update(RandomInput(), &state).torque.cwiseAbs().maxCoeff(),
            1.001e-3);
}

TEST_F(OperationalSpaceControllerTest, RateIsLimitedAgainstWhatTheArmGot) {
  params_.torque_rate_limit = 1000;
  const OperationalSpaceController<7> dut(params_);
  auto state = dut.MakeState();
  OperationalSpaceControllerInput<7> input = RandomInput();
  const Vector7 last = dut.Update(input, &state).torque;
  input.received_torque = last + Vector7::Constant(0.3);
  const Vector7 torque = dut.Update(input, &state).torque;
  EXPECT_LE((torque - *input.received_torque).cwiseAbs().maxCoeff(), 1 + 1e-9);
  EXPECT_GT((torque - last).cwiseAbs().maxCoeff(), 1.2);
  // What is no number says nothing.
  input.received_torque = Vector7::Constant(kNan);
  EXPECT_LE((dut.Update(input, &state).torque - torque).cwiseAbs().maxCoeff(),
            1 + 1e-9);
}

TEST_F(OperationalSpaceControllerTest, VelocityIsFedForwardAlone) {
  params_.acceleration_feed_forward = false;
  const OperationalSpaceController<7> dut(params_);
  auto state = dut.MakeState();
  OperationalSpaceControllerInput<7> input = RandomInput();
  const Vector7 torque = dut.Update(input, &state).torque;
  input.proxy_acceleration.setZero();
  params_.acceleration_feed_forward = true;
  const OperationalSpaceController<7> both(params_);
  auto other = both.MakeState();
  EXPECT_EQ(torque, both.Update(input, &other).torque);
}

TEST_F(OperationalSpaceControllerTest, RandomSweepStaysFinite) {
  const OperationalSpaceController<7> dut{
      OperationalSpaceControllerParams<7>{}};
  OperationalSpaceControllerState<7> state = dut.MakeState();
  for (int i = 0; i < 3000; ++i) {
    OperationalSpaceControllerInput<7> input = RandomInput();
    const double rank_loss = std::pow(10, -12 * random_.Uniform());
    input.model.J_BE.row(i % 6) *= rank_loss;
    const auto output = dut.Update(input, &state);
    EXPECT_TRUE(output.torque.allFinite());
    EXPECT_GE(output.injected_damping, 0);
  }
  EXPECT_EQ(state.bad_inputs, 0);
  EXPECT_GT(state.singular, 0);
}

TEST_F(OperationalSpaceControllerTest, BadInputBrakesAndHoldsTheWeight) {
  params_.torque_rate_limit = 1000;
  const OperationalSpaceController<7> dut(params_);
  OperationalSpaceControllerState<7> state = dut.MakeState();
  OperationalSpaceControllerInput<7> input = RandomInput();
  input.motion_error = Vector3d(0.01, 0, 0);
  for (int i = 0; i < 30; ++i) dut.Update(input, &state);
  const Vector7 held = -input.model.gravity - input.model.mass * input.v / 0.05;
  EXPECT_GT((state.torque - held).norm(), 1);
  input.motion_error.x() = kNan;
  Vector7 last = state.torque;
  for (int i = 0; i < 1000; ++i) {
    const auto output = dut.Update(input, &state);
    EXPECT_LE((output.torque - last).cwiseAbs().maxCoeff(), 1 + 1e-9);
    EXPECT_EQ(output.motion_force, Vector3d::Zero());
    last = output.torque;
  }
  EXPECT_TRUE(last.isApprox(held, 1e-12));
  EXPECT_EQ(state.bad_inputs, 1000);
}

// What accelerated the arm before would go on doing so.
TEST_F(OperationalSpaceControllerTest, WithoutAModelTheLastOneBrakes) {
  const OperationalSpaceController<7> dut(params_);
  OperationalSpaceControllerState<7> state = dut.MakeState();
  OperationalSpaceControllerInput<7> input = RandomInput();
  OperationalSpaceControllerInput<7> bad = input;
  bad.model.mass(2, 3) = kNan;
  EXPECT_EQ(dut.Update(bad, &state).torque, Vector7::Zero());
  dut.Update(input, &state);
  bad.v *= 0.5;
  Vector7 torque = Vector7::Zero();
  for (int i = 0; i < 1000; ++i) torque = dut.Update(bad, &state).torque;
  const Vector7 brake = -input.model.mass * bad.v / 0.05;
  EXPECT_TRUE(torque.isApprox(brake - input.model.gravity, 1e-12));
  bad.v(0) = kNan;
  for (int i = 0; i < 1000; ++i) torque = dut.Update(bad, &state).torque;
  EXPECT_TRUE(torque.isApprox(-input.model.gravity, 1e-12));
  EXPECT_EQ(state.bad_inputs, 2001);
}

// Every input is looked at, and a selection that is no projection is refused.
TEST_F(OperationalSpaceControllerTest, EveryBadInputIsRefused) {
  const OperationalSpaceController<7> dut(params_);
  OperationalSpaceControllerState<7> state = dut.MakeState();
  const OperationalSpaceControllerInput<7> good = RandomInput();
  std::int64_t expected = 0;
  const auto refuse = [&](auto set) {
    OperationalSpaceControllerInput<7> input = good;
    set(input);
    const auto output = dut.Update(input, &state);
    EXPECT_TRUE(output.torque.allFinite());
    EXPECT_EQ(state.bad_inputs, ++expected);
  };
  using I = OperationalSpaceControllerInput<7>;
  refuse([](I& i) { i.model.J_BE(0, 0) = kNan; });
  refuse([](I& i) { i.model.mass(0, 0) = kNan; });
  refuse([](I& i) { i.model.mass *= -1; });
  refuse([](I& i) { i.model.bias(0) = kNan; });
  refuse([](I& i) { i.model.gravity(0) = kNan; });
  refuse([](I& i) { i.model.Jdot_v(0) = kNan; });
  refuse([](I& i) { i.q(0) = kNan; });
  refuse([](I& i) { i.v(0) = kNan; });
  refuse([](I& i) { i.motion_error(0) = kNan; });
  refuse([](I& i) { i.rotation_error(0) = kNan; });
  refuse([](I& i) { i.proxy_velocity(5) = kNan; });
  refuse([](I& i) { i.proxy_acceleration(5) = kNan; });
  refuse([](I& i) { i.reference_force(0) = kNan; });
  refuse([](I& i) { i.reference_moment(0) = kNan; });
  refuse([](I& i) { i.sensed_wrench(5) = kNan; });
  refuse([](I& i) { i.force_selection(0, 0) = kNan; });
  refuse([](I& i) { i.force_selection = 0.5 * Matrix3d::Identity(); });
  refuse([](I& i) { i.moment_selection(0, 1) = 1; });
}

TEST_F(OperationalSpaceControllerTest, CopyContinuesAlike) {
  const OperationalSpaceController<7> dut{
      OperationalSpaceControllerParams<7>{}};
  OperationalSpaceControllerState<7> state = dut.MakeState();
  OperationalSpaceControllerInput<7> input = RandomInput();
  input.force_selection = kAlongZ;
  for (int i = 0; i < 10; ++i) dut.Update(input, &state);
  OperationalSpaceControllerState<7> copy = state;
  input.force_selection.setZero();
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(dut.Update(input, &state).torque,
              dut.Update(input, &copy).torque);
  }
}

TEST_F(OperationalSpaceControllerTest, DoesNotAllocate) {
  const OperationalSpaceController<7> dut(params_);
  OperationalSpaceControllerState<7> state = dut.MakeState();
  OperationalSpaceControllerInput<7> input = RandomInput();
  OperationalSpaceControllerInput<7> singular = input;
  singular.model.J_BE.row(0).setZero();
  OperationalSpaceControllerInput<7> bad = input;
  bad.q(0) = kNan;
  ScopedNoAlloc guard;
  dut.Update(input, &state);
  dut.Update(singular, &state);
  dut.Update(bad, &state);
  EXPECT_EQ(guard.count(), 0);
  EXPECT_EQ(state.singular, 1);
  EXPECT_EQ(state.bad_inputs, 1);
}

TEST_F(OperationalSpaceControllerTest, InvalidParamsNameTheField) {
  using P = OperationalSpaceControllerParams<7>;
  const auto error = [](auto set) {
    P params;
    set(params);
    EXPECT_THROW(OperationalSpaceController<7>{params}, std::invalid_argument);
    return ValidationError(params);
  };
  const std::string who = "OperationalSpaceControllerParams: field `";
  const auto negative = [&](const std::string& field, double P::* member) {
    EXPECT_EQ(error([member](P& p) { p.*member = -1; }),
              who + field + "` expected a finite value >= 0, got -1");
  };
  negative("position_stiffness", &P::position_stiffness);
  negative("position_damping", &P::position_damping);
  negative("rotation_stiffness", &P::rotation_stiffness);
  negative("rotation_damping", &P::rotation_damping);
  negative("force_gain", &P::force_gain);
  negative("force_integral_gain", &P::force_integral_gain);
  negative("force_damping", &P::force_damping);
  negative("motion_speed_limit", &P::motion_speed_limit);
  negative("rotation_speed_limit", &P::rotation_speed_limit);
  negative("posture_speed_limit", &P::posture_speed_limit);
  negative("max_proportional_force", &P::max_proportional_force);
  negative("max_proportional_moment", &P::max_proportional_moment);
  negative("max_integral_force", &P::max_integral_force);
  negative("moment_gain", &P::moment_gain);
  negative("moment_integral_gain", &P::moment_integral_gain);
  negative("moment_damping", &P::moment_damping);
  negative("max_integral_moment", &P::max_integral_moment);
  EXPECT_EQ(error([](P& p) { p.force_filter_cutoff = -1; }),
            who +
                "force_filter_cutoff` expected 0 or a finite value >= 0.01, "
                "got -1");
  negative("selection_blend_time", &P::selection_blend_time);
  negative("posture_stiffness", &P::posture_stiffness);
  negative("posture_damping", &P::posture_damping);
  const auto not_positive = [&](const std::string& field, double P::* member) {
    EXPECT_EQ(error([member](P& p) { p.*member = 0; }),
              who + field + "` expected a finite value > 0, got 0");
  };
  not_positive("force_speed_limit", &P::force_speed_limit);
  not_positive("moment_speed_limit", &P::moment_speed_limit);
  not_positive("max_mass", &P::max_mass);
  not_positive("characteristic_length", &P::characteristic_length);
  not_positive("torque_rate_limit", &P::torque_rate_limit);
  not_positive("period", &P::period);
  EXPECT_EQ(error([](P& p) { p.torque_limit(6) = -12; }),
            who + "torque_limit[6]` expected a finite value > 0, got -12");
  EXPECT_NE(error([](P& p) { p.torque_margin = 1; }).find("`torque_margin`"),
            std::string::npos);
  EXPECT_NE(error([](P& p) {
              p.joint_limits.position_margin = -1;
            }).find("`position_margin`"),
            std::string::npos);
  EXPECT_NE(error([](P& p) { p.q_rest(2) = kNan; }).find("`q_rest`"),
            std::string::npos);
  EXPECT_NE(error([](P& p) {
              p.force_passivity.max_energy = 0;
            }).find("`max_energy`"),
            std::string::npos);
  EXPECT_NE(error([](P& p) {
              p.moment_passivity.max_damping = -1;
            }).find("`max_damping`"),
            std::string::npos);
  EXPECT_EQ(error([](P& p) { p.impedance.damping = -1; }),
            "CartesianImpedanceParams: field `damping` expected a finite value "
            ">= 0, got -1");
}

// Without redundancy, too, the tool accelerates as it is told to, and holds the
// arm's weight.
TEST(SixJointControllerTest, TheToolAcceleratesAsAsked) {
  using Joints = JointVector<6>;
  OperationalSpaceControllerParams<6> params;
  params.joint_limits.lower.setConstant(-9);
  params.joint_limits.upper.setConstant(9);
  params.joint_limits.speed.setConstant(9);
  params.torque_limit.setConstant(1e6);
  params.torque_rate_limit = 1e12;
  const OperationalSpaceController<6> dut(params);
  OperationalSpaceControllerState<6> state = dut.MakeState();
  const ArmModel<6> arm(MakeSixJointArm());
  RandomStream random(11);
  for (int i = 0; i < 50; ++i) {
    OperationalSpaceControllerInput<6> input;
    input.q = kSixJointArmAtRest + RandomVector<Joints>(&random, 0.1);
    input.v = RandomVector<Joints>(&random, 0.3);
    input.proxy_acceleration = RandomVector<Vector6>(&random, 1);
    Pose X_BE;
    arm.Calc(input.q, input.v, &X_BE, &input.model);
    input.proxy_velocity = input.model.J_BE * input.v;
    const Joints torque = dut.Update(input, &state).torque;
    const Joints acceleration = input.model.mass.ldlt().solve(
        torque + input.model.gravity - input.model.bias);
    EXPECT_LT((input.model.J_BE * acceleration + input.model.Jdot_v -
               input.proxy_acceleration)
                  .norm(),
              1e-9);
  }
  EXPECT_EQ(state.bad_inputs, 0);
}

TEST(SixJointControllerTest, HasNoLimitsOfItsOwn) {
  const std::string error =
      ValidationError(OperationalSpaceControllerParams<6>{});
  EXPECT_NE(error.find("speed[0]"), std::string::npos) << error;
}

}  // namespace
}  // namespace dual_proxy
