// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/robot_cycle.h"

#include <utility>

#include "dual_proxy/common/validate.h"

namespace dual_proxy {

void RobotCycleParams::Validate() const {
  const char* who = "RobotCycleParams";
  side.Validate();
  model.Validate();
  sensor.Validate();
  ThrowUnlessIn(who, "p_SE", p_SE, Finite());
  if (sensor.period != side.controller.period) {
    ThrowInvalidField(who, "sensor.period", "side.controller.period",
                      sensor.period);
  }
}

RobotCycle::RobotCycle(const RobotCycleParams& params)
    : params_((params.Validate(), params)),
      side_(params_.side),
      model_(params_.model),
      adapter_(params_.sensor) {}

RobotCycleState RobotCycle::MakeState(std::uint64_t seed,
                                      std::uint64_t angular_seed) const {
  RobotCycleState state;
  state.side = side_.MakeState(seed, angular_seed);
  state.sensor = adapter_.MakeState();
  return state;
}

void RobotCycle::Restart(RobotCycleState* state, std::uint64_t seed,
                         std::uint64_t angular_seed) const {
  state->side = side_.MakeState(seed, angular_seed);
  state->first_sequence = state->newest_message.sequence + 1;
  state->stale_sequence = state->seen_sequence;
}

void RobotCycle::Update(double time, const RobotCycleInput& input,
                        RobotCycleState* state) const noexcept {
  RobotSideInput<SerialArm<7>> side;
  state->seen_sequence = input.message.sequence;
  if (input.message.sequence != state->stale_sequence) {
    side.message = input.message;
  }
  side.q = input.q;
  side.v = input.v;
  side.hold = input.hold;
  side.received_command = input.received_torque;
  model_.Calc(side.q, side.v, &side.X_BE, &side.model);
  state->X_BE = side.X_BE;

  const Reading<Vector6>& reading = input.sensor;
  if (reading.valid && reading.time > state->sensor_time) {
    state->sensor_time = reading.time;
    adapter_.Update({.measured = reading.value,
                     .X_BE = side.X_BE,
                     .v_BE = CalcTwist(side.model, side.v),
                     .p_SE = params_.p_SE,
                     .tare = input.tare},
                    &state->sensor);
  }
  side.sensed_wrench = state->sensor.wrench;
  side.sensor_ready = state->sensor.ready && !input.distrust_sensor;
  side.sensor_age = time - state->sensor_time;
  side_.Update(time, side, &state->side);

  const Message& message = state->side.half.output().message;
  if (message.sequence >= 0) {
    state->newest_message = message;
    state->newest_message.sequence += state->first_sequence;
  }
}

}  // namespace dual_proxy
