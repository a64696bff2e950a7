// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/schemes/position_force/scheme.h"

namespace dual_proxy {

PositionForceRobotHalf::PositionForceRobotHalf(const RobotHalfParams& shared,
                                               const PositionForceParams&)
    : proxy_(shared.proxy), sender_(shared.sender) {}

PositionForceRobotHalfState PositionForceRobotHalf::MakeState() const {
  return {.proxy = proxy_.MakeState(), .sender = sender_.MakeState()};
}

void PositionForceRobotHalf::Update(double time, const RobotHalfInput& input,
                                    State* state) const noexcept {
  proxy_.Update(time,
                {.message = FromMessage<PoseMessage>(input.message),
                 .X_BE = input.X_BE,
                 .sensor_ready = input.sensor_ready,
                 .hold = input.hold},
                &state->proxy);
  const RobotSideProxyOutput& proxy = state->proxy.output;
  RobotHalfOutput& output = state->output;
  output.setpoint = {.motion_error = proxy.motion_error,
                     .rotation_error = proxy.rotation_error,
                     .velocity = proxy.proxy_velocity,
                     .acceleration = proxy.proxy_acceleration};
  output.proxy_pose = proxy.proxy_pose;
  output.message = ToMessage(
      sender_.Update(time, input.sensed_wrench.head<3>(), &state->sender));
  output.link = state->proxy.link;
  output.bad_inputs = state->proxy.bad_inputs;
  output.limiter_bad_inputs = state->proxy.limiter.bad_inputs;
  output.sender_bad_inputs = state->sender.bad_inputs;
}

}  // namespace dual_proxy
