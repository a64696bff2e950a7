// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/sides/haptic_side.h"

#include <cmath>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "dual_proxy/common/random.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using Vector6d = Eigen::Matrix<double, 6, 1>;

class HapticSideTest : public ::testing::Test {
 protected:
  // A handle that wanders about while the robot presses on a floor.
  HapticSideInput Input(int tick) {
    HapticSideInput input;
    input.X_DH.p = 0.01 * Vector3d(random_.Normal(), random_.Normal(), -1);
    input.device_velocity.head<3>() = Vector3d(0.1, 0, 0.02);
    PoseMessage message{.sequence = tick / 20,
                        .send_time = 0.001 * (tick / 20 * 20),
                        .pose = {}};
    message.force_selection = Vector3d::UnitZ().asDiagonal();
    input.message = ToMessage(message);
    return input;
  }

  VectorXd Signals() const {
    VectorXd vector(SizeOf(dut_.layout()));
    Eigen::Ref<VectorXd> numbers(vector);
    SignalSink sink(&numbers);
    dut_.VisitSignals(state_, &sink);
    EXPECT_EQ(sink.size(), vector.size());
    return vector;
  }

  HapticSide dut_;
  HapticSideState state_ = dut_.MakeState();
  RandomStream random_{11};
};

// The side adds nothing to its half and its controller.
TEST_F(HapticSideTest, SameAsItsParts) {
  const HapticSideParams params = dut_.params();
  const HapticHalf half = Schemes::MakeHapticHalf(
      static_cast<int>(params.scheme),
      {.proxy = params.proxy, .sender = params.sender}, params.schemes);
  const HapticController controller(params.controller);
  HapticHalf::State half_state = half.MakeState();
  HapticControllerState controller_state = controller.MakeState();
  for (int i = 0; i < 500; ++i) {
    const double time = 0.001 * i;
    const HapticSideInput input = Input(i);
    dut_.Update(time, input, &state_);
    half.Update(time,
                {.message = input.message,
                 .X_DH = input.X_DH,
                 .device_velocity = input.device_velocity},
                &half_state);
    const HapticSetpoint& setpoint = half_state.output().setpoint;
    EXPECT_EQ(state_.output.device_wrench,
              controller.Update({.reference_force = setpoint.reference_force,
                                 .reference_moment = setpoint.reference_moment,
                                 .device_velocity = input.device_velocity,
                                 .force_selection = setpoint.force_selection,
                                 .contact_normals = setpoint.contact_normals},
                                &controller_state));
    EXPECT_EQ(state_.half.output().message.sequence,
              half_state.output().message.sequence);
    EXPECT_EQ(state_.half.output().message.body,
              half_state.output().message.body);
  }
  EXPECT_GT(state_.output.device_wrench.norm(), 0.1);
  EXPECT_EQ(state_.half.output().message.sequence, 24);
}

TEST_F(HapticSideTest, LayoutNamesWhatIsWritten) {
  for (int i = 0; i < 50; ++i) dut_.Update(0.001 * i, Input(i), &state_);
  const VectorXd vector = Signals();
  bool found = false;
  for (const SignalSlice& signal : dut_.layout()) {
    if (signal.name != "device_force") continue;
    found = true;
    EXPECT_EQ(vector.segment<3>(signal.start),
              state_.output.device_wrench.head<3>());
  }
  EXPECT_TRUE(found);
}

TEST_F(HapticSideTest, NotFiniteGivesNoForceAndIsCounted) {
  for (int i = 0; i < 50; ++i) dut_.Update(0.001 * i, Input(i), &state_);
  HapticSideInput input = Input(50);
  input.device_velocity(1) = std::numeric_limits<double>::quiet_NaN();
  dut_.Update(0.05, input, &state_);
  EXPECT_EQ(state_.output.device_wrench, Vector6d::Zero());
  EXPECT_EQ(state_.output.bad_inputs, 1);
}

TEST_F(HapticSideTest, CycleThatBothRefuseCountsOnce) {
  for (int i = 0; i < 50; ++i) dut_.Update(0.001 * i, Input(i), &state_);
  HapticSideInput input = Input(50);
  input.device_velocity(1) = std::numeric_limits<double>::quiet_NaN();
  input.X_DH.p(0) = std::numeric_limits<double>::quiet_NaN();
  dut_.Update(0.05, input, &state_);
  EXPECT_EQ(state_.half.output().bad_inputs, 1);
  EXPECT_EQ(state_.controller.bad_inputs, 1);
  EXPECT_EQ(state_.output.bad_inputs, 1);
  input = Input(51);
  input.X_DH.p(0) = std::numeric_limits<double>::quiet_NaN();
  dut_.Update(0.051, input, &state_);
  EXPECT_EQ(state_.output.bad_inputs, 2);
  dut_.Update(0.052, Input(52), &state_);
  EXPECT_EQ(state_.output.bad_inputs, 2);
  EXPECT_EQ(state_.half.output().sender_bad_inputs, 2);
}

TEST_F(HapticSideTest, CopyContinuesAlikeWithoutAllocation) {
  for (int i = 0; i < 50; ++i) dut_.Update(0.001 * i, Input(i), &state_);
  HapticSideState copy = state_;
  const HapticSideInput input = Input(50);
  VectorXd vector(SizeOf(dut_.layout()));
  Eigen::Ref<VectorXd> numbers(vector);
  ScopedNoAlloc guard;
  dut_.Update(0.05, input, &state_);
  SignalSink sink(&numbers);
  dut_.VisitSignals(state_, &sink);
  EXPECT_EQ(guard.count(), 0);
  dut_.Update(0.05, input, &copy);
  EXPECT_EQ(copy.output.device_wrench, state_.output.device_wrench);
}

// A hand that presses 8 mm into a floor on which a robot rests, with any
// scheme.
class OperatorAidsTest : public ::testing::TestWithParam<int> {
 protected:
  static HapticSideParams Params() {
    HapticSideParams params;
    params.scheme = static_cast<Scheme>(GetParam());
    params.aids.buttons = true;
    return params;
  }

  HapticSideInput Input(int tick, const Vector3d& p) const {
    HapticSideInput input;
    input.X_DH.p = p;
    const std::int64_t sequence = tick / 20;
    const double sent = 0.001 * static_cast<double>(sequence * 20);
    if (ToDeviceTag(dut_.params().scheme) == ForceMessage::kTag) {
      input.message = ToMessage(ForceMessage{
          .sequence = sequence, .send_time = sent, .force = {0, 0, -5}});
    } else {
      PoseMessage message{.sequence = sequence, .send_time = sent, .pose = {}};
      message.force_selection = Vector3d::UnitZ().asDiagonal();
      input.message = ToMessage(message, ToDeviceTag(dut_.params().scheme));
    }
    return input;
  }

  // Of what is sent, in whichever frame.
  Vector3d Sent() const {
    const auto& body = state_.half.output().message.body;
    return {body[0], body[1], body[2]};
  }

  double Force() const { return state_.output.device_wrench.norm(); }

  const Vector3d pressed_{0.01, 0, -0.008};
  HapticSide dut_{Params()};
  HapticSideState state_ = dut_.MakeState();
};

TEST_P(OperatorAidsTest, ClutchHoldsTheRobotAndFreesTheHand) {
  int tick = 0;
  const auto update = [&](bool clutch, const Vector3d& p, const Vector3d& v) {
    HapticSideInput input = Input(tick, p);
    input.buttons.clutch = clutch;
    input.device_velocity.head<3>() = v;
    dut_.Update(0.001 * tick++, input, &state_);
  };
  const Vector3d rest = Vector3d::Zero();
  while (tick < 1000) update(false, pressed_, rest);
  ASSERT_GT(Force(), 1.5);
  const Vector3d sent = Sent();
  double force = Force();
  // Back to the middle and beyond, fast.
  const Vector3d v(-0.05, 0.02, 0.03);
  Vector3d p = pressed_;
  for (int i = 0; i < 1000; ++i) {
    p += 0.001 * v;
    update(true, p, v);
    ASSERT_LT((Sent() - sent).norm(), 1e-12);
    ASSERT_LT(Force(), force + 0.05);
    force = Force();
    if (i > 150) {
      ASSERT_EQ(force, 0);
    }
  }
  // Nothing jumps, and the force grows from zero.
  double last = 0;
  for (int i = 0; i < 700; ++i) {
    update(false, p, rest);
    ASSERT_LT((Sent() - sent).norm(), 1e-12);
    ASSERT_LT(Force() - last, 0.03) << i;
    last = Force();
  }
  EXPECT_GT(last, 1.5);
  // The robot goes on from where it was.
  for (int i = 0; i < 100; ++i) update(false, p + Vector3d(0.004, 0, 0), rest);
  EXPECT_GT((Sent() - sent).norm(), 0.0039);
}

TEST_P(OperatorAidsTest, ForceScaleTakesOverSmoothly) {
  int tick = 0;
  const auto update = [&](double scale) {
    HapticSideInput input = Input(tick, pressed_);
    input.buttons.force_scale = scale;
    dut_.Update(0.001 * tick++, input, &state_);
  };
  while (tick < 1000) update(1);
  // Some schemes ask for more than the device can give.
  const double whole = state_.half.output().setpoint.reference_force.norm();
  double last = Force();
  for (int i = 0; i < 600; ++i) {
    update(0.5);
    ASSERT_LT(std::abs(Force() - last), 0.0011 * whole);
    last = Force();
  }
  EXPECT_NEAR(last, whole / 2, 1e-9);
  update(std::numeric_limits<double>::quiet_NaN());
  EXPECT_NEAR(Force(), whole / 2, 1e-9);
  for (int i = 0; i < 1000; ++i) update(-1);
  EXPECT_EQ(Force(), 0);
}

// Before it is engaged the robot rests, wherever the handle is.
TEST_P(OperatorAidsTest, HomingComesBeforeTheRobotMoves) {
  Vector3d p(0.03, 0, 0);
  const Vector3d home = [&] {
    HapticSideState other = dut_.MakeState();
    for (int i = 0; i < 100; ++i) {
      dut_.Update(0.001 * i, Input(i, Vector3d::Zero()), &other);
    }
    const auto& body = other.half.output().message.body;
    return Vector3d(body[0], body[1], body[2]);
  }();
  bool homed = false;
  for (int i = 0; i < 3000; ++i) {
    HapticSideInput input = Input(i, p);
    input.buttons.home = true;
    dut_.Update(0.001 * i, input, &state_);
    // A light handle that nobody holds.
    p += 0.001 * 0.02 * state_.output.device_wrench.head<3>();
    if (i > 40) {
      ASSERT_LT((Sent() - home).norm(), 1e-4) << i;
    }
    homed = state_.aids.homing.done;
    if (homed) break;
  }
  EXPECT_TRUE(homed);
  EXPECT_LT(p.norm(), 0.0021);
  EXPECT_TRUE(state_.aids.clutch.clutched);
}

TEST_P(OperatorAidsTest, FixturesActBesideTheScheme) {
  HapticSideParams params = Params();
  params.aids.workspace_wall.stiffness = 1000;
  params.aids.guidance.shape = GuidanceShape::kPlane;
  params.aids.guidance.direction = Vector3d::UnitY();
  const HapticSide dut(params);
  HapticSideState state = dut.MakeState();
  const Vector3d p(0.053, 0.005, 0);
  for (int i = 0; i < 1000; ++i) {
    HapticSideInput input;
    input.X_DH.p = p;
    dut.Update(0.001 * i, input, &state);
  }
  const Vector3d expected(-3, -1.5, 0);
  EXPECT_LT((state.output.device_wrench.head<3>() - expected).norm(), 1e-9);
}

TEST_P(OperatorAidsTest, DoNotAllocate) {
  HapticSideParams params = Params();
  params.aids.workspace_wall.stiffness = 1000;
  params.aids.guidance.shape = GuidanceShape::kLine;
  const HapticSide dut(params);
  HapticSideState state = dut.MakeState();
  HapticSideInput input = Input(0, pressed_);
  input.buttons = {.clutch = true, .home = true, .force_scale = 0.5};
  VectorXd vector(SizeOf(dut.layout()));
  Eigen::Ref<VectorXd> numbers(vector);
  ScopedNoAlloc guard;
  dut.Update(0, input, &state);
  SignalSink sink(&numbers);
  dut.VisitSignals(state, &sink);
  EXPECT_EQ(guard.count(), 0);
  EXPECT_EQ(sink.size(), vector.size());
}

// Those whose messages a test can make up without their halves.
INSTANTIATE_TEST_SUITE_P(
    Schemes, OperatorAidsTest,
    ::testing::Values(Schemes::IndexOf<DualProxyScheme>(),
                      Schemes::IndexOf<PositionForceScheme>(),
                      Schemes::IndexOf<PositionPositionScheme>()));

TEST_F(HapticSideTest, ButtonsDoNothingUnlessTheyAreOn) {
  HapticSideState other = dut_.MakeState();
  for (int i = 0; i < 200; ++i) {
    HapticSideInput input = Input(i);
    dut_.Update(0.001 * i, input, &state_);
    input.buttons = {.clutch = true, .home = true, .force_scale = 0.5};
    input.handle_force = Vector3d(1, 2, 3);
    dut_.Update(0.001 * i, input, &other);
    ASSERT_EQ(other.output.device_wrench, state_.output.device_wrench);
    ASSERT_EQ(other.half.output().message.body,
              state_.half.output().message.body);
  }
}

TEST_F(HapticSideTest, SendsTheLastGripperOpeningThatWasValid) {
  EXPECT_TRUE(std::isnan(state_.message().gripper_opening));
  HapticSideInput input = Input(0);
  dut_.Update(0, input, &state_);
  EXPECT_TRUE(std::isnan(state_.message().gripper_opening));
  input.gripper_opening = 0.012;
  dut_.Update(0.001, input, &state_);
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(),
                           std::numeric_limits<double>::infinity()}) {
    input.gripper_opening = bad;
    dut_.Update(0.002, input, &state_);
    EXPECT_EQ(state_.message().gripper_opening, 0.012);
  }
  EXPECT_EQ(state_.message().body, state_.half.output().message.body);
}

TEST_F(HapticSideTest, ParamsAreCheckedTogether) {
  HapticSideParams params;
  params.sender.period = 0.002;
  EXPECT_EQ(ValidationError(params),
            "HapticSideParams: field `sender.period` expected the proxy's "
            "period, got 0.002");
  params = {};
  params.controller.period = 0.002;
  EXPECT_THROW(HapticSide{params}, std::invalid_argument);
  params = {};
  params.controller.max_force = -1;
  EXPECT_NE(ValidationError(params).find("`max_force`"), std::string::npos);
}

}  // namespace
}  // namespace dual_proxy
