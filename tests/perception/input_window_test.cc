// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/perception/input_window.h"

#include <gtest/gtest.h>

#include "no_alloc.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;

TEST(InputWindowTest, IsTenMillisecondsLong) {
  EXPECT_EQ(InputWindow(1.0 / 15).size(), 1);
  EXPECT_EQ(InputWindow(0.01).size(), 1);
  EXPECT_EQ(InputWindow(0.007).size(), 1);
  EXPECT_EQ(InputWindow(0.005).size(), 2);
  EXPECT_EQ(InputWindow(0.002).size(), 5);
  EXPECT_EQ(InputWindow(0.001).size(), 10);
  EXPECT_EQ(InputWindow(0.0001).size(), InputWindowState::kMostInputs);
}

TEST(InputWindowTest, OneInputStaysAsItIs) {
  InputWindowState state;
  ContactInput input{Vector3d(1, 2, 3), Vector3d(4, 5, 6), Vector3d(7, 8, 9)};
  EXPECT_TRUE(InputWindow(0.01).Add(&input, &state));
  EXPECT_EQ(input.force, Vector3d(1, 2, 3));
  EXPECT_EQ(input.velocity, Vector3d(4, 5, 6));
  EXPECT_EQ(input.command, Vector3d(7, 8, 9));
}

TEST(InputWindowTest, MeanOfWhatIsNotOutermost) {
  const InputWindow dut(0.001);
  InputWindowState state;
  ScopedNoAlloc guard;
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < 10; ++i) {
      // Two of ten are wild.
      const double wild = i == 3 ? 50 : i == 4 ? -1e6 : 0;
      ContactInput input{Vector3d(i + wild, round, 0),
                         Vector3d(0.1 * i, 0, wild), Vector3d(-i, 0, 0)};
      ASSERT_EQ(dut.Add(&input, &state), i == 9);
      if (i < 9) continue;
      // Of 0 to 2 and 5 to 9 with one below and one above, the six in the
      // middle: 1, 2, 5, 6, 7 and 8.
      EXPECT_NEAR(input.force.x(), 29.0 / 6, 1e-12);
      EXPECT_EQ(input.force.y(), round);
      EXPECT_NEAR(input.velocity.x(), 0.45, 1e-12);
      EXPECT_EQ(input.velocity.z(), 0);
      EXPECT_NEAR(input.command.x(), -4.5, 1e-12);
    }
  }
  EXPECT_EQ(guard.count(), 0);
}

}  // namespace
}  // namespace dual_proxy
