// SPDX-License-Identifier: BSD-3-Clause
// What holds for every C++ face: the table of ports, the recorded traces, state
// in the Context, values that are none, memory.

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <typeinfo>
#include <utility>
#include <vector>

#include <drake/common/nice_type_name.h>
#include <gtest/gtest.h>

#include "face_table.h"
#include "no_alloc.h"
#include "same_bits.h"

namespace dual_proxy {
namespace {

using drake::math::RigidTransformd;
using drake::systems::Context;
using drake::systems::System;
using Eigen::VectorXd;
using Outputs = std::vector<VectorXd>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// The value of a port with all that it carries not finite.
VectorXd Spoil(const PortRow& port, double bad) {
  VectorXd value = VectorXd::Constant(port.Width(), bad);
  if (port.type == "PoseMessage") value.head<2>() << 99, 0.02;
  return value;
}

const std::type_info& TypeOf(const std::string& name) {
  if (name == "PoseMessage") return typeid(Message);
  if (name == "RigidTransform") return typeid(RigidTransformd);
  EXPECT_EQ(name, "Matrix3X");
  return typeid(Eigen::Matrix3Xd);
}

class FaceTest : public ::testing::TestWithParam<std::string> {
 protected:
  // The rows that are played at first, before something is done to the face.
  static constexpr std::size_t kHalf = 13;

  const FaceRow& row_{FaceTable().at(GetParam())};
  FacePlayer dut_{GetParam()};
};

TEST_P(FaceTest, PortsAreThoseOfTheTable) {
  const System<double>& face = dut_.face();
  ASSERT_EQ(face.num_input_ports(), std::ssize(row_.inputs));
  for (int i = 0; i < face.num_input_ports(); ++i) {
    const PortRow& expected = row_.inputs[i];
    const auto& port = face.get_input_port(i);
    EXPECT_EQ(port.get_name(), expected.name);
    if (expected.type.empty()) {
      ASSERT_EQ(port.get_data_type(), drake::systems::kVectorValued);
      EXPECT_EQ(port.size(), expected.size) << expected.name;
    } else {
      ASSERT_EQ(port.get_data_type(), drake::systems::kAbstractValued);
      EXPECT_EQ(face.AllocateInputAbstract(port)->static_type_info(),
                TypeOf(expected.type))
          << expected.name;
    }
  }
  ASSERT_EQ(face.num_output_ports(), std::ssize(row_.outputs));
  for (int i = 0; i < face.num_output_ports(); ++i) {
    const PortRow& expected = row_.outputs[i];
    const auto& port = face.get_output_port(i);
    EXPECT_EQ(port.get_name(), expected.name);
    if (expected.type.empty()) {
      ASSERT_EQ(port.get_data_type(), drake::systems::kVectorValued);
      EXPECT_EQ(port.size(), expected.size) << expected.name;
    } else {
      ASSERT_EQ(port.get_data_type(), drake::systems::kAbstractValued);
      EXPECT_EQ(port.Allocate()->static_type_info(), TypeOf(expected.type))
          << expected.name;
    }
    EXPECT_EQ(face.HasDirectFeedthrough(i), expected.feedthrough)
        << expected.name;
  }
}

TEST_P(FaceTest, ClassIsNamedAfterThePydrakeFace) {
  std::string name = drake::NiceTypeName::Get(dut_.face());
  name = name.substr(0, name.find('<'));
  EXPECT_EQ(name, "dual_proxy::" + row_.class_name + "System");
}

// To 1e-12 of each value, or of 1: another compiler than that which the trace
// was recorded with may round differently.
TEST_P(FaceTest, GivesTheRecordedTrace) {
  const std::vector<TraceRow> rows = LoadTrace(GetParam());
  const Outputs outputs = dut_.Play(rows, 0, rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    ASSERT_EQ(outputs[i].size(), rows[i].outputs.size());
    int column = 0;
    for (const PortRow& port : row_.outputs) {
      for (int k = 0; k < port.Width(); ++k, ++column) {
        const double actual = outputs[i][column];
        const double expected = rows[i].outputs[column];
        const bool same =
            actual == expected || (std::isnan(actual) && std::isnan(expected));
        if (same) continue;  // Also where it is infinite.
        EXPECT_NEAR(actual, expected, 1e-12 * std::max(1.0, std::abs(expected)))
            << port.name << "." << k << " in row " << i;
      }
    }
  }
}

TEST_P(FaceTest, ResetGivesTheSameBits) {
  const std::vector<TraceRow> rows = LoadTrace(GetParam());
  const Outputs first = dut_.Play(rows, 0, rows.size());
  dut_.face().SetDefaultContext(&dut_.mutable_context());
  dut_.mutable_context().SetTime(0);
  dut_.simulator().Initialize();
  EXPECT_TRUE(SameBits(dut_.Play(rows, 0, rows.size()), first));
}

TEST_P(FaceTest, AnotherContextOfTheSameFaceIsIndependent) {
  const std::vector<TraceRow> rows = LoadTrace(GetParam());
  const Outputs first = dut_.Play(rows, 0, rows.size());
  FacePlayer again(dut_, dut_.face().CreateDefaultContext());
  EXPECT_TRUE(SameBits(again.Play(rows, 0, rows.size()), first));
}

TEST_P(FaceTest, ClonesContinueAlikeAndIndependently) {
  const std::vector<TraceRow> rows = LoadTraceWithoutBadInputs(GetParam());
  dut_.Play(rows, 0, kHalf);
  // Between two steps, as a new simulator takes those of the very time anew.
  dut_.simulator().AdvanceTo(rows[kHalf - 1].time + 0.0003);
  FacePlayer twin(dut_, dut_.context().Clone());
  FacePlayer other(dut_, dut_.context().Clone());
  // The other one's inputs stand still, vectors at half of what they were.
  FlatInputs standing = rows[kHalf - 1].inputs;
  for (const PortRow& port : row_.inputs) {
    if (port.type.empty()) standing.at(port.name) *= 0.5;
  }
  bool differs = false;
  for (std::size_t i = kHalf; i < rows.size(); ++i) {
    other.Fix(standing);
    other.StepTo(rows[i].time);
    const Outputs mine = dut_.Play(rows, i, i + 1);
    EXPECT_TRUE(SameBits(twin.Play(rows, i, i + 1), mine)) << "row " << i;
    differs = differs || !SameBits(other.Outputs(), mine[0]);
  }
  EXPECT_TRUE(differs);
}

TEST_P(FaceTest, BadInputsNeverThrowAndNeverGetThrough) {
  const std::vector<TraceRow> clean = LoadTraceWithoutBadInputs(GetParam());
  for (const PortRow& input : row_.inputs) {
    for (const double bad : {kNan, kInfinity, -kInfinity}) {
      std::vector<TraceRow> rows = clean;
      for (std::size_t i = kHalf; i < kHalf + 5; ++i) {
        rows[i].inputs.at(input.name) = Spoil(input, bad);
      }
      FacePlayer player(dut_, dut_.face().CreateDefaultContext());
      const Outputs outputs = player.Play(rows, 0, rows.size());
      for (std::size_t i = 0; i < rows.size(); ++i) {
        int column = 0;
        for (const PortRow& output : row_.outputs) {
          EXPECT_TRUE(!output.acting ||
                      outputs[i].segment(column, output.Width()).allFinite())
              << input.name << " of " << bad << ": " << output.name
              << " in row " << i;
          column += output.Width();
        }
      }
    }
  }
}

TEST_P(FaceTest, OptionalInputsMayStayUnconnected) {
  std::vector<TraceRow> rows = LoadTraceWithoutBadInputs(GetParam());
  for (const PortRow& input : row_.inputs) {
    if (!input.optional) continue;
    std::vector<TraceRow> without = rows;
    std::vector<TraceRow> with_zeros = rows;
    // A sensor of which nothing is said is ready.
    const double nothing = input.name == "sensor_ready" ? 1 : 0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      without[i].inputs.erase(input.name);
      with_zeros[i].inputs.at(input.name).setConstant(nothing);
    }
    FacePlayer player(dut_, dut_.face().CreateDefaultContext());
    const Outputs outputs = player.Play(without, 0, rows.size());
    for (const VectorXd& row : outputs) EXPECT_TRUE(row.allFinite());
    // RobotSideProxy does without a bumpless hand-over where nothing is sensed,
    // ForceTorqueSensor takes the velocity from the poses.
    const bool has_default_of_zero =
        input.type.empty() && input.name != "robot_velocity" &&
        !(GetParam() == "RobotSideProxy" && input.name == "sensed_wrench");
    if (has_default_of_zero) {
      FacePlayer zeros(dut_, dut_.face().CreateDefaultContext());
      EXPECT_TRUE(SameBits(outputs, zeros.Play(with_zeros, 0, rows.size())))
          << input.name;
    }
  }
}

// Once it has been through everything that the trace has, a face steps and
// computes its outputs without the heap. What is counted is what Drake does for
// one update of the face and for its output ports; new values at the input
// ports and the bookkeeping of a simulator are left out, as they are Drake's
// own. So are outputs of type Matrix3X, as Eigen allocates when their number of
// columns changes.
TEST_P(FaceTest, NothingIsAllocatedOnceWarm) {
  const std::vector<TraceRow> rows = LoadTrace(GetParam());
  dut_.Play(rows, 0, rows.size());

  const System<double>& face = dut_.face();
  Context<double>& context = dut_.mutable_context();
  ScopedNoAlloc setup;
  const std::unique_ptr<drake::systems::State<double>> state =
      context.CloneState();
  EXPECT_GT(setup.count(), 0) << "Drake's allocations are counted, too";
  const auto events = face.AllocateCompositeEventCollection();
  face.GetPeriodicEvents(context, events.get());
  const auto& updates = events->get_unrestricted_update_events();
  EXPECT_EQ(updates.HasEvents(), row_.class_name != "ArmKinematics");
  std::vector<std::unique_ptr<drake::AbstractValue>> values;
  for (int i = 0; i < face.num_output_ports(); ++i) {
    values.push_back(face.get_output_port(i).Allocate());
  }
  const auto look = [&] {
    for (int i = 0; i < face.num_output_ports(); ++i) {
      if (row_.outputs[i].type == "Matrix3X") continue;
      face.get_output_port(i).Calc(context, values[i].get());
      face.get_output_port(i).Eval<drake::AbstractValue>(context);
    }
  };
  const double start = context.get_time() + 1;
  for (std::size_t row = 0; row < rows.size(); ++row) {
    dut_.Fix(rows[row].inputs);
    context.SetTime(start + rows[row].time);
    ScopedNoAlloc guard;
    look();
    if (updates.HasEvents()) {
      EXPECT_TRUE(face.CalcUnrestrictedUpdate(context, updates, state.get())
                      .succeeded());
      face.ApplyUnrestrictedUpdate(updates, state.get(), &context);
    }
    look();
    EXPECT_EQ(guard.count(), 0) << "row " << row;
  }
}

INSTANTIATE_TEST_SUITE_P(Faces, FaceTest, ::testing::ValuesIn([] {
                           std::vector<std::string> names;
                           for (const auto& [name, row] : FaceTable())
                             names.push_back(name);
                           return names;
                         }()),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace dual_proxy
