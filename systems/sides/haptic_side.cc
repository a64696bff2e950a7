// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/sides/haptic_side.h"

#include <cmath>
#include <utility>

#include "dual_proxy/common/possible.h"
#include "dual_proxy/common/rotation.h"
#include "dual_proxy/common/validate.h"

namespace dual_proxy {

namespace {

HapticHalf MakeHalf(const HapticSideParams& params) {
  return Schemes::MakeHapticHalf(
      static_cast<int>(params.scheme),
      {.proxy = params.proxy, .sender = params.sender}, params.schemes);
}

}  // namespace

void HapticSideParams::Validate() const {
  const char* who = "HapticSideParams";
  ValidateFields(who, *this);
  if (controller.period != proxy.period) {
    ThrowInvalidField(who, "controller.period", "the proxy's period",
                      controller.period);
  }
  if (sender.period != proxy.period) {
    ThrowInvalidField(who, "sender.period", "the proxy's period",
                      sender.period);
  }
  if (aids.period != proxy.period) {
    ThrowInvalidField(who, "aids.period", "the proxy's period", aids.period);
  }
}

HapticSide::HapticSide(HapticSideParams params, bool rotations)
    : params_((params.Validate(), std::move(params))),
      aids_(params_.aids),
      half_(MakeHalf(params_)),
      controller_(params_.controller),
      rotations_(rotations) {
  layout_ =
      MakeLayout([this](SignalSink* sink) { VisitSignals(MakeState(), sink); });
}

HapticSideState HapticSide::MakeState() const {
  HapticSideState state;
  state.aids = aids_.MakeState();
  state.half = half_.MakeState();
  state.controller = controller_.MakeState();
  return state;
}

void HapticSide::Update(double time, const HapticSideInput& input,
                        HapticSideState* state) const noexcept {
  HapticSideOutput& output = state->output;
  output.handle = input.X_DH;
  output.device_velocity = input.device_velocity;
  output.handle_force = input.handle_force;

  const std::int64_t refused = output.bad_inputs;
  HapticSideInput possible = input;
  RefuseBeyond(kMaxDevicePosition, &possible.X_DH.p);
  RefuseBeyond(kMaxSpeed, &possible.device_velocity);
  RefuseBeyond(kMaxForce, &possible.handle_force);
  RefuseBeyond(kMaxTime, &time);
  Advance(time, possible, state);
  const bool valid = time >= state->time && IsValidPose(possible.X_DH);
  if (!valid) output.bad_inputs = refused + 1;
  StoreIfFinite(time, &state->time);
}

void HapticSide::Advance(double time, const HapticSideInput& input,
                         HapticSideState* state) const noexcept {
  HapticSideOutput& output = state->output;
  output.X_DH = input.X_DH;
  Vector6 velocity = input.device_velocity;
  if (aids_.on()) {
    aids_.FilterInput(input.buttons, &output.X_DH, &velocity, &state->aids);
  }

  if (std::isfinite(input.gripper_opening) && !state->aids.clutch.clutched) {
    state->gripper_opening = input.gripper_opening;
  }

  const std::int64_t refused_by_half = state->half.output().bad_inputs;
  const std::int64_t refused_by_controller = state->controller.bad_inputs;
  half_.Update(time,
               {.message = input.message,
                .X_DH = output.X_DH,
                .device_velocity = velocity,
                .device_wrench = output.device_wrench,
                .held = state->aids.clutch.clutched},
               &state->half);
  const HapticHalfOutput& half = state->half.output();
  output.setpoint = half.setpoint;
  Eigen::Vector3d dx = output.X_DH.p - half.proxy_pose.p;
  if (aids_.on()) {
    aids_.FilterSetpoint(&output.setpoint, &state->aids);
    dx *= state->aids.force_gain;
  }
  output.device_wrench =
      controller_.Update({.reference_force = output.setpoint.reference_force,
                          .reference_moment = output.setpoint.reference_moment,
                          .device_velocity = input.device_velocity,
                          .force_selection = output.setpoint.force_selection,
                          .contact_normals = output.setpoint.contact_normals,
                          .proxy_displacement = dx,
                          .fixture_force = state->aids.fixture_force,
                          .handle_force = input.handle_force},
                         &state->controller);
  if (state->half.output().bad_inputs != refused_by_half ||
      state->controller.bad_inputs != refused_by_controller) {
    ++output.bad_inputs;
  }
}

void HapticSide::VisitSignals(const HapticSideState& state,
                              SignalSink* sink) const {
  const HapticSideOutput& output = state.output;
  const HapticHalfOutput& half = state.half.output();
  const HapticSetpoint& setpoint = output.setpoint;
  sink->Vector({"device_position", "m", "D", "x_h, of the handle, from home"},
               output.X_DH.p);
  if (rotations_) {
    sink->Rotation({"device_orientation", "", "D", "R_h as a quaternion"},
                   output.X_DH.R);
  }
  sink->Vector({"device_velocity", "m/s", "D", "v_h, of the handle"},
               output.device_velocity.head<3>());
  if (rotations_) {
    sink->Vector(
        {"device_angular_velocity", "rad/s", "D", "w_h, of the handle"},
        output.device_velocity.tail<3>());
  }
  sink->Vector({"haptic_proxy_position", "m", "D", "x_ph"}, half.proxy_pose.p);
  if (rotations_) {
    sink->Rotation(
        {"haptic_proxy_orientation", "", "D", "R_ph as a quaternion"},
        half.proxy_pose.R);
  }
  sink->Vector({"haptic_reference_force", "N", "D", "F_h, on the hand"},
               setpoint.reference_force);
  if (rotations_) {
    sink->Vector({"haptic_reference_moment", "N m", "D", "M_h, on the hand"},
                 setpoint.reference_moment);
  }
  sink->Vector({"device_force", "N", "D", "sent to the device, on the hand"},
               output.device_wrench.head<3>());
  if (rotations_) {
    sink->Vector(
        {"device_moment", "N m", "D", "sent to the device, on the hand"},
        output.device_wrench.tail<3>());
  }
  if (params_.controller.method == HapticControlMethod::kForceFeedback) {
    sink->Vector(
        {"handle_force", "N", "D", "sensed, of the handle on the hand"},
        output.handle_force);
  }
  sink->Matrix({"haptic_force_selection", "", "D", "Omega_fh, row by row"},
               setpoint.force_selection);
  sink->Integer({"haptic_link_status", "", "",
                 "at the device: 0 waiting, 1 connected, 2 lost"},
                static_cast<double>(half.link.status));
  sink->Scalar(
      {"haptic_link_age", "s", "", "of the message in use at the device"},
      half.link.age);
  sink->Count("haptic_link_dropped", "messages refused",
              half.link.dropped + half.link.bad_inputs);
  sink->Count("haptic_link_bad_messages",
              "of them, those that were not finite or not valid",
              half.link.bad_inputs);
  sink->Count("haptic_link_gaps", "sequence numbers skipped", half.link.gaps);
  sink->Count("haptic_link_spikes", "messages that came unusually late",
              half.link.spikes);
  sink->Count("haptic_link_losses", "times that the link was lost",
              half.link.losses);
  sink->Count("haptic_bad_inputs", "cycles that the side refused",
              output.bad_inputs);
  sink->Count("haptic_sender_bad_inputs", "samples that the sender refused",
              half.sender_bad_inputs);
  aids_.VisitSignals(state.aids, output.handle, sink);
}

}  // namespace dual_proxy
