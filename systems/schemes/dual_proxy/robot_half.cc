// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/directions_apart.h"
#include "dual_proxy/schemes/dual_proxy/scheme.h"

namespace dual_proxy {

namespace {

// What of the force space is the hand's to feel: apart by more than 45 degrees
// from what a planner owns.
Eigen::Matrix3d CalcFelt(const RobotHalfInput& input) noexcept {
  if (input.planner_selection.isZero(0)) return input.force_selection;
  return DirectionsApart(input.force_selection, input.planner_selection, 0.5);
}

}  // namespace

DualProxyRobotHalf::DualProxyRobotHalf(const RobotHalfParams& shared,
                                       const NoParams&)
    : proxy_(shared.proxy), sender_(shared.sender) {}

DualProxyRobotHalfState DualProxyRobotHalf::MakeState() const {
  return {.proxy = proxy_.MakeState(), .sender = sender_.MakeState()};
}

void DualProxyRobotHalf::Update(double time, const RobotHalfInput& input,
                                State* state) const noexcept {
  proxy_.Update(time,
                {.message = FromMessage<PoseMessage>(input.message),
                 .X_BE = input.X_BE,
                 .force_selection = input.force_selection,
                 .moment_selection = input.moment_selection,
                 .has_sensed = true,
                 .sensed_force = input.sensed_wrench.head<3>(),
                 .sensed_moment = input.sensed_wrench.tail<3>(),
                 .sensor_ready = input.sensor_ready,
                 .hold = input.hold},
                &state->proxy);
  const RobotSideProxyOutput& proxy = state->proxy.output;
  RobotHalfOutput& output = state->output;
  output.setpoint = {.motion_error = proxy.motion_error,
                     .rotation_error = proxy.rotation_error,
                     .velocity = proxy.proxy_velocity,
                     .acceleration = proxy.proxy_acceleration,
                     .reference_force = proxy.reference_force,
                     .reference_moment = proxy.reference_moment,
                     .force_selection = proxy.force_selection,
                     .moment_selection = proxy.moment_selection};
  output.proxy_pose = proxy.proxy_pose;
  output.message = ToMessage(
      sender_.Update(time,
                     {.pose = proxy_.FromRobot(input.X_BE, state->proxy),
                      .force_selection = CalcFelt(input),
                      .moment_selection = input.moment_selection,
                      .contact_normals = input.contact_normals},
                     &state->sender));
  output.link = state->proxy.link;
  output.bad_inputs = state->proxy.bad_inputs;
  output.limiter_bad_inputs = state->proxy.limiter.bad_inputs;
  output.sender_bad_inputs = state->sender.bad_inputs;
}

}  // namespace dual_proxy
