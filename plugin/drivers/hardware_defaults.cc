// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/hardware_defaults.h"

#include <algorithm>

namespace dual_proxy {

RobotSideParams<SerialArm<7>> MakeHardwareDefaults(
    RobotSideParams<SerialArm<7>> side) {
  constexpr double kMaxGain = 0.5;
  constexpr int kDelay = 3;  // Periods.
  OperationalSpaceControllerParams<7>& controller = side.controller;
  controller.force_gain = std::min(controller.force_gain, kMaxGain);
  controller.moment_gain = std::min(controller.moment_gain, kMaxGain);
  controller.force_passivity.actuation_delay = kDelay;
  controller.moment_passivity.actuation_delay = kDelay;
  controller.acceleration_feed_forward = false;
  controller.gravity_compensation = false;
  side.proxy.reclutch = true;
  return side;
}

}  // namespace dual_proxy
