// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <limits>
#include <string_view>

#include "dual_proxy/faces/block.h"

namespace dual_proxy {

/** Gives every port the same number, or nothing; poses are at the identity, or
nothing but that number if it is none. */
class ExampleInputs final : public InputPorts {
 public:
  explicit ExampleInputs(double value, bool connected = true)
      : connected_(connected) {
    values_.fill(value);
  }

 private:
  using Vector6 = Eigen::Matrix<double, 6, 1>;

  const double* VisitVector(const PortText& port, int, Need need) override {
    if (!connected_ && need != Need::kRequired) return nullptr;
    // Normals are of length one, or none.
    static constexpr std::array<double, 9> kNone{};
    return std::string_view(port.name) == "contact_normals" ? kNone.data()
                                                            : values_.data();
  }
  bool VisitPose(const PortText&, Pose* value) override {
    value->p.setConstant(values_[0]);
    return true;
  }
  bool VisitMessage(const PortText&, MessageTag tag, Message* value) override {
    if (!connected_) return false;
    *value = ToMessage(PoseMessage{.sequence = sequence_++, .send_time = 0});
    value->tag = tag;
    return true;
  }
  bool VisitNormals(const PortText&, Eigen::Matrix3Xd* value) override {
    if (!connected_) return false;
    value->setConstant(3, 1, values_[0]);
    return true;
  }
  bool VisitReaction(const PortText&, int, Vector6* value) override {
    value->setConstant(values_[0]);
    return true;
  }

  std::array<double, 32> values_;
  bool connected_;
  std::int64_t sequence_{0};
};

/** Reads one output of type vector. */
class ExampleOutput final : public OutputPorts {
 public:
  explicit ExampleOutput(int index) : index_(index) {}

  Eigen::VectorXd value;

 private:
  bool Visit(const PortText&, PortType type, int size, MessageTag,
             const Direct&) override {
    if (next_++ != index_ || type != PortType::kVector) return false;
    value.resize(size);
    return true;
  }
  VectorRef vector() override { return value; }
  void Set(const Pose&) override {}
  void Set(const Message&) override {}
  void Set(const Eigen::Ref<const Eigen::Matrix3Xd>&) override {}

  int index_;
  int next_{0};
};

inline Eigen::VectorXd ReadOutput(const Block& block, int index, double time,
                                  const BlockMemory& memory) {
  ExampleInputs inputs(0.01);
  ExampleOutput output(index);
  block.VisitOutputs(time, memory, &inputs, &output);
  return output.value;
}

}  // namespace dual_proxy
