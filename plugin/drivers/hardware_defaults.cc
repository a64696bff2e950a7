// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/hardware_defaults.h"

namespace dual_proxy {

RobotSideParams<SerialArm<7>> MakeHardwareDefaults(
    RobotSideParams<SerialArm<7>> side) {
  constexpr int kDelay = 3;  // Periods.
  OperationalSpaceControllerParams<7>& controller = side.controller;
  controller.force_gain = 0.5;
  controller.force_passivity.actuation_delay = kDelay;
  controller.moment_passivity.actuation_delay = kDelay;
  controller.acceleration_feed_forward = false;
  controller.gravity_compensation = false;
  side.proxy.reclutch = Reclutches(side.scheme);
  return side;
}

}  // namespace dual_proxy
