// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/sides/robot_side.h"

#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "dual_proxy/common/random.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;

const Matrix3d kAlongZ{Vector3d::UnitZ().asDiagonal()};

class RobotSideTest : public ::testing::Test {
 protected:
  // An arm whose first six joints are the tool's six freedoms, 7 kg each.
  RobotSideInput Input(int tick) {
    RobotSideInput input;
    input.model.J_BE.leftCols<6>().setIdentity();
    input.model.mass = 7 * Matrix7::Identity();
    input.X_BE.p = Vector3d(0.4, 0, 0.3 + 1e-3 * random_.Normal());
    for (int i = 0; i < 7; ++i) input.v(i) = 0.01 * random_.Normal();
    input.q = dut_.params().controller.q_rest;
    input.sensed_wrench << 0.2 * random_.Normal(), 0, -5, 0, 0, 0;
    input.force_selection = tick % 200 < 100 ? kAlongZ : Matrix3d::Zero();
    input.message.sequence = tick / 20;
    input.message.send_time = 0.001 * (tick / 20 * 20);
    input.message.pose.p = Vector3d(0.16, 1e-4 * tick, 0.12);
    return input;
  }

  RobotSide dut_;
  RobotSideState state_ = dut_.MakeState();
  RandomStream random_{12};
};

// The fused side and the separate parts give the same bits.
TEST_F(RobotSideTest, SameAsItsParts) {
  const RobotSideParams params = dut_.params();
  const RobotSideProxy proxy(params.proxy);
  const OperationalSpaceController controller(params.controller);
  const PoseSender sender(params.sender);
  RobotSideProxyState proxy_state = proxy.MakeState();
  OperationalSpaceControllerState controller_state = controller.MakeState();
  PoseSenderState sender_state = sender.MakeState();
  for (int i = 0; i < 700; ++i) {
    const double time = 0.001 * i;
    const RobotSideInput input = Input(i);
    dut_.Update(time, input, &state_);

    proxy.Update(time,
                 {.message = input.message,
                  .X_BE = input.X_BE,
                  .force_selection = input.force_selection,
                  .moment_selection = input.moment_selection,
                  .has_sensed = true,
                  .sensed_force = input.sensed_wrench.head<3>(),
                  .sensed_moment = input.sensed_wrench.tail<3>()},
                 &proxy_state);
    const RobotSideProxyOutput& setpoint = proxy_state.output;
    const auto command =
        controller.Update({.model = input.model,
                           .q = input.q,
                           .v = input.v,
                           .motion_error = setpoint.motion_error,
                           .rotation_error = setpoint.rotation_error,
                           .proxy_velocity = setpoint.proxy_velocity,
                           .proxy_acceleration = setpoint.proxy_acceleration,
                           .reference_force = setpoint.reference_force,
                           .reference_moment = setpoint.reference_moment,
                           .force_selection = input.force_selection,
                           .moment_selection = input.moment_selection,
                           .sensed_wrench = input.sensed_wrench},
                          &controller_state);
    const PoseMessage& message =
        sender.Update(time, input.X_BE, input.force_selection,
                      input.moment_selection, &sender_state);

    EXPECT_EQ(state_.output.controller.torque, command.torque);
    EXPECT_EQ(state_.output.controller.contact_force, command.contact_force);
    EXPECT_EQ(state_.output.proxy.proxy_pose.p, setpoint.proxy_pose.p);
    EXPECT_EQ(state_.output.message.sequence, message.sequence);
    EXPECT_EQ(state_.output.message.pose.p, message.pose.p);
    EXPECT_EQ(state_.output.message.force_selection, message.force_selection);
  }
  EXPECT_EQ(state_.output.bad_inputs, 0);
  EXPECT_EQ(state_.output.proxy.link_status, LinkStatus::kConnected);
  EXPECT_GT(state_.output.force_message.sequence, 30);
}

// A sensor that goes, or is tared, in the middle of a contact.
TEST_F(RobotSideTest, WithoutASensorItHoldsItsPlaceAndPushesForNothing) {
  RobotSideInput input = Input(0);
  input.v.setZero();
  input.message.pose.p.z() = -0.2;
  input.sensed_wrench << 0, 0, -6, 0, 0, 0;
  int i = 0;
  const auto run = [&](int ticks) {
    for (const int end = i + ticks; i < end; ++i) {
      input.message.sequence = i / 20;
      input.message.send_time = 0.001 * (i / 20 * 20);
      dut_.Update(0.001 * i, input, &state_);
    }
  };
  run(3000);  // The proxy has stopped.
  const double pressed = state_.output.controller.contact_force.z();
  ASSERT_LT(pressed, -1);
  input.sensor_ready = false;
  input.sensed_wrench.setZero();
  for (int k = 0; k < 500; ++k) {
    run(1);
    EXPECT_GE(state_.output.controller.contact_force.z(), pressed - 1e-9);
    EXPECT_LE(state_.output.controller.contact_force.z(), 1e-9);
  }
  EXPECT_LT(state_.output.controller.contact_force.norm(), 1e-9);
  EXPECT_LT(std::abs(state_.output.controller.motion_force.z()), 1e-9);
}

// A filter that updates at t = k T and reads what the cycle before has left
// sees the mean of exactly the cycles from (k - 1) T on.
TEST_F(RobotSideTest, MeansCoverOneFilterPeriod) {
  const double filter_period = dut_.params().filter_period;
  Vector3d force_sum = Vector3d::Zero();
  Vector3d velocity_sum = Vector3d::Zero();
  Vector3d motion_sum = Vector3d::Zero();
  Vector3d contact_sum = Vector3d::Zero();
  int count = 0;
  int windows = 0;
  for (int i = 0; i < 1000; ++i) {
    const double time = 0.001 * i;
    // Tick k is due at the first control cycle with time >= k T.
    if (time >= (windows + 1) * filter_period - 1e-9) {
      ++windows;
      EXPECT_TRUE(state_.output.filter_means.sensed_force.isApprox(
          force_sum / count, 1e-12));
      EXPECT_TRUE(state_.output.filter_means.velocity.isApprox(
          velocity_sum / count, 1e-12));
      EXPECT_TRUE(state_.output.filter_means.motion_force.isApprox(
          motion_sum / count, 1e-12));
      EXPECT_TRUE(state_.output.filter_means.contact_force.isApprox(
          contact_sum / count, 1e-12));
      EXPECT_GE(count, 66);
      EXPECT_LE(count, 67);
      force_sum.setZero();
      velocity_sum.setZero();
      motion_sum.setZero();
      contact_sum.setZero();
      count = 0;
    }
    const RobotSideInput input = Input(i);
    dut_.Update(time, input, &state_);
    force_sum += input.sensed_wrench.head<3>();
    velocity_sum += input.v.head<3>();
    motion_sum += state_.output.controller.motion_force;
    contact_sum += state_.output.controller.contact_force;
    ++count;
  }
  EXPECT_EQ(windows, 14);
}

// 0.3 / 0.1 is below 3 in floating point: the tolerance makes it the third
// window, for every multiple.
TEST_F(RobotSideTest, MeansStartAnewAtMultiplesInSpiteOfRounding) {
  RobotSideParams params;
  params.filter_period = 0.1;
  const RobotSide dut(params);
  RobotSideState state = dut.MakeState();
  for (int i = 0; i <= 2000; ++i) {
    dut.Update(i * 0.001, Input(i), &state);
    EXPECT_EQ(state.filter_means.samples, i % 100 + 1) << i;
  }
}

TEST_F(RobotSideTest, RefusedCyclesAddNothingToTheMeans) {
  dut_.Update(0, Input(0), &state_);
  const FilterMeans before = state_.output.filter_means;
  RobotSideInput bad = Input(1);
  bad.sensed_wrench(2) = std::numeric_limits<double>::quiet_NaN();
  dut_.Update(0.001, bad, &state_);
  EXPECT_EQ(state_.output.bad_inputs, 1);
  EXPECT_EQ(state_.filter_means.samples, 1);
  EXPECT_EQ(state_.output.filter_means.sensed_force, before.sensed_force);
  EXPECT_TRUE(state_.output.controller.torque.allFinite());
  dut_.Update(0.002, Input(2), &state_);
  EXPECT_EQ(state_.filter_means.samples, 2);
}

TEST_F(RobotSideTest, RefusedCyclesCountOnceWhoeverRefuses) {
  dut_.Update(0, Input(0), &state_);
  RobotSideInput bad = Input(1);
  bad.sensed_wrench(2) = std::numeric_limits<double>::quiet_NaN();
  dut_.Update(0.001, bad, &state_);
  EXPECT_EQ(state_.proxy.bad_inputs, 1);
  EXPECT_EQ(state_.controller.bad_inputs, 1);
  EXPECT_EQ(state_.output.bad_inputs, 1);
  bad = Input(2);
  bad.X_BE.R *= 2;  // No matter to the controller.
  dut_.Update(0.002, bad, &state_);
  EXPECT_EQ(state_.proxy.bad_inputs, 2);
  EXPECT_EQ(state_.controller.bad_inputs, 1);
  EXPECT_EQ(state_.output.bad_inputs, 2);
  dut_.Update(0.003, Input(3), &state_);
  EXPECT_EQ(state_.output.bad_inputs, 2);
  EXPECT_EQ(state_.output.counters.sender_bad_inputs, 1);
  EXPECT_EQ(state_.output.counters.force_sender_bad_inputs, 1);
}

// Of moments and rotations, over a period of its own.
TEST_F(RobotSideTest, MeansOfTheAngularFilter) {
  RobotSideParams params;
  params.angular_filter_period = 0.05;
  const RobotSide dut(params);
  RobotSideState state = dut.MakeState();
  Vector3d moment_sum = Vector3d::Zero();
  Vector3d velocity_sum = Vector3d::Zero();
  Vector3d motion_sum = Vector3d::Zero();
  Vector3d contact_sum = Vector3d::Zero();
  for (int i = 0; i < 150; ++i) {
    RobotSideInput input = Input(i);
    input.sensed_wrench.tail<3>() << 0.1, 0.01 * random_.Normal(), 0.2;
    if (i > 20) input.moment_selection = kAlongZ;
    dut.Update(0.001 * i, input, &state);
    // Without the angular filter nothing else is different.
    dut_.Update(0.001 * i, input, &state_);
    EXPECT_EQ(state.output.controller.torque, state_.output.controller.torque);
    EXPECT_EQ(state.output.filter_means.velocity,
              state_.output.filter_means.velocity);
    EXPECT_EQ(state_.output.angular_filter_means.sensed_moment,
              Vector3d::Zero());
    EXPECT_EQ(state_.angular_filter_means.samples, 0);
    if (i < 100) continue;
    moment_sum += input.sensed_wrench.tail<3>();
    velocity_sum += input.v.segment<3>(3);
    motion_sum += state.output.controller.motion_moment;
    contact_sum += state.output.controller.contact_moment;
  }
  const AngularFilterMeans& means = state.output.angular_filter_means;
  EXPECT_TRUE(means.sensed_moment.isApprox(moment_sum / 50, 1e-12));
  EXPECT_TRUE(means.angular_velocity.isApprox(velocity_sum / 50, 1e-12));
  EXPECT_TRUE(means.motion_moment.isApprox(motion_sum / 50, 1e-12));
  EXPECT_TRUE(means.contact_moment.isApprox(contact_sum / 50, 1e-12));
  EXPECT_GT(means.contact_moment.norm(), 0.01);
}

TEST_F(RobotSideTest, LayoutNamesWhatIsWritten) {
  for (int i = 0; i < 50; ++i) dut_.Update(0.001 * i, Input(i), &state_);
  VectorXd vector = VectorXd::Constant(
      RobotSide::OutputSize(), std::numeric_limits<double>::quiet_NaN());
  RobotSide::WriteVector(state_.output, vector);
  EXPECT_TRUE(vector.allFinite());
  std::set<std::string> names;
  int expected_start = 0;
  for (const SignalSlice& signal : RobotSide::OutputLayout()) {
    EXPECT_EQ(signal.start, expected_start) << signal.name;
    expected_start += signal.size;
    EXPECT_TRUE(names.insert(signal.name).second) << signal.name;
    if (signal.name == "torque") {
      EXPECT_EQ(vector.segment<7>(signal.start),
                state_.output.controller.torque);
    }
    if (signal.name == "mean_contact_force") {
      EXPECT_EQ(vector.segment<3>(signal.start),
                state_.output.filter_means.contact_force);
    }
  }
  EXPECT_EQ(expected_start, vector.size());
  for (const char* name : {"robot_position",
                           "robot_velocity",
                           "robot_orientation",
                           "robot_proxy_position",
                           "robot_proxy_orientation",
                           "motion_error",
                           "reference_force",
                           "sensed_force",
                           "sensed_moment",
                           "motion_force",
                           "force_space_force",
                           "force_selection",
                           "joint_position",
                           "joint_velocity",
                           "torque",
                           "observed_energy",
                           "injected_damping",
                           "robot_link_status",
                           "robot_link_age",
                           "robot_link_dropped"}) {
    EXPECT_EQ(names.count(name), 1u) << name;
  }
}

TEST_F(RobotSideTest, CopyContinuesAlikeWithoutAllocation) {
  for (int i = 0; i < 99; ++i) dut_.Update(0.001 * i, Input(i), &state_);
  RobotSideState copy = state_;
  VectorXd vector(RobotSide::OutputSize());
  RandomStream at_fork = random_;
  {
    ScopedNoAlloc guard;
    for (int i = 99; i < 300; ++i) {
      dut_.Update(0.001 * i, Input(i), &state_);
      RobotSide::WriteVector(state_.output, vector);
    }
    EXPECT_EQ(guard.count(), 0);
  }
  random_ = at_fork;
  for (int i = 99; i < 300; ++i) dut_.Update(0.001 * i, Input(i), &copy);
  EXPECT_EQ(copy.output.controller.torque, state_.output.controller.torque);
}

TEST_F(RobotSideTest, ParamsAreCheckedTogether) {
  RobotSideParams params;
  params.controller.period = 0.002;
  EXPECT_EQ(ValidationError(params),
            "RobotSideParams: field `controller.period` expected the proxy's "
            "period, got 0.002");
  params = {};
  params.sender.period = 0.002;
  EXPECT_THROW(RobotSide{params}, std::invalid_argument);
  params = {};
  params.filter_period = 0.0001;
  EXPECT_EQ(ValidationError(params),
            "RobotSideParams: field `filter_period` expected a finite value >= "
            "proxy.period = 0.001, got 0.0001");
  params = {};
  params.angular_filter_period = 0.0001;
  EXPECT_EQ(ValidationError(params),
            "RobotSideParams: field `angular_filter_period` expected 0 or at "
            "least the control period, got 0.0001");
  params = {};
  params.filter_period = 0;
  EXPECT_THROW(RobotSide{params}, std::invalid_argument);
  params = {};
  params.controller.max_mass = 0;
  EXPECT_NE(ValidationError(params).find("`max_mass`"), std::string::npos);
}

}  // namespace
}  // namespace dual_proxy
