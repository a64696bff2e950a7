// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/sides/haptic_side.h"

#include "dual_proxy/common/validate.h"

namespace dual_proxy {

namespace {

void Visit(const HapticSideOutput& output, SignalSink* sink) {
  const HapticSideProxyOutput& proxy = output.proxy;
  sink->Vector("device_position", output.X_DH.p);
  sink->Rotation("device_orientation", output.X_DH.R);
  sink->Vector("device_velocity", output.device_velocity.head<3>());
  sink->Vector("device_angular_velocity", output.device_velocity.tail<3>());
  sink->Vector("haptic_proxy_position", proxy.proxy_pose.p);
  sink->Rotation("haptic_proxy_orientation", proxy.proxy_pose.R);
  sink->Vector("haptic_reference_force", proxy.reference_force);
  sink->Vector("haptic_reference_moment", proxy.reference_moment);
  sink->Vector("device_force", output.device_wrench.head<3>());
  sink->Vector("device_moment", output.device_wrench.tail<3>());
  sink->Matrix("haptic_force_selection", proxy.force_selection);
  sink->Scalar("haptic_link_status", static_cast<double>(proxy.link_status));
  sink->Scalar("haptic_link_age", proxy.link_age);
  sink->Count("haptic_link_dropped", output.link_dropped);
  sink->Count("haptic_bad_inputs", output.bad_inputs);
  sink->Count("haptic_link_bad_messages", output.link.bad_inputs);
  sink->Count("haptic_link_gaps", output.link.gaps);
  sink->Count("haptic_link_spikes", output.link.spikes);
  sink->Count("haptic_link_losses", output.link.losses);
  sink->Count("haptic_sender_bad_inputs", output.sender_bad_inputs);
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
}

HapticSide::HapticSide(HapticSideParams params)
    : params_((params.Validate(), params)),
      proxy_(params.proxy),
      controller_(params.controller),
      sender_(params.sender) {}

HapticSideState HapticSide::MakeState() const {
  HapticSideState state;
  state.proxy = proxy_.MakeState();
  state.controller = controller_.MakeState();
  state.sender = sender_.MakeState();
  return state;
}

void HapticSide::Update(double time, const HapticSideInput& input,
                        HapticSideState* state) const noexcept {
  HapticSideOutput& output = state->output;
  output.X_DH = input.X_DH;
  output.device_velocity = input.device_velocity;

  const std::int64_t refused_by_proxy = state->proxy.bad_inputs;
  const std::int64_t refused_by_controller = state->controller.bad_inputs;
  proxy_.Update(time, {.message = input.message, .X_DH = input.X_DH},
                &state->proxy);
  output.proxy = state->proxy.output;
  output.link = state->proxy.link;
  output.link_dropped = output.link.dropped + output.link.bad_inputs;

  output.device_wrench = controller_.Update(
      output.proxy.reference_force, output.proxy.reference_moment,
      input.device_velocity, output.proxy.force_selection, &state->controller);
  if (state->proxy.bad_inputs != refused_by_proxy ||
      state->controller.bad_inputs != refused_by_controller) {
    ++output.bad_inputs;
  }

  output.message = sender_.Update(time, input.X_DH, Eigen::Matrix3d::Zero(),
                                  Eigen::Matrix3d::Zero(), &state->sender);
  output.sender_bad_inputs = state->sender.bad_inputs;
}

const std::vector<SignalSlice>& HapticSide::OutputLayout() {
  static const std::vector<SignalSlice> layout = MakeLayout(&Visit);
  return layout;
}

int HapticSide::OutputSize() {
  return OutputLayout().back().start + OutputLayout().back().size;
}

void HapticSide::WriteVector(const HapticSideOutput& output,
                             Eigen::Ref<Eigen::VectorXd> vector) {
  SignalSink sink(&vector);
  Visit(output, &sink);
}

}  // namespace dual_proxy
