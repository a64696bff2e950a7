// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/control/robot.h"
#include "dual_proxy/experiment/scenario.h"
#include "dual_proxy/loop/teleop_loop.h"

namespace dual_proxy {

/** What each part of a loop takes from a scenario: the one place where they are
made, for every host and every wiring.
@tparam Robot  SerialArm<7> or PointMass.
@param scenario  distributed and valid.
@param model  the controller's, of an arm with its tool.
@throws ScenarioError if the operator's recording cannot be read. */
template <typename Robot>
RobotSideParams<Robot> MakeRobotSideParams(const Scenario& scenario);
HapticSideParams MakeHapticSideParams(const Scenario& scenario);
template <typename Robot>
TeleopLoopParams<Robot> MakeTeleopLoopParams(
    const Scenario& scenario, const typename Robot::Model::Params& model);

/** Where the operator means the handle to go: the scenario's path, in D. */
OperatorPathParams CalcHandlePath(const Scenario& scenario);

}  // namespace dual_proxy
