// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/faces/block_system.h"

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <drake/common/value.h>
#include <drake/multibody/math/spatial_algebra.h>
#include <drake/systems/analysis/simulator.h>
#include <drake/systems/framework/diagram_builder.h>
#include <drake/systems/primitives/constant_vector_source.h>
#include <gtest/gtest.h>

#include "dual_proxy/faces/example_blocks.h"
#include "dual_proxy/faces/systems.h"
#include "example_inputs.h"

namespace dual_proxy {
namespace {

using drake::math::RigidTransformd;
using drake::systems::Context;
using drake::systems::Simulator;
using Eigen::Vector3d;

// Fixes all inputs to what ExampleInputs gives, but for messages.
void FixInputs(const BlockSystem& system, double value,
               Context<double>* context) {
  for (const PortInfo& info : ListInputs(system.block())) {
    const auto& port = system.GetInputPort(info.name);
    switch (info.type) {
      case PortType::kVector:
        port.FixValue(context,
                      Eigen::VectorXd::Constant(info.size, value).eval());
        break;
      case PortType::kPose:
        port.FixValue(context, RigidTransformd(Vector3d::Constant(value)));
        break;
      case PortType::kReaction:
        port.FixValue(
            context,
            std::vector<drake::multibody::SpatialForce<double>>{
                {Vector3d::Constant(value), Vector3d::Constant(value)}});
        break;
      default:
        break;
    }
  }
}

Eigen::VectorXd EvalAll(const BlockSystem& system,
                        const Context<double>& context) {
  std::vector<double> values;
  for (const PortInfo& info : ListOutputs(system.block())) {
    if (info.type != PortType::kVector) continue;
    const auto value = system.GetOutputPort(info.name).Eval(context);
    values.insert(values.end(), value.begin(), value.end());
  }
  return Eigen::VectorXd::Map(values.data(), std::ssize(values));
}

TEST(BlockSystemTest, HasThePortsOfItsBlock) {
  for (const BlockPtr& block : MakeExampleBlocks()) {
    const BlockSystem dut(block);
    const std::vector<PortInfo> inputs = ListInputs(*block);
    ASSERT_EQ(dut.num_input_ports(), std::ssize(inputs));
    for (int i = 0; i < dut.num_input_ports(); ++i) {
      EXPECT_EQ(dut.get_input_port(i).get_name(), inputs[i].name);
    }
    const std::vector<PortInfo> outputs = ListOutputs(*block);
    ASSERT_EQ(dut.num_output_ports(), std::ssize(outputs));
    for (int i = 0; i < dut.num_output_ports(); ++i) {
      EXPECT_EQ(dut.get_output_port(i).get_name(), outputs[i].name);
      EXPECT_EQ(dut.HasDirectFeedthrough(i),
                block->timing().feedthrough || !outputs[i].direct.empty())
          << outputs[i].name;
    }
  }
}

// Reset, a clone, and another clone that gets other inputs on the way.
TEST(BlockSystemTest, MemoryIsInTheContext) {
  int differing = 0;
  for (const BlockPtr& block : MakeExampleBlocks()) {
    if (block->timing().period == 0) continue;
    const double end = 40 * block->timing().period + block->timing().offset;
    const BlockSystem dut(block);
    Simulator<double> first(dut);
    FixInputs(dut, 0.01, &first.get_mutable_context());
    first.AdvanceTo(0.5125 * end);
    Simulator<double> twin(dut, first.get_context().Clone());
    Simulator<double> other(dut, first.get_context().Clone());
    FixInputs(dut, 0.02, &other.get_mutable_context());
    other.AdvanceTo(end);
    first.AdvanceTo(end);
    twin.AdvanceTo(end);
    const Eigen::VectorXd expected = EvalAll(dut, first.get_context());
    EXPECT_EQ(EvalAll(dut, twin.get_context()), expected) << block->name();
    differing += EvalAll(dut, other.get_context()) != expected ? 1 : 0;
    Context<double>& context = first.get_mutable_context();
    dut.SetDefaultContext(&context);
    context.SetTime(0);
    first.Initialize();
    first.AdvanceTo(end);
    EXPECT_EQ(EvalAll(dut, context), expected) << block->name();
  }
  // The others need messages, or more force, to show anything.
  EXPECT_GE(differing, 8);
}

TEST(BlockSystemTest, WithFeedthroughAStepStandsForTheRestOfItsInstant) {
  const HapticSideProxySystem dut;
  Simulator<double> simulator(dut);
  Context<double>& context = simulator.get_mutable_context();
  const auto& input = dut.GetInputPort("device_pose");
  input.FixValue(&context, RigidTransformd());
  const auto force = [&] {
    return Vector3d(dut.GetOutputPort("reference_force").Eval(context));
  };
  simulator.AdvancePendingEvents();
  const Vector3d before = force();
  input.FixValue(&context, RigidTransformd(Vector3d(0, 0, 0.05)));
  EXPECT_EQ(force(), before);
}

// The message of what is thrown, "" if nothing is.
template <typename Function>
std::string ErrorOf(Function function) {
  try {
    function();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

testing::AssertionResult Names(const std::string& error,
                               const std::vector<std::string>& words) {
  for (const std::string& word : words) {
    if (error.find(word) == std::string::npos) {
      return testing::AssertionFailure() << "no " << word << " in: " << error;
    }
  }
  return testing::AssertionSuccess();
}

TEST(BlockSystemTest, WhatIsMissingOrOfAnotherKindIsNamed) {
  const RobotSideProxySystem dut;
  Simulator<double> unconnected(dut);
  EXPECT_TRUE(
      Names(ErrorOf([&] { unconnected.AdvanceTo(0.01); }), {"robot_pose"}));
  Simulator<double> simulator(dut);
  Context<double>& context = simulator.get_mutable_context();
  dut.GetInputPort("robot_pose").FixValue(&context, RigidTransformd());
  dut.GetInputPort("haptic_message")
      .FixValue(&context,
                drake::Value<Message>(ToMessage(ForceMessage{.sequence = 0})));
  EXPECT_TRUE(
      Names(ErrorOf([&] { simulator.AdvanceTo(0.01); }),
            {"haptic_message", "expected PoseMessage", "ForceMessage"}));
}

TEST(BlockSystemTest, APoseHasTheVerySameNumbersWhateverTheyAre) {
  Pose X{.p = Vector3d(1, 2, 3)};
  X.R *= 1 + 1e-9;
  const RigidTransformd drakes = ToRigidTransform(X);
  EXPECT_EQ(drakes.translation(), X.p);
  EXPECT_EQ(drakes.rotation().matrix(), X.R);
}

TEST(BlockSystemTest, ErrorsOfTheAlgorithmsNameWhatIsWrong) {
  EXPECT_TRUE(Names(ErrorOf([] { CommunicationChannelSystem({}, 0, 0); }),
                    {"CommunicationChannel", "rate"}));
}

TEST(BlockSystemTest, AJointThatThePlantHasNotIsNamed) {
  const SensorReactionSystem dut(1000);
  auto context = dut.CreateDefaultContext();
  FixInputs(dut, 1, context.get());
  context->SetTime(0.1);
  try {
    EvalAll(dut, *context);
    FAIL();
  } catch (const std::out_of_range& error) {
    EXPECT_NE(std::string(error.what())
                  .find("`sensor_joint` expected an index of 1 joints of the "
                        "plant, got 1000"),
              std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace dual_proxy
