// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/teleop_loop_params.h"

#include "dual_proxy/proxy/workspace_map.h"

namespace dual_proxy {

RobotSideParams MakeRobotSideParams(const Scenario& scenario) {
  return {.scheme = scenario.scheme,
          .schemes = scenario.schemes,
          .proxy = scenario.robot_proxy,
          .controller = scenario.controller,
          .sender = scenario.link.sender,
          .perception = {.filter = scenario.filter,
                         .angular_filter = scenario.angular_filter}};
}

HapticSideParams MakeHapticSideParams(const Scenario& scenario) {
  return {.scheme = scenario.scheme,
          .schemes = scenario.schemes,
          .proxy = scenario.haptic_proxy,
          .controller = scenario.haptic_controller,
          .sender = scenario.link.sender};
}

OperatorPathParams CalcHandlePath(const Scenario& scenario) {
  const WorkspaceMap map(scenario.map);
  OperatorPathParams path = scenario.CalcOperatorPath();
  for (auto&& point : path.points.colwise()) {
    point = map.HapticProxy(point, scenario.map.R_cw).p;
  }
  path.rotations = scenario.map.R_DB * path.rotations;
  return path;
}

TeleopLoopParams MakeTeleopLoopParams(const Scenario& scenario,
                                      const ArmModelParams& arm) {
  return {.robot = MakeRobotSideParams(scenario),
          .haptic = MakeHapticSideParams(scenario),
          .channel = scenario.link.channel,
          .arm = arm,
          .sensor = scenario.sensor,
          .p_SE = kSensorToToolPoint,
          .device = scenario.device,
          .path = CalcHandlePath(scenario),
          .seeds = {.filter = scenario.CalcSeed(Stream::kFilter),
                    .angular_filter = scenario.CalcSeed(Stream::kAngularFilter),
                    .sensor = scenario.CalcSeed(Stream::kSensor),
                    .to_robot = scenario.CalcSeed(Stream::kToRobot),
                    .to_device = scenario.CalcSeed(Stream::kToDevice)}};
}

}  // namespace dual_proxy
