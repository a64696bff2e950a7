// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/possible.h"
#include "dual_proxy/common/validate.h"
#include "dual_proxy/faces/blocks.h"
#include "dual_proxy/faces/shared_ports.h"

namespace dual_proxy {

namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Vector14 = Eigen::Matrix<double, 14, 1>;

// That of the simulated hardware, which steps with the side.
void CheckPeriod(const char* who, const char* field, double period,
                 double control_period) {
  if (period != control_period) {
    ThrowInvalidField(who, field, "the side's own period", period);
  }
}

struct RobotBlockInput {
  RobotSideInput<SerialArm<7>> side;
  Vector14 x{Vector14::Zero()};
  // Of a simulated sensor.
  Vector6 reaction{Vector6::Zero()};
  bool has_reaction{false};
  bool tare{false};
};

struct RobotBlockMemory {
  RobotSideState<SerialArm<7>> side;
  ForceTorqueSensorState sensor;
  Vector7 torque{Vector7::Zero()};  // N m, of the last step.
  bool stepped{false};
};

class RobotSideBlock final : public BlockOf<RobotBlockInput, RobotBlockMemory> {
 public:
  RobotSideBlock(const RobotSideParams<SerialArm<7>>& params,
                 const ArmModelParams<7>& arm,
                 const std::optional<Vector7>& q_start,
                 const std::optional<RobotSideSensor>& sensor,
                 const RobotSideSeeds& seeds)
      : BlockOf("RobotSide", {.period = params.controller.period}),
        side_(params),
        arm_(arm) {
    RobotBlockMemory start;
    start.side = side_.MakeState(seeds.filter, seeds.angular_filter);
    if (q_start) {
      ThrowUnlessIn("RobotSide", "q_start", *q_start,
                    Between(-kMaxPosition, kMaxPosition));
      Pose X_BE;
      ModelTerms<7> terms;
      arm_.Calc(*q_start, Vector7::Zero(), &X_BE, &terms);
      start.torque = -terms.gravity;
    }
    if (sensor) {
      CheckPeriod("RobotSide", "sensor.period", sensor->params.period,
                  params.controller.period);
      ThrowUnlessIn("RobotSide", "p_SE", sensor->p_SE,
                    Between(-kMaxPosition, kMaxPosition));
      sensor_.emplace(sensor->params);
      p_SE_ = sensor->p_SE;
      start.sensor = sensor_->MakeState(sensor->seed);
    }
    set_start(std::move(start));
  }

  const std::vector<SignalSlice>& layout() const override {
    return side_.layout();
  }

 private:
  void ReadInputs(InputPorts* ports, RobotBlockInput* input) const override {
    RobotSideInput<SerialArm<7>>& side = input->side;
    ports->GetMessage({"haptic_message", "without it the robot waits"},
                      ToRobotTag(side_.params().scheme), &side.message);
    ports->GetVector(kRobotState, &input->x, Need::kRequired);
    if (sensor_) {
      input->has_reaction =
          ports->GetVector({"reaction",
                            "[force; moment], N, N m, in S, of the arm on the "
                            "tool (only with a simulated sensor)"},
                           &input->reaction, Need::kAfterStart);
    } else {
      ports->GetVector({"sensed_wrench",
                        "[force; moment] at E, N, N m (not with a simulated "
                        "sensor)"},
                       &side.sensed_wrench);
    }
    ContactSelections selections;
    const bool has_force = ports->GetVector(
        {"force_selection",
         "Omega_f if somebody else knows the directions of contact; the side's "
         "own filters rest if this or one of the next two is connected"},
        &selections.force);
    const bool has_moment = ports->GetVector(
        {"moment_selection", "Omega_tau, likewise"}, &selections.moment);
    const bool has_normals =
        ports->GetVector({"contact_normals",
                          "unit vectors into the surfaces, likewise; without "
                          "them the hand may be pulled into one"},
                         &selections.normals);
    if (has_force || has_moment || has_normals) side.selections = selections;
    if (sensor_) {
      ports->GetFlag({"tare",
                      "asks for the sensor's bias to be learned anew when it "
                      "comes to exceed 0.5 (only with a simulated sensor)"},
                     &input->tare);
    } else {
      ports->GetFlag(
          {"sensor_ready",
           "> 0.5 if the force sensor can be relied on, as without a "
           "connection; otherwise the robot holds its place (not with "
           "a simulated sensor)"},
          &side.sensor_ready);
    }
    PlannerReference planner;
    const bool has_planner = ports->GetVector(
        {"planner_selection",
         "Omega_p, the directions that a planner owns; if this is connected "
         "the side's own planner rests"},
        &planner.selection);
    ports->GetVector({"planner_position", "m, of the tool point, there"},
                     &planner.position);
    ports->GetVector({"planner_velocity", "m/s, likewise"}, &planner.velocity);
    ports->GetVector({"planner_force", "N, on the environment, there"},
                     &planner.force);
    if (has_planner) side.planner = planner;
  }

  void Update(double time, const RobotBlockInput& input,
              RobotBlockMemory* memory) const override {
    RobotSideInput<SerialArm<7>> side = input.side;
    side.q = input.x.head<7>();
    side.v = input.x.tail<7>();
    arm_.Calc(side.q, side.v, &side.X_BE, &side.model);
    if (sensor_) {
      side.sensed_wrench = memory->sensor.adapter.wrench;
      side.sensor_ready = memory->sensor.adapter.ready;
    }
    side_.Update(time, side, &memory->side);
    memory->torque = memory->side.output.controller.torque;
    memory->stepped = true;
    if (sensor_ && input.has_reaction) {
      sensor_->Update({.measured = input.reaction,
                       .X_BE = side.X_BE,
                       .v_BE = memory->side.output.v_BE,
                       .p_SE = p_SE_,
                       .tare = input.tare},
                      &memory->sensor);
    }
  }

  void WriteOutputs(double, const RobotBlockMemory& memory, InputPorts* inputs,
                    OutputPorts* ports) const override {
    ports->PutVector({"signals", "all results, see `layout`"},
                     SizeOf(side_.layout()),
                     [&](OutputPorts::VectorRef signals) {
                       signals.setZero();
                       if (!memory.stepped) return;
                       SignalSink sink(&signals);
                       side_.VisitSignals(memory.side, &sink);
                     });
    ports->PutVector({"torque", "N m, with gravity compensation"},
                     memory.torque);
    ports->PutPose({"robot_pose", "X_BE, at the current `robot_state`"},
                   [&] {
                     Vector14 x = Vector14::Zero();
                     inputs->GetVector(kRobotState, &x, Need::kRequired);
                     Pose X_BE;
                     ModelTerms<7> terms;
                     arm_.Calc(x.head<7>(), x.tail<7>(), &X_BE, &terms);
                     return X_BE;
                   },
                   {.inputs = {"robot_state"}});
    ports->PutMessage({"message", "to the haptic side"},
                      ToDeviceTag(side_.params().scheme),
                      [&] { return memory.side.half.output().message; });
    const ScheduledFilterState& force = memory.side.perception.force;
    const FilterInput means = force.mean_input();
    ports->PutVector(
        {"mean_sensed_force", "N, mean over the filter's current period"},
        means.sensed);
    ports->PutVector({"mean_velocity", "m/s, likewise"}, means.velocity);
    ports->PutVector({"mean_motion_force", "N, likewise"}, means.motion);
    ports->PutVector({"mean_contact_force", "N, likewise"}, means.contact);
    WriteFound(memory.side.perception, ports);
    if (sensor_) {
      ports->PutVector({"sensed_wrench",
                        "[force; moment] at E, N, N m (only with a simulated "
                        "sensor)"},
                       memory.sensor.adapter.wrench);
      ports->PutCounts(
          {"sensor_counters",
           "so far: samples that the sensor refused, times at rest "
           "that gave no bias (only with a simulated sensor)"},
          {memory.sensor.adapter.bad_inputs,
           memory.sensor.adapter.tares_refused});
    }
    if (side_.params().gripper.enabled)
      WriteGripper(memory.side.gripper, ports);
    if (!side_.params().perception.angular_filter.enabled) return;
    const FilterInput moments = memory.side.perception.moment.mean_input();
    ports->PutVector(
        {"mean_sensed_moment",
         "N m, mean over the angular filter's current period (only "
         "with an angular filter)"},
        moments.sensed);
    ports->PutVector({"mean_angular_velocity", "rad/s, likewise"},
                     moments.velocity);
    ports->PutVector({"mean_motion_moment", "N m, likewise"}, moments.motion);
    ports->PutVector({"mean_contact_moment", "N m, likewise"}, moments.contact);
    WriteFoundMoments(memory.side.perception, ports);
  }

  RobotSide<SerialArm<7>> side_;
  ArmModel<7> arm_;
  std::optional<ForceTorqueSensor> sensor_;
  Eigen::Vector3d p_SE_{Eigen::Vector3d::Zero()};
};

struct HapticBlockMemory {
  HapticSideState side;
  SimulatedHapticDeviceState device;
  bool stepped{false};
};

class HapticSideBlock final
    : public BlockOf<HapticSideInput, HapticBlockMemory> {
 public:
  HapticSideBlock(const HapticSideParams& params,
                  const std::optional<HapticSideDevice>& device)
      : BlockOf("HapticSide", {.period = params.controller.period}),
        side_(params) {
    HapticBlockMemory start{.side = side_.MakeState(), .device = {}};
    if (device) {
      CheckPeriod("HapticSide", "device.period", device->params.period,
                  params.controller.period);
      device_.emplace(device->params);
      path_.emplace(device->path);
      start.device = device_->MakeState();
    }
    set_start(std::move(start));
  }

  const std::vector<SignalSlice>& layout() const override {
    return side_.layout();
  }

 private:
  void ReadInputs(InputPorts* ports, HapticSideInput* input) const override {
    ports->GetMessage({"robot_message",
                       "without it there is no force, but messages are sent"},
                      ToDeviceTag(side_.params().scheme), &input->message);
    if (device_) return;
    ports->GetPose(
        {"device_pose",
         "X_DH, from the device's home (not with a simulated device)"},
        &input->X_DH);
    ports->GetVector({"device_velocity",
                      "[linear; angular], m/s, rad/s (not with a simulated "
                      "device)"},
                     &input->device_velocity, Need::kRequired);
    ports->GetVector(kHandleForce, &input->handle_force);
    OperatorButtons& buttons = input->buttons;
    ports->GetFlag({"clutch",
                    "> 0.5 while it is pressed: the robot holds still, the "
                    "hand is free (not with a simulated device)"},
                   &buttons.clutch);
    ports->GetFlag({"home",
                    "> 0.5 while the handle is to go home (not with a "
                    "simulated device)"},
                   &buttons.home);
    Eigen::Matrix<double, 1, 1> scale(buttons.force_scale);
    if (ports->GetVector({"force_scale",
                          "by which F_h is multiplied, 1 without a connection "
                          "(not with a simulated device)"},
                         &scale)) {
      buttons.force_scale = scale(0);
    }
    Eigen::Matrix<double, 1, 1> opening(input->gripper_opening);
    if (ports->GetVector({"gripper_opening",
                          "m, of the device's gripper, not finite: none (not "
                          "with a simulated device)"},
                         &opening)) {
      input->gripper_opening = opening(0);
    }
  }

  void Update(double time, const HapticSideInput& input,
              HapticBlockMemory* memory) const override {
    memory->stepped = true;
    if (!device_) {
      side_.Update(time, input, &memory->side);
      return;
    }
    // What the device was told in the step before acts on it now.
    const Vector6 told = memory->side.output.device_wrench;
    const OperatorPathSample intended = path_->Calc(time);
    side_.Update(time,
                 {.message = input.message,
                  .X_DH = memory->device.read_pose,
                  .device_velocity = memory->device.read_velocity,
                  .handle_force = memory->device.handle_force,
                  .buttons = {.clutch = intended.clutch,
                              .home = intended.home,
                              .force_scale = intended.force_scale},
                  .gripper_opening = intended.gripper_opening},
                 &memory->side);
    device_->Update({.p = intended.position, .R = intended.rotation},
                    intended.velocity, told, &memory->device, intended.home);
  }

  void WriteOutputs(double, const HapticBlockMemory& memory, InputPorts*,
                    OutputPorts* ports) const override {
    ports->PutVector({"signals", "all results, see `layout`"},
                     SizeOf(side_.layout()),
                     [&](OutputPorts::VectorRef signals) {
                       signals.setZero();
                       if (!memory.stepped) return;
                       SignalSink sink(&signals);
                       side_.VisitSignals(memory.side, &sink);
                     });
    ports->PutVector(
        {"device_wrench", "[force; moment], N, N m, of the device on the hand"},
        memory.side.output.device_wrench);
    ports->PutMessage({"message", "to the robot side"},
                      ToRobotTag(side_.params().scheme),
                      [&] { return memory.side.message(); });
    if (!device_) return;
    ports->PutPose(
        {"device_pose",
         "X_DH, as the driver reads it (only with a simulated device)"},
        [&] { return memory.device.read_pose; });
    ports->PutCounts(
        {"device_bad_inputs",
         "steps with an input that the device refused so far (only "
         "with a simulated device)"},
        {memory.device.bad_inputs});
  }

  HapticSide side_;
  std::optional<SimulatedHapticDevice> device_;
  std::optional<OperatorPath> path_;
};

}  // namespace

BlockPtr MakeRobotSideBlock(const RobotSideParams<SerialArm<7>>& params,
                            const ArmModelParams<7>& arm,
                            const std::optional<Vector7>& q_start,
                            const std::optional<RobotSideSensor>& sensor,
                            const RobotSideSeeds& seeds) {
  return std::make_shared<RobotSideBlock>(params, arm, q_start, sensor, seeds);
}

BlockPtr MakeHapticSideBlock(const HapticSideParams& params,
                             const std::optional<HapticSideDevice>& device) {
  return std::make_shared<HapticSideBlock>(params, device);
}

}  // namespace dual_proxy
