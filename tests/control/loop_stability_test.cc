// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/loop_stability.h"

#include <gtest/gtest.h>
#include <stdexcept>

namespace dual_proxy {
namespace {

bool Settles(double period, double time_step,
             const ContactModel& contact = {}) {
  ForceLoopParams loop;
  loop.period = period;
  return ForceLoopSettles(loop, contact, time_step);
}

// Scene `plane` in Drake loses no contact with the former, and with the latter
// 71, 46 and 134 times.
TEST(ForceLoopSettlesTest, AgreesWithThePandaOnTheTable) {
  for (const double period : {0.25e-3, 1e-3, 2e-3, 3e-3, 4e-3}) {
    EXPECT_TRUE(Settles(period, 1e-3)) << period;
  }
  EXPECT_TRUE(Settles(3e-3, 3e-3));
  EXPECT_FALSE(Settles(8e-3, 1e-3));
  EXPECT_FALSE(Settles(1e-2, 1e-3));
  EXPECT_FALSE(Settles(1.0 / 240, 1.0 / 240));
}

TEST(ForceLoopSettlesTest, PlantMayBeSlowerThanControl) {
  for (const double time_step : {1e-4, 2e-3, 1.0 / 240, 6.6e-3, 1e-2}) {
    EXPECT_TRUE(Settles(1e-3, time_step)) << time_step;
  }
}

// 0, 285 and 299 lost contacts in Drake.
TEST(ForceLoopSettlesTest, StifferContactsNeedShorterPeriods) {
  EXPECT_TRUE(Settles(1e-3, 1e-3, {.stiffness = 1e5}));
  EXPECT_FALSE(Settles(2e-3, 1e-3, {.stiffness = 1e5}));
  EXPECT_FALSE(Settles(1e-3, 1e-3, {.stiffness = 3e5}));
}

TEST(ForceLoopSettlesTest, IsThatOfTheLoopsOwnGains) {
  ForceLoopParams loop;
  loop.period = 8e-3;
  loop.gain = 1;
  EXPECT_TRUE(ForceLoopSettles(loop, {}, 1e-3));
  loop.period = 2e-3;
  loop.gain = 2.5;
  loop.passivity.enabled = false;
  EXPECT_FALSE(ForceLoopSettles(loop, {}, 1e-3));
}

TEST(ForceLoopSettlesTest, InvalidLoopsAreRefused) {
  EXPECT_THROW(Settles(0, 1e-3), std::invalid_argument);
}

TEST(ForceLoopKeepsItsSpeedLimitTest, AtTheUsualPeriods) {
  const auto keeps = [](double period) {
    ForceLoopParams loop;
    loop.period = period;
    return ForceLoopKeepsItsSpeedLimit(loop, 4.4, 1e-3);
  };
  EXPECT_TRUE(keeps(1e-3));
  EXPECT_TRUE(keeps(2e-3));
  EXPECT_FALSE(keeps(1e-2));
}

TEST(MotionLoopSettlesTest, DampingTimesPeriodIsBounded) {
  // With a step of delay v[k + 1] = v[k] - a v[k - 1] is stable for a < 1.
  for (const double period : {1e-3, 2e-3, 5e-3}) {
    EXPECT_TRUE(MotionLoopSettles(0, 0.95 / period, period, period));
    EXPECT_FALSE(MotionLoopSettles(0, 1.05 / period, period, period));
  }
}

TEST(MotionLoopSettlesTest, SlowlyIsGoodEnough) {
  EXPECT_TRUE(MotionLoopSettles(1, 40, 1e-3, 1e-3));
  EXPECT_TRUE(MotionLoopSettles(0, 0, 1e-3, 1e-3));
}

}  // namespace
}  // namespace dual_proxy
