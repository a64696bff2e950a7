// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/control/arm_model.h"
#include "dual_proxy/experiment/scenario.h"
#include "dual_proxy/loop/teleop_loop.h"

namespace dual_proxy {

/** What each part of a loop takes from a scenario: the one place where they are
made, for every host and every wiring.
@param scenario  distributed and valid.
@param arm  the controller's model of the arm with its tool.
@throws ScenarioError if the operator's recording cannot be read. */
RobotSideParams MakeRobotSideParams(const Scenario& scenario);
HapticSideParams MakeHapticSideParams(const Scenario& scenario);
TeleopLoopParams MakeTeleopLoopParams(const Scenario& scenario,
                                      const ArmModelParams& arm);

/** Where the operator means the handle to go: the scenario's path, in D. */
OperatorPathParams CalcHandlePath(const Scenario& scenario);

}  // namespace dual_proxy
