// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/sides/robot_side.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "dual_proxy/common/possible.h"
#include "dual_proxy/common/validate.h"

namespace dual_proxy {

namespace {

template <typename Robot>
RobotHalf MakeHalf(const RobotSideParams<Robot>& params) {
  params.Validate();
  return Schemes::MakeRobotHalf(
      static_cast<int>(params.scheme),
      {.proxy = params.proxy, .sender = params.sender}, params.schemes);
}

template <int kJoints>
OperationalSpaceControllerInput<kJoints> MakeControllerInput(
    const RobotSideInput<SerialArm<kJoints>>& input,
    const RobotSetpoint& setpoint) {
  return {.model = input.model,
          .q = input.q,
          .v = input.v,
          .motion_error = setpoint.motion_error,
          .rotation_error = setpoint.rotation_error,
          .proxy_velocity = setpoint.velocity,
          .proxy_acceleration = setpoint.acceleration,
          .reference_force = setpoint.reference_force,
          .reference_moment = setpoint.reference_moment,
          .force_selection = setpoint.force_selection,
          .moment_selection = setpoint.moment_selection,
          .force_feedback = setpoint.force_feedback,
          .sensed_wrench = input.sensed_wrench,
          .sensor_ready = input.sensor_ready,
          .received_torque = input.received_command};
}

PointControllerInput MakeControllerInput(const RobotSideInput<PointMass>& input,
                                         const RobotSetpoint& setpoint) {
  return {.model = input.model,
          .v = input.v,
          .motion_error = setpoint.motion_error,
          .proxy_velocity = setpoint.velocity.head<3>(),
          .proxy_acceleration = setpoint.acceleration.head<3>(),
          .reference_force = setpoint.reference_force,
          .force_selection = setpoint.force_selection,
          .force_feedback = setpoint.force_feedback,
          .sensed_force = input.sensed_wrench.head<3>(),
          .sensor_ready = input.sensor_ready};
}

// What a filter of forces takes, and what one of moments.
template <typename Output>
FilterInput MakeForceSample(const Vector6& sensed, const Vector6& v_BE,
                            const Output& command) {
  return {.sensed = sensed.head<3>(),
          .velocity = v_BE.head<3>(),
          .motion = command.motion_force,
          .contact = command.contact_force};
}

template <int kJoints>
FilterInput MakeMomentSample(
    const Vector6& sensed, const Vector6& v_BE,
    const OperationalSpaceControllerOutput<kJoints>& command) {
  return {.sensed = sensed.tail<3>(),
          .velocity = v_BE.tail<3>(),
          .motion = command.motion_moment,
          .contact = command.contact_moment};
}

FilterInput MakeMomentSample(const Vector6& /* sensed */,
                             const Vector6& /* v_BE */,
                             const PointControllerOutput& /* command */) {
  return {};
}

template <int kJoints>
void RefuseImpossible(ModelTerms<kJoints>* model) {
  RefuseBeyond(kMaxModelTerm, &model->J_BE);
  RefuseBeyond(kMaxModelTerm, &model->mass);
  RefuseBeyond(kMaxModelTerm, &model->bias);
  RefuseBeyond(kMaxModelTerm, &model->gravity);
  RefuseBeyond(kMaxModelTerm, &model->Jdot_v);
}

void RefuseImpossible(PointTerms* model) {
  RefuseBeyond(kMaxModelTerm, &model->mass);
}

template <typename Robot>
void RefuseImpossible(RobotSideInput<Robot>* input) {
  RefuseBeyond(kMaxPosition, &input->X_BE.p);
  RefuseImpossible(&input->model);
  RefuseBeyond(kMaxPosition, &input->q);
  RefuseBeyond(kMaxSpeed, &input->v);
  if (!IsWithin(CalcTwist(input->model, input->v), kMaxSpeed)) {
    input->v.setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  RefuseBeyond(kMaxForce, &input->sensed_wrench);
}

template <int kJoints>
void VisitCounters(const OperationalSpaceControllerState<kJoints>& controller,
                   SignalSink* sink) {
  sink->Count("robot_singular", "cycles with a bounded apparent mass",
              controller.singular);
  sink->Count("torque_limited", "cycles in which a torque was limited",
              controller.torque_limited);
  sink->Count("torque_rate_limited",
              "cycles in which a torque's rate was limited",
              controller.rate_limited);
  sink->Count("joint_limited",
              "cycles in which a joint was kept from its limits",
              controller.joint_limited);
}

void VisitCounters(const PointControllerState& controller, SignalSink* sink) {
  sink->Count("force_limited", "cycles in which the command was limited",
              controller.force_limited);
  sink->Count("force_rate_limited",
              "cycles in which the command's rate was limited",
              controller.rate_limited);
}

}  // namespace

template <typename Robot>
void RobotSideParams<Robot>::Validate() const {
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
  if (proxy.reclutch && !Reclutches(scheme)) {
    ThrowInvalidField(
        who, "proxy.reclutch",
        "false for a scheme whose robot goes to where the hand is", true);
  }
  if (gripper.enabled && gripper.period != proxy.period) {
    ThrowInvalidField(who, "gripper.period", "the proxy's period",
                      gripper.period);
  }
  if (perception.filter.period < proxy.period) {
    ThrowInvalidField(who, "perception.filter.period",
                      "at least the control period", perception.filter.period);
  }
  const Eigen::Vector3d scan =
      2 * std::numbers::pi * planner.scan_frequency * planner.scan_amplitude;
  const bool scans = !planner.active.empty();
  if (scans && scan.cwiseAbs().maxCoeff() > proxy.limiter.max_velocity) {
    ThrowInvalidField(who, "planner.scan_frequency",
                      "a scan no faster than proxy.limiter.max_velocity",
                      planner.scan_frequency);
  }
  const AngularFilterParams& angular = perception.angular_filter;
  if (!Robot::kRotates && angular.enabled) {
    ThrowInvalidField(who, "perception.angular_filter.enabled",
                      "false: a point does not turn", true);
  }
  if (angular.enabled && angular.filter.period < proxy.period) {
    ThrowInvalidField(who, "perception.angular_filter.filter.period",
                      "at least the control period", angular.filter.period);
  }
}

template <typename Robot>
RobotSide<Robot>::RobotSide(Params params)
    : params_(std::move(params)),
      half_(MakeHalf(params_)),
      planner_(params_.planner),
      controller_(params_.controller),
      gripper_(params_.gripper) {
  if (UsesSelections(params_.scheme)) {
    perception_.emplace(params_.perception);
    blend_.emplace(params_.proxy);
  }
  layout_ =
      MakeLayout([this](SignalSink* sink) { VisitSignals(MakeState(), sink); });
}

template <typename Robot>
RobotSideState<Robot> RobotSide<Robot>::MakeState(
    std::uint64_t seed, std::uint64_t angular_seed) const {
  State state;
  state.half = half_.MakeState();
  state.controller = controller_.MakeState();
  state.gripper = gripper_.MakeState();
  if (perception_) {
    state.perception = perception_->MakeState(seed, angular_seed);
  }
  return state;
}

template <typename Robot>
void RobotSide<Robot>::TakePlanner(double time, const Input& input,
                                   State* state) const noexcept {
  const bool ready = input.sensor_ready && !input.hold &&
                     state->half.output().link.status == LinkStatus::kConnected;
  if (input.planner) {
    blend_->TakePlanner(*input.planner, ready, &state->blend);
  } else {
    if (planner_.enabled()) {
      planner_.Update(time, input.X_BE.p, ready, &state->planner);
    }
    blend_->TakePlanner(state->planner.output, ready, &state->blend);
  }
}

template <typename Robot>
bool RobotSide<Robot>::TakeWrench(Input* input, State* state) const noexcept {
  const bool good =
      input->sensed_wrench.allFinite() && std::isfinite(input->sensor_age);
  if (good) {
    state->sensed_wrench = input->sensed_wrench;
    // A clock that is ahead keeps no wrench fresh.
    state->sensed_age = std::max(0.0, input->sensor_age);
  } else {
    input->sensed_wrench = state->sensed_wrench;
    state->sensed_age += params_.controller.period;
  }
  const bool fresh = state->sensed_age <= params_.max_sensor_age;
  if (!fresh) {
    input->sensed_wrench.setZero();
    input->sensor_ready = false;
  }
  return good && fresh;
}

template <typename Robot>
void RobotSide<Robot>::Update(double time, const Input& input,
                              State* state) const noexcept {
  RobotSideOutput<Robot>& output = state->output;
  output.X_BE = input.X_BE;
  output.q = input.q;
  output.v = input.v;
  output.sensed_wrench = input.sensed_wrench;
  output.sensor_ready = input.sensor_ready;

  const std::int64_t refused = output.bad_inputs;
  Input possible = input;
  RefuseImpossible(&possible);
  RefuseBeyond(kMaxTime, &time);
  const bool finite = possible.sensed_wrench.allFinite();
  const bool sensed = TakeWrench(&possible, state);
  Advance(time, sensed, possible, state);
  if (!(time >= state->time) || !finite) output.bad_inputs = refused + 1;
  const LinkMonitorState& link = state->half.output().link;
  if (output.bad_inputs != refused) {
    output.hold = HoldReason::kBadInputs;
  } else if (input.hold) {
    output.hold = HoldReason::kAsked;
  } else if (!possible.sensor_ready) {
    output.hold = HoldReason::kNoSensor;
  } else if (link.status != LinkStatus::kConnected) {
    output.hold = HoldReason::kNoLink;
  } else {
    output.hold = HoldReason::kNone;
  }
  StoreIfFinite(time, &state->time);
}

template <typename Robot>
void RobotSide<Robot>::Advance(double time, bool sensed, const Input& input,
                               State* state) const noexcept {
  RobotSideOutput<Robot>& output = state->output;
  output.v_BE = CalcTwist(input.model, input.v);
  if (input.selections) {
    output.selections = *input.selections;
  } else if (perception_) {
    output.selections = perception_->GetSelections(state->perception);
  }

  const std::int64_t refused_by_half = state->half.output().bad_inputs;
  const std::int64_t refused_by_blend = state->blend.bad_inputs;
  const std::int64_t refused_by_controller = state->controller.bad_inputs;
  if (blend_) TakePlanner(time, input, state);
  half_.Update(time,
               {.message = input.message,
                .X_BE = input.X_BE,
                .v_BE = output.v_BE,
                .force_selection = output.selections.force,
                .moment_selection = output.selections.moment,
                .contact_normals = output.selections.normals,
                .sensed_wrench = input.sensed_wrench,
                .sensor_ready = input.sensor_ready,
                .hold = input.hold,
                .planner_selection = state->blend.planner.selection},
               &state->half);
  if (gripper_.enabled()) {
    const LinkMonitorState& link = state->half.output().link;
    const bool accepted = input.message.sequence == link.last_sequence;
    gripper_.Update(link.status == LinkStatus::kConnected,
                    accepted ? input.message.gripper_opening : kNoGripper,
                    &state->gripper);
  }
  output.setpoint = state->half.output().setpoint;
  output.reference_pose = state->half.output().proxy_pose;
  if (blend_) {
    blend_->Update(input.X_BE, &state->blend, &output.setpoint,
                   &output.reference_pose);
  }
  output.controller = controller_.Update(
      MakeControllerInput(input, output.setpoint), &state->controller);
  const bool valid = state->controller.bad_inputs == refused_by_controller;
  if (!valid || state->half.output().bad_inputs != refused_by_half ||
      state->blend.bad_inputs != refused_by_blend) {
    ++output.bad_inputs;
  }

  if (perception_) {
    if (!input.selections) perception_->UpdateFilters(time, &state->perception);
    if (valid && sensed) {
      perception_->AddSamples(
          time,
          MakeForceSample(input.sensed_wrench, output.v_BE, output.controller),
          MakeMomentSample(input.sensed_wrench, output.v_BE, output.controller),
          &state->perception);
    }
  }
}

template <typename Robot>
void RobotSide<Robot>::VisitSignals(const State& state,
                                    SignalSink* sink) const {
  const RobotSideOutput<Robot>& output = state.output;
  const RobotHalfOutput& half = state.half.output();
  const RobotSetpoint& setpoint = output.setpoint;
  const typename Robot::Controller::Output& controller = output.controller;
  const bool angular = perception_ && perception_->has_angular_filter();

  sink->Vector({"robot_position", "m", "B", "x_r, of the tool point"},
               output.X_BE.p);
  sink->Vector({"robot_velocity", "m/s", "B", "v_BE, of the tool point"},
               output.v_BE.template head<3>());
  if constexpr (Robot::kRotates) {
    sink->Vector({"robot_angular_velocity", "rad/s", "B", "w_BE, of the tool"},
                 output.v_BE.template tail<3>());
    sink->Rotation({"robot_orientation", "", "B", "R_BE as a quaternion"},
                   output.X_BE.R);
  }
  sink->Vector({"robot_proxy_position", "m", "B",
                "x_pr, after its limiter; with a planner's share"},
               output.reference_pose.p);
  if constexpr (Robot::kRotates) {
    sink->Rotation({"robot_proxy_orientation", "", "B", "R_pr as a quaternion"},
                   output.reference_pose.R);
  }
  sink->Vector({"robot_proxy_velocity", "m/s", "B", "of the proxy"},
               setpoint.velocity.head<3>());
  sink->Vector({"motion_error", "m", "B", "dx_m, robot minus proxy"},
               setpoint.motion_error);
  if constexpr (Robot::kRotates) {
    sink->Vector({"rotation_error", "rad", "B", "dphi_m, robot against proxy"},
                 setpoint.rotation_error);
  }
  sink->Vector({"reference_force", "N", "B", "F_r"}, setpoint.reference_force);
  if constexpr (Robot::kRotates) {
    sink->Vector({"reference_moment", "N m", "B", "M_r"},
                 setpoint.reference_moment);
  }
  sink->Vector({"sensed_force", "N", "B", "F_s, on the environment, at E"},
               output.sensed_wrench.template head<3>());
  if constexpr (Robot::kRotates) {
    sink->Vector(
        {"sensed_moment", "N m", "B", "M_s, on the environment, about E"},
        output.sensed_wrench.template tail<3>());
  }
  sink->Integer({"sensor_ready", "", "", "whether the sensor's bias is known"},
                output.sensor_ready);
  sink->Vector({"motion_force", "N", "B", "F_m, command in motion space"},
               controller.motion_force);
  if constexpr (Robot::kRotates) {
    sink->Vector({"motion_moment", "N m", "B", "M_m, command in motion space"},
                 controller.motion_moment);
  }
  sink->Vector({"force_space_force", "N", "B", "F_f, command in force space"},
               controller.contact_force);
  if constexpr (Robot::kRotates) {
    sink->Vector(
        {"moment_space_moment", "N m", "B", "M_f, command in moment space"},
        controller.contact_moment);
  }
  sink->Matrix({"force_selection", "", "B", "Omega_f, row by row"},
               output.selections.force);
  if (has_planner()) {
    sink->Matrix(
        {"planner_selection", "", "B", "Omega_p, a planner's, row by row"},
        state.blend.planner.selection);
  }
  if constexpr (Robot::kRotates) {
    sink->Joints({"joint_position", "rad", "", "q"}, output.q);
    sink->Joints({"joint_velocity", "rad/s", "", "dq/dt"}, output.v);
    sink->Joints({"torque", "N m", "", "commanded"}, controller.torque);
  } else {
    sink->Vector({"commanded_force", "N", "B", "of all that pushes a point"},
                 controller.force);
  }
  sink->Scalar({"observed_energy", "J", "", "of the closed force loop"},
               controller.observed_energy);
  sink->Scalar({"injected_damping", "N s/m", "", "by the passivity controller"},
               controller.injected_damping);
  if constexpr (Robot::kRotates) {
    sink->Scalar(
        {"observed_moment_energy", "J", "", "of the closed moment loop"},
        controller.observed_moment_energy);
    sink->Scalar({"injected_moment_damping", "N m s/rad", "",
                  "by the passivity controller of moments"},
                 controller.injected_moment_damping);
  }
  if (perception_) {
    const ForceSpaceParticleFilterState& filter = state.perception.force.filter;
    sink->Integer({"dimension", "", "", "of the force space, by the filter"},
                  filter.dimension);
    sink->Vector(
        {"force_direction", "", "B", "U1 of the filter; zero at dimension 0"},
        filter.force_direction());
    sink->Count("filter_means_bad_inputs", "samples that its means refused",
                state.perception.force.means.bad_inputs);
    sink->Count("filter_bad_inputs", "updates refused", filter.bad_inputs);
    sink->Count("filter_all_weights_zero",
                "updates in which nothing was likely", filter.all_weights_zero);
  }
  if (angular) {
    const ForceSpaceParticleFilterState& filter =
        state.perception.moment.filter;
    sink->Integer({"moment_dimension", "", "",
                   "of the moment space, by the angular filter"},
                  filter.dimension);
    sink->Matrix({"moment_selection", "", "B", "Omega_tau, row by row"},
                 filter.force_selection);
    sink->Count("angular_filter_means_bad_inputs",
                "samples that its means refused",
                state.perception.moment.means.bad_inputs);
    sink->Count("angular_filter_bad_inputs", "updates refused",
                filter.bad_inputs);
    sink->Count("angular_filter_all_weights_zero",
                "updates in which nothing was likely", filter.all_weights_zero);
  }
  if (gripper_.enabled()) {
    sink->Scalar({"gripper_width_command", "m", "", "for the gripper's driver"},
                 state.gripper.width);
  }
  sink->Integer({"robot_link_status", "", "",
                 "at the robot: 0 waiting, 1 connected, 2 lost"},
                static_cast<double>(half.link.status));
  sink->Scalar(
      {"robot_link_age", "s", "", "of the message in use at the robot"},
      half.link.age);
  sink->Count("robot_link_dropped", "messages refused",
              half.link.dropped + half.link.bad_inputs);
  sink->Count("robot_link_bad_messages",
              "of them, those that were not finite or not valid",
              half.link.bad_inputs);
  sink->Count("robot_link_gaps", "sequence numbers skipped", half.link.gaps);
  sink->Count("robot_link_spikes", "messages that came unusually late",
              half.link.spikes);
  sink->Count("robot_link_losses", "times that the link was lost",
              half.link.losses);
  sink->Count("robot_bad_inputs", "cycles that the side refused",
              output.bad_inputs);
  sink->Count("robot_limiter_bad_inputs",
              "targets that the proxy's limiter refused",
              half.limiter_bad_inputs);
  sink->Count("robot_sender_bad_inputs", "samples that the sender refused",
              half.sender_bad_inputs);
  VisitCounters(state.controller, sink);
}

template struct RobotSideParams<SerialArm<6>>;
template struct RobotSideParams<SerialArm<7>>;
template struct RobotSideParams<PointMass>;
template class RobotSide<SerialArm<6>>;
template class RobotSide<SerialArm<7>>;
template class RobotSide<PointMass>;

}  // namespace dual_proxy
