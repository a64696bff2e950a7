// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/loop_stability.h"

#include <algorithm>
#include <stdexcept>

#include <gtest/gtest.h>

#include "dual_proxy/simulation/haptic_device.h"

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

HeldDeviceModel ModelOf(const SimulatedHapticDeviceParams& device) {
  return {.hand_mass = device.hand_mass,
          .hand_stiffness = device.hand_stiffness,
          .hand_damping = device.hand_damping,
          .device_mass = device.device_mass,
          .device_damping = device.device_damping,
          .velocity_cutoff = device.velocity_cutoff};
}

// Whether the simulated device, pushed out of its place, comes to rest.
bool ComesToRest(const HapticControllerParams& params,
                 const SimulatedHapticDeviceParams& device_params) {
  const HapticController controller(params);
  const SimulatedHapticDevice device(device_params);
  HapticControllerState state = controller.MakeState();
  SimulatedHapticDeviceState hand = device.MakeState({.p = {0, 0, 1e-3}});
  HapticControllerInput input;
  input.force_selection.setIdentity();
  Eigen::Matrix<double, 6, 1> wrench = Eigen::Matrix<double, 6, 1>::Zero();
  double swing = 0;
  for (int i = 0; i < 3000; ++i) {
    input.device_velocity = hand.read_velocity;
    input.handle_force = hand.handle_force;
    const auto next = controller.Update(input, &state);
    device.Update({}, Eigen::Vector3d::Zero(), wrench, &hand);
    wrench = next;
    if (i >= 2500) swing = std::max(swing, hand.handle_force.norm());
  }
  return swing < 0.1;
}

TEST(HapticForceLoopSettlesTest, AgreesWithTheSimulatedDevice) {
  HapticControllerParams params;
  params.method = HapticControlMethod::kForceFeedback;
  int unstable = 0;
  for (const double device_mass : {0.1, 0.25, 1.0, 4.0}) {
    for (const double hand_stiffness : {300.0, 600.0}) {
      SimulatedHapticDeviceParams device;
      device.device_mass = device_mass;
      device.hand_stiffness = hand_stiffness;
      device.hand_damping = hand_stiffness / 20;
      device.resolution = 0;
      for (const double gain : {0.0, 2.0, 4.0, 6.0, 8.0, 9.0, 16.0, 32.0}) {
        params.force_gain = gain;
        params.force_integral_gain = gain == 0 ? 0 : 30;
        const bool settles = HapticForceLoopSettles(params, ModelOf(device));
        EXPECT_EQ(settles, ComesToRest(params, device))
            << device_mass << " kg, gain " << gain;
        unstable += !settles;
      }
    }
  }
  EXPECT_GT(unstable, 15);
}

// The gain at which it begins to swing goes with (hand + device) / hand mass.
TEST(HapticForceLoopSettlesTest, LightDevicesNeedSmallGains) {
  HapticControllerParams params;
  params.force_integral_gain = 0;
  SimulatedHapticDeviceParams device;
  for (const double device_mass : {0.25, 1.0, 4.0}) {
    device.device_mass = device_mass;
    const double mass = device.hand_mass + device_mass;
    params.force_gain = 5.2 * mass / device.hand_mass;
    EXPECT_TRUE(HapticForceLoopSettles(params, ModelOf(device)));
    params.force_gain = 6 * mass / device.hand_mass;
    EXPECT_FALSE(HapticForceLoopSettles(params, ModelOf(device)));
  }
  params.period = 0;
  EXPECT_THROW(HapticForceLoopSettles(params, ModelOf(device)),
               std::invalid_argument);
}

}  // namespace
}  // namespace dual_proxy
