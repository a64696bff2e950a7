// SPDX-License-Identifier: BSD-3-Clause
// What the hand feels of a model, what the robot does with it, and how it is
// found.
#include "dual_proxy/schemes/model_mediated/scheme.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "dual_proxy/common/random.h"
#include "dual_proxy/common/rotation.h"
#include "no_alloc.h"
#include "textbook_bench.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kPeriod = 0.001;
constexpr double kDepth = 0.04;  // m: where the hand means to be, in B.
constexpr double kHand = 600 / TextbookBench<ModelMediatedScheme>::kScale;
using Bench = TextbookBench<ModelMediatedScheme>;

Bench::Params MakeBenchParams(double delay, double wall_stiffness = 3e4) {
  Bench::Params params;
  params.channel.delay = delay;
  params.wall_stiffness = wall_stiffness;
  params.hand_stiffness = 600;
  params.hand.z() = -kDepth / Bench::kScale;
  return params;
}

class DelayTest : public ::testing::TestWithParam<double> {};

INSTANTIATE_TEST_SUITE_P(ModelMediated, DelayTest,
                         ::testing::Values(0.0, 0.05, 0.15, 0.35, 0.65, 1.5));

// The stiffness of a wall of 3e4 N/m shows in no motion of the robot, so that
// it is rendered with 500 N/m: two springs in a row, hand and model. The robot
// exerts what the hand feels.
TEST_P(DelayTest, SteadyForceIsThatOfTheRenderedWall) {
  const double expected = kDepth / (1 / kHand + 1.0 / 500);
  ASSERT_NEAR(expected, 6.49, 0.005);
  Bench bench(MakeBenchParams(GetParam()));
  bench.AdvanceTo(30);
  EXPECT_TRUE(bench.connected());
  EXPECT_EQ(bench.robot().surface.stiffness, 0);
  for (const bool of_wall : {true, false}) {
    const auto [lowest, highest] = bench.Range(1, [&] {
      return of_wall ? bench.wall_force() : bench.device_force().z();
    });
    EXPECT_NEAR(lowest, expected, 0.01 * expected);
    EXPECT_NEAR(highest, expected, 0.01 * expected);
    // A standard deviation can not be more than half of this.
    EXPECT_LT(highest - lowest, 2 * 0.02);
  }
}

// What gives way is felt as it is, beginning where it begins.
TEST_P(DelayTest, SoftWallsAreRenderedWithTheirOwnStiffness) {
  for (const double stiffness : {300.0, 500.0, 1000.0, 2000.0}) {
    Bench bench(MakeBenchParams(GetParam(), stiffness));
    bench.AdvanceTo(30);
    EXPECT_NEAR(bench.robot().surface.stiffness, stiffness, 0.01 * stiffness);
    EXPECT_NEAR(bench.haptic().surface.offset, -Bench::Start().z(), 1e-4);
    const double expected = kDepth / (1 / kHand + 1 / stiffness);
    const auto [lowest, highest] =
        bench.Range(1, [&] { return bench.wall_force(); });
    EXPECT_NEAR(lowest, expected, 0.01 * expected);
    EXPECT_NEAR(highest, expected, 0.01 * expected);
  }
}

// The hand comes down at 20 mm/s. With its spring alone the force on it would
// change by 25 N/s, with damping that begins in full it would step by half a
// newton.
TEST_P(DelayTest, FirstContactGivesNoForceStep) {
  Bench::Params params = MakeBenchParams(GetParam());
  params.handle.z() = params.hand.z() = 0.004;
  Bench bench(params);
  bench.AdvanceTo(3);
  ASSERT_EQ(bench.wall_force(), 0);
  double largest = 0;
  double last = 0;
  for (int i = 0; i < 8000; ++i) {
    bench.set_hand(
        {0, 0, std::max(-kDepth / Bench::kScale, 0.004 - 0.02 * i * kPeriod)});
    bench.Step();
    const double force = bench.device_force().z();
    largest = std::max(largest, std::abs(force - last));
    last = force;
  }
  EXPECT_GT(last, 6.4);
  EXPECT_LT(largest, 0.1);
}

// The model stays with the hand when the robot has left the wall, so that the
// second touch is felt when it happens and not two delays later.
TEST_P(DelayTest, KnownWallIsFeltAtOnce) {
  Bench bench(MakeBenchParams(GetParam()));
  bench.AdvanceTo(20);
  const Vector3d pressed(0, 0, -kDepth / Bench::kScale);
  bench.set_hand({0, 0, 0.02});
  bench.AdvanceTo(30);
  ASSERT_FALSE(bench.robot().surface.contact);
  ASSERT_EQ(bench.device_force().norm(), 0);
  bench.set_hand(pressed);
  while (bench.handle().z() > -0.0001) bench.Step();
  bench.AdvanceTo(bench.time() + 0.02);
  EXPECT_GT(bench.device_force().z(), 1);
  bench.AdvanceTo(60);
  EXPECT_NEAR(bench.wall_force(), 6.45, 0.05);
}

// --- What the hand feels -----------------------------------------------------

class ModelMediatedHapticHalfTest : public ::testing::Test {
 protected:
  static HapticHalfParams MakeShared() {
    HapticHalfParams shared;
    shared.proxy.map = {.R_DB = ExpRotation({0, 0, 1}), .scale = 2.5};
    return shared;
  }

  // A message a period.
  void Send(const Vector3d& normal, const Vector3d& point,
            double stiffness = 500, bool contact = true) {
    ModelMediatedSurfaceMessage message;
    message.sequence = ++sequence_;
    message.send_time = time_;
    message.contact = contact;
    message.normal = normal;
    message.point = point;
    message.stiffness = stiffness;
    input_.message = ToMessage(message);
  }

  // Where the hand is, in B and in the robot's scale.
  void MoveTo(const Vector3d& x_d) {
    input_.X_DH.p = WorkspaceMap(shared_.proxy.map).HapticProxy(x_d, R_).p;
  }

  // N, in B: on the hand.
  Vector3d Step() {
    dut_.Update(time_, input_, &state_);
    time_ += kPeriod;
    return shared_.proxy.map.R_DB.transpose() *
           state_.output.setpoint.reference_force;
  }

  Matrix3d R_{Matrix3d::Identity()};
  HapticHalfParams shared_{MakeShared()};
  ModelMediatedHapticHalf dut_{shared_, {}};
  ModelMediatedHapticHalfState state_{dut_.MakeState()};
  HapticHalfInput input_;
  double time_{0};
  std::int64_t sequence_{-1};
};

// 10 mm up and 10 mm down, as at first contact: at 0.04 m/s, which with 500 N/m
// is 20 N/s.
TEST_F(ModelMediatedHapticHalfTest, ModelThatJumpsMovesTheForceSlowly) {
  MoveTo({0, 0, 0.02});
  double last = 0;
  double last_offset = 0.02;
  for (const double surface : {0.01, 0.0, 0.01, 0.03}) {
    double steps = 0;
    for (int i = 0; i < 1000; ++i, ++steps) {
      Send(Vector3d::UnitZ(), {0, 0, surface});
      const double force = Step().z();
      EXPECT_LE(std::abs(force - last), 20 * kPeriod * (1 + 1e-9));
      EXPECT_LE(std::abs(state_.surface.offset - last_offset),
                0.04 * kPeriod * (1 + 1e-9));
      if (force == last) break;
      last = force;
      last_offset = state_.surface.offset;
      if (force == 0) last_offset = surface;
    }
    EXPECT_NEAR(last, -500 * std::max(0.0, 0.02 - surface), 1e-9);
    EXPECT_NEAR(steps, 250, 2);
  }
}

// Whatever changes, and all at once.
TEST_F(ModelMediatedHapticHalfTest, NoChangeOfTheModelIsFasterThanTheRate) {
  RandomStream random(3);
  const Vector3d x_d(0.45, 0, 0.18);
  MoveTo(x_d);
  Vector3d last = Vector3d::Zero();
  double largest = 0;
  for (int i = 0; i < 20000; ++i) {
    if (i % 500 == 0) {
      const Vector3d normal(random.Normal(), random.Normal(), random.Normal());
      const double stiffness = 200 + 1800 * random.Uniform();
      Send(normal.normalized(), x_d + 0.02 * random.Normal() * normal,
           stiffness, random.Uniform() < 0.5);
    } else if (i % 20 == 0) {
      Send(state_.goal.normal, state_.goal.point, state_.goal.stiffness);
    }
    const Vector3d force = Step();
    EXPECT_LE((force - last).norm(), 20 * kPeriod * (1 + 1e-6)) << i;
    last = force;
    largest = std::max(largest, force.norm());
  }
  EXPECT_GT(largest, 5);
}

// Out of the surface it may go anywhere at once.
TEST_F(ModelMediatedHapticHalfTest, ModelIsRightWhereItIsNotFelt) {
  MoveTo({0, 0, -0.001});
  Send(Vector3d::UnitZ(), Vector3d::Zero());
  EXPECT_EQ(Step(), Vector3d::Zero());
  EXPECT_EQ(state_.surface.offset, 0);
  MoveTo({0, 0, 0.004});
  EXPECT_NEAR(Step().z(), -2, 1e-9);
  // x_p lies on it, and the command is the spring's, in B.
  const auto sent =
      FromMessage<ModelMediatedMotionMessage>(state_.output.message);
  EXPECT_EQ(sent.sequence, 0);
  time_ += 0.02;
  Step();
  const auto next =
      FromMessage<ModelMediatedMotionMessage>(state_.output.message);
  EXPECT_LT(next.pose.p.norm(), 1e-12);
  EXPECT_LT((next.force - Vector3d(0, 0, 2)).norm(), 1e-9);
}

// Damping of 27 N s/m of the device; it does not hold the hand back.
TEST_F(ModelMediatedHapticHalfTest, SurfaceDampsAndNeverPulls) {
  MoveTo({0, 0, -0.001});
  Send(Vector3d::UnitZ(), Vector3d::Zero());
  Step();
  MoveTo({0, 0, 0.004});
  input_.device_velocity(2) = 0.05;
  EXPECT_NEAR(Step().z(), -2 - 27 * 0.05, 1e-9);
  input_.device_velocity(2) = -0.05;
  EXPECT_NEAR(Step().z(), -2 + 27 * 0.05, 1e-9);
  input_.device_velocity(2) = -0.5;
  EXPECT_NEAR(Step().z(), 0, 1e-9);
  input_.device_velocity(2) = 0.5;
  MoveTo({0, 0, 0.0002});
  EXPECT_NEAR(Step().z(), -0.1 - 0.1 * 27 * 0.5, 1e-9);
}

TEST_F(ModelMediatedHapticHalfTest, LostLinkIsForgottenAtItsRate) {
  MoveTo({0, 0, -0.001});
  Send(Vector3d::UnitZ(), Vector3d::Zero());
  Step();
  MoveTo({0, 0, 0.01});
  double last = Step().z();
  ASSERT_NEAR(last, -5, 1e-9);
  time_ += 0.5;
  for (int i = 1; i <= 100; ++i) EXPECT_NEAR(Step().z(), -5 + 0.02 * i, 1e-9);
  EXPECT_EQ(state_.output.link.status, LinkStatus::kLost);
  // Back before it has gone; the robot is off the surface, then on it again.
  Send(Vector3d::UnitZ(), Vector3d::Zero(), 500, false);
  EXPECT_NEAR(Step().z(), -2.98, 1e-9);
  EXPECT_FALSE(state_.known);
  Send(Vector3d::UnitZ(), Vector3d::Zero());
  for (int i = 0; i < 500; ++i) {
    last = Step().z();
    EXPECT_GT(last, -5 - 1e-9);
  }
  EXPECT_NEAR(last, -5, 1e-9);
  // So is what is not valid.
  input_.X_DH.p.x() = kNan;
  EXPECT_NEAR(Step().z(), -4.98, 1e-9);
  EXPECT_EQ(state_.output.bad_inputs, 1);
  EXPECT_FALSE(state_.known);
}

TEST_F(ModelMediatedHapticHalfTest, ForceScaleIsTheHandsShare) {
  ModelMediatedParams own;
  own.force_scale = 0.5;
  const ModelMediatedHapticHalf dut(shared_, own);
  MoveTo({0, 0, 0.02});
  Send(Vector3d::UnitZ(), {0, 0, 0.01});
  input_.device_velocity(2) = 0.01;
  double last = 0;
  for (int i = 0; i < 300; ++i) {
    dut.Update(time_, input_, &state_);
    time_ += kPeriod;
    const double force = state_.output.setpoint.reference_force.norm();
    EXPECT_LT(std::abs(force - last), 0.03);
    last = force;
  }
  EXPECT_NEAR(last, 0.5 * 5 + 27 * 0.01, 1e-9);
}

TEST_F(ModelMediatedHapticHalfTest, MessagesThatMakeNoPlaneAreRefused) {
  std::int64_t refused = 0;
  const auto refuse = [&](const Vector3d& normal, const Vector3d& point,
                          double stiffness) {
    Send(normal, point, stiffness);
    Step();
    EXPECT_EQ(state_.output.link.bad_inputs, ++refused);
  };
  refuse(Vector3d::Zero(), Vector3d::Zero(), 500);
  refuse({0, 0, 0.9}, Vector3d::Zero(), 500);
  refuse({0, 0, kNan}, Vector3d::Zero(), 500);
  refuse(Vector3d::UnitZ(), {0, 0, kNan}, 500);
  refuse(Vector3d::UnitZ(), Vector3d::Zero(), 0);
  refuse(Vector3d::UnitZ(), Vector3d::Zero(), kNan);
  Send(Vector3d::Zero(), Vector3d::Zero(), 500, false);
  Step();
  EXPECT_EQ(state_.output.link.bad_inputs, refused);
  EXPECT_FALSE(state_.known);
}

// --- What the robot does -----------------------------------------------------

class ModelMediatedRobotHalfTest : public ::testing::Test {
 protected:
  ModelMediatedRobotHalfTest() { input_.X_BE.p = kPlace; }

  // For 2 s: in contact along the columns of `normals`, pressed with `force`.
  void Press(const Matrix3d& selection, const Vector3d& force,
             const Vector3d& x_p, const Vector3d& commanded) {
    input_.force_selection = selection;
    input_.sensed_wrench.head<3>() = force;
    for (int i = 0; i < 2000; ++i, time_ += kPeriod) {
      if (i % 20 == 0) {
        ModelMediatedMotionMessage message;
        message.sequence = ++sequence_;
        message.send_time = time_;
        message.pose.p = x_p;
        message.force = commanded;
        input_.message = ToMessage(message);
      }
      dut_.Update(time_, input_, &state_);
    }
  }

  const RobotSetpoint& setpoint() const { return state_.output.setpoint; }

  static inline const Vector3d kPlace{0.45, 0, 0.18};
  static inline const Matrix3d kAlongZ{Vector3d::UnitZ().asDiagonal()};

  ModelMediatedRobotHalf dut_{{}, {}};
  ModelMediatedRobotHalfState state_{dut_.MakeState()};
  RobotHalfInput input_;
  double time_{0};
  std::int64_t sequence_{-1};
};

TEST_F(ModelMediatedRobotHalfTest, AlongTheNormalWhatTheHandFeels) {
  // 3 mm beside it, in the model's plane.
  Press(kAlongZ, {0, 0, -6}, kPlace + Vector3d(0.003, 0, 0), {0, 0, -7});
  EXPECT_LT((setpoint().reference_force - Vector3d(0, 0, -7)).norm(), 1e-9);
  EXPECT_EQ(setpoint().force_selection, kAlongZ);
  EXPECT_TRUE(setpoint().force_feedback);
  EXPECT_LT((setpoint().motion_error - Vector3d(-0.003, 0, 0)).norm(), 1e-9);
  const auto sent =
      FromMessage<ModelMediatedSurfaceMessage>(state_.output.message);
  EXPECT_TRUE(sent.contact);
  EXPECT_LT((sent.normal + Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_LT((sent.point - kPlace).norm(), 1e-12);
  EXPECT_EQ(sent.stiffness, 500);
}

// Also where the hand's model is not quite where the surface is.
TEST_F(ModelMediatedRobotHalfTest, ModelThatIsBesideTheSurfaceChangesNothing) {
  for (const double beside : {-0.003, 0.003}) {
    Press(kAlongZ, {0, 0, -6}, kPlace + Vector3d(0, 0, beside), {0, 0, -5});
    EXPECT_LT((setpoint().reference_force - Vector3d(0, 0, -5)).norm(), 1e-9);
  }
}

// 6 N on 500 N/m: x_p on the surface, 12 mm above the tool, asks for no force.
TEST_F(ModelMediatedRobotHalfTest, SurfaceIsWhereASoftOneBegins) {
  Press(kAlongZ, {0, 0, -6}, kPlace, {0, 0, -6});
  state_.surface.stiffness = 500;
  Press(kAlongZ, {0, 0, -6}, kPlace + Vector3d(0, 0, 0.012), Vector3d::Zero());
  EXPECT_LT(setpoint().reference_force.norm(), 0.01);
}

// The hand goes on, as it knows of no surface: 2 N and no more.
TEST_F(ModelMediatedRobotHalfTest, HoldsASurfaceThatTheHandDoesNotKnow) {
  Press(kAlongZ, {0, 0, -6}, kPlace - Vector3d(0, 0, 0.03), Vector3d::Zero());
  EXPECT_LT((setpoint().reference_force - Vector3d(0, 0, -2)).norm(), 1e-9);
  // The hand begins to feel it, and x_p comes up to it: 2 mm still to go.
  Press(kAlongZ, {0, 0, -2}, kPlace - Vector3d(0, 0, 0.002), {0, 0, -0.5});
  EXPECT_LT((setpoint().reference_force - Vector3d(0, 0, -1)).norm(), 1e-9);
  // It has lifted: a spring pulls the tool off.
  Press(kAlongZ, {0, 0, -2}, kPlace + Vector3d(0, 0, 0.004), Vector3d::Zero());
  EXPECT_LT((setpoint().reference_force - Vector3d(0, 0, 2)).norm(), 1e-9);
}

// Whether there is a contact or not, so that nothing moves when one comes.
TEST_F(ModelMediatedRobotHalfTest, ProxyGoesOnToTheHand) {
  for (const bool contact : {true, false}) {
    Press(contact ? kAlongZ : Matrix3d::Zero(), {0, 0, contact ? -6.0 : 0.0},
          kPlace, {0, 0, -5});
    EXPECT_LT(
        (state_.output.proxy_pose.p - kPlace + Vector3d(0, 0, 0.01)).norm(),
        1e-9);
  }
  EXPECT_EQ(setpoint().reference_force, Vector3d::Zero());
  EXPECT_FALSE(
      FromMessage<ModelMediatedSurfaceMessage>(state_.output.message).contact);
}

// In a corner the second direction has a spring, of 2 N and no more, as the
// hand does not feel it.
TEST_F(ModelMediatedRobotHalfTest, SecondDirectionIsNotPartOfTheModel) {
  Press(kAlongZ, {0, 0, -6}, kPlace, {0, 0, -6});
  const Matrix3d both = Vector3d(1, 0, 1).asDiagonal();
  Press(both, {4, 0, -6}, kPlace + Vector3d(0.003, 0.001, 0), {0, 0, -6});
  EXPECT_LT((setpoint().reference_force - Vector3d(1.5, 0, -6)).norm(), 1e-9);
  Press(both, {4, 0, -6}, kPlace + Vector3d(0.006, 0.001, 0), {0, 0, -6});
  EXPECT_LT((setpoint().reference_force - Vector3d(2, 0, -6)).norm(), 1e-9);
  EXPECT_LT((state_.surface.normal + Vector3d::UnitZ()).norm(), 1e-12);
}

TEST_F(ModelMediatedRobotHalfTest, LostLinkHoldsTheRobotAndForgetsTheModel) {
  Press(kAlongZ, {0, 0, -6}, kPlace, {0, 0, -6});
  const Pose before = state_.output.proxy_pose;
  double last = setpoint().reference_force.norm();
  for (int i = 0; i < 1000; ++i, time_ += kPeriod) {
    dut_.Update(time_, input_, &state_);
    const double force = setpoint().reference_force.norm();
    EXPECT_LE(std::abs(force - last), 50 * kPeriod * (1 + 1e-9));
    last = force;
  }
  EXPECT_EQ(state_.output.link.status, LinkStatus::kLost);
  EXPECT_EQ(last, 0);
  EXPECT_EQ(state_.output.proxy_pose.p, before.p);
  const auto sent =
      FromMessage<ModelMediatedSurfaceMessage>(state_.output.message);
  EXPECT_FALSE(sent.contact);
  EXPECT_EQ(sent.normal, Vector3d::Zero());
}

TEST_F(ModelMediatedRobotHalfTest, ForceThatIsNotFiniteIsRefused) {
  Press(kAlongZ, {0, 0, -6}, kPlace, {0, 0, -6});
  const std::int64_t refused = state_.output.link.bad_inputs;
  Press(kAlongZ, {0, 0, -6}, kPlace, {0, 0, kNan});
  EXPECT_EQ(state_.output.link.bad_inputs, refused + 100);
  EXPECT_TRUE(setpoint().reference_force.allFinite());
}

// --- How the surface is found ------------------------------------------------

class SurfaceEstimatorTest : public ::testing::Test {
 protected:
  void Update(const Vector3d& position, const Vector3d& force) {
    dut_.Update(position, force, n_ * n_.transpose(), &state_);
  }
  Vector3d point(const Vector3d& position) const {
    return position - state_.depth * state_.normal;
  }

  Vector3d n_{Vector3d::UnitZ()};
  SurfaceEstimator dut_{{}};
  SurfaceEstimatorState state_{dut_.MakeState()};
  RandomStream random_{5};
};

// With the noise of a force sensor.
TEST_F(SurfaceEstimatorTest, StiffnessIsObservedWhereTheSurfaceGivesWay) {
  for (const double stiffness : {100.0, 300.0, 1000.0, 2500.0, 5000.0}) {
    state_ = dut_.MakeState();
    for (int i = 0; i < 3000; ++i) {
      const double force = 5 - 4 * std::cos(2 * M_PI * i * kPeriod);
      Update({0.3, 0.2, 0.5 + force / stiffness},
             {0.2 * random_.Normal(), 0, force + 0.2 * random_.Normal()});
    }
    // 5000 N/m give way by 1.6 mm in all, 0.6 mm rms: that is not enough.
    const double expected =
        stiffness == 5000 ? 500 : std::clamp(stiffness, 200.0, 2000.0);
    EXPECT_NEAR(dut_.stiffness(state_), expected, 0.03 * expected);
  }
}

// A tool that slides up a slope which the normal does not show moves along it
// as far as on a soft surface; the force does not follow.
TEST_F(SurfaceEstimatorTest, MotionWithoutForceIsNoStiffness) {
  for (int i = 0; i < 5000; ++i) {
    const double x = 0.05 * i * kPeriod;
    Update({x, 0, 0.5 + 0.05 * x}, {0, 0, 6 + 0.2 * random_.Normal()});
  }
  EXPECT_GT(state_.covariance(0, 0), 1e-6);
  EXPECT_EQ(state_.stiffness, 0);
}

TEST_F(SurfaceEstimatorTest, PlaceIsLowPassed) {
  Update({0, 0, 0.5}, {0, 0, 6});
  for (int i = 0; i < 1000; ++i) Update({0, 0, 0.5}, {0, 0, 6});
  EXPECT_EQ(point({0, 0, 0.5}).z(), 0.5);
  for (int i = 0; i < 200; ++i) Update({0, 0, 0.51}, {0, 0, 6});
  EXPECT_NEAR(point({0, 0, 0.51}).z(), 0.51 - 0.01 / M_E, 1e-4);
}

// As the filter turns the normal, the surface turns about the tool.
TEST_F(SurfaceEstimatorTest, TurningNormalLeavesThePlace) {
  const Vector3d place(0.5, 0.1, 0.4);
  for (int i = 0; i < 1000; ++i) Update(place, {0, 0, 6});
  n_ = Vector3d(0.05, 0, 1).normalized();
  Update(place, {0, 0, 6});
  EXPECT_LT((state_.normal - n_).norm(), 1e-12);
  EXPECT_LT((point(place) - place).norm(), 1e-12);
}

TEST_F(SurfaceEstimatorTest, FreeToolPushesTheSurfaceOn) {
  for (int i = 0; i < 1000; ++i) Update({0, 0, 0.5}, {0, 0, 6});
  n_.setZero();
  Vector3d position(0, 0, 0.45);
  for (int i = 0; i < 1000; ++i) Update(position, Vector3d::Zero());
  EXPECT_FALSE(state_.contact);
  EXPECT_NEAR(point(position).z(), 0.5, 1e-9);
  for (; position.z() < 0.53; position.z() += 1e-4) {
    Update(position, Vector3d::Zero());
  }
  Update(position, Vector3d::Zero());
  EXPECT_NEAR(point(position).z(), 0.53, 2e-4);
}

// Another wall of a corner is the next surface when the first is left.
TEST_F(SurfaceEstimatorTest, OneSurfaceAtATime) {
  const Vector3d place(0.5, 0.1, 0.4);
  const auto press = [&](const Vector3d& selected) {
    for (int i = 0; i < 1000; ++i) {
      dut_.Update(place, {0, 5, 6}, selected.asDiagonal(), &state_);
    }
  };
  press({0, 0, 1});
  press({0, 1, 1});
  EXPECT_EQ(state_.normal, Vector3d::UnitZ());
  press({0, 1, 0});
  EXPECT_EQ(state_.normal, Vector3d::UnitY());
  EXPECT_TRUE(state_.contact);
}

TEST(ModelMediatedTest, DoesNotAllocate) {
  Bench bench(MakeBenchParams(0.05));
  ScopedNoAlloc guard;
  bench.AdvanceTo(0.5);
  EXPECT_EQ(guard.count(), 0);
  EXPECT_TRUE(bench.haptic().known);
}

TEST(ModelMediatedParamsTest, ErrorsNameFieldRangeAndValue) {
  ModelMediatedParams params;
  params.default_stiffness = 100;
  EXPECT_EQ(ValidationError(params),
            "ModelMediatedParams: field `default_stiffness` expected a number "
            "in [min_stiffness = 200, max_stiffness = 2000], got 100");
  EXPECT_THROW(ModelMediatedRobotHalf({}, params), std::invalid_argument);
  params = {};
  params.force_scale = 0;
  EXPECT_THROW(ModelMediatedHapticHalf({}, params), std::invalid_argument);
  params = {};
  params.holding_force = 0.5;
  EXPECT_THROW(ModelMediatedRobotHalf({}, params), std::invalid_argument);
}

}  // namespace
}  // namespace dual_proxy
