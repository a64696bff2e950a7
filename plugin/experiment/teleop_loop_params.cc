// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/teleop_loop_params.h"

#include "dual_proxy/proxy/workspace_map.h"

namespace dual_proxy {

namespace {

// Of the robot that is asked for.
void TakeController(const Scenario& scenario,
                    OperationalSpaceControllerParams<7>* controller) {
  *controller = scenario.controller;
}

void TakeController(const Scenario& scenario,
                    PointControllerParams* controller) {
  *controller = scenario.point_controller;
}

}  // namespace

template <typename Robot>
RobotSideParams<Robot> MakeRobotSideParams(const Scenario& scenario) {
  typename Robot::Controller::Params controller;
  TakeController(scenario, &controller);
  GripperParams gripper = scenario.gripper;
  if (!scenario.operator_params.gripper.empty()) gripper.enabled = true;
  return {.scheme = scenario.scheme,
          .schemes = scenario.schemes,
          .proxy = scenario.robot_proxy,
          .controller = controller,
          .sender = scenario.link.sender,
          .perception = {.filter = scenario.filter,
                         .angular_filter = scenario.angular_filter},
          .planner = scenario.planner,
          .gripper = gripper};
}

HapticSideParams MakeHapticSideParams(const Scenario& scenario) {
  OperatorAidsParams aids = scenario.operator_aids;
  const OperatorParams& person = scenario.operator_params;
  if (!person.clutch.empty() || !person.home.empty() ||
      !person.force_scale.empty()) {
    aids.buttons = true;
  }
  return {.scheme = scenario.scheme,
          .schemes = scenario.schemes,
          .proxy = scenario.haptic_proxy,
          .controller = scenario.haptic_controller,
          .sender = scenario.link.sender,
          .aids = aids};
}

OperatorPathParams CalcHandlePath(const Scenario& scenario) {
  const WorkspaceMap map(scenario.map);
  OperatorPathParams path = scenario.CalcOperatorPath();
  for (auto&& point : path.points.colwise()) {
    point = map.HapticProxy(point, scenario.map.R_cw).p;
  }
  path.rotations = scenario.map.R_DB * path.rotations;
  path.clutch = scenario.operator_params.clutch;
  path.home = scenario.operator_params.home;
  path.force_scale = scenario.operator_params.force_scale;
  path.gripper = scenario.operator_params.gripper;
  return path;
}

template <typename Robot>
TeleopLoopParams<Robot> MakeTeleopLoopParams(
    const Scenario& scenario, const typename Robot::Model::Params& model) {
  return {.robot = MakeRobotSideParams<Robot>(scenario),
          .haptic = MakeHapticSideParams(scenario),
          .channel = scenario.link.channel,
          .model = model,
          .sensor = scenario.sensor,
          .p_SE = Robot::kRotates ? kSensorToToolPoint
                                  : Eigen::Vector3d(Eigen::Vector3d::Zero()),
          .device = scenario.device,
          .path = CalcHandlePath(scenario),
          .faults = scenario.faults,
          .clock = scenario.link.clock,
          .seeds = {.filter = scenario.CalcSeed(Stream::kFilter),
                    .angular_filter = scenario.CalcSeed(Stream::kAngularFilter),
                    .sensor = scenario.CalcSeed(Stream::kSensor),
                    .to_robot = scenario.CalcSeed(Stream::kToRobot),
                    .to_device = scenario.CalcSeed(Stream::kToDevice)}};
}

template RobotSideParams<SerialArm<7>> MakeRobotSideParams(const Scenario&);
template RobotSideParams<PointMass> MakeRobotSideParams(const Scenario&);
template TeleopLoopParams<SerialArm<7>> MakeTeleopLoopParams(
    const Scenario&, const ArmModelParams<7>&);
template TeleopLoopParams<PointMass> MakeTeleopLoopParams(
    const Scenario&, const PointModelParams&);

}  // namespace dual_proxy
