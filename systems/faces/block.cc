// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/faces/block.h"

#include <atomic>
#include <utility>

namespace dual_proxy {

namespace {

class InputLister final : public InputPorts {
 public:
  std::vector<PortInfo> ports;

 private:
  void Add(const PortText& port, PortType type, Need need) {
    ports.push_back({.name = port.name,
                     .meaning = port.meaning,
                     .type = type,
                     .need = need});
  }

  const double* VisitVector(const PortText& port, int size,
                            Need need) override {
    Add(port, PortType::kVector, need);
    ports.back().size = size;
    return nullptr;
  }
  bool VisitPose(const PortText& port, Pose*) override {
    Add(port, PortType::kPose, Need::kRequired);
    return false;
  }
  bool VisitMessage(const PortText& port, MessageTag tag, Message*) override {
    Add(port, PortType::kMessage, Need::kOptional);
    ports.back().tag = tag;
    return false;
  }
  bool VisitNormals(const PortText& port, Eigen::Matrix3Xd*) override {
    Add(port, PortType::kNormals, Need::kOptional);
    return false;
  }
  bool VisitReaction(const PortText& port, int joint,
                     Eigen::Matrix<double, 6, 1>*) override {
    Add(port, PortType::kReaction, Need::kAfterStart);
    ports.back().joint = joint;
    return false;
  }
};

class OutputLister final : public OutputPorts {
 public:
  std::vector<PortInfo> ports;

 private:
  bool Visit(const PortText& port, PortType type, int size, MessageTag tag,
             const Direct& direct) override {
    ports.push_back({.name = port.name,
                     .meaning = port.meaning,
                     .type = type,
                     .size = size,
                     .tag = tag,
                     .timed = direct.time,
                     .direct = {direct.inputs.begin(), direct.inputs.end()}});
    return false;
  }
  VectorRef vector() override { return empty_; }
  void Set(const Pose&) override {}
  void Set(const Message&) override {}
  void Set(const Eigen::Ref<const Eigen::Matrix3Xd>&) override {}

  Eigen::VectorXd empty_;
};

}  // namespace

const std::vector<SignalSlice>& Block::layout() const {
  static const std::vector<SignalSlice> none;
  return none;
}

SharedMemory Block::Step(double time, const SharedMemory& before,
                         InputPorts* inputs) const {
  std::shared_ptr<BlockMemory> after = TakeSpare(*before);
  DoStep(time, inputs, after.get());
  return after;
}

std::shared_ptr<BlockMemory> Block::TakeSpare(const BlockMemory& from) const {
  std::shared_ptr<BlockMemory> spare;
  {
    const std::scoped_lock lock(mutex_);
    for (const auto& memory : spares_) {
      if (memory.use_count() == 1) {
        spare = memory;
        break;
      }
    }
  }
  if (spare) {
    // What the thread that let go of it last has read comes before.
    std::atomic_thread_fence(std::memory_order_acquire);
    Copy(from, spare.get());
    return spare;
  }
  spare = Clone(from);
  const std::scoped_lock lock(mutex_);
  return spares_.emplace_back(std::move(spare));
}

std::vector<PortInfo> ListInputs(const Block& block) {
  InputLister lister;
  block.VisitInputs(&lister);
  return std::move(lister.ports);
}

std::vector<PortInfo> ListOutputs(const Block& block) {
  OutputLister lister;
  block.VisitOutputs(0, *block.start(), nullptr, &lister);
  return std::move(lister.ports);
}

}  // namespace dual_proxy
