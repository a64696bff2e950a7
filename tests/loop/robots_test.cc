// SPDX-License-Identifier: BSD-3-Clause

// The same loop with every kind of robot: it touches a plane, finds it and
// holds its force there.

#include <cmath>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Core>

#include "dual_proxy/loop/teleop_loop.h"
#include "dual_proxy/simulation/point_robot.h"
#include "dual_proxy/simulation/simulated_arm.h"
#include "no_alloc.h"
#include "test_arm.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kPeriod = 0.001;
constexpr double kGap = 0.03;  // m: from where the tool starts to the plane.
constexpr double kToolRadius = 0.01;

ContactSceneParams MakeTable(const Vector3d& p_BE) {
  ContactSurfaceParams table;
  table.position = p_BE - Vector3d(0, 0, kGap + kToolRadius);
  table.stiffness = 1e4;
  table.dissipation = 2;
  return {.surfaces = {table}, .tool_radius = kToolRadius};
}

/** A robot with a plant of its own. */
struct SixJoints {
  using Plant = SimulatedArm<6>;

  static Plant MakePlant(const ContactSceneParams& scene) {
    return {{}, MakeSixJointArm(), scene};
  }
  static Plant::State Start(const Plant& plant) {
    return plant.MakeState(kSixJointArmAtRest);
  }
  static Pose GetPose(const Plant::State& state) { return state.X_BE; }
  static TeleopLoopInput<Plant::Robot> MakeInput(const Plant::State& state) {
    return {.q = state.q, .v = state.v, .reaction = state.reaction};
  }
  static Vector3d GetContactForce(const Plant::State& state) {
    return state.truth.force();
  }
  static void Set(TeleopLoopParams<Plant::Robot>* params) {
    params->model = MakeSixJointArm();
    OperationalSpaceControllerParams<6>& controller = params->robot.controller;
    controller.q_rest = kSixJointArmAtRest;
    controller.joint_limits.lower.setConstant(-6.2);
    controller.joint_limits.upper.setConstant(6.2);
    controller.joint_limits.speed.setConstant(3);
    controller.torque_limit << 150, 150, 150, 28, 28, 28;
    controller.torque_rate_limit = 5000;
  }
};

struct Point {
  using Plant = PointRobot;

  static Plant MakePlant(const ContactSceneParams& scene) {
    return Plant({}, scene);
  }
  static Plant::State Start(const Plant& plant) {
    return plant.MakeState({0.1, -0.2, 0.3});
  }
  static Pose GetPose(const Plant::State& state) {
    return {.p = state.position};
  }
  static TeleopLoopInput<PointMass> MakeInput(const Plant::State& state) {
    TeleopLoopInput<PointMass> input{.q = state.position, .v = state.velocity};
    input.reaction.head<3>() = state.contact.force;
    return input;
  }
  static Vector3d GetContactForce(const Plant::State& state) {
    return state.contact.force;
  }
  static void Set(TeleopLoopParams<PointMass>*) {}
};

template <typename Kind>
class RobotTest : public ::testing::Test {
 protected:
  using Plant = typename Kind::Plant;
  using Loop = TeleopLoop<typename Plant::Robot>;

  RobotTest()
      : start_(Kind::GetPose(Kind::Start(Kind::MakePlant({})))),
        plant_(Kind::MakePlant(MakeTable(start_.p))),
        plant_state_(Kind::Start(plant_)),
        loop_(MakeParams()),
        state_(loop_.MakeState()) {}

  // The hand goes down, presses for two seconds, and comes back.
  typename Loop::Params MakeParams() const {
    typename Loop::Params params;
    params.robot.proxy.map.p_cw = start_.p;
    params.robot.proxy.map.R_cw = start_.R;
    params.haptic.proxy.map = params.robot.proxy.map;
    params.robot.perception.filter.period = 0.01;
    params.sensor.gravity = 0;
    params.path.times = Eigen::Vector4d(0, 1, 3, 4);
    params.path.points = Eigen::Matrix3Xd::Zero(3, 4);
    params.path.points.row(2) << 0, -0.025, -0.025, 0;
    Kind::Set(&params);
    return params;
  }

  double time() const { return kPeriod * tick_; }

  void RunTo(double end) {
    while (time() < end) {
      auto input = Kind::MakeInput(plant_state_);
      input.has_reaction = tick_ > 0;
      loop_.Update(time(), input, &state_);
      plant_.Update(state_.command(), &plant_state_);
      ++tick_;
    }
  }

  Vector3d contact_force() const { return Kind::GetContactForce(plant_state_); }

  Pose start_;
  Plant plant_;
  typename Plant::State plant_state_;
  Loop loop_;
  typename Loop::State state_;
  int tick_{0};
};

using Kinds = ::testing::Types<SixJoints, Point>;
TYPED_TEST_SUITE(RobotTest, Kinds);

TYPED_TEST(RobotTest, FindsThePlaneAndHoldsItsForce) {
  this->RunTo(3);
  const auto& side = this->state_.robot;
  const RobotSetpoint& setpoint = side.half.output().setpoint;
  EXPECT_EQ(side.perception.force.filter.dimension, 1);
  EXPECT_GT(std::abs(side.perception.force.filter.force_direction().z()),
            0.999);
  EXPECT_LT(setpoint.reference_force.z(), -3);
  EXPECT_NEAR(this->contact_force().z(), setpoint.reference_force.z(), 0.3);
  EXPECT_LT(setpoint.motion_error.norm(), 1e-3);
  EXPECT_EQ(side.output.bad_inputs, 0);
  // And lets go of it.
  this->RunTo(6);
  EXPECT_EQ(side.perception.force.filter.dimension, 0);
  EXPECT_EQ(this->contact_force(), Vector3d::Zero());
  EXPECT_LT((side.output.X_BE.p - this->start_.p).norm(), 1e-3);
}

TYPED_TEST(RobotTest, DoesNotAllocate) {
  this->RunTo(1.9);
  VectorXd signals(SizeOf(this->loop_.layout()));
  const ScopedNoAlloc guard;
  this->RunTo(2);
  this->loop_.WriteSignals(this->state_, signals);
  EXPECT_EQ(guard.count(), 0);
}

std::set<std::string> Names(const std::vector<SignalSlice>& layout) {
  std::set<std::string> names;
  for (const SignalSlice& signal : layout) names.insert(signal.name);
  return names;
}

TEST(RobotSignalsTest, APointHasNoRotationsAndNoJoints) {
  const TeleopLoopParams<PointMass> defaults;
  const auto point = Names(TeleopLoop<PointMass>(defaults).layout());
  TeleopLoopParams<SerialArm<7>> params;
  params.model = MakeTestArm();
  const auto arm = Names(TeleopLoop<SerialArm<7>>(params).layout());
  for (const char* name :
       {"robot_orientation", "robot_proxy_orientation", "rotation_error",
        "robot_angular_velocity", "sensed_moment", "joint_position", "torque",
        "joint_limited", "device_orientation", "device_moment"}) {
    EXPECT_TRUE(arm.contains(name)) << name;
    EXPECT_FALSE(point.contains(name)) << name;
  }
  for (const char* name :
       {"commanded_force", "force_limited", "force_rate_limited"}) {
    EXPECT_TRUE(point.contains(name)) << name;
    EXPECT_FALSE(arm.contains(name)) << name;
  }
}

TEST(RobotParamsTest, APointHasNoAngularFilter) {
  TeleopLoopParams<PointMass> params;
  params.robot.perception.angular_filter.enabled = true;
  EXPECT_THROW(params.Validate(), std::invalid_argument);
}

}  // namespace
}  // namespace dual_proxy
