// SPDX-License-Identifier: BSD-3-Clause
// What single C++ faces do: wirings, messages of the wrong kind, errors.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <drake/systems/framework/diagram_builder.h>
#include <gtest/gtest.h>

#include "dual_proxy/common/rotation.h"
#include "dual_proxy/common/window_mean_system.h"
#include "dual_proxy/control/arm_kinematics_system.h"
#include "dual_proxy/control/haptic_controller_system.h"
#include "dual_proxy/control/operational_space_controller_system.h"
#include "dual_proxy/link/communication_channel_system.h"
#include "dual_proxy/link/pose_sender_system.h"
#include "dual_proxy/perception/contact_history_system.h"
#include "dual_proxy/perception/force_space_particle_filter_system.h"
#include "dual_proxy/proxy/haptic_side_proxy_system.h"
#include "dual_proxy/proxy/robot_side_proxy_system.h"
#include "dual_proxy/sides/haptic_side_system.h"
#include "dual_proxy/simulation/force_torque_sensor_system.h"
#include "dual_proxy/simulation/simulated_haptic_device_system.h"
#include "face_table.h"
#include "same_bits.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using drake::Value;
using drake::math::RigidTransformd;
using drake::systems::DiagramBuilder;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kPeriod = 0.001;

// Calls `step(time, inputs)` for every step in the trace of a face.
void ForEachStep(const std::string& face, double period,
                 const std::function<void(double, const FlatInputs&)>& step) {
  const std::vector<TraceRow> rows = LoadTrace(face);
  int steps = 0;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    for (; steps * period < rows[i].time + period / 2; ++steps) {
      step(steps * period, rows[i].inputs);
    }
  }
  EXPECT_GE(steps, 25);
}

// The sides, made of their parts.

// Compares at the start and between steps: there the plant and the other side
// look.
void ExpectSameBetweenSteps(const std::string& face, FacePlayer* one,
                            FacePlayer* two) {
  const FlatInputs start = LoadTrace(face)[0].inputs;
  one->Fix(start);
  two->Fix(start);
  EXPECT_TRUE(SameBits(one->Outputs(), two->Outputs()));
  ForEachStep(face, kPeriod, [&](double time, const FlatInputs& inputs) {
    for (FacePlayer* player : {one, two}) {
      player->Fix(inputs);
      player->simulator().AdvanceTo(time + kPeriod / 2);
    }
    EXPECT_TRUE(SameBits(one->Outputs(), two->Outputs())) << time;
  });
}

// Compares in each step: what faces with feedthrough, in a row, show together
// with some outputs of the fused face, in its flat outputs from index `start`.
void ExpectSameInSteps(const std::string& face, int start, FacePlayer* fused,
                       FacePlayer* separate) {
  ForEachStep(face, kPeriod, [&](double time, const FlatInputs& inputs) {
    for (FacePlayer* player : {fused, separate}) {
      player->Fix(inputs);
      player->StepTo(time);
    }
    const VectorXd outputs = separate->Outputs();
    EXPECT_TRUE(
        SameBits(outputs, fused->Outputs().segment(start, outputs.size())))
        << time;
  });
}

TEST(WiringTest, SimulatedSensorInFrontOfARobotSide) {
  const FaceParams& params = GetFaceParams();
  DiagramBuilder<double> builder;
  auto* side = builder.AddSystem<RobotSideSystem>(params.robot_side(),
                                                  params.arm, params.q_start);
  auto* sensor = builder.AddSystem<ForceTorqueSensorSystem>(
      params.sensor, params.p_SE, params.sensor_seed);
  builder.Connect(side->get_robot_pose_output_port(),
                  sensor->get_robot_pose_input_port());
  builder.Connect(sensor->get_sensed_wrench_output_port(),
                  side->get_sensed_wrench_input_port());
  builder.Connect(sensor->get_ready_output_port(),
                  side->get_sensor_ready_input_port());
  auto* kinematics = builder.AddSystem<ArmKinematicsSystem>(params.arm);
  builder.Connect(kinematics->get_robot_velocity_output_port(),
                  sensor->get_robot_velocity_input_port());
  builder.ExportInput(sensor->get_reaction_input_port(), "reaction");
  for (const char* name : {"haptic_message", "robot_state", "force_selection",
                           "moment_selection"}) {
    builder.ExportInput(side->GetInputPort(name), name);
  }
  builder.ConnectInput("robot_state", kinematics->get_robot_state_input_port());
  builder.ExportInput(sensor->get_tare_input_port(), "tare");
  for (int i = 0; i < side->num_output_ports(); ++i) {
    builder.ExportOutput(side->get_output_port(i));
  }
  builder.ExportOutput(sensor->get_sensed_wrench_output_port());
  builder.ExportOutput(sensor->get_counters_output_port(), "sensor_counters");

  FacePlayer fused("RobotSideWithSensor");
  FacePlayer separate("RobotSideWithSensor", builder.Build());
  ExpectSameBetweenSteps("RobotSideWithSensor", &fused, &separate);
}

TEST(WiringTest, SimulatedDeviceInFrontOfAHapticSide) {
  DiagramBuilder<double> builder;
  auto* side = builder.AddSystem<HapticSideSystem>();
  auto* device = builder.AddSystem<SimulatedHapticDeviceSystem>(
      GetFaceParams().path, GetFaceParams().device);
  builder.Connect(side->get_device_wrench_output_port(),
                  device->get_device_wrench_input_port());
  builder.Connect(device->get_device_pose_output_port(),
                  side->get_device_pose_input_port());
  builder.Connect(device->get_device_velocity_output_port(),
                  side->get_device_velocity_input_port());
  builder.ExportInput(side->get_robot_message_input_port(), "robot_message");
  for (int i = 0; i < side->num_output_ports(); ++i) {
    builder.ExportOutput(side->get_output_port(i));
  }
  builder.ExportOutput(device->get_device_pose_output_port());
  builder.ExportOutput(device->get_bad_inputs_output_port(),
                       "device_bad_inputs");

  FacePlayer fused("HapticSideWithDevice");
  FacePlayer separate("HapticSideWithDevice", builder.Build());
  ExpectSameBetweenSteps("HapticSideWithDevice", &fused, &separate);
}

TEST(WiringTest, RobotSideOfSeparateFaces) {
  const FaceParams& params = GetFaceParams();
  DiagramBuilder<double> builder;
  auto* arm = builder.AddSystem<ArmKinematicsSystem>(params.arm);
  auto* proxy =
      builder.AddSystem<RobotSideProxySystem>(params.robot_side_proxy());
  auto* controller = builder.AddSystem<OperationalSpaceControllerSystem>(
      OperationalSpaceControllerParams<7>{}, params.arm);
  builder.Connect(arm->get_robot_pose_output_port(),
                  proxy->get_robot_pose_input_port());
  for (const char* name :
       {"motion_error", "rotation_error", "reference_force", "reference_moment",
        "proxy_velocity", "proxy_acceleration"}) {
    builder.Connect(proxy->GetOutputPort(name), controller->GetInputPort(name));
  }
  builder.ExportInput(proxy->get_haptic_message_input_port(), "haptic_message");
  builder.ExportInput(proxy->get_sensor_ready_input_port(), "sensor_ready");
  builder.ConnectInput("sensor_ready",
                       controller->get_sensor_ready_input_port());
  builder.ExportInput(arm->get_robot_state_input_port(), "robot_state");
  builder.ConnectInput("robot_state", controller->get_robot_state_input_port());
  for (const char* name :
       {"force_selection", "moment_selection", "sensed_wrench"}) {
    builder.ExportInput(proxy->GetInputPort(name), name);
    builder.ConnectInput(name, controller->GetInputPort(name));
  }
  builder.ExportOutput(controller->get_torque_output_port());

  FacePlayer fused("RobotSide");
  FacePlayer separate("RobotSide", builder.Build());
  ExpectSameInSteps(
      "RobotSide",
      SizeOf(RobotSide<SerialArm<7>>(GetFaceParams().robot_side()).layout()),
      &fused, &separate);
}

TEST(WiringTest, HapticSideOfSeparateFaces) {
  DiagramBuilder<double> builder;
  auto* proxy = builder.AddSystem<HapticSideProxySystem>();
  auto* controller = builder.AddSystem<HapticControllerSystem>();
  auto* sender = builder.AddSystem<PoseSenderSystem>();
  for (const char* name :
       {"reference_force", "reference_moment", "force_selection"}) {
    builder.Connect(proxy->GetOutputPort(name), controller->GetInputPort(name));
  }
  builder.ExportInput(proxy->get_robot_message_input_port(), "robot_message");
  builder.ExportInput(proxy->get_device_pose_input_port(), "device_pose");
  builder.ConnectInput("device_pose", sender->get_pose_input_port());
  builder.ExportInput(controller->get_device_velocity_input_port(),
                      "device_velocity");
  builder.ExportOutput(controller->get_device_wrench_output_port());
  builder.ExportOutput(sender->get_message_output_port());

  FacePlayer fused("HapticSide");
  FacePlayer separate("HapticSide", builder.Build());
  ExpectSameInSteps("HapticSide", SizeOf(HapticSide().layout()), &fused,
                    &separate);
}

// The instant of a step.

TEST(FeedthroughTest, AStepStandsForTheRestOfItsInstant) {
  FacePlayer dut("HapticSideProxy");
  dut.Fix(LoadTrace("HapticSideProxy")[0].inputs);
  const VectorXd before = dut.Outputs();
  dut.StepTo(0);
  // What the plant does within the instant makes no second step.
  const Pose moved{.p = {0, 0, 0.05}, .R = Matrix3d::Identity()};
  dut.Fix({{"device_pose", Flatten(moved)}});
  EXPECT_TRUE(SameBits(dut.Outputs(), before));
  dut.simulator().AdvanceTo(0.0005);
  // A second step's worth, at 20 N/s.
  EXPECT_NEAR(dut.Outputs().head<3>().norm(), 0.04, 1e-12);
}

TEST(FeedthroughTest, LookingChangesNothing) {
  const std::vector<TraceRow> rows = LoadTrace("OperationalSpaceController");
  FacePlayer watched("OperationalSpaceController");
  FacePlayer unwatched("OperationalSpaceController");
  for (const TraceRow& row : rows) {
    for (FacePlayer* player : {&watched, &unwatched}) player->Fix(row.inputs);
    while (watched.context().get_time() < row.time) {
      watched.Outputs();
      watched.simulator().AdvanceTo(
          std::min(watched.context().get_time() + 0.0004, row.time));
    }
    unwatched.simulator().AdvanceTo(row.time);
    ASSERT_TRUE(SameBits(watched.Outputs(), unwatched.Outputs())) << row.time;
  }
}

// Poses as Drake's type.

TEST(PoseTest, AreTheVerySameNumbersWhateverTheyAre) {
  for (const double scale : {1.0, 1.0 + 1e-9, -1.0, 0.0, kNan, kInfinity}) {
    const Pose X{.p = {1, 2, scale}, .R = scale * ExpRotation({0.1, 0.2, 0.3})};
    const RigidTransformd drake = ToRigidTransform(X);
    EXPECT_TRUE(SameBits(Flatten(ToPose(drake)), Flatten(X))) << scale;
  }
}

// The filter's optional prior.

TEST(ForceSpaceParticleFilterSystemTest, BadPriorLeavesTheOneBefore) {
  const std::vector<TraceRow> rows =
      LoadTraceWithoutBadInputs("ForceSpaceParticleFilter");
  FacePlayer good("ForceSpaceParticleFilter");
  const std::vector<VectorXd> expected = good.Play(rows, 0, rows.size());
  for (const Matrix3Xd& bad :
       {Matrix3Xd::Constant(3, 1, kNan).eval(), Matrix3Xd::Zero(3, 1).eval(),
        Matrix3Xd::Ones(3, 9).eval()}) {
    FacePlayer dut("ForceSpaceParticleFilter");
    for (std::size_t i = 0; i < rows.size(); ++i) {
      FlatInputs inputs = rows[i].inputs;
      if (i >= 5) {
        inputs.erase("prior");
        dut.face().GetInputPort("prior").FixValue(&dut.mutable_context(),
                                                  Value<Matrix3Xd>(bad));
      }
      dut.Fix(inputs);
      if (i > 0) dut.StepTo(rows[i].time);
      // But for the counters, the last port.
      const Eigen::Index size = expected[i].size() - 2;
      EXPECT_TRUE(SameBits(dut.Outputs().head(size), expected[i].head(size)))
          << "row " << i;
    }
    const auto& state =
        dut.context().get_abstract_state<ForceSpaceParticleFilterState>(0);
    EXPECT_EQ(state.bad_inputs, std::ssize(rows) - 5);
    EXPECT_EQ(state.updates, std::ssize(rows) - 1);
  }
}

// The history in a ring with the filter.

TEST(ContactHistorySystemTest, GivesAllNormalsToTheFilterInARing) {
  DiagramBuilder<double> builder;
  ContactHistoryParams params;
  params.min_age = 0;
  auto* filter = builder.AddSystem<ForceSpaceParticleFilterSystem>();
  auto* history = builder.AddSystem<ContactHistorySystem>(params);
  builder.Connect(history->get_prior_output_port(),
                  filter->get_prior_input_port());
  builder.Connect(filter->get_force_selection_output_port(),
                  history->get_force_selection_input_port());
  builder.Connect(filter->get_force_direction_output_port(),
                  history->get_force_direction_input_port());
  builder.ExportInput(history->get_robot_pose_input_port(), "robot_pose");
  builder.ExportInput(filter->get_sensed_force_input_port(), "sensed_force");
  builder.ExportInput(filter->get_motion_force_input_port(), "motion_force");
  const auto diagram = builder.Build();
  drake::systems::Simulator<double> simulator(*diagram);
  auto& context = simulator.get_mutable_context();
  const auto& output = history->get_prior_output_port();
  const auto go = [&](const Vector3d& p_BE, double force, double until) {
    diagram->GetInputPort("robot_pose")
        .FixValue(&context, RigidTransformd(p_BE));
    for (const char* name : {"sensed_force", "motion_force"}) {
      diagram->GetInputPort(name).FixValue(&context, Vector3d(0, 0, -force));
    }
    simulator.AdvanceTo(until);
    return output.Eval<Matrix3Xd>(history->GetMyContextFromRoot(context));
  };
  const Vector3d table(0.4, 0.1, 0.01);
  EXPECT_EQ(go(table, 10, 1).cols(), 0);
  EXPECT_EQ(go(table + Vector3d(0, 0, 0.1), 0, 2).cols(), 0);
  const Matrix3Xd prior = go(table, 0, 2.2);
  ASSERT_EQ(prior.cols(), 1);
  EXPECT_LT(prior(2, 0), -std::cos(5 * std::numbers::pi / 180));
  const auto& state = filter->GetMyContextFromRoot(context)
                          .get_abstract_state<ForceSpaceParticleFilterState>(0);
  ASSERT_EQ(state.num_priors, 1);
  EXPECT_LT((state.prior.col(0) - prior.col(0)).norm(), 1e-15);
}

// The channel between a sender's and a receiver's steps.

struct Received {
  std::int64_t sequence;
  double age;  // When the receiver sees it in a step.
};

std::vector<Received> Transmit(double rate, double delay, double duration) {
  DiagramBuilder<double> builder;
  PoseSenderParams params;
  params.rate = rate;
  auto* sender = builder.AddSystem<PoseSenderSystem>(params);
  auto* channel = builder.AddSystem<CommunicationChannelSystem>(
      CommunicationChannelParams{.delay = delay}, 0, rate, kPeriod);
  builder.Connect(sender->get_message_output_port(),
                  channel->get_message_input_port());
  builder.ExportInput(sender->get_pose_input_port(), "pose");
  const auto diagram = builder.Build();
  drake::systems::Simulator<double> simulator(*diagram);
  diagram->GetInputPort("pose").FixValue(&simulator.get_mutable_context(),
                                         RigidTransformd());
  const auto& context = channel->GetMyContextFromRoot(simulator.get_context());
  std::vector<Received> received;
  std::int64_t last = -1;
  for (int i = 0; i * kPeriod < duration; ++i) {
    // The steps at this time are still to come.
    simulator.AdvanceTo(i * kPeriod);
    const auto& message =
        channel->get_message_output_port().Eval<Message>(context);
    if (message.sequence == last) continue;
    last = message.sequence;
    received.push_back({last, i * kPeriod - message.send_time});
  }
  return received;
}

TEST(CommunicationChannelSystemTest, DelaysExactlyAsAsked) {
  for (const double rate : {5.0, 50.0, 500.0}) {
    for (const double delay : {0.0, 0.05, 0.15, 0.35}) {
      const std::vector<Received> received = Transmit(rate, delay, delay + 0.6);
      ASSERT_GE(std::ssize(received), 0.6 * rate - 1);
      for (std::size_t k = 0; k < received.size(); ++k) {
        EXPECT_EQ(received[k].sequence, static_cast<std::int64_t>(k));
        // One step after it was made, and the delay.
        EXPECT_NEAR(received[k].age, delay + kPeriod, 1e-9);
      }
    }
  }
}

// At these rates messages do not fall on the sides' steps.
TEST(CommunicationChannelSystemTest, MissesNoMessageAtOddRates) {
  for (const double rate : {16.0, 60.0, 80.0, 300.0}) {
    const std::vector<Received> received = Transmit(rate, 0, 1);
    ASSERT_GE(std::ssize(received), rate - 1);
    for (std::size_t k = 0; k < received.size(); ++k) {
      EXPECT_EQ(received[k].sequence, static_cast<std::int64_t>(k));
      EXPECT_LT(received[k].age, 0.0021);
    }
  }
}

// A message of another kind than its receiver is made for: the diagram is wired
// wrong, and says so at the first step.

TEST(MessageKindTest, AnotherOneIsAnErrorThatNamesThePort) {
  const FaceParams& params = GetFaceParams();
  const auto error = [](drake::systems::System<double>* face,
                        const std::string& input, const Message& message) {
    face->set_name("dut");
    drake::systems::Simulator<double> simulator(*face);
    auto& context = simulator.get_mutable_context();
    for (int i = 0; i < face->num_input_ports(); ++i) {
      const auto& port = face->get_input_port(i);
      if (port.get_data_type() == drake::systems::kVectorValued) {
        port.FixValue(&context, VectorXd::Zero(port.size()).eval());
      }
    }
    face->GetInputPort(input).FixValue(&context, Value<Message>(message));
    try {
      simulator.AdvanceTo(0.05);
    } catch (const std::logic_error& thrown) {
      return std::string(thrown.what());
    }
    return std::string("no exception");
  };
  const Message pose = ToMessage(PoseMessage{.sequence = 0, .pose = {}});
  const Message force = ToMessage(ForceMessage{.sequence = 0});
  RobotSideSystem robot(params.robot_side(), params.arm);
  EXPECT_EQ(error(&robot, "haptic_message", pose), "no exception");
  EXPECT_EQ(error(&robot, "haptic_message", force),
            "dut: input port `haptic_message` expected PoseMessage, got "
            "ForceMessage");
  HapticSideParams haptic_params;
  haptic_params.scheme = SchemeOf<PositionForceScheme>;
  HapticSideSystem haptic(haptic_params,
                          HapticSideDevice{.params = {}, .path = params.path});
  EXPECT_EQ(error(&haptic, "robot_message", force), "no exception");
  EXPECT_EQ(error(&haptic, "robot_message", pose),
            "dut: input port `robot_message` expected ForceMessage, got "
            "PoseMessage");
  CommunicationChannelSystem channel;
  EXPECT_EQ(error(&channel, "message", force),
            "dut: input port `message` expected PoseMessage, got "
            "ForceMessage");
  // Nothing has come yet: that is of no kind.
  EXPECT_EQ(error(&channel, "message", {}), "no exception");
}

// The side's own filters are of use where nobody else knows the contact.

TEST(RobotSideSystemTest, FiltersRestWhereTheSelectionComesFromOutside) {
  const FaceParams& params = GetFaceParams();
  for (const bool outside : {false, true}) {
    const RobotSideSystem dut(params.robot_side(), params.arm);
    drake::systems::Simulator<double> simulator(dut);
    auto& context = simulator.get_mutable_context();
    VectorXd x = VectorXd::Zero(14);
    x.head<7>() = params.q_start;
    dut.get_robot_state_input_port().FixValue(&context, x);
    dut.get_sensed_wrench_input_port().FixValue(
        &context, Vector6(Vector6::Unit(2) * -15));
    if (outside) {
      dut.get_force_selection_input_port().FixValue(
          &context, VectorXd::Unit(9, 0).eval());
    }
    simulator.AdvanceTo(0.5);
    const auto& memory = context.get_abstract_state<RobotSideMemory>(0);
    EXPECT_EQ(memory.side.perception.force.filter.updates > 0, !outside);
    EXPECT_NEAR(memory.side.output.selections.force(0, 0), outside, 1e-9);
    EXPECT_EQ(dut.get_dimension_output_port().Eval(context)[0],
              memory.side.perception.force.filter.dimension);
  }
}

// Typed getters are the ports of their names.

#define EXPECT_INPUT(dut, name) \
  EXPECT_EQ(&(dut).get_##name##_input_port(), &(dut).GetInputPort(#name))
#define EXPECT_OUTPUT(dut, name) \
  EXPECT_EQ(&(dut).get_##name##_output_port(), &(dut).GetOutputPort(#name))

TEST(GettersTest, Proxies) {
  const RobotSideProxySystem robot;
  EXPECT_INPUT(robot, haptic_message);
  EXPECT_INPUT(robot, robot_pose);
  EXPECT_INPUT(robot, force_selection);
  EXPECT_INPUT(robot, moment_selection);
  EXPECT_INPUT(robot, sensed_wrench);
  EXPECT_INPUT(robot, sensor_ready);
  EXPECT_OUTPUT(robot, motion_error);
  EXPECT_OUTPUT(robot, rotation_error);
  EXPECT_OUTPUT(robot, reference_force);
  EXPECT_OUTPUT(robot, reference_moment);
  EXPECT_OUTPUT(robot, proxy_pose);
  EXPECT_OUTPUT(robot, link_status);
  EXPECT_OUTPUT(robot, proxy_velocity);
  EXPECT_OUTPUT(robot, proxy_acceleration);
  const HapticSideProxySystem haptic;
  EXPECT_INPUT(haptic, robot_message);
  EXPECT_INPUT(haptic, device_pose);
  EXPECT_OUTPUT(haptic, reference_force);
  EXPECT_OUTPUT(haptic, reference_moment);
  EXPECT_OUTPUT(haptic, proxy_pose);
  EXPECT_OUTPUT(haptic, force_selection);
  EXPECT_OUTPUT(haptic, link_status);
}

TEST(GettersTest, ControlAndPerception) {
  const OperationalSpaceControllerSystem controller({}, GetFaceParams().arm);
  EXPECT_INPUT(controller, robot_state);
  EXPECT_INPUT(controller, motion_error);
  EXPECT_INPUT(controller, rotation_error);
  EXPECT_INPUT(controller, reference_force);
  EXPECT_INPUT(controller, reference_moment);
  EXPECT_INPUT(controller, force_selection);
  EXPECT_INPUT(controller, moment_selection);
  EXPECT_INPUT(controller, sensed_wrench);
  EXPECT_INPUT(controller, proxy_velocity);
  EXPECT_INPUT(controller, proxy_acceleration);
  EXPECT_INPUT(controller, sensor_ready);
  EXPECT_OUTPUT(controller, torque);
  EXPECT_OUTPUT(controller, motion_force);
  EXPECT_OUTPUT(controller, contact_force);
  EXPECT_OUTPUT(controller, observed_energy);
  EXPECT_OUTPUT(controller, injected_damping);
  const HapticControllerSystem haptic;
  EXPECT_INPUT(haptic, reference_force);
  EXPECT_INPUT(haptic, reference_moment);
  EXPECT_INPUT(haptic, device_velocity);
  EXPECT_INPUT(haptic, force_selection);
  EXPECT_OUTPUT(haptic, device_wrench);
  const ArmKinematicsSystem arm(GetFaceParams().arm);
  EXPECT_INPUT(arm, robot_state);
  EXPECT_OUTPUT(arm, robot_pose);
  EXPECT_OUTPUT(arm, robot_velocity);
  const ForceSpaceParticleFilterSystem filter;
  EXPECT_INPUT(filter, sensed_force);
  EXPECT_INPUT(filter, velocity);
  EXPECT_INPUT(filter, motion_force);
  EXPECT_INPUT(filter, contact_force);
  EXPECT_INPUT(filter, prior);
  EXPECT_OUTPUT(filter, force_selection);
  EXPECT_OUTPUT(filter, dimension);
  EXPECT_OUTPUT(filter, particles);
  EXPECT_OUTPUT(filter, force_direction);
  EXPECT_OUTPUT(filter, direction_uncertainty);
  EXPECT_OUTPUT(filter, dimension_confidence);
  const ContactHistorySystem history;
  EXPECT_INPUT(history, robot_pose);
  EXPECT_INPUT(history, force_selection);
  EXPECT_INPUT(history, force_direction);
  EXPECT_OUTPUT(history, prior);
  const WindowMeanSystem mean;
  EXPECT_INPUT(mean, value);
  EXPECT_OUTPUT(mean, mean);
}

TEST(GettersTest, LinkAndSimulation) {
  const PoseSenderSystem sender;
  EXPECT_INPUT(sender, pose);
  EXPECT_INPUT(sender, force_selection);
  EXPECT_INPUT(sender, moment_selection);
  EXPECT_OUTPUT(sender, message);
  const CommunicationChannelSystem channel;
  EXPECT_INPUT(channel, message);
  EXPECT_OUTPUT(channel, message);
  const ForceTorqueSensorSystem sensor;
  EXPECT_INPUT(sensor, reaction);
  EXPECT_INPUT(sensor, robot_pose);
  EXPECT_INPUT(sensor, tare);
  EXPECT_OUTPUT(sensor, sensed_wrench);
  EXPECT_OUTPUT(sensor, ready);
  const SimulatedHapticDeviceSystem device(GetFaceParams().path);
  EXPECT_INPUT(device, device_wrench);
  EXPECT_OUTPUT(device, device_pose);
  EXPECT_OUTPUT(device, device_velocity);
  EXPECT_OUTPUT(device, hand_position);
}

TEST(GettersTest, Sides) {
  const FaceParams& params = GetFaceParams();
  for (const bool simulated : {false, true}) {
    const RobotSideSystem robot(
        params.robot_side(), params.arm, params.q_start,
        simulated ? std::optional(params.robot_side_sensor()) : std::nullopt);
    EXPECT_INPUT(robot, haptic_message);
    EXPECT_INPUT(robot, robot_state);
    EXPECT_INPUT(robot, force_selection);
    EXPECT_INPUT(robot, moment_selection);
    EXPECT_OUTPUT(robot, signals);
    EXPECT_OUTPUT(robot, torque);
    EXPECT_OUTPUT(robot, robot_pose);
    EXPECT_OUTPUT(robot, message);
    EXPECT_OUTPUT(robot, mean_sensed_force);
    EXPECT_OUTPUT(robot, mean_velocity);
    EXPECT_OUTPUT(robot, mean_motion_force);
    EXPECT_OUTPUT(robot, mean_contact_force);
    EXPECT_OUTPUT(robot, force_selection);
    EXPECT_OUTPUT(robot, dimension);
    if (simulated) {
      EXPECT_INPUT(robot, reaction);
      EXPECT_INPUT(robot, tare);
      EXPECT_OUTPUT(robot, sensed_wrench);
      EXPECT_THROW(robot.get_sensed_wrench_input_port(), std::exception);
    } else {
      EXPECT_INPUT(robot, sensed_wrench);
      EXPECT_INPUT(robot, sensor_ready);
      EXPECT_THROW(robot.get_reaction_input_port(), std::exception);
      EXPECT_THROW(robot.get_sensed_wrench_output_port(), std::exception);
    }
    const HapticSideSystem haptic(
        {}, simulated ? std::optional(HapticSideDevice{.params = params.device,
                                                       .path = params.path})
                      : std::nullopt);
    EXPECT_INPUT(haptic, robot_message);
    EXPECT_OUTPUT(haptic, signals);
    EXPECT_OUTPUT(haptic, device_wrench);
    EXPECT_OUTPUT(haptic, message);
    if (simulated) {
      EXPECT_OUTPUT(haptic, device_pose);
      EXPECT_THROW(haptic.get_device_pose_input_port(), std::exception);
      EXPECT_THROW(haptic.get_device_velocity_input_port(), std::exception);
    } else {
      EXPECT_INPUT(haptic, device_pose);
      EXPECT_INPUT(haptic, device_velocity);
      EXPECT_THROW(haptic.get_device_pose_output_port(), std::exception);
    }
  }
}

// Errors at construction.

TEST(ErrorsTest, NameWhatIsWrong) {
  const FaceParams& params = GetFaceParams();
  const auto expect = [](const std::string& beginning,
                         const std::function<void()>& make) {
    const std::string message = InvalidArgument(make);
    EXPECT_EQ(message.substr(0, beginning.size()), beginning);
  };
  expect("WindowMean: field `window` expected", [] { WindowMeanSystem(0.0); });
  expect("WindowMeanSystem: field `period` expected",
         [] { WindowMeanSystem(0.1, -1.0); });
  for (const double bad : {0.0, -1.0, kNan, kInfinity}) {
    expect("CommunicationChannelSystem: field `rate` expected",
           [bad] { CommunicationChannelSystem({}, 0, bad); });
    expect("CommunicationChannelSystem: field `period` expected",
           [bad] { CommunicationChannelSystem({}, 0, 50, bad); });
  }
  expect("ForceTorqueSensorSystem: field `p_SE` expected",
         [] { ForceTorqueSensorSystem({}, Vector3d(0, kNan, 0)); });
  expect("ArmModelParams: field `mass[0]` expected",
         [] { ArmKinematicsSystem{ArmModelParams<7>{}}; });
  expect("RobotSideSystem: field `q_start` expected", [&params] {
    RobotSideSystem({}, params.arm, Vector7::Constant(kNan));
  });
  RobotSideSensor sensor = params.robot_side_sensor();
  sensor.p_SE[1] = kInfinity;
  expect("RobotSideSystem: field `p_SE` expected",
         [&] { RobotSideSystem({}, params.arm, std::nullopt, sensor); });
  sensor = params.robot_side_sensor();
  sensor.params.period = 0.002;
  expect(
      "RobotSideSystem: field `sensor.period` expected the side's own period, "
      "got 0.002",
      [&] { RobotSideSystem({}, params.arm, std::nullopt, sensor); });
  HapticSideDevice device{.params = params.device, .path = params.path};
  device.params.period = 0.002;
  expect(
      "HapticSideSystem: field `device.period` expected the side's own period, "
      "got 0.002",
      [&] { HapticSideSystem({}, device); });
}

}  // namespace
}  // namespace dual_proxy
