// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/faces/block_system.h"

#include <limits>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

#include <drake/common/value.h>
#include <drake/multibody/math/spatial_algebra.h>

namespace dual_proxy {

namespace {

using drake::AbstractValue;
using drake::Value;
using drake::math::RigidTransformd;
using drake::systems::BasicVector;
using drake::systems::Context;
using drake::systems::InputPort;
using drake::systems::LeafSystem;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using SpatialForces = std::vector<drake::multibody::SpatialForce<double>>;

// The value that a port which is no vector has by default.
std::unique_ptr<AbstractValue> MakeValue(PortType type) {
  switch (type) {
    case PortType::kPose:
      return std::make_unique<Value<RigidTransformd>>();
    case PortType::kMessage:
      return std::make_unique<Value<Message>>();
    case PortType::kNormals:
      return std::make_unique<Value<Eigen::Matrix3Xd>>();
    default:
      return std::make_unique<Value<SpatialForces>>();
  }
}

// Reads ports in their order, or, with `by_name`, those that are asked for.
class PortReader final : public InputPorts {
 public:
  PortReader(const LeafSystem<double>& system, const Context<double>& context,
             bool by_name = false)
      : system_(system), context_(context), by_name_(by_name) {}

 private:
  const InputPort<double>& Find(const PortText& text) {
    return by_name_ ? system_.GetInputPort(text.name)
                    : system_.get_input_port(next_++);
  }

  const double* VisitVector(const PortText& text, int, Need need) override {
    const InputPort<double>& port = Find(text);
    if (need == Need::kOptional && !port.HasValue(context_)) return nullptr;
    if (need == Need::kAfterStart && context_.get_time() <= 0) return nullptr;
    return port.Eval(context_).data();
  }

  bool VisitPose(const PortText& text, Pose* value) override {
    const auto& X = Find(text).Eval<RigidTransformd>(context_);
    *value = {.p = X.translation(), .R = X.rotation().matrix()};
    return true;
  }

  bool VisitMessage(const PortText& text, MessageTag tag,
                    Message* value) override {
    const InputPort<double>& port = Find(text);
    if (!port.HasValue(context_)) return false;
    const auto& message = port.Eval<Message>(context_);
    if (message.sequence != -1 && message.tag != tag) {
      throw std::logic_error(system_.GetSystemName() + ": input port `" +
                             port.get_name() + "` expected " +
                             DescribeTag(tag) + ", got " +
                             DescribeTag(message.tag));
    }
    *value = message;
    return true;
  }

  bool VisitNormals(const PortText& text, Eigen::Matrix3Xd* value) override {
    const InputPort<double>& port = Find(text);
    if (!port.HasValue(context_)) return false;
    *value = port.Eval<Eigen::Matrix3Xd>(context_);
    return true;
  }

  bool VisitReaction(const PortText& text, int joint, Vector6* value) override {
    const InputPort<double>& port = Find(text);
    if (context_.get_time() <= 0) return false;
    const auto& forces = port.Eval<SpatialForces>(context_);
    if (std::cmp_greater_equal(joint, forces.size())) {
      throw std::out_of_range(
          system_.GetSystemName() + ": `sensor_joint` expected an index of " +
          std::to_string(forces.size()) + " joints of the plant, got " +
          std::to_string(joint));
    }
    const auto& force = forces[joint];
    *value << force.translational(), force.rotational();
    return true;
  }

  const LeafSystem<double>& system_;
  const Context<double>& context_;
  bool by_name_;
  int next_{0};
};

// Writes the port of that index.
class PortWriter final : public OutputPorts {
 public:
  PortWriter(int index, AbstractValue* abstract)
      : index_(index), abstract_(abstract) {}
  PortWriter(int index, BasicVector<double>* vector)
      : index_(index), vector_(vector) {}

 private:
  bool Visit(const PortText&, PortType, int, MessageTag,
             const Direct&) override {
    return next_++ == index_;
  }
  VectorRef vector() override { return vector_->get_mutable_value(); }
  void Set(const Pose& X) override {
    abstract_->get_mutable_value<RigidTransformd>() = ToRigidTransform(X);
  }
  void Set(const Message& message) override {
    abstract_->get_mutable_value<Message>() = message;
  }
  void Set(const Eigen::Ref<const Eigen::Matrix3Xd>& normals) override {
    abstract_->get_mutable_value<Eigen::Matrix3Xd>() = normals;
  }

  int index_;
  int next_{0};
  AbstractValue* abstract_{};
  BasicVector<double>* vector_{};
};

}  // namespace

BlockSystem::BlockSystem(std::shared_ptr<const Block> block)
    : block_(std::move(block)) {
  DeclareInputs();
  DeclareStep();
  DeclareOutputs();
}

void BlockSystem::DeclareInputs() {
  for (const PortInfo& port : ListInputs(*block_)) {
    if (port.type == PortType::kVector) {
      DeclareVectorInputPort(port.name, port.size);
    } else {
      DeclareAbstractInputPort(port.name, *MakeValue(port.type));
    }
  }
}

void BlockSystem::DeclareStep() {
  const BlockTiming& timing = block_->timing();
  memory_ticket_ = nothing_ticket();
  if (timing.period == 0) return;
  memory_ = DeclareAbstractState(Value<Memory>(Memory{block_->start()}));
  memory_ticket_ = abstract_state_ticket(memory_);
  if (timing.feedthrough) {
    last_step_ = DeclareDiscreteState(
        Eigen::VectorXd::Constant(1, -std::numeric_limits<double>::infinity()));
    stepped_ = &DeclareCacheEntry(
        "stepped memory", Memory{block_->start()}, &BlockSystem::CalcStepped,
        {all_input_ports_ticket(), all_state_ticket(), time_ticket()});
    memory_ticket_ = stepped_->ticket();
  }
  DeclarePeriodicUnrestrictedUpdateEvent(timing.period, timing.offset,
                                         &BlockSystem::Advance);
}

void BlockSystem::DeclareOutputs() {
  int index = 0;
  for (const PortInfo& port : ListOutputs(*block_)) {
    std::set<drake::systems::DependencyTicket> tickets;
    for (const std::string& input : port.direct) {
      tickets.insert(GetInputPort(input).ticket());
    }
    if (port.direct.empty()) tickets.insert(memory_ticket_);
    if (port.timed) tickets.insert(time_ticket());
    const auto write = [this, index](const Context& context, auto* value) {
      PortReader inputs(*this, context, true);
      PortWriter writer(index, value);
      block_->VisitOutputs(context.get_time(), EvalMemory(context), &inputs,
                           &writer);
    };
    if (port.type == PortType::kVector) {
      DeclareVectorOutputPort(
          port.name, BasicVector<double>(port.size),
          [write](const Context& context, BasicVector<double>* value) {
            write(context, value);
          },
          tickets);
    } else {
      DeclareAbstractOutputPort(
          port.name, [type = port.type] { return MakeValue(type); },
          [write](const Context& context, AbstractValue* value) {
            write(context, value);
          },
          tickets);
    }
    ++index;
  }
}

const BlockMemory& BlockSystem::EvalMemory(const Context& context) const {
  if (stepped_ != nullptr) return *stepped_->Eval<Memory>(context).shared;
  if (block_->timing().period == 0) return *block_->start();
  return *context.get_abstract_state<Memory>(memory_).shared;
}

void BlockSystem::CalcStepped(const Context& context, Memory* memory) const {
  const SharedMemory& before =
      context.get_abstract_state<Memory>(memory_).shared;
  if (context.get_discrete_state(last_step_).value()[0] == context.get_time()) {
    memory->shared = before;
    return;
  }
  PortReader inputs(*this, context);
  memory->shared = block_->Step(context.get_time(), before, &inputs);
}

drake::systems::EventStatus BlockSystem::Advance(
    const Context& context, drake::systems::State<double>* state) const {
  auto& memory = state->get_mutable_abstract_state<Memory>(memory_);
  if (stepped_ != nullptr) {
    memory = stepped_->Eval<Memory>(context);
    state->get_mutable_discrete_state(last_step_)[0] = context.get_time();
  } else {
    PortReader inputs(*this, context);
    memory.shared = block_->Step(
        context.get_time(), context.get_abstract_state<Memory>(memory_).shared,
        &inputs);
  }
  return drake::systems::EventStatus::Succeeded();
}

}  // namespace dual_proxy
