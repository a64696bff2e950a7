// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/window_mean.h"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "dual_proxy/common/random.h"
#include "no_alloc.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

class WindowMeanTest : public ::testing::Test {
 protected:
  WindowMean<3> dut_{0.1};
  WindowMeanState<3> state_{dut_.MakeState()};
};

TEST_F(WindowMeanTest, IsZeroBeforeTheFirstSample) {
  EXPECT_EQ(state_.mean, Vector3d(0, 0, 0));
  EXPECT_EQ(state_.samples, 0);
}

TEST_F(WindowMeanTest, IsTheMeanOfTheSamplesOfTheWindow) {
  dut_.Update(0.00, Vector3d(1, 2, -3), &state_);
  EXPECT_EQ(state_.mean, Vector3d(1, 2, -3));
  dut_.Update(0.05, Vector3d(2, 4, -6), &state_);
  EXPECT_EQ(state_.mean, Vector3d(1.5, 3, -4.5));
  dut_.Update(0.09, Vector3d(6, 0, 0), &state_);
  EXPECT_EQ(state_.mean, Vector3d(3, 2, -3));
  EXPECT_EQ(state_.samples, 3);
  dut_.Update(0.10, Vector3d(7, 8, 9), &state_);
  EXPECT_EQ(state_.mean, Vector3d(7, 8, 9));
  EXPECT_EQ(state_.samples, 1);
  EXPECT_EQ(state_.window, 1);
}

// Some multiples of the window fall short of their quotient in floating point:
// 0.3 / 0.1 < 3. The tolerance makes each the first sample of its window.
TEST_F(WindowMeanTest, StartsAnewAtEachMultipleInSpiteOfRounding) {
  for (int i = 0; i <= 5000; ++i) {
    dut_.Update(i * 0.001, Vector3d::Zero(), &state_);
    ASSERT_EQ(state_.samples, i % 100 + 1) << i;
    ASSERT_EQ(state_.window, i / 100) << i;
  }
}

TEST_F(WindowMeanTest, WindowWithoutSampleKeepsTheMean) {
  dut_.Update(0.02, Vector3d(1, 1, 1), &state_);
  const Vector3d before = state_.mean;
  dut_.Update(0.13, Vector3d(kNaN, 0, 0), &state_);
  dut_.Update(0.27, Vector3d(0, kInfinity, 0), &state_);
  EXPECT_EQ(state_.mean, before);
  dut_.Update(0.35, Vector3d(5, 5, 5), &state_);
  EXPECT_EQ(state_.mean, Vector3d(5, 5, 5));
  EXPECT_EQ(state_.bad_inputs, 2);
}

TEST_F(WindowMeanTest, RefusesTimesThatAreNone) {
  dut_.Update(0.02, Vector3d(1, 1, 1), &state_);
  for (const double time : {kNaN, kInfinity, -kInfinity, 1e300}) {
    dut_.Update(time, Vector3d(9, 9, 9), &state_);
  }
  EXPECT_EQ(state_.bad_inputs, 4);
  EXPECT_EQ(state_.samples, 1);
  EXPECT_EQ(state_.mean, Vector3d(1, 1, 1));
}

TEST_F(WindowMeanTest, RandomSamplesAgainstThePlainMean) {
  RandomStream random(5);
  for (int run = 0; run < 200; ++run) {
    WindowMean<12> dut(0.001 + random.Uniform());
    WindowMeanState<12> state = dut.MakeState();
    const double start = dut.window() * std::floor(100 * random.Uniform());
    Eigen::Matrix<double, 12, 1> sum = Eigen::Matrix<double, 12, 1>::Zero();
    const int count = 1 + static_cast<int>(50 * random.Uniform());
    for (int i = 0; i < count; ++i) {
      Eigen::Matrix<double, 12, 1> value;
      for (double& x : value) x = random.Normal();
      sum += value;
      dut.Update(start + dut.window() * i / count, value, &state);
    }
    EXPECT_EQ(state.samples, count) << run;
    EXPECT_TRUE(state.mean.isApprox(sum / count, 1e-12)) << run;
  }
}

// A vector's mean is that of its parts, bit for bit.
TEST_F(WindowMeanTest, PartsGiveTheSameBits) {
  RandomStream random(6);
  const WindowMean<12> whole(0.1);
  WindowMeanState<12> whole_state = whole.MakeState();
  for (int i = 0; i < 250; ++i) {
    Eigen::Matrix<double, 12, 1> value;
    for (double& x : value) x = random.Normal();
    whole.Update(0.001 * i, value, &whole_state);
    dut_.Update(0.001 * i, value.segment<3>(6), &state_);
    ASSERT_EQ(state_.mean, whole_state.mean.segment<3>(6)) << i;
  }
}

TEST_F(WindowMeanTest, CopyContinuesAlikeWithoutAllocation) {
  dut_.Update(0.02, Vector3d(1, 2, 3), &state_);
  WindowMeanState<3> copy = state_;
  {
    ScopedNoAlloc guard;
    dut_.Update(0.03, Vector3d(4, 5, 6), &state_);
    dut_.Update(0.12, Vector3d(kNaN, 5, 6), &state_);
    EXPECT_EQ(guard.count(), 0);
  }
  EXPECT_EQ(copy.mean, Vector3d(1, 2, 3));
  dut_.Update(0.03, Vector3d(4, 5, 6), &copy);
  EXPECT_EQ(copy.mean, state_.mean);
}

TEST_F(WindowMeanTest, WindowIsChecked) {
  for (const double window : {0.0, -1.0, kNaN, kInfinity, 1e300}) {
    EXPECT_THROW(WindowMean<3>{window}, std::invalid_argument) << window;
  }
  try {
    WindowMean<3>{-1};
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_EQ(std::string(error.what()),
              "WindowMean: field `window` expected a number in (0, 1e+11], got "
              "-1");
  }
}

}  // namespace
}  // namespace dual_proxy
