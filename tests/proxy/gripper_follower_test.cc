// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/gripper_follower.h"

#include <limits>

#include <gtest/gtest.h>

#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

class GripperFollowerTest : public ::testing::Test {
 protected:
  void Run(double opening, int ticks, bool connected = true) {
    const ScopedNoAlloc guard;
    for (int i = 0; i < ticks; ++i) dut_.Update(connected, opening, &state_);
    EXPECT_EQ(guard.count(), 0);
  }

  const GripperParams params_;
  const GripperFollower dut_{params_};
  GripperState state_{dut_.MakeState()};
};

TEST_F(GripperFollowerTest, FollowsAtItsSpeedWithinItsRange) {
  EXPECT_EQ(state_.width, params_.start_width);
  Run(0.01, 100);
  EXPECT_NEAR(state_.width, 0.07, 1e-12);
  Run(0.01, 1000);
  EXPECT_NEAR(state_.width, 0.03, 1e-12);
  Run(1, 2000);
  EXPECT_EQ(state_.width, params_.max_width);
  Run(-0.002, 2000);
  EXPECT_EQ(state_.width, 0);
}

TEST_F(GripperFollowerTest, KeepsTheLastTargetWithoutAnOpening) {
  Run(0.01, 100);
  for (const double none : {std::numeric_limits<double>::quiet_NaN(),
                            std::numeric_limits<double>::infinity()}) {
    Run(none, 1000);
    EXPECT_NEAR(state_.width, 0.03, 1e-12);
  }
}

TEST_F(GripperFollowerTest, HoldsWithoutALink) {
  Run(0.01, 100);
  const double width = state_.width;
  Run(0.01, 500, false);
  EXPECT_EQ(state_.width, width);
}

TEST_F(GripperFollowerTest, ErrorsNameTheField) {
  GripperParams params;
  params.start_width = 0.09;
  EXPECT_NE(ValidationError(params).find("`start_width`"), std::string::npos);
  params = {};
  params.scale = 0;
  EXPECT_NE(ValidationError(params).find("`scale`"), std::string::npos);
}

}  // namespace
}  // namespace dual_proxy
