// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/loop/teleop_loop.h"

#include <utility>

#include "dual_proxy/common/validate.h"
#include "dual_proxy/loop/loop_signals.h"

namespace dual_proxy {

void ClockParams::Validate() const { ValidateFields("ClockParams", *this); }

template <typename Robot>
void TeleopLoopParams<Robot>::Validate() const {
  const char* who = "TeleopLoopParams";
  robot.Validate();
  haptic.Validate();
  channel.Validate();
  model.Validate();
  sensor.Validate();
  device.Validate();
  path.Validate();
  for (const InputFault& fault : faults) fault.Validate();
  clock.Validate();
  ThrowUnlessIn(who, "p_SE", p_SE, Finite());
  const double period = robot.controller.period;
  const auto check = [who, period](const char* name, double value) {
    if (value != period) {
      ThrowInvalidField(who, name, "robot.controller.period", value);
    }
  };
  check("haptic.controller.period", haptic.controller.period);
  check("sensor.period", sensor.period);
  check("device.period", device.period);
  if (haptic.scheme != robot.scheme) {
    ThrowInvalidField(who, "haptic.scheme", "the robot's scheme",
                      static_cast<int>(haptic.scheme));
  }
}

template <typename Robot>
TeleopLoop<Robot>::TeleopLoop(Params params)
    : params_((params.Validate(), std::move(params))),
      robot_(params_.robot),
      haptic_(params_.haptic, Robot::kRotates),
      channel_(params_.channel),
      model_(params_.model),
      sensor_(params_.sensor),
      device_(params_.device),
      path_(params_.path),
      faults_(params_.faults) {
  layout_ =
      MakeLayout([this](SignalSink* sink) { VisitSignals(MakeState(), sink); });
}

template <typename Robot>
auto TeleopLoop<Robot>::CalcHoldingTorque(const Coordinates& q) const
    -> Coordinates
  requires Robot::kRotates
{
  Pose X_BE;
  typename Robot::Model::Terms terms;
  model_.Calc(q, Coordinates::Zero(), &X_BE, &terms);
  return -terms.gravity;
}

template <typename Robot>
TeleopLoopState<Robot> TeleopLoop<Robot>::MakeState() const {
  const TeleopLoopSeeds& seeds = params_.seeds;
  return {.robot = robot_.MakeState(seeds.filter, seeds.angular_filter),
          .haptic = haptic_.MakeState(),
          .sensor = sensor_.MakeState(seeds.sensor),
          .device = device_.MakeState(),
          .to_robot = channel_.MakeState(seeds.to_robot),
          .to_device = channel_.MakeState(seeds.to_device)};
}

template <typename Robot>
void TeleopLoop<Robot>::Update(double time, const Input& input,
                               State* state) const noexcept {
  UpdateRobotSide(time, input, state);
  UpdateHapticSide(time, state);
  UpdateLink(time, state);
  state->stepped = true;
}

template <typename Robot>
void TeleopLoop<Robot>::UpdateRobotSide(double time, const Input& input,
                                        State* state) const noexcept {
  const ForceTorqueAdapterState& sensor = state->sensor.adapter;
  RobotSideInput<Robot> side;
  side.message = channel_.Receive(time, state->to_robot);
  side.q = input.q;
  side.v = input.v;
  side.sensed_wrench = sensor.wrench;
  side.sensor_ready = sensor.ready;
  if (faults_.on()) {
    InputFaultsState* const faults = &state->faults;
    faults_.Apply(time, FaultyInput::kMessageToRobot, &side.message, faults);
    faults_.Apply(time, FaultyInput::kRobotPosition, side.q, faults);
    faults_.Apply(time, FaultyInput::kRobotVelocity, side.v, faults);
    side.selections = faults_.Select(time, period());
  }
  model_.Calc(side.q, side.v, &side.X_BE, &side.model);
  robot_.Update(time, side, &state->robot);
  if (!input.has_reaction) return;
  Vector6 reaction = input.reaction;
  if (faults_.on()) {
    faults_.Apply(time, FaultyInput::kSensor, reaction, &state->faults);
  }
  sensor_.Update({.measured = reaction,
                  .X_BE = side.X_BE,
                  .v_BE = state->robot.output.v_BE,
                  .p_SE = params_.p_SE},
                 &state->sensor);
}

template <typename Robot>
void TeleopLoop<Robot>::UpdateHapticSide(double time,
                                         State* state) const noexcept {
  const Vector6 told = state->haptic.output.device_wrench;
  const OperatorPathSample intended = path_.Calc(time);
  HapticSideInput side{.message = channel_.Receive(time, state->to_device),
                       .X_DH = state->device.read_pose,
                       .device_velocity = state->device.read_velocity,
                       .handle_force = state->device.handle_force,
                       .buttons = {.clutch = intended.clutch,
                                   .home = intended.home,
                                   .force_scale = intended.force_scale},
                       .gripper_opening = intended.gripper_opening};
  if (faults_.on()) {
    InputFaultsState* const faults = &state->faults;
    faults_.Apply(time, FaultyInput::kMessageToDevice, &side.message, faults);
    faults_.Apply(time, FaultyInput::kDevicePose, &side.X_DH, faults);
    faults_.Apply(time, FaultyInput::kDeviceVelocity, side.device_velocity,
                  faults);
  }
  haptic_.Update(params_.clock.Read(time), side, &state->haptic);
  device_.Update({.p = intended.position, .R = intended.rotation},
                 intended.velocity, told, &state->device, intended.home);
}

template <typename Robot>
void TeleopLoop<Robot>::UpdateLink(double time, State* state) const noexcept {
  // The looks until the next period begins.
  const double interval = 1 / params_.robot.sender.rate;
  for (;;) {
    const double look = CommunicationChannel::kLook * period() +
                        static_cast<double>(state->next_look) * interval;
    if (!(look < time + period())) return;
    ++state->next_look;
    channel_.Send(look, state->haptic.message(), &state->to_robot);
    channel_.Send(look, state->robot.half.output().message, &state->to_device);
  }
}

template <typename Robot>
void TeleopLoop<Robot>::VisitSignals(const State& state,
                                     SignalSink* sink) const {
  haptic_.VisitSignals(state.haptic, sink);
  VisitDevice(state.device, sink);
  robot_.VisitSignals(state.robot, sink);
  VisitSensor(state.sensor, sink);
  VisitChannel(Direction::kToRobot, state.to_robot, sink);
  VisitChannel(Direction::kToDevice, state.to_device, sink);
}

template <typename Robot>
void TeleopLoop<Robot>::WriteSignals(const State& state,
                                     Eigen::Ref<Eigen::VectorXd> vector) const {
  if (!state.stepped) {
    vector.setZero();
    return;
  }
  SignalSink sink(&vector);
  VisitSignals(state, &sink);
}

template struct TeleopLoopParams<SerialArm<6>>;
template struct TeleopLoopParams<SerialArm<7>>;
template struct TeleopLoopParams<PointMass>;
template class TeleopLoop<SerialArm<6>>;
template class TeleopLoop<SerialArm<7>>;
template class TeleopLoop<PointMass>;

}  // namespace dual_proxy
