// SPDX-License-Identifier: BSD-3-Clause
// Whatever messages, times and measurements both sides of a scheme get, what
// goes out is finite, within its limits, and valid for who receives it.
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "dual_proxy/common/rotation.h"
#include "dual_proxy/link/communication_channel.h"
#include "dual_proxy/sides/haptic_side.h"
#include "dual_proxy/sides/robot_side.h"
#include "fuzz_tools.h"
#include "test_arm.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kPeriod = 0.001;
constexpr int kSettled = 100;
constexpr int kMostTicks = 400;
constexpr double kSlack = 1 + 1e-9;

template <typename Content>
bool IsValidAs(const Message& message, MessageTag tag = Content::kTag) {
  return message.tag == tag && IsValid(FromMessage<Content>(message, tag));
}

bool IsValidToRobot(Scheme scheme, const Message& message) {
  const MessageTag tag = ToRobotTag(scheme);
  if (tag == TdpaMotionMessage::kTag) {
    return IsValidAs<TdpaMotionMessage>(message);
  } else if (tag == FourChannelToRobot::kTag) {
    return IsValidAs<FourChannelToRobot>(message);
  } else if (tag == WaveToRobot::kTag) {
    return IsValidAs<WaveToRobot>(message);
  } else if (tag == ModelMediatedMotionMessage::kTag) {
    return IsValidAs<ModelMediatedMotionMessage>(message);
  }
  return IsValidAs<PoseMessage>(message, tag);
}

bool IsValidToDevice(Scheme scheme, const Message& message) {
  const MessageTag tag = ToDeviceTag(scheme);
  if (tag == ForceMessage::kTag) {
    return IsValidAs<ForceMessage>(message);
  } else if (tag == TdpaForceMessage::kTag) {
    return IsValidAs<TdpaForceMessage>(message);
  } else if (tag == FourChannelToDevice::kTag) {
    return IsValidAs<FourChannelToDevice>(message);
  } else if (tag == WaveToDevice::kTag) {
    return IsValidAs<WaveToDevice>(message);
  } else if (tag == ModelMediatedSurfaceMessage::kTag) {
    return IsValidAs<ModelMediatedSurfaceMessage>(message);
  }
  return IsValidAs<PoseMessage>(message, tag);
}

// What both sides get in a cycle.
struct Inputs {
  double robot_time{0};
  double haptic_time{0};
  RobotSideInput<SerialArm<7>> robot;
  PlannerReference planner;
  HapticSideInput haptic;

  // All numbers that may be changed.
  auto Spans() {
    const auto all = [](auto& matrix) {
      return std::span<double>(matrix.data(),
                               static_cast<std::size_t>(matrix.size()));
    };
    return std::array<std::span<double>, 27>{
        std::span(&robot_time, 1),
        std::span(&haptic_time, 1),
        std::span<double>(robot.message.body),
        std::span(&robot.message.send_time, 1),
        std::span(&robot.message.gripper_opening, 1),
        std::span<double>(haptic.message.body),
        std::span(&haptic.message.send_time, 1),
        all(robot.X_BE.p),
        all(robot.X_BE.R),
        all(robot.q),
        all(robot.v),
        all(robot.sensed_wrench),
        all(robot.model.J_BE),
        all(robot.model.mass),
        all(robot.model.bias),
        all(robot.model.gravity),
        all(robot.model.Jdot_v),
        all(planner.selection),
        all(planner.position),
        all(planner.velocity),
        all(planner.force),
        all(haptic.X_DH.p),
        all(haptic.X_DH.R),
        all(haptic.device_velocity),
        all(haptic.handle_force),
        std::span(&haptic.buttons.force_scale, 1),
        std::span(&haptic.gripper_opening, 1)};
  }
};

// A change of the inputs that lasts until it is taken back.
struct Change {
  enum Kind {
    kNumber,      // To `value`.
    kAdd,         // By `value`.
    kSequence,    // By `number`, of a message.
    kTagAndSize,  // To `number`, of a message.
    kRotation,    // By a vector, of a message, where its body has one.
    kSelection,   // Likewise, along a vector.
    kNormal,      // Likewise, a vector.
    kButtons,
    kKinds
  };

  Kind kind;
  std::size_t span{0};
  std::size_t entry{0};
  bool to_robot{false};
  std::int64_t number{0};
  double value{0};
  Vector3d vector{Vector3d::Zero()};
};

Change TakeChange(FuzzInput* input) {
  Inputs inputs;
  const auto spans = inputs.Spans();
  Change change{.kind = static_cast<Change::Kind>(input->Byte() % 8)};
  static_assert(Change::kKinds == 8);
  change.span = static_cast<std::size_t>(input->Byte()) % spans.size();
  const std::size_t size = spans[change.span].size();
  change.entry = static_cast<std::size_t>(input->Byte()) % size;
  change.to_robot = change.entry % 2 == 0;
  switch (change.kind) {
    case Change::kNumber:
    case Change::kAdd:
      change.value = input->Number();
      break;
    case Change::kSequence:
    case Change::kTagAndSize:
      change.number = input->Byte() < 128 ? input->Take<std::int8_t>()
                                          : input->Take<std::int64_t>();
      break;
    default:
      for (double& value : change.vector) value = input->Number();
  }
  return change;
}

void Apply(const Change& change, Inputs* inputs) {
  Message& message =
      change.to_robot ? inputs->robot.message : inputs->haptic.message;
  const std::span<double> numbers = inputs->Spans()[change.span];
  double& number = numbers[change.entry];
  // Of pose, selections and normals in the bodies of messages.
  const std::size_t place = change.entry % 8 < 4 ? 3 : 4;
  switch (change.kind) {
    case Change::kNumber:
      number = change.value;
      break;
    case Change::kAdd:
      number += change.value;
      break;
    case Change::kSequence:
      message.sequence = static_cast<std::int64_t>(
          static_cast<std::uint64_t>(message.sequence) +
          static_cast<std::uint64_t>(change.number));
      break;
    case Change::kTagAndSize:
      message.size = static_cast<std::int32_t>(change.number);
      message.tag = static_cast<MessageTag>(change.number >> 32);
      break;
    case Change::kRotation:
      Eigen::Map<Matrix3d>(message.body.data() + place) =
          ExpRotation(change.vector);
      break;
    case Change::kSelection:
    case Change::kNormal: {
      const Vector3d normal = change.vector.stableNormalized();
      const Matrix3d Omega = normal * normal.transpose();
      if (change.kind == Change::kNormal) {
        Eigen::Map<Vector3d>(message.body.data() + (place == 3 ? 30 : 1)) =
            normal;
      } else {
        Eigen::Map<Matrix3d>(message.body.data() + (place == 3 ? 12 : 21)) =
            Omega;
        inputs->planner.selection = Omega;
      }
      break;
    }
    default:
      inputs->haptic.buttons.clutch = change.vector.x() > 0;
      inputs->haptic.buttons.home = change.vector.y() > 0;
      inputs->robot.sensor_ready = !(change.vector.z() > 0);
      if (change.to_robot) inputs->robot.planner = PlannerReference{};
  }
}

struct Memory {
  RobotSideState<SerialArm<7>> robot;
  HapticSideState haptic;
  CommunicationChannelState to_robot;
  CommunicationChannelState to_device;
};

// What of a memory the cycle that follows is compared to.
struct Before {
  explicit Before(const Memory& memory)
      : first(!memory.robot.controller.initialized),
        torque(memory.robot.output.controller.torque),
        gripper_width(memory.robot.gripper.width),
        robot_refused(memory.robot.output.bad_inputs),
        device_refused(memory.haptic.output.bad_inputs),
        robot_sent(memory.robot.half.output().message.sequence),
        device_sent(memory.haptic.half.output().message.sequence) {}

  bool first;
  Vector7 torque;
  double gripper_width;
  std::int64_t robot_refused;
  std::int64_t device_refused;
  std::int64_t robot_sent;
  std::int64_t device_sent;
};

// Both sides of a scheme over a link, on machines that stay where they are.
class Pair {
 public:
  Pair(Scheme scheme, HapticControlMethod method) {
    arm_.Calc(kTestArmAtRest, Vector7::Zero(), &X_BE_, &terms_);
    RobotSideParams<SerialArm<7>> robot;
    HapticSideParams haptic;
    robot.scheme = haptic.scheme = scheme;
    robot.proxy.map.p_cw = haptic.proxy.map.p_cw = X_BE_.p;
    robot.proxy.map.R_cw = haptic.proxy.map.R_cw = X_BE_.R;
    robot.controller.q_rest = kTestArmAtRest;
    robot.perception.filter.num_particles = 50;
    robot.perception.angular_filter.enabled = true;
    robot.gripper.enabled = true;
    haptic.controller.method = method;
    haptic.controller.max_moment = 0.4;
    haptic.aids.buttons = true;
    robot_ = std::make_unique<RobotSide<SerialArm<7>>>(robot);
    haptic_ = std::make_unique<HapticSide>(haptic);
    settled_ = {robot_->MakeState(), haptic_->MakeState(),
                channel_.MakeState(1), channel_.MakeState(2)};
    for (int i = 0; i < kSettled; ++i) Step(i, {}, &settled_);
  }

  Memory MakeState() const { return settled_; }

  void Step(int tick, std::span<const Change> changes, Memory* memory) const {
    const double time = kPeriod * tick;
    Inputs inputs;
    inputs.robot_time = inputs.haptic_time = time;
    RobotSideInput<SerialArm<7>>& robot = inputs.robot;
    robot.message = channel_.Receive(time, memory->to_robot);
    robot.X_BE = X_BE_;
    robot.model = terms_;
    robot.q = kTestArmAtRest;
    HapticSideInput& haptic = inputs.haptic;
    haptic.message = channel_.Receive(time, memory->to_device);
    for (const Change& change : changes) Apply(change, &inputs);
    if (robot.planner) robot.planner = inputs.planner;

    const Before before(*memory);
    robot_->Update(inputs.robot_time, robot, &memory->robot);
    haptic_->Update(inputs.haptic_time, haptic, &memory->haptic);
    CheckRobot(before, memory->robot);
    CheckDevice(before, memory->haptic);
    channel_.Send(time, memory->robot.half.output().message,
                  &memory->to_device);
    channel_.Send(time, memory->haptic.message(), &memory->to_robot);
  }

  void CheckRobot(const Before& before,
                  const RobotSideState<SerialArm<7>>& now) const {
    const auto& params = robot_->params();
    const auto& controller = params.controller;
    const RobotSideOutput<SerialArm<7>>& output = now.output;
    const Vector7& torque = output.controller.torque;
    const double usable = kSlack * (1 - controller.torque_margin);
    Require(torque.allFinite(), "finite torques");
    Require(
        (torque.cwiseAbs().array() <= usable * controller.torque_limit.array())
            .all(),
        "torques within their limits");
    // The first torque is what holds the arm.
    Require(before.first ||
                (torque - before.torque).cwiseAbs().maxCoeff() <=
                    usable * controller.torque_rate_limit * controller.period,
            "torques within the limit of their rate");
    const RobotSetpoint& setpoint = output.setpoint;
    Require(setpoint.motion_error.allFinite() &&
                setpoint.rotation_error.allFinite() &&
                setpoint.velocity.allFinite() &&
                setpoint.acceleration.allFinite() &&
                setpoint.reference_force.allFinite() &&
                setpoint.reference_moment.allFinite(),
            "a finite setpoint of the robot");
    Require(IsSelection(now.perception.force.filter.force_selection),
            "what perception finds is a projection");
    Require(IsValidPose(output.reference_pose), "the robot's reference");
    const std::int64_t refused = output.bad_inputs - before.robot_refused;
    Require(refused == 0 || refused == 1,
            "a cycle that the robot's side refuses counts once");
    const double width = now.gripper.width;
    Require(width >= 0 && width <= params.gripper.max_width,
            "the gripper's width within its range");
    Require(std::abs(width - before.gripper_width) <=
                kSlack * params.gripper.max_speed * kPeriod,
            "the gripper's speed within its limit");
    CheckLink(now.half.output().link);
    const Message& sent = now.half.output().message;
    CheckSent(before.robot_sent, sent);
    Require(sent.sequence < 0 || IsValidToDevice(params.scheme, sent),
            "what the robot sends is valid");
  }

  void CheckDevice(const Before& before, const HapticSideState& now) const {
    const auto& params = haptic_->params();
    const Vector6& wrench = now.output.device_wrench;
    Require(wrench.allFinite(), "a finite wrench on the hand");
    Require(wrench.head<3>().norm() <= kSlack * params.controller.max_force,
            "the device's force within its limit");
    Require(wrench.tail<3>().norm() <= kSlack * params.controller.max_moment,
            "the device's moment within its limit");
    const HapticSetpoint& setpoint = now.half.output().setpoint;
    Require(setpoint.reference_force.allFinite() &&
                setpoint.reference_moment.allFinite() &&
                setpoint.injected_force.allFinite(),
            "a finite setpoint of the device");
    Require(IsSelection(setpoint.force_selection) &&
                IsSelection(setpoint.moment_selection) &&
                AreNormals(setpoint.contact_normals),
            "the device's selections and normals");
    Require(IsValidPose(now.half.output().proxy_pose), "the haptic proxy");
    const std::int64_t refused = now.output.bad_inputs - before.device_refused;
    Require(refused == 0 || refused == 1,
            "a cycle that the device's side refuses counts once");
    CheckLink(now.half.output().link);
    const Message sent = now.message();
    CheckSent(before.device_sent, sent);
    Require(sent.sequence < 0 || IsValidToRobot(params.scheme, sent),
            "what the device sends is valid");
  }

  // Whether all is well again a while after nothing is wrong any more.
  void CheckRecovery(int tick, Memory* memory) const {
    // Longer than any stamp that was accepted can be ahead.
    const double max_age = robot_->params().proxy.link.max_age;
    tick += static_cast<int>((max_age + 1) / kPeriod);
    for (int i = 0; i < 1100; ++i) Step(tick + i, {}, memory);
    Require(memory->robot.half.output().link.status == LinkStatus::kConnected,
            "the robot's link comes back");
    Require(memory->haptic.half.output().link.status == LinkStatus::kConnected,
            "the device's link comes back");
  }

 private:
  static void CheckLink(const LinkMonitorState& link) {
    Require(link.received >= 0 && link.dropped >= 0 && link.gaps >= 0 &&
                link.spikes >= 0 && link.bad_inputs >= 0 && link.losses >= 0,
            "counters that do not overflow");
    Require(std::isfinite(link.age) && std::isfinite(link.last_send_time) &&
                std::isfinite(link.last_arrival_time),
            "finite ages");
    Require((link.status == LinkStatus::kWaiting) == (link.received == 0),
            "a link waits until something was received");
  }

  static void CheckSent(std::int64_t before, const Message& now) {
    Require(now.sequence == before || now.sequence == before + 1,
            "one message at a time");
    Require(IsFinite(now), "a finite message");
  }

  ArmModel<7> arm_{MakeTestArm()};
  Pose X_BE_;
  ModelTerms<7> terms_;
  CommunicationChannel channel_{{.delay = 0.005}};
  std::unique_ptr<RobotSide<SerialArm<7>>> robot_;
  std::unique_ptr<HapticSide> haptic_;
  Memory settled_;
};

// A channel takes whatever is sent, and loses count of nothing.
void CheckChannel(FuzzInput* input) {
  CommunicationChannelParams params;
  params.delay = 0.01 * input->Byte();
  params.jitter = 0.001 * input->Byte();
  params.loss = input->Byte() / 255.0;
  params.reordering = input->Byte() % 2 == 0;
  const CommunicationChannel channel(params);
  CommunicationChannelState state = channel.MakeState(1);
  double time = 0;
  std::int64_t offered = 0;
  while (!input->empty()) {
    Message message{.tag = input->Take<MessageTag>(),
                    .size = input->Byte() - 10,
                    .sequence = input->Take<std::int8_t>(),
                    .send_time = input->Number()};
    message.body[input->Byte() % Message::kMaxSize] = input->Number();
    DescribeTag(message.tag);
    const double step = input->Number();
    if (step >= 0 && step < 1e9) time += step;
    if (message.sequence != -1 && message.sequence != state.last_sequence) {
      ++offered;
    }
    channel.Send(time, message, &state);
    Require(state.sent + state.refused == offered &&
                state.lost + state.overflow <= state.sent &&
                state.in_flight.size() <= InFlightMessages::kCapacity,
            "a channel's counts");
    Require(IsFinite(channel.Receive(time, state)),
            "what a channel delivers is finite");
  }
}

void Run(FuzzInput* input) {
  const int kind = input->Byte();
  if (kind % 16 == 15) return CheckChannel(input);
  constexpr HapticControlMethod kMethods[] = {
      HapticControlMethod::kOpenLoop, HapticControlMethod::kForceFeedback,
      HapticControlMethod::kPosition};
  const int scheme = kind % Schemes::kSize;
  const int method = kind / 16 % 3;
  static std::unique_ptr<Pair> pairs[Schemes::kSize][3];
  std::unique_ptr<Pair>& pair = pairs[scheme][method];
  if (!pair) {
    pair =
        std::make_unique<Pair>(static_cast<Scheme>(scheme), kMethods[method]);
  }
  const bool recovers = input->Byte() % 8 == 7;
  Memory memory = pair->MakeState();
  std::vector<Change> changes;
  int tick = kSettled;
  while (!input->empty() && tick < kSettled + kMostTicks) {
    const int what = input->Byte();
    if (what < 32) {
      changes.clear();
    } else if (what < 160) {
      changes.push_back(TakeChange(input));
    } else {
      for (int i = 0; i < 1 + (what - 160) / 2; ++i) {
        pair->Step(tick++, changes, &memory);
      }
    }
  }
  pair->Step(tick++, changes, &memory);
  if (recovers) pair->CheckRecovery(tick, &memory);
}

}  // namespace
}  // namespace dual_proxy

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data,
                                      std::size_t size) {
  dual_proxy::FuzzInput input(data, size);
  dual_proxy::Run(&input);
  return 0;
}
