// SPDX-License-Identifier: BSD-3-Clause
// What single C++ faces do: the algorithm's own numbers, wirings, errors.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <drake/systems/framework/diagram_builder.h>
#include <gtest/gtest.h>

#include "dual_proxy/baselines/position_force_haptic_side_system.h"
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

// What a port of counters shows.
VectorXd Counts(std::initializer_list<std::int64_t> counters) {
  VectorXd result(static_cast<Eigen::Index>(counters.size()));
  std::copy(counters.begin(), counters.end(), result.begin());
  return result;
}

// The face gives the same bits, step by step, as the algorithm alone does for
// the inputs of the face's trace. `step(time, inputs)` makes one step of the
// algorithm and returns what all output ports should show.
void ExpectTheAlgorithm(
    const std::string& face,
    const std::function<VectorXd(double, const FlatInputs&)>& step,
    double period = kPeriod) {
  FacePlayer dut(face);
  ForEachStep(face, period, [&](double time, const FlatInputs& inputs) {
    dut.Fix(inputs);
    dut.StepTo(time);
    EXPECT_TRUE(SameBits(dut.Outputs(), step(time, inputs))) << time;
  });
}

TEST(AlgorithmTest, RobotSideProxy) {
  const RobotSideProxy algorithm(GetFaceParams().robot_side_proxy());
  RobotSideProxyState state = algorithm.MakeState();
  ExpectTheAlgorithm("RobotSideProxy", [&](double time, const FlatInputs& in) {
    RobotSideProxyInput input;
    input.message = PoseMessageFromFlat(in.at("haptic_message"));
    input.X_BE = PoseFromFlat(in.at("robot_pose"));
    input.force_selection = MatrixFromFlat(in.at("force_selection"));
    input.moment_selection = MatrixFromFlat(in.at("moment_selection"));
    input.has_sensed = true;
    input.sensed_force = in.at("sensed_wrench").head<3>();
    input.sensed_moment = in.at("sensed_wrench").tail<3>();
    input.sensor_ready = in.at("sensor_ready")(0) > 0.5;
    algorithm.Update(time, input, &state);
    const RobotSideProxyOutput& output = state.output;
    return Concatenate({output.motion_error, output.rotation_error,
                        output.reference_force, output.reference_moment,
                        Flatten(output.proxy_pose),
                        LinkStatusVector(state.link), output.proxy_velocity,
                        output.proxy_acceleration});
  });
  EXPECT_GT(state.output.reference_force.norm(), 0.1);
}

TEST(AlgorithmTest, HapticSideProxy) {
  const HapticSideProxy algorithm{HapticSideProxyParams{}};
  HapticSideProxyState state = algorithm.MakeState();
  ExpectTheAlgorithm("HapticSideProxy", [&](double time, const FlatInputs& in) {
    algorithm.Update(time,
                     {.message = PoseMessageFromFlat(in.at("robot_message")),
                      .X_DH = PoseFromFlat(in.at("device_pose"))},
                     &state);
    const HapticSideProxyOutput& output = state.output;
    return Concatenate({output.reference_force, output.reference_moment,
                        Flatten(output.proxy_pose),
                        Flatten(output.force_selection),
                        LinkStatusVector(state.link)});
  });
  EXPECT_GT(state.output.reference_force.norm(), 0.1);
}

TEST(AlgorithmTest, ForceSpaceParticleFilter) {
  const ForceSpaceParticleFilterParams& params = GetFaceParams().filter;
  const ForceSpaceParticleFilter algorithm(params);
  ForceSpaceParticleFilterState state =
      algorithm.MakeState(GetFaceParams().filter_seed);
  ExpectTheAlgorithm(
      "ForceSpaceParticleFilter",
      [&](double, const FlatInputs& in) {
        algorithm.SetPrior(Vector3d(in.at("prior")), &state);
        algorithm.Update(in.at("sensed_force"), in.at("velocity"),
                         in.at("motion_force"), in.at("contact_force"), &state);
        Vector3d direction = Vector3d::Zero();
        if (state.dimension > 0) direction = state.singular_vectors.col(0);
        return Concatenate(
            {Flatten(state.force_selection),
             VectorXd::Constant(1, state.dimension),
             Matrix3Xd(state.particles).reshaped(), direction,
             Eigen::Vector2d(state.direction_uncertainty,
                             state.dimension_confidence),
             Counts({state.bad_inputs, state.all_weights_zero})});
      },
      params.period);
  EXPECT_EQ(state.dimension, 1);
}

TEST(AlgorithmTest, ContactHistory) {
  const ContactHistoryParams& params = GetFaceParams().history;
  const ContactHistory algorithm(params);
  ContactHistoryState state = algorithm.MakeState();
  ExpectTheAlgorithm(
      "ContactHistory",
      [&](double, const FlatInputs& in) {
        const Vector3d p_BE = PoseFromFlat(in.at("robot_pose")).p;
        algorithm.UpdateFromSelection(p_BE,
                                      MatrixFromFlat(in.at("force_selection")),
                                      in.at("force_direction"), &state);
        const RememberedContacts prior = algorithm.Lookup(p_BE, state);
        return prior.normals.cols() > 0 ? VectorXd(prior.normals.col(0))
                                        : VectorXd(VectorXd::Zero(3));
      },
      params.period);
  EXPECT_EQ(state.bad_inputs, 3);
}

TEST(AlgorithmTest, OperationalSpaceController) {
  const OperationalSpaceController algorithm;
  const ArmModel arm(GetFaceParams().arm);
  OperationalSpaceControllerState state = algorithm.MakeState();
  ExpectTheAlgorithm(
      "OperationalSpaceController", [&](double, const FlatInputs& in) {
        OperationalSpaceControllerInput input;
        input.q = in.at("robot_state").head<7>();
        input.v = in.at("robot_state").tail<7>();
        Pose X_BE;
        arm.Calc(input.q, input.v, &X_BE, &input.model);
        input.motion_error = in.at("motion_error");
        input.rotation_error = in.at("rotation_error");
        input.proxy_velocity = in.at("proxy_velocity");
        input.proxy_acceleration = in.at("proxy_acceleration");
        input.reference_force = in.at("reference_force");
        input.reference_moment = in.at("reference_moment");
        input.force_selection = MatrixFromFlat(in.at("force_selection"));
        input.moment_selection = MatrixFromFlat(in.at("moment_selection"));
        input.sensed_wrench = in.at("sensed_wrench");
        input.sensor_ready = in.at("sensor_ready")(0) > 0.5;
        const OperationalSpaceControllerOutput output =
            algorithm.Update(input, &state);
        return Concatenate({output.torque, output.motion_force,
                            output.contact_force,
                            VectorXd::Constant(1, output.observed_energy),
                            VectorXd::Constant(1, output.injected_damping)});
      });
  EXPECT_GT(state.torque.norm(), 1);
}

TEST(AlgorithmTest, HapticController) {
  const HapticController algorithm;
  HapticControllerState state = algorithm.MakeState();
  ExpectTheAlgorithm("HapticController", [&](double, const FlatInputs& in) {
    return algorithm.Update(in.at("reference_force"), in.at("reference_moment"),
                            in.at("device_velocity"),
                            MatrixFromFlat(in.at("force_selection")), &state);
  });
  EXPECT_GT(state.bad_inputs, 0);
}

TEST(AlgorithmTest, PositionForceHapticSide) {
  const PositionForceHapticSide algorithm;
  PositionForceHapticSideState state = algorithm.MakeState();
  ExpectTheAlgorithm(
      "PositionForceHapticSide", [&](double time, const FlatInputs& in) {
        algorithm.Update(time, ForceMessageFromFlat(in.at("force_message")),
                         &state);
        const LinkMonitorState& link = state.link;
        return Concatenate(
            {state.reference_force, Vector3d::Zero(), LinkStatusVector(link),
             Counts({link.dropped + link.bad_inputs, link.bad_inputs, link.gaps,
                     link.spikes, link.losses})});
      });
  EXPECT_GT(state.reference_force.norm(), 0.1);
}

TEST(AlgorithmTest, PoseSender) {
  const PoseSender algorithm{PoseSenderParams{}};
  PoseSenderState state = algorithm.MakeState();
  ExpectTheAlgorithm("PoseSender", [&](double time, const FlatInputs& in) {
    return Flatten(algorithm.Update(time, PoseFromFlat(in.at("pose")),
                                    MatrixFromFlat(in.at("force_selection")),
                                    MatrixFromFlat(in.at("moment_selection")),
                                    &state));
  });
  EXPECT_GT(state.message.sequence, 3);
}

TEST(AlgorithmTest, WindowMean) {
  const WindowMean<3> algorithm(GetFaceParams().window);
  WindowMeanState<3> state = algorithm.MakeState();
  ExpectTheAlgorithm("WindowMean", [&](double time, const FlatInputs& in) {
    algorithm.Update(time, in.at("value"), &state);
    return state.mean;
  });
  EXPECT_EQ(state.window, 2);
}

TEST(AlgorithmTest, ArmKinematics) {
  const ArmModel algorithm(GetFaceParams().arm);
  ExpectTheAlgorithm("ArmKinematics", [&](double, const FlatInputs& in) {
    const Vector7 v = in.at("robot_state").tail<7>();
    Pose X_BE;
    ModelTerms terms;
    algorithm.Calc(in.at("robot_state").head<7>(), v, &X_BE, &terms);
    return Concatenate({Flatten(X_BE), RobotSide::CalcTwist(terms.J_BE, v)});
  });
}

TEST(AlgorithmTest, ForceTorqueSensor) {
  const FaceParams& params = GetFaceParams();
  const ForceTorqueSensor algorithm(params.sensor);
  ForceTorqueSensorState state = algorithm.MakeState(params.sensor_seed);
  ExpectTheAlgorithm(
      "ForceTorqueSensor", [&](double time, const FlatInputs& in) {
        // A simulated plant has no reaction before its first step.
        if (time > 0) {
          algorithm.Update({.measured = in.at("reaction"),
                            .X_BE = PoseFromFlat(in.at("robot_pose")),
                            .v_BE = in.at("robot_velocity"),
                            .p_SE = params.p_SE,
                            .tare = in.at("tare")(0) > 0.5},
                           &state);
        }
        return Concatenate(
            {state.adapter.wrench,
             Eigen::VectorXd::Constant(1, state.adapter.ready),
             Counts({state.adapter.bad_inputs, state.adapter.tares_refused})});
      });
  // One is asked for, and one after a value that is not finite.
  EXPECT_EQ(state.adapter.tares, 2);
}

TEST(AlgorithmTest, SimulatedHapticDevice) {
  const OperatorPath path(GetFaceParams().path);
  const SimulatedHapticDevice algorithm(GetFaceParams().device);
  SimulatedHapticDeviceState state = algorithm.MakeState();
  ExpectTheAlgorithm(
      "SimulatedHapticDevice", [&](double time, const FlatInputs& in) {
        const OperatorPathSample sample = path.Calc(time);
        algorithm.Update({.p = sample.position, .R = sample.rotation},
                         sample.velocity, in.at("device_wrench"), &state);
        return Concatenate({Flatten(state.read_pose), state.read_velocity,
                            state.intended.p, Counts({state.bad_inputs})});
      });
  EXPECT_GT(state.read_pose.p.norm(), 1e-4);
}

// Compares a RobotSide with the algorithm; `and_more` is what its ports show at
// the end.
void ExpectTheRobotSide(
    const std::string& face, const RobotSideParams& params,
    const std::function<VectorXd(const RobotSideOutput&)>& and_more) {
  const RobotSide algorithm(params);
  const ArmModel arm(GetFaceParams().arm);
  RobotSideState state = algorithm.MakeState();
  ExpectTheAlgorithm(face, [&](double time, const FlatInputs& in) {
    RobotSideInput input;
    input.message = PoseMessageFromFlat(in.at("haptic_message"));
    input.q = in.at("robot_state").head<7>();
    input.v = in.at("robot_state").tail<7>();
    arm.Calc(input.q, input.v, &input.X_BE, &input.model);
    input.force_selection = MatrixFromFlat(in.at("force_selection"));
    input.moment_selection = MatrixFromFlat(in.at("moment_selection"));
    input.sensed_wrench = in.at("sensed_wrench");
    input.sensor_ready = in.at("sensor_ready")(0) > 0.5;
    algorithm.Update(time, input, &state);
    const RobotSideOutput& output = state.output;
    VectorXd signals(RobotSide::OutputSize());
    RobotSide::WriteVector(output, signals);
    const FilterMeans& means = output.filter_means;
    return Concatenate({signals, output.controller.torque, Flatten(output.X_BE),
                        Flatten(output.message), Flatten(output.force_message),
                        means.sensed_force, means.velocity, means.motion_force,
                        means.contact_force, and_more(output)});
  });
  EXPECT_GT(state.output.bad_inputs, 0);
}

TEST(AlgorithmTest, RobotSide) {
  ExpectTheRobotSide("RobotSide", GetFaceParams().robot_side(),
                     [](const RobotSideOutput&) { return VectorXd(0); });
}

TEST(AlgorithmTest, RobotSideWithAngularFilter) {
  const FaceParams& params = GetFaceParams();
  ExpectTheRobotSide(
      "RobotSideWithAngularFilter", params.robot_side(params.filter.period),
      [](const RobotSideOutput& output) {
        const auto& means = output.angular_filter_means;
        EXPECT_NE(means.sensed_moment, Vector3d::Zero());
        return Concatenate({means.sensed_moment, means.angular_velocity,
                            means.motion_moment, means.contact_moment});
      });
}

TEST(AlgorithmTest, HapticSide) {
  const HapticSide algorithm;
  HapticSideState state = algorithm.MakeState();
  ExpectTheAlgorithm("HapticSide", [&](double time, const FlatInputs& in) {
    algorithm.Update(time,
                     {.message = PoseMessageFromFlat(in.at("robot_message")),
                      .X_DH = PoseFromFlat(in.at("device_pose")),
                      .device_velocity = in.at("device_velocity")},
                     &state);
    VectorXd signals(HapticSide::OutputSize());
    HapticSide::WriteVector(state.output, signals);
    return Concatenate(
        {signals, state.output.device_wrench, Flatten(state.output.message)});
  });
  EXPECT_GT(state.output.bad_inputs, 0);
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
      OperationalSpaceControllerParams{}, params.arm);
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
  ExpectSameInSteps("RobotSide", RobotSide::OutputSize(), &fused, &separate);
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
  ExpectSameInSteps("HapticSide", HapticSide::OutputSize(), &fused, &separate);
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
  auto* channel = builder.AddSystem<CommunicationChannelSystem<PoseMessage>>(
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
        channel->get_message_output_port().Eval<PoseMessage>(context);
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

// Typed getters are the ports of their names.

#define EXPECT_INPUT(dut, name) \
  EXPECT_EQ(&(dut).get_##name##_input_port(), &(dut).GetInputPort(#name))
#define EXPECT_OUTPUT(dut, name) \
  EXPECT_EQ(&(dut).get_##name##_output_port(), &(dut).GetOutputPort(#name))

TEST(GettersTest, ProxiesAndBaseline) {
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
  const PositionForceHapticSideSystem baseline;
  EXPECT_INPUT(baseline, force_message);
  EXPECT_OUTPUT(baseline, device_wrench);
  EXPECT_OUTPUT(baseline, link_status);
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
  const CommunicationChannelSystem<ForceMessage> channel;
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
    EXPECT_OUTPUT(robot, force_message);
    EXPECT_OUTPUT(robot, mean_sensed_force);
    EXPECT_OUTPUT(robot, mean_velocity);
    EXPECT_OUTPUT(robot, mean_motion_force);
    EXPECT_OUTPUT(robot, mean_contact_force);
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
           [bad] { CommunicationChannelSystem<PoseMessage>({}, 0, bad); });
    expect("CommunicationChannelSystem: field `period` expected",
           [bad] { CommunicationChannelSystem<ForceMessage>({}, 0, 50, bad); });
    expect("PositionForceHapticSideSystem: field `period` expected",
           [bad] { PositionForceHapticSideSystem({}, bad); });
  }
  expect("ForceTorqueSensorSystem: field `p_SE` expected",
         [] { ForceTorqueSensorSystem({}, Vector3d(0, kNan, 0)); });
  expect("ArmModelParams: field `mass[0]` expected",
         [] { ArmKinematicsSystem{ArmModelParams{}}; });
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
