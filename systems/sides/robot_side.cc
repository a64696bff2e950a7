// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/sides/robot_side.h"

#include "dual_proxy/common/validate.h"

namespace dual_proxy {

namespace {

void Visit(const RobotSideOutput& output, SignalSink* sink) {
  const RobotSideProxyOutput& proxy = output.proxy;
  const OperationalSpaceControllerOutput& controller = output.controller;
  const FilterMeans& means = output.filter_means;
  sink->Vector("robot_position", output.X_BE.p);
  sink->Vector("robot_velocity", output.v_BE.head<3>());
  sink->Vector("robot_angular_velocity", output.v_BE.tail<3>());
  sink->Rotation("robot_orientation", output.X_BE.R);
  sink->Vector("robot_proxy_position", proxy.proxy_pose.p);
  sink->Rotation("robot_proxy_orientation", proxy.proxy_pose.R);
  sink->Vector("robot_proxy_velocity", proxy.proxy_velocity);
  sink->Vector("motion_error", proxy.motion_error);
  sink->Vector("rotation_error", proxy.rotation_error);
  sink->Vector("reference_force", proxy.reference_force);
  sink->Vector("reference_moment", proxy.reference_moment);
  sink->Vector("sensed_force", output.sensed_wrench.head<3>());
  sink->Vector("sensed_moment", output.sensed_wrench.tail<3>());
  sink->Scalar("sensor_ready", output.sensor_ready);
  sink->Vector("motion_force", controller.motion_force);
  sink->Vector("motion_moment", controller.motion_moment);
  sink->Vector("force_space_force", controller.contact_force);
  sink->Vector("moment_space_moment", controller.contact_moment);
  sink->Matrix("force_selection", output.force_selection);
  sink->Vector("joint_position", output.q);
  sink->Vector("joint_velocity", output.v);
  sink->Vector("torque", controller.torque);
  sink->Scalar("observed_energy", controller.observed_energy);
  sink->Scalar("injected_damping", controller.injected_damping);
  sink->Scalar("observed_moment_energy", controller.observed_moment_energy);
  sink->Scalar("injected_moment_damping", controller.injected_moment_damping);
  sink->Scalar("robot_link_status", static_cast<double>(proxy.link_status));
  sink->Scalar("robot_link_age", proxy.link_age);
  sink->Scalar("robot_link_dropped", static_cast<double>(output.link_dropped));
  sink->Scalar("robot_bad_inputs", static_cast<double>(output.bad_inputs));
  sink->Vector("mean_sensed_force", means.sensed_force);
  sink->Vector("mean_velocity", means.velocity);
  sink->Vector("mean_motion_force", means.motion_force);
  sink->Vector("mean_contact_force", means.contact_force);
  const RobotSideCounters& counters = output.counters;
  sink->Count("robot_link_bad_messages", counters.link.bad_inputs);
  sink->Count("robot_link_gaps", counters.link.gaps);
  sink->Count("robot_link_spikes", counters.link.spikes);
  sink->Count("robot_link_losses", counters.link.losses);
  sink->Count("robot_limiter_bad_inputs", counters.limiter_bad_inputs);
  sink->Count("robot_singular", counters.singular);
  sink->Count("torque_limited", counters.torque_limited);
  sink->Count("torque_rate_limited", counters.torque_rate_limited);
  sink->Count("joint_limited", counters.joint_limited);
  sink->Count("robot_sender_bad_inputs", counters.sender_bad_inputs);
  sink->Count("robot_force_sender_bad_inputs",
              counters.force_sender_bad_inputs);
  sink->Count("filter_means_bad_inputs", counters.means_bad_inputs);
  sink->Count("angular_filter_means_bad_inputs",
              counters.angular_means_bad_inputs);
}

RobotSideProxyInput MakeProxyInput(const RobotSideInput& input) {
  return {.message = input.message,
          .X_BE = input.X_BE,
          .force_selection = input.force_selection,
          .moment_selection = input.moment_selection,
          .has_sensed = true,
          .sensed_force = input.sensed_wrench.head<3>(),
          .sensed_moment = input.sensed_wrench.tail<3>(),
          .sensor_ready = input.sensor_ready};
}

}  // namespace

void RobotSideParams::Validate() const {
  const char* who = "RobotSideParams";
  ValidateFields(who, *this);
  if (controller.period != proxy.period) {
    ThrowInvalidField(who, "controller.period", "the proxy's period",
                      controller.period);
  }
  if (sender.period != proxy.period) {
    ThrowInvalidField(who, "sender.period", "the proxy's period",
                      sender.period);
  }
  if (angular_filter_period != 0 && !(angular_filter_period >= proxy.period)) {
    ThrowInvalidField(who, "angular_filter_period",
                      "0 or at least the control period",
                      angular_filter_period);
  }
}

RobotSide::RobotSide(RobotSideParams params)
    : params_((params.Validate(), params)),
      proxy_(params.proxy),
      controller_(params.controller),
      filter_means_(params.filter_period),
      pose_sender_(params.sender),
      force_sender_(params.sender) {
  if (params.angular_filter_period > 0) {
    angular_filter_means_.emplace(params.angular_filter_period);
  }
}

RobotSideState RobotSide::MakeState() const {
  RobotSideState state;
  state.proxy = proxy_.MakeState();
  state.controller = controller_.MakeState();
  state.filter_means = filter_means_.MakeState();
  state.pose_sender = pose_sender_.MakeState();
  state.force_sender = force_sender_.MakeState();
  return state;
}

Vector6 RobotSide::CalcTwist(const Matrix67& J_BE, const Vector7& v) noexcept {
  return J_BE * v;
}

void RobotSide::Update(double time, const RobotSideInput& input,
                       RobotSideState* state) const noexcept {
  RobotSideOutput& output = state->output;
  output.X_BE = input.X_BE;
  output.v_BE = CalcTwist(input.model.J_BE, input.v);
  output.q = input.q;
  output.v = input.v;
  output.force_selection = input.force_selection;
  output.sensed_wrench = input.sensed_wrench;
  output.sensor_ready = input.sensor_ready;

  const std::int64_t refused_by_proxy = state->proxy.bad_inputs;
  const std::int64_t refused_by_controller = state->controller.bad_inputs;
  proxy_.Update(time, MakeProxyInput(input), &state->proxy);
  output.proxy = state->proxy.output;
  output.link_dropped =
      state->proxy.link.dropped + state->proxy.link.bad_inputs;

  output.controller =
      controller_.Update({.model = input.model,
                          .q = input.q,
                          .v = input.v,
                          .motion_error = output.proxy.motion_error,
                          .rotation_error = output.proxy.rotation_error,
                          .proxy_velocity = output.proxy.proxy_velocity,
                          .proxy_acceleration = output.proxy.proxy_acceleration,
                          .reference_force = output.proxy.reference_force,
                          .reference_moment = output.proxy.reference_moment,
                          .force_selection = input.force_selection,
                          .moment_selection = input.moment_selection,
                          .sensed_wrench = input.sensed_wrench,
                          .sensor_ready = input.sensor_ready},
                         &state->controller);
  const bool valid = state->controller.bad_inputs == refused_by_controller;
  if (!valid || state->proxy.bad_inputs != refused_by_proxy) {
    ++output.bad_inputs;
  }

  if (valid) {
    Eigen::Matrix<double, 12, 1> sample;
    sample << output.sensed_wrench.head<3>(), output.v_BE.head<3>(),
        output.controller.motion_force, output.controller.contact_force;
    filter_means_.Update(time, sample, &state->filter_means);
    const Eigen::Matrix<double, 12, 1>& mean = state->filter_means.mean;
    output.filter_means = {.sensed_force = mean.segment<3>(0),
                           .velocity = mean.segment<3>(3),
                           .motion_force = mean.segment<3>(6),
                           .contact_force = mean.segment<3>(9)};
  }
  if (valid && angular_filter_means_) {
    Eigen::Matrix<double, 12, 1> sample;
    sample << output.sensed_wrench.tail<3>(), output.v_BE.tail<3>(),
        output.controller.motion_moment, output.controller.contact_moment;
    angular_filter_means_->Update(time, sample, &state->angular_filter_means);
    const Eigen::Matrix<double, 12, 1>& mean = state->angular_filter_means.mean;
    output.angular_filter_means = {.sensed_moment = mean.segment<3>(0),
                                   .angular_velocity = mean.segment<3>(3),
                                   .motion_moment = mean.segment<3>(6),
                                   .contact_moment = mean.segment<3>(9)};
  }

  output.message =
      pose_sender_.Update(time, input.X_BE, input.force_selection,
                          input.moment_selection, &state->pose_sender);
  output.force_message = force_sender_.Update(
      time, input.sensed_wrench.head<3>(), &state->force_sender);
  output.counters = {
      .link = state->proxy.link,
      .limiter_bad_inputs = state->proxy.limiter.bad_inputs,
      .singular = state->controller.singular,
      .torque_limited = state->controller.torque_limited,
      .torque_rate_limited = state->controller.rate_limited,
      .joint_limited = state->controller.joint_limited,
      .sender_bad_inputs = state->pose_sender.bad_inputs,
      .force_sender_bad_inputs = state->force_sender.bad_inputs,
      .means_bad_inputs = state->filter_means.bad_inputs,
      .angular_means_bad_inputs = state->angular_filter_means.bad_inputs};
}

const std::vector<SignalSlice>& RobotSide::OutputLayout() {
  static const std::vector<SignalSlice> layout = MakeLayout(&Visit);
  return layout;
}

int RobotSide::OutputSize() {
  return OutputLayout().back().start + OutputLayout().back().size;
}

void RobotSide::WriteVector(const RobotSideOutput& output,
                            Eigen::Ref<Eigen::VectorXd> vector) {
  SignalSink sink(&vector);
  Visit(output, &sink);
}

}  // namespace dual_proxy
