// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/control/robot.h"
#include "dual_proxy/sides/robot_side.h"

namespace dual_proxy {

/** `side`, a simulation's or the defaults, with what a Panda or FR3 at the end
of a cable needs otherwise:

- force_gain and moment_gain at most 0.5, as a torque acts two to three periods
  after it was computed: with 2.5 the tool bounces on 100 kN/m (tests/drivers/
  hardware_stability_test.cc prints the grid);
- actuation_delay 3, likewise;
- no acceleration fed forward, which drives torques into the limit of their
  rate;
- no gravity compensation, which the arm adds itself;
- a robot that never travels to where the hand is (proxy.reclutch): Validate()
  refuses a scheme whose robot has to. */
RobotSideParams<SerialArm<7>> MakeHardwareDefaults(
    RobotSideParams<SerialArm<7>> side = {});

}  // namespace dual_proxy
