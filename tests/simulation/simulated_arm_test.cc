// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/simulated_arm.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "dual_proxy/common/rotation.h"
#include "no_alloc.h"
#include "test_arm.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

const double kNan = std::numeric_limits<double>::quiet_NaN();

SimulatedArmParams MakeParams() {
  SimulatedArmParams params;
  params.p_SE = {0, 0, 0.1};
  params.tool_mass = 0.5;
  params.tool_com = {0, 0, 0.04};
  params.tool_inertia = Vector3d(2e-4, 2e-4, 8e-5).asDiagonal();
  return params;
}

constexpr double kRadius = 0.01;

// A half-space at the tool's side: its surface is `gap` away in direction
// `normal`.
ContactSurfaceParams MakePlane(const Vector3d& normal, double gap) {
  const SimulatedArm<7> arm(MakeParams(), MakeTestArm());
  const Vector3d p_BE = arm.MakeState(kTestArmAtRest).X_BE.p;
  ContactSurfaceParams plane;
  plane.position = p_BE + (kRadius + gap) * normal;
  plane.rotation =
      Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), -normal).matrix();
  plane.stiffness = 1e4;
  plane.dissipation = 2;
  return plane;
}

const Vector3d kDown = -Vector3d::UnitZ();

/** Holds the orientation, damps what moves, carries the weight, and pushes. */
class Pusher {
 public:
  explicit Pusher(double damping) : damping_(damping) {}

  Vector7 CalcTorque(const SimulatedArmState<7>& state,
                     const Vector3d& force) const {
    Vector6 wrench;
    wrench << force - damping_ * state.v_BE.head<3>(),
        -100 * LogRotation(state.X_BE.R * R_.transpose()) -
            2 * state.v_BE.tail<3>();
    const Vector7 hold = -0.5 * state.v;
    return state.terms.J_BE.transpose() * wrench - state.terms.gravity + hold;
  }

 private:
  double damping_;
  Matrix3d R_{SimulatedArm<7>(MakeParams(), MakeTestArm())
                  .MakeState(kTestArmAtRest)
                  .X_BE.R};
};

SimulatedArmState<7> Push(const SimulatedArm<7>& arm, const Vector3d& force,
                          double seconds, double damping = 50) {
  const Pusher pusher(damping);
  SimulatedArmState<7> state = arm.MakeState(kTestArmAtRest);
  const int periods = static_cast<int>(seconds / arm.params().period + 0.5);
  for (int i = 0; i < periods; ++i) {
    arm.Update(pusher.CalcTorque(state, force), &state);
  }
  return state;
}

double KineticEnergy(const SimulatedArmState<7>& state) {
  return 0.5 * state.v.dot(state.terms.mass * state.v);
}

TEST(SimulatedArmTest, KineticEnergyIsKeptTheBetterTheShorterTheStep) {
  ArmModelParams<7> arm = MakeTestArm();
  arm.gravity.setZero();
  const Vector7 v{{1, -0.7, 0.5, 0.8, -1, 0.6, 1.5}};
  const auto calc_error = [&](double time_step) {
    SimulatedArmParams params = MakeParams();
    params.period = 0.1;
    params.time_step = time_step;
    const SimulatedArm<7> dut(params, arm);
    SimulatedArmState<7> state = dut.MakeState(kTestArmAtRest, v);
    const double start = KineticEnergy(state);
    for (int i = 0; i < 10; ++i) dut.Update(Vector7::Zero(), &state);
    return std::abs(KineticEnergy(state) / start - 1);
  };
  const double coarse = calc_error(1e-3);
  EXPECT_LT(coarse, 5e-3);
  EXPECT_NEAR(coarse / calc_error(5e-4), 2, 0.2);
  EXPECT_NEAR(calc_error(5e-4) / calc_error(2.5e-4), 2, 0.1);
}

TEST(SimulatedArmTest, WithSixJointsEnergyIsKeptTheBetterTheShorterTheStep) {
  ArmModelParams<6> arm = MakeSixJointArm();
  arm.gravity.setZero();
  const JointVector<6> v{{1, -0.7, 0.5, 0.8, -1, 1.5}};
  const auto calc_error = [&](double time_step) {
    SimulatedArmParams params = MakeParams();
    params.period = 0.1;
    params.time_step = time_step;
    const SimulatedArm<6> dut(params, arm);
    SimulatedArmState<6> state = dut.MakeState(kSixJointArmAtRest, v);
    const auto energy = [&state] {
      return 0.5 * state.v.dot(state.terms.mass * state.v);
    };
    const double start = energy();
    for (int i = 0; i < 10; ++i) dut.Update(JointVector<6>::Zero(), &state);
    return std::abs(energy() / start - 1);
  };
  const double coarse = calc_error(1e-3);
  EXPECT_LT(coarse, 2e-2);
  EXPECT_NEAR(coarse / calc_error(5e-4), 2, 0.2);
}

TEST(SimulatedArmTest, FallConverges) {
  const auto fall = [](double time_step) {
    SimulatedArmParams params = MakeParams();
    params.period = 0.5;
    params.time_step = time_step;
    const SimulatedArm<7> dut(params, MakeTestArm());
    SimulatedArmState<7> state = dut.MakeState(kTestArmAtRest);
    dut.Update(Vector7::Zero(), &state);
    return state.q;
  };
  const Vector7 exact = 2 * fall(5e-4) - fall(1e-3);
  EXPECT_GT((exact - kTestArmAtRest).norm(), 0.5);
  const double coarse = (fall(4e-3) - exact).norm();
  EXPECT_LT(coarse, 0.05);
  EXPECT_NEAR(coarse / (fall(2e-3) - exact).norm(), 2, 0.2);
}

TEST(SimulatedArmTest, AtRestTheSurfaceCarriesThePush) {
  const ContactSurfaceParams floor = MakePlane(kDown, 1e-3);
  const SimulatedArm<7> dut(MakeParams(), MakeTestArm(), {{floor}, kRadius});
  const Vector3d push(0, 0, -8);
  const SimulatedArmState<7> state = Push(dut, push, 3);
  EXPECT_LT(state.v.norm(), 1e-6);
  EXPECT_LT((state.truth.force() - push).norm(), 1e-4);
  EXPECT_EQ(state.truth.CalcNormal(), kDown);
  EXPECT_EQ(state.truth.dimension(), 1);
  EXPECT_EQ(state.truth.moment_dimension(), 0);
  EXPECT_NEAR(floor.position.z() - (state.X_BE.p.z() - kRadius), 8 / 1e4, 1e-8);
  // The sensor sees the push less the tool's weight, in S.
  const Vector3d reaction = state.X_BE.R * state.reaction.head<3>();
  EXPECT_LT((reaction - push - Vector3d(0, 0, 0.5 * 9.81)).norm(), 1e-4);
  EXPECT_LT(state.reaction.tail<3>().norm(), 1e-3);
}

TEST(SimulatedArmTest, SensorFeelsWeightInertiaAndLever) {
  // Nothing is beyond the tool: what the arm does to it is all it takes.
  SimulatedArmParams params = MakeParams();
  params.tool_com = {0.02, -0.01, 0.05};
  const ArmModelParams<7> arm = MakeTestArm();
  const SimulatedArm<7> dut(params, arm);
  SimulatedArmState<7> state = dut.MakeState(
      kTestArmAtRest, Vector7{{0.5, -0.4, 0.3, 0.6, -0.5, 0.8, 1}});
  const auto calc_com = [&](const SimulatedArmState<7>& at) -> Vector3d {
    return at.X_BE.p + at.X_BE.R * (params.tool_com - params.p_SE);
  };
  // Momentum from poses alone, by differences.
  Vector3d last_com = calc_com(state);
  Vector3d last_momentum = Vector3d::Zero();
  Vector3d last_force = Vector3d::Zero();
  constexpr double kPeriod = 1e-3;
  for (int i = 0; i < 200; ++i) {
    const Matrix3d R_start = state.X_BE.R;
    dut.Update(Vector7::Constant(0.3), &state);
    const Vector3d com = calc_com(state);
    const Vector3d momentum = params.tool_mass * (com - last_com) / kPeriod;
    if (i > 1) {
      const Vector3d expected =
          (momentum - last_momentum) / kPeriod - params.tool_mass * arm.gravity;
      const Vector3d force = R_start * state.reaction.head<3>();
      EXPECT_LT((0.5 * (force + last_force) - expected).norm(), 0.02)
          << "period " << i;
    }
    last_force = R_start * state.reaction.head<3>();
    last_com = com;
    last_momentum = momentum;
  }

  // Hanging still, the moment is that of the weight.
  SimulatedArmState<7> still = dut.MakeState(kTestArmAtRest);
  dut.Update(-still.terms.gravity, &still);
  const Vector3d weight =
      still.X_BE.R.transpose() * (params.tool_mass * arm.gravity);
  EXPECT_LT((still.reaction.head<3>() + weight).norm(), 1e-9);
  EXPECT_LT((still.reaction.tail<3>() + params.tool_com.cross(weight)).norm(),
            1e-9);
}

TEST(SimulatedArmTest, FrictionIsMuTimesTheNormalForceAndAgainstTheMotion) {
  ContactSurfaceParams floor = MakePlane(kDown, 0);
  floor.friction = 0.3;
  const SimulatedArm<7> dut(MakeParams(), MakeTestArm(), {{floor}, kRadius});
  const SimulatedArmState<7> state = Push(dut, {3, 4, -8}, 0.5);
  const Vector3d force = state.truth.force();
  EXPECT_NEAR(force.z(), -8, 0.1);
  EXPECT_NEAR(force.head<2>().norm(), -0.3 * force.z(), 1e-9);
  EXPECT_GT(state.v_BE.head<2>().norm(), 0.02);
  // At the point of contact, on which the tool turns a little, too.
  Vector3d u = state.v_BE.head<3>() +
               state.v_BE.tail<3>().cross((kRadius - 4e-4) * kDown);
  u.z() = 0;
  const Vector3d friction(force.x(), force.y(), 0);
  EXPECT_LT((friction.normalized() - u.normalized()).norm(), 1e-3);
}

TEST(SimulatedArmTest, SticksOnASlopeWithoutCreeping) {
  // 15 degrees, whose tangent is 0.268.
  const Vector3d normal = Eigen::AngleAxisd(0.2618, Vector3d::UnitY()) * kDown;
  ContactSurfaceParams slope = MakePlane(normal, 0);
  const auto slide = [&](double friction) {
    slope.friction = friction;
    const SimulatedArm<7> dut(MakeParams(), MakeTestArm(), {{slope}, kRadius});
    const Pusher pusher(50);
    SimulatedArmState<7> state = Push(dut, 8 * kDown, 2);
    const Vector3d start = state.X_BE.p;
    for (int i = 0; i < 2000; ++i) {
      dut.Update(pusher.CalcTorque(state, 8 * kDown), &state);
    }
    return (state.X_BE.p - start).norm();
  };
  EXPECT_LT(slide(0.28), 1e-6);
  EXPECT_GT(slide(0.25), 1e-3);
}

TEST(SimulatedArmTest, ImpactDoesNotAddEnergyAtAnyStiffness) {
  for (const double stiffness : {1e3, 1e5, 1e7, 1e9}) {
    for (const double friction : {0.0, 0.5}) {
      ContactSurfaceParams floor = MakePlane(kDown, 5e-3);
      floor.stiffness = stiffness;
      floor.friction = friction;
      floor.dissipation = 0;
      ArmModelParams<7> arm = MakeTestArm();
      arm.gravity.setZero();
      const SimulatedArm<7> dut(MakeParams(), arm, {{floor}, kRadius});
      // Down at 1 m/s, and to the side.
      SimulatedArmState<7> state = dut.MakeState(kTestArmAtRest);
      Vector6 twist;
      twist << 0.3, 0.1, -1, 0, 0, 0;
      const Vector7 v =
          state.terms.J_BE.transpose() *
          (state.terms.J_BE * state.terms.J_BE.transpose()).ldlt().solve(twist);
      state = dut.MakeState(kTestArmAtRest, v);
      const double start = KineticEnergy(state);
      double impulse = 0;
      for (int i = 0; i < 50; ++i) {
        dut.Update(Vector7::Zero(), &state);
        impulse -= 1e-3 * state.truth.force().z();
        EXPECT_LT(KineticEnergy(state), 1.02 * start)
            << "stiffness " << stiffness << ", period " << i;
      }
      // Stopped, and thrown back by not more than it came with.
      EXPECT_GT(impulse, 0.5) << stiffness;
      EXPECT_LT(impulse, 20) << stiffness;
    }
  }
}

TEST(SimulatedArmTest, TwoSurfacesInACorner) {
  for (const double friction : {0.0, 0.2}) {
    ContactSurfaceParams floor = MakePlane(kDown, 5e-4);
    ContactSurfaceParams wall = MakePlane(Vector3d::UnitY(), 1e-3);
    floor.friction = friction;
    wall.friction = friction;
    const SimulatedArm<7> dut(MakeParams(), MakeTestArm(),
                              {{floor, wall}, kRadius});
    const Vector3d push(0, 5, -8);
    const SimulatedArmState<7> state = Push(dut, push, 3);
    EXPECT_LT(state.v.norm(), 1e-5);
    EXPECT_LT((state.truth.force() - push).norm(), 1e-3);
    EXPECT_EQ(state.truth.dimension(), 2);
    if (friction == 0) {
      EXPECT_LT((state.truth.CalcNormal() - push.normalized()).norm(), 1e-4);
      EXPECT_NEAR(wall.position.y() - state.X_BE.p.y() - kRadius, -5 / 1e4,
                  1e-7);
    }
  }
}

TEST(SimulatedArmTest, FlatToolOnAPlane) {
  SimulatedArmParams params = MakeParams();
  params.p_EBall.resize(3, 4);
  params.p_EBall << -0.02, 0.02, -0.02, 0.02, -0.02, -0.02, 0.02, 0.02, 0, 0, 0,
      0;
  ContactSurfaceParams floor = MakePlane(kDown, 1e-3);
  floor.friction = 0.3;
  const SimulatedArm<7> dut(params, MakeTestArm(), {{floor}, kRadius});
  const SimulatedArmState<7> state = Push(dut, {0, 0, -8}, 3);
  EXPECT_LT(state.v.norm(), 1e-6);
  EXPECT_LT((state.truth.force() - Vector3d(0, 0, -8)).norm(), 1e-3);
  EXPECT_EQ(state.truth.dimension(), 1);
  EXPECT_EQ(state.truth.moment_dimension(), 2);
  EXPECT_LT((state.truth.CalcFreeAxis() - kDown).norm(), 1e-4);
  // Four balls sink in as one would.
  EXPECT_NEAR(floor.position.z() - (state.X_BE.p.z() - kRadius), 8 / 1e4, 1e-6);
}

TEST(SimulatedArmTest, PeriodIsDividedIntoEqualSteps) {
  ContactSurfaceParams floor = MakePlane(kDown, 0);
  floor.friction = 0.3;
  const auto run = [&](double period, double time_step, int updates) {
    SimulatedArmParams params = MakeParams();
    params.period = period;
    params.time_step = time_step;
    const SimulatedArm<7> dut(params, MakeTestArm(), {{floor}, kRadius});
    SimulatedArmState<7> state = dut.MakeState(kTestArmAtRest);
    for (int i = 0; i < updates; ++i) {
      dut.Update(-0.9 * dut.MakeState(kTestArmAtRest).terms.gravity, &state);
    }
    return state;
  };
  const SimulatedArmState<7> expected = run(5e-4, 5e-4, 40);
  EXPECT_EQ(run(2e-3, 5e-4, 10).q, expected.q);
  EXPECT_EQ(run(2e-3, 6e-4, 10).q, expected.q);
  EXPECT_EQ(run(5e-4, 1, 40).reaction, expected.reaction);
  EXPECT_NE(run(1e-3, 1e-3, 20).q, expected.q);
}

TEST(SimulatedArmTest, BadTorqueActsAsZero) {
  const SimulatedArm<7> dut(MakeParams(), MakeTestArm());
  SimulatedArmState<7> state = dut.MakeState(kTestArmAtRest);
  SimulatedArmState<7> expected = state;
  dut.Update(Vector7::Zero(), &expected);
  Vector7 torque = Vector7::Ones();
  torque(3) = kNan;
  dut.Update(torque, &state);
  EXPECT_EQ(state.q, expected.q);
  EXPECT_EQ(state.bad_inputs, 1);
  EXPECT_EQ(expected.bad_inputs, 0);
}

TEST(SimulatedArmTest, DoesNotAllocate) {
  ContactSurfaceParams floor = MakePlane(kDown, -1e-3);
  floor.friction = 0.3;
  const SimulatedArm<7> dut(MakeParams(), MakeTestArm(), {{floor}, kRadius});
  SimulatedArmState<7> state = dut.MakeState(kTestArmAtRest);
  ScopedNoAlloc guard;
  dut.Update(Vector7::Zero(), &state);
  EXPECT_EQ(guard.count(), 0);
  EXPECT_EQ(state.truth.dimension(), 1);
}

TEST(SimulatedArmTest, ErrorsNameFieldRangeAndValue) {
  using Params = SimulatedArmParams;
  EXPECT_EQ(ValidationError(Params{}), "no exception");
  const std::string who = "SimulatedArmParams: field `";
  for (const auto& [field, member] : {std::pair{"period", &Params::period},
                                      {"time_step", &Params::time_step}}) {
    Params params;
    params.*member = 0;
    EXPECT_EQ(ValidationError(params),
              who + field + "` expected a finite value > 0, got 0");
  }
  Params params;
  params.time_step = 1e-7;
  EXPECT_EQ(ValidationError(params),
            who + "time_step` expected at least period / 1000, got 1e-07");
  params = {};
  params.p_EBall.resize(3, 0);
  EXPECT_EQ(ValidationError(params),
            who + "p_EBall` expected 1 to 4 columns, got 0");
  params.p_EBall.setConstant(3, 2, kNan);
  EXPECT_NE(ValidationError(params).find("p_EBall` expected finite values"),
            std::string::npos);
  params = {};
  params.tool_mass = -1;
  EXPECT_EQ(ValidationError(params),
            who + "tool_mass` expected a finite value >= 0, got -1");
  params = {};
  params.tool_inertia(0, 0) = 1;
  EXPECT_NE(ValidationError(params).find("`tool_inertia`"), std::string::npos);

  params = MakeParams();
  params.tool_mass = 1.3;
  EXPECT_EQ(InvalidArgument([&] { SimulatedArm<7>(params, MakeTestArm()); }),
            who + "tool_mass` expected a number in [0, 1.2], got 1.3");
  EXPECT_THROW(SimulatedArm<7>(MakeParams(), MakeTestArm(), {{}, -1}),
               std::invalid_argument);
  const SimulatedArm<7> dut(MakeParams(), MakeTestArm());
  EXPECT_EQ(InvalidArgument([&] {
              dut.MakeState(Vector7::Constant(kNan));
            }).find("SimulatedArm: field `q` expected finite values"),
            0);
}

}  // namespace
}  // namespace dual_proxy
