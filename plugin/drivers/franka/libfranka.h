// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <franka/control_types.h>
#include <franka/duration.h>
#include <franka/exception.h>
#include <franka/gripper.h>
#include <franka/lowpass_filter.h>
#include <franka/robot.h>
#include <franka/robot_state.h>

#include "dual_proxy/drivers/franka/franka_gripper.h"
#include "dual_proxy/drivers/franka/franka_robot_side.h"

namespace dual_proxy {

/** libfranka, for FrankaRobotSide and FrankaGripper. Whoever includes this
links Franka::Franka, as find_package(Franka) gives it. */
struct Libfranka {
  using Robot = franka::Robot;
  using RobotState = franka::RobotState;
  using Gripper = franka::Gripper;
  using RobotMode = franka::RobotMode;
  using RealtimeConfig = franka::RealtimeConfig;
  using Torques = franka::Torques;
  using Duration = franka::Duration;
  using Exception = franka::Exception;
  using ControlException = franka::ControlException;
  using NetworkException = franka::NetworkException;
  using CommandException = franka::CommandException;
  using RealtimeException = franka::RealtimeException;
  using InvalidOperationException = franka::InvalidOperationException;

  static constexpr double kMaxCutoffFrequency = franka::kMaxCutoffFrequency;
};

}  // namespace dual_proxy
