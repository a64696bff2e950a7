// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/perception/force_bias.h"

#include <cmath>

#include <gtest/gtest.h>

#include "feeler.h"

namespace dual_proxy {
namespace {

const Vector3d kBias(0.5, -0.3, 0.8);  // N

ForceBias MakeBias() { return {0.5, 0.02, 0.25, 0.0015, 0.01}; }

TEST(ForceBiasTest, IsLearnedInFreeSpace) {
  const ForceBias dut = MakeBias();
  ForceBiasState state = dut.MakeState();
  EXPECT_NEAR(ForceBias::CalcStd(state), 0.5, 1e-12);
  RandomStream random(1);
  for (int i = 0; i < 100; ++i) {
    dut.Drift(&state);
    dut.LearnFree(kBias + DrawVector(0.2, &random), &state);
  }
  EXPECT_LT((state.mean - kBias).norm(), 0.15);
  EXPECT_LT(ForceBias::CalcStd(state), 0.1);
}

// A force that grows as a soft surface's does is no bias.
TEST(ForceBiasTest, DoesNotFollowWhatGrowsFast) {
  const ForceBias dut = MakeBias();
  ForceBiasState state = dut.MakeState();
  for (int i = 0; i < 300; ++i) {
    dut.Drift(&state);
    dut.LearnFree(Vector3d::Zero(), &state);
  }
  for (int i = 0; i < 50; ++i) {
    dut.Drift(&state);
    dut.LearnFree(Vector3d(0, 0, -0.02 * i), &state);
  }
  EXPECT_GT(state.mean.z(), -0.35);  // Of -1 N.
}

TEST(ForceBiasTest, DriftsNoFartherThanWhatNobodyKnows) {
  const ForceBias dut = MakeBias();
  ForceBiasState state = dut.MakeState();
  for (int i = 0; i < 200; ++i) dut.LearnFree(kBias, &state);
  const double learned = ForceBias::CalcStd(state);
  ForceBiasState without = state;
  without.mean.setZero();
  for (int i = 0; i < 1000; ++i) dut.Drift(&without);  // 10 s
  EXPECT_NEAR(ForceBias::CalcStd(without),
              std::hypot(learned, 0.02 * std::sqrt(10.0)), 1e-3);
  // One that there is may be a weight, which turns with the tool.
  for (int i = 0; i < 100; ++i) dut.Drift(&state);  // 1 s
  EXPECT_NEAR(ForceBias::CalcStd(state),
              std::hypot(learned, 0.02, 0.25 * state.mean.norm()), 1e-3);
  for (int i = 0; i < 1000000; ++i) dut.Drift(&state);
  EXPECT_NEAR(ForceBias::CalcStd(state), 0.5, 1e-9);
}

// Along a line a bias across it may as well be a tilt of the normal; a circle
// tells them apart.
TEST(ForceBiasTest, IsLearnedWhereTheVelocityShowsTheNormal) {
  const ForceBias dut = MakeBias();
  for (const bool circle : {false, true}) {
    ForceBiasState state = dut.MakeState();
    const Vector3d bias(0.2, 0.3, 0);
    for (int i = 0; i < 600; ++i) {
      const double angle = circle ? 0.02 * i : 0;
      const Vector3d velocity =
          0.05 * Vector3d(std::cos(angle), std::sin(angle), 0);
      dut.Drift(&state);
      dut.LearnSliding(SlidingForce(6, 0.3, velocity) + bias,
                       {kDown, velocity, 6}, &state);
    }
    if (circle) {
      EXPECT_LT((state.mean - bias).norm(), 0.1);
    } else {
      EXPECT_GT(std::sqrt(state.covariance(1, 1)), 0.25);
    }
  }
}

}  // namespace
}  // namespace dual_proxy
