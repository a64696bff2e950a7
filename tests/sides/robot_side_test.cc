// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/sides/robot_side.h"

#include <algorithm>
#include <cmath>
#include <limits>
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
  RobotSideInput<SerialArm<7>> Input(int tick) {
    RobotSideInput<SerialArm<7>> input;
    input.model.J_BE.leftCols<6>().setIdentity();
    input.model.mass = 7 * Matrix7::Identity();
    input.X_BE.p = Vector3d(0.4, 0, 0.3 + 1e-3 * random_.Normal());
    for (int i = 0; i < 7; ++i) input.v(i) = 0.01 * random_.Normal();
    input.q = dut_.params().controller.q_rest;
    input.sensed_wrench << 0.2 * random_.Normal(), 0, -5, 0, 0, 0;
    input.message = ToMessage(
        PoseMessage{.sequence = tick / 20,
                    .send_time = 0.001 * (tick / 20 * 20),
                    .pose = {.p = Vector3d(0.16, 1e-4 * tick, 0.12)}});
    return input;
  }

  // What somebody else knows: the floor is there, and is not.
  static ContactSelections Known(int tick) {
    return {.force = tick % 200 < 100 ? kAlongZ : Matrix3d::Zero()};
  }

  RobotSide<SerialArm<7>> dut_;
  RobotSideState<SerialArm<7>> state_ = dut_.MakeState();
  RandomStream random_{12};
};

// The side adds nothing to its half, its controller and perception.
TEST_F(RobotSideTest, SameAsItsParts) {
  const RobotSideParams<SerialArm<7>> params = dut_.params();
  const RobotHalf half = Schemes::MakeRobotHalf(
      static_cast<int>(params.scheme),
      {.proxy = params.proxy, .sender = params.sender}, params.schemes);
  const OperationalSpaceController<7> controller(params.controller);
  const ContactPerception perception(params.perception);
  RobotHalf::State half_state = half.MakeState();
  OperationalSpaceControllerState<7> controller_state = controller.MakeState();
  ContactPerceptionState perception_state = perception.MakeState(3, 4);
  state_ = dut_.MakeState(3, 4);
  bool found = false;
  for (int i = 0; i < 700; ++i) {
    const double time = 0.001 * i;
    RobotSideInput<SerialArm<7>> input = Input(i);
    dut_.Update(time, input, &state_);

    const ContactSelections selections =
        perception.GetSelections(perception_state);
    found = found || selections.force != Matrix3d::Zero();
    half.Update(time,
                {.message = input.message,
                 .X_BE = input.X_BE,
                 .v_BE = CalcTwist(input.model, input.v),
                 .force_selection = selections.force,
                 .moment_selection = selections.moment,
                 .contact_normals = selections.normals,
                 .sensed_wrench = input.sensed_wrench},
                &half_state);
    const RobotSetpoint& setpoint = half_state.output().setpoint;
    const auto command =
        controller.Update({.model = input.model,
                           .q = input.q,
                           .v = input.v,
                           .motion_error = setpoint.motion_error,
                           .rotation_error = setpoint.rotation_error,
                           .proxy_velocity = setpoint.velocity,
                           .proxy_acceleration = setpoint.acceleration,
                           .reference_force = setpoint.reference_force,
                           .reference_moment = setpoint.reference_moment,
                           .force_selection = setpoint.force_selection,
                           .moment_selection = setpoint.moment_selection,
                           .force_feedback = setpoint.force_feedback,
                           .sensed_wrench = input.sensed_wrench},
                          &controller_state);
    perception.UpdateFilters(time, &perception_state);
    perception.AddSamples(time,
                          {.sensed = input.sensed_wrench.head<3>(),
                           .velocity = input.v.head<3>(),
                           .motion = command.motion_force,
                           .contact = command.contact_force},
                          {}, &perception_state);

    ASSERT_EQ(state_.output.controller.torque, command.torque) << i;
    ASSERT_EQ(state_.output.selections.force, selections.force) << i;
    ASSERT_EQ(state_.perception.force.means.mean,
              perception_state.force.means.mean);
    ASSERT_EQ(state_.perception.force.filter.particles,
              perception_state.force.filter.particles);
    EXPECT_EQ(state_.half.output().message.body,
              half_state.output().message.body);
  }
  EXPECT_TRUE(found);
  EXPECT_EQ(state_.output.bad_inputs, 0);
  EXPECT_EQ(state_.half.output().link.status, LinkStatus::kConnected);
}

// The filters rest, and what they had found does not count.
TEST_F(RobotSideTest, SelectionFromOutsideReplacesPerception) {
  for (int i = 0; i < 300; ++i) {
    RobotSideInput<SerialArm<7>> input = Input(i);
    input.selections = Known(i);
    dut_.Update(0.001 * i, input, &state_);
    EXPECT_EQ(state_.output.selections.force, Known(i).force);
    EXPECT_EQ(state_.half.output().setpoint.force_selection, Known(i).force);
    if (i % 20 != 0) continue;
    const auto sent = FromMessage<PoseMessage>(state_.half.output().message);
    EXPECT_EQ(sent.force_selection, Known(i).force);
  }
  EXPECT_EQ(state_.perception.force.filter.updates, 0);
  EXPECT_GT(state_.perception.force.means.samples, 0);
  for (int i = 300; i < 600; ++i) dut_.Update(0.001 * i, Input(i), &state_);
  EXPECT_EQ(state_.perception.force.filter.updates, 5);
}

// Where the scheme has no use for it there is none, and no signal of it.
TEST_F(RobotSideTest, PerceptionIsThereForTheSchemesThatUseIt) {
  Schemes::ForEach([this]<typename S>() {
    RobotSideParams<SerialArm<7>> params;
    params.scheme = SchemeOf<S>;
    const RobotSide<SerialArm<7>> dut(params);
    EXPECT_EQ(dut.has_perception(), S::kUsesSelections) << S::kName;
    RobotSideState<SerialArm<7>> state = dut.MakeState();
    for (int i = 0; i < 200; ++i) dut.Update(0.001 * i, Input(i), &state);
    EXPECT_EQ(state.perception.force.filter.updates > 0, S::kUsesSelections);
    bool named = false;
    for (const SignalSlice& signal : dut.layout()) {
      named = named || signal.name == "dimension";
    }
    EXPECT_EQ(named, S::kUsesSelections) << S::kName;
  });
}

// A sensor that goes, or is tared, in the middle of a contact.
TEST_F(RobotSideTest, WithoutASensorItHoldsItsPlaceAndPushesForNothing) {
  RobotSideInput<SerialArm<7>> input = Input(0);
  input.v.setZero();
  input.selections = Known(0);
  input.sensed_wrench << 0, 0, -6, 0, 0, 0;
  int i = 0;
  const auto run = [&](int ticks) {
    for (const int end = i + ticks; i < end; ++i) {
      input.message = ToMessage(PoseMessage{.sequence = i / 20,
                                            .send_time = 0.001 * (i / 20 * 20),
                                            .pose = {.p = {0.16, 0, -0.2}}});
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

TEST_F(RobotSideTest, RefusedCyclesAddNothingToTheMeans) {
  dut_.Update(0, Input(0), &state_);
  const auto before = state_.perception.force.means.mean;
  RobotSideInput<SerialArm<7>> bad = Input(1);
  bad.sensed_wrench(2) = std::numeric_limits<double>::quiet_NaN();
  dut_.Update(0.001, bad, &state_);
  EXPECT_EQ(state_.output.bad_inputs, 1);
  EXPECT_EQ(state_.perception.force.means.samples, 1);
  EXPECT_EQ(state_.perception.force.means.mean, before);
  EXPECT_TRUE(state_.output.controller.torque.allFinite());
  dut_.Update(0.002, Input(2), &state_);
  EXPECT_EQ(state_.perception.force.means.samples, 2);
}

// What adapters do with a bad sample, for those who have none.
TEST_F(RobotSideTest, HoldsItsPlaceOnceThereIsNoGoodWrench) {
  const auto step = [this](int i, bool good, double age, bool hold) {
    RobotSideInput<SerialArm<7>> input = Input(i);
    input.selections = ContactSelections{.force = kAlongZ};
    input.sensor_age = age;
    input.hold = hold;
    if (!good) input.sensed_wrench(1) = std::numeric_limits<double>::infinity();
    dut_.Update(0.001 * i, input, &state_);
  };
  int i = 0;
  for (; i < 300; ++i) step(i, true, 0, false);
  EXPECT_EQ(state_.output.hold, HoldReason::kNone);
  EXPECT_GT(state_.output.controller.contact_force.norm(), 1);
  // The last good one is younger than 10 ms.
  for (const int end = i + 9; i < end; ++i) step(i, false, 0, false);
  EXPECT_EQ(state_.output.hold, HoldReason::kBadInputs);
  EXPECT_FALSE(state_.output.setpoint.force_selection.isZero());
  EXPECT_GT(state_.output.controller.contact_force.norm(), 1);
  for (const int end = i + 200; i < end; ++i) step(i, false, 0, false);
  EXPECT_EQ(state_.output.bad_inputs, 209);
  EXPECT_TRUE(state_.output.setpoint.force_selection.isZero());
  EXPECT_LT(state_.output.controller.contact_force.norm(), 1e-3);
  EXPECT_TRUE(state_.output.setpoint.reference_force.isZero());
  step(i++, true, 0, false);
  EXPECT_EQ(state_.output.hold, HoldReason::kNone);
  step(i++, true, 0.02, false);  // Too old.
  EXPECT_EQ(state_.output.hold, HoldReason::kNoSensor);
  step(i++, true, std::numeric_limits<double>::quiet_NaN(), false);
  EXPECT_EQ(state_.output.hold, HoldReason::kNoSensor);
  step(i++, true, 0.009, false);
  EXPECT_EQ(state_.output.hold, HoldReason::kNone);
  step(i++, true, -5, false);  // By a clock that is ahead.
  EXPECT_EQ(state_.output.hold, HoldReason::kNone);
  for (const int end = i + 12; i < end; ++i) step(i, false, 0, false);
  EXPECT_GT(state_.sensed_age, dut_.params().max_sensor_age);
  step(i++, true, 0, false);
  step(i++, true, 0, true);
  EXPECT_EQ(state_.output.hold, HoldReason::kAsked);
  for (const int end = i + 600; i < end; ++i) {
    RobotSideInput<SerialArm<7>> input = Input(0);
    dut_.Update(0.001 * i, input, &state_);
  }
  EXPECT_EQ(state_.output.hold, HoldReason::kNoLink);
}

TEST_F(RobotSideTest, ReclutchesWithSomeSchemes) {
  RobotSideParams<SerialArm<7>> params;
  params.proxy.reclutch = true;
  params.Validate();
  params.scheme = SchemeOf<TdpaScheme>;
  EXPECT_EQ(ValidationError(params),
            "RobotSideParams: field `proxy.reclutch` expected false for a "
            "scheme whose robot goes to where the hand is, got 1");
}

TEST_F(RobotSideTest, RefusedCyclesCountOnceWhoeverRefuses) {
  dut_.Update(0, Input(0), &state_);
  RobotSideInput<SerialArm<7>> bad = Input(1);
  bad.v(2) = std::numeric_limits<double>::quiet_NaN();
  bad.X_BE.R *= 2;
  dut_.Update(0.001, bad, &state_);
  EXPECT_EQ(state_.half.output().bad_inputs, 1);
  EXPECT_EQ(state_.controller.bad_inputs, 1);
  EXPECT_EQ(state_.output.bad_inputs, 1);
  bad = Input(2);
  bad.X_BE.R *= 2;  // No matter to the controller.
  dut_.Update(0.002, bad, &state_);
  EXPECT_EQ(state_.half.output().bad_inputs, 2);
  EXPECT_EQ(state_.controller.bad_inputs, 1);
  EXPECT_EQ(state_.output.bad_inputs, 2);
  dut_.Update(0.003, Input(3), &state_);
  EXPECT_EQ(state_.output.bad_inputs, 2);
  EXPECT_EQ(state_.half.output().sender_bad_inputs, 2);
}

// It has its directions, the hand feels nothing of them; not without a link.
TEST_F(RobotSideTest, PlannerSharesTheReference) {
  const PlannerReference planner{.selection = kAlongZ, .force = {0, 0, -3}};
  const ContactSelections floor{.force = kAlongZ};
  const auto run = [&](int begin, int end, bool planned) {
    for (int i = begin; i < end; ++i) {
      RobotSideInput<SerialArm<7>> input = Input(std::min(i, 1500));
      input.selections = floor;
      if (planned) input.planner = planner;
      dut_.Update(0.001 * i, input, &state_);
    }
  };
  const auto felt = [&] {
    return FromMessage<PoseMessage>(state_.half.output().message)
        .force_selection;
  };
  run(0, 500, false);
  EXPECT_EQ(state_.output.setpoint.reference_force,
            state_.half.output().setpoint.reference_force);
  EXPECT_EQ(felt(), kAlongZ);
  run(500, 1500, true);
  EXPECT_EQ(state_.output.setpoint.reference_force, planner.force);
  EXPECT_EQ(felt(), Matrix3d::Zero());
  run(1500, 4000, true);  // No new message.
  EXPECT_EQ(state_.half.output().link.status, LinkStatus::kLost);
  EXPECT_EQ(state_.output.setpoint.reference_force, Vector3d::Zero());
  EXPECT_EQ(felt(), kAlongZ);
  EXPECT_EQ(state_.output.bad_inputs, 0);
}

TEST_F(RobotSideTest, BadPlannerIsRefusedAndCounted) {
  for (int i = 0; i < 3; ++i) {
    RobotSideInput<SerialArm<7>> input = Input(i);
    input.planner = PlannerReference{.selection = 2 * kAlongZ};
    dut_.Update(0.001 * i, input, &state_);
  }
  EXPECT_EQ(state_.output.bad_inputs, 3);
  EXPECT_EQ(state_.blend.planner.selection, Matrix3d::Zero());
}

TEST_F(RobotSideTest, LayoutNamesWhatIsWritten) {
  for (int i = 0; i < 50; ++i) dut_.Update(0.001 * i, Input(i), &state_);
  VectorXd vector = VectorXd::Constant(
      SizeOf(dut_.layout()), std::numeric_limits<double>::quiet_NaN());
  Eigen::Ref<VectorXd> numbers(vector);
  SignalSink sink(&numbers);
  dut_.VisitSignals(state_, &sink);
  EXPECT_EQ(sink.size(), vector.size());
  EXPECT_TRUE(vector.allFinite());
  bool found = false;
  for (const SignalSlice& signal : dut_.layout()) {
    if (signal.name != "torque") continue;
    found = true;
    EXPECT_EQ(vector.segment<7>(signal.start), state_.output.controller.torque);
  }
  EXPECT_TRUE(found);
}

TEST_F(RobotSideTest, CopyContinuesAlikeWithoutAllocation) {
  for (int i = 0; i < 99; ++i) dut_.Update(0.001 * i, Input(i), &state_);
  RobotSideState<SerialArm<7>> copy = state_;
  VectorXd vector(SizeOf(dut_.layout()));
  Eigen::Ref<VectorXd> numbers(vector);
  RandomStream at_fork = random_;
  {
    ScopedNoAlloc guard;
    for (int i = 99; i < 300; ++i) {
      dut_.Update(0.001 * i, Input(i), &state_);
      SignalSink sink(&numbers);
      dut_.VisitSignals(state_, &sink);
    }
    EXPECT_EQ(guard.count(), 0);
  }
  random_ = at_fork;
  for (int i = 99; i < 300; ++i) dut_.Update(0.001 * i, Input(i), &copy);
  EXPECT_EQ(copy.output.controller.torque, state_.output.controller.torque);
}

TEST_F(RobotSideTest, ParamsAreCheckedTogether) {
  RobotSideParams<SerialArm<7>> params;
  params.controller.period = 0.002;
  EXPECT_EQ(ValidationError(params),
            "RobotSideParams: field `controller.period` expected the proxy's "
            "period, got 0.002");
  params = {};
  params.sender.period = 0.002;
  EXPECT_THROW(RobotSide<SerialArm<7>>{params}, std::invalid_argument);
  params = {};
  params.perception.filter.period = 0.0001;
  EXPECT_EQ(ValidationError(params),
            "RobotSideParams: field `perception.filter.period` expected at "
            "least the control period, got 0.0001");
  params = {};
  params.perception.angular_filter.filter.period = 0.0001;
  EXPECT_EQ(ValidationError(params), "no exception");
  params.perception.angular_filter.enabled = true;
  EXPECT_EQ(ValidationError(params),
            "RobotSideParams: field `perception.angular_filter.filter.period` "
            "expected at least the control period, got 0.0001");
  params = {};
  params.planner.scan_amplitude.y() = 0.1;
  EXPECT_EQ(ValidationError(params), "no exception");
  params.planner.active = {{1, 2}};
  params.planner.directions = {{0, 0, 1}};
  EXPECT_EQ(ValidationError(params),
            "RobotSideParams: field `planner.scan_frequency` expected a scan "
            "no faster than proxy.limiter.max_velocity, got 0.5");
  params = {};
  params.controller.max_mass = 0;
  EXPECT_NE(ValidationError(params).find("`max_mass`"), std::string::npos);
}

}  // namespace
}  // namespace dual_proxy
