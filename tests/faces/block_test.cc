// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/faces/block.h"

#include <algorithm>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "dual_proxy/faces/example_blocks.h"
#include "example_inputs.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

std::vector<Eigen::VectorXd> ReadAll(const Block& block, double time,
                                     const SharedMemory& memory) {
  std::vector<Eigen::VectorXd> result;
  for (int i = 0; i < std::ssize(ListOutputs(block)); ++i) {
    result.push_back(ReadOutput(block, i, time, *memory));
  }
  return result;
}

TEST(BlockTest, PortsHaveNamesOfTheirOwnAndMeanings) {
  for (const BlockPtr& block : MakeExampleBlocks()) {
    std::set<std::string> inputs;
    for (const PortInfo& port : ListInputs(*block)) {
      EXPECT_TRUE(inputs.insert(port.name).second) << port.name;
      EXPECT_FALSE(port.meaning.empty()) << port.name;
      EXPECT_EQ(port.size > 0, port.type == PortType::kVector) << port.name;
    }
    std::set<std::string> outputs;
    for (const PortInfo& port : ListOutputs(*block)) {
      EXPECT_TRUE(outputs.insert(port.name).second) << port.name;
      EXPECT_FALSE(port.meaning.empty()) << port.name;
      for (const std::string& name : port.direct) {
        EXPECT_TRUE(inputs.contains(name)) << port.name << " of " << name;
      }
    }
  }
}

TEST(BlockTest, WhatNoSystemCanBeMadeOfIsRefused) {
  EXPECT_EQ(
      InvalidArgument([] { MakeSensorReactionBlock(-1); }),
      "SensorReaction: field `sensor_joint` expected an integer >= 0, got "
      "-1");
  EXPECT_EQ(InvalidArgument([] { MakeWindowMeanBlock(1e300); }),
            "WindowMean: field `window` expected a number in (0, 1e+11], got "
            "1e+300");
  EXPECT_EQ(
      InvalidArgument([] { MakeCommunicationChannelBlock({}, 0, 1e300); }),
      "CommunicationChannel: field `rate` expected a number in (0, "
      "1/period = 1000], got 1e+300");
  ArmModelParams<7> arm;
  arm.mass.setOnes();
  const Vector7 q = Vector7::Constant(1e300);
  EXPECT_EQ(InvalidArgument([&] { MakeRobotSideBlock({}, arm, q); }),
            "RobotSide: field `q_start[0]` expected a number in [-1000, 1000], "
            "got 1e+300");
}

TEST(BlockTest, AStepLeavesTheMemoryBeforeAsItWas) {
  for (const BlockPtr& block : MakeExampleBlocks()) {
    if (block->timing().period == 0) continue;
    const std::vector<Eigen::VectorXd> start =
        ReadAll(*block, 0, block->start());
    ExampleInputs inputs(0.01);
    SharedMemory memory = block->start();
    std::vector<SharedMemory> kept{memory};
    std::vector<std::vector<Eigen::VectorXd>> seen{start};
    for (int i = 0; i < 50; ++i) {
      const double time = i * block->timing().period;
      memory = block->Step(time, memory, &inputs);
      kept.push_back(memory);
      seen.push_back(ReadAll(*block, 0, memory));
    }
    for (std::size_t i = 0; i < kept.size(); ++i) {
      EXPECT_EQ(ReadAll(*block, 0, kept[i]), seen[i])
          << block->name() << " after " << i;
    }
    // The others' outputs are no vectors.
    if (block->name() != "ContactHistory" && block->name() != "PoseSender" &&
        block->name() != "CommunicationChannel") {
      EXPECT_NE(seen.front(), seen.back()) << block->name();
    }
  }
}

TEST(BlockTest, StepsOfTheSameMemoryAreTheSame) {
  for (const BlockPtr& block : MakeExampleBlocks()) {
    if (block->timing().period == 0) continue;
    ExampleInputs inputs(0.01, false);
    const SharedMemory once = block->Step(0, block->start(), &inputs);
    const SharedMemory again = block->Step(0, block->start(), &inputs);
    EXPECT_NE(once, again);
    EXPECT_EQ(ReadAll(*block, 0, once), ReadAll(*block, 0, again))
        << block->name();
  }
}

TEST(BlockTest, NothingIsAllocatedOnceWarm) {
  for (const BlockPtr& block : MakeExampleBlocks()) {
    // Its port is a matrix on the heap.
    if (block->timing().period == 0 ||
        block->name() == "ForceSpaceParticleFilter") {
      continue;
    }
    ExampleInputs inputs(0.01);
    SharedMemory memory = block->start();
    const auto run = [&](int begin, int end) {
      for (int i = begin; i < end; ++i) {
        memory = block->Step(i * block->timing().period, memory, &inputs);
      }
    };
    run(0, 200);
    ScopedNoAlloc guard;
    run(200, 400);
    EXPECT_EQ(guard.count(), 0) << block->name();
  }
}

TEST(BlockTest, InputsThatAreNoNumbersNeverThrow) {
  for (const BlockPtr& block : MakeExampleBlocks()) {
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(),
                             std::numeric_limits<double>::infinity()}) {
      ExampleInputs inputs(bad);
      SharedMemory memory = block->start();
      for (int i = 0; i < 5 && block->timing().period > 0; ++i) {
        EXPECT_NO_THROW(
            memory = block->Step(i * block->timing().period, memory, &inputs))
            << block->name();
      }
      const std::vector<PortInfo> ports = ListOutputs(*block);
      for (int i = 0; i < std::ssize(ports); ++i) {
        const bool acts = ports[i].name == "torque" ||
                          ports[i].name == "device_wrench" ||
                          ports[i].name == "reference_force";
        if (!acts) continue;
        EXPECT_TRUE(ReadOutput(*block, i, 0, *memory).allFinite())
            << block->name() << ": " << ports[i].name;
      }
    }
  }
}

}  // namespace
}  // namespace dual_proxy
