// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/sides/haptic_side.h"

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
