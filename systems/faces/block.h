// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <initializer_list>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "dual_proxy/common/pose.h"
#include "dual_proxy/common/signal_layout.h"
#include "dual_proxy/link/message.h"

namespace dual_proxy {

/** @file
An algorithm as a block of a block diagram: ports with names, a memory, a
period. It is told once, without Drake; BlockSystem makes a C++ LeafSystem of
it, dual_proxy.systems a pydrake one. */

/** What a port carries. */
enum class PortType {
  kVector,
  kPose,      ///< In Drake a RigidTransform.
  kMessage,   ///< Of one tag.
  kNormals,   ///< A matrix of 3 x k.
  kReaction,  ///< Of a plant's `reaction_forces` that of one joint.
};

/** A port's name, and what it carries, with unit and frame. */
struct PortText {
  const char* name;
  const char* meaning;
};

/** Whether an input must be connected. */
enum class Need {
  kRequired,
  kOptional,
  /** kRequired, but at time 0 there is nothing: a simulated plant has no
  reactions before its first step. */
  kAfterStart,
};

/** What is known of a port. */
struct PortInfo {
  std::string name;
  std::string meaning;
  PortType type{PortType::kVector};
  int size{0};                        ///< Of a vector.
  MessageTag tag{0};                  ///< Of messages.
  int joint{0};                       ///< Of a reaction.
  Need need{Need::kOptional};         ///< Of an input.
  bool timed{false};                  ///< Of an output: it changes with time.
  std::vector<std::string> direct{};  ///< Of an output: the inputs it reads.
};

/** Visits the input ports of a block, which declares them or reads them.

What is not connected leaves its value as it is; each function returns whether
there was something.
@throws std::exception if a required one is not connected, or a message is of
another kind. */
class InputPorts {
 public:
  virtual ~InputPorts() = default;

  /** A vector, or row by row a 3x3 matrix. */
  template <typename Array>
  bool GetVector(const PortText& port, Array* value,
                 Need need = Need::kOptional) {
    constexpr int kSize = Array::SizeAtCompileTime;
    static_assert(kSize != Eigen::Dynamic);
    const double* data = VisitVector(port, kSize, need);
    if (data == nullptr) return false;
    *value = Eigen::Map<const Eigen::Matrix<
        double, Array::RowsAtCompileTime, Array::ColsAtCompileTime,
        Array::ColsAtCompileTime == 1 ? Eigen::ColMajor : Eigen::RowMajor>>(
        data);
    return true;
  }

  /** A vector of size 1: true if above 0.5. */
  bool GetFlag(const PortText& port, bool* value) {
    const double* data = VisitVector(port, 1, Need::kOptional);
    if (data != nullptr) *value = *data > 0.5;
    return data != nullptr;
  }

  bool GetPose(const PortText& port, Pose* value) {
    return VisitPose(port, value);
  }

  /** The empty message is of every kind. */
  bool GetMessage(const PortText& port, MessageTag tag, Message* value) {
    return VisitMessage(port, tag, value);
  }

  /** A Message as the content that is in it. */
  template <typename Content>
  bool GetMessageOf(const PortText& port, Content* value) {
    Message message;
    if (!VisitMessage(port, Content::kTag, &message)) return false;
    *value = FromMessage<Content>(message);
    return true;
  }

  bool GetNormals(const PortText& port, Eigen::Matrix3Xd* value) {
    return VisitNormals(port, value);
  }

  /** [force; moment] of a joint, kAfterStart. */
  bool GetReaction(const PortText& port, int joint,
                   Eigen::Matrix<double, 6, 1>* value) {
    return VisitReaction(port, joint, value);
  }

 protected:
  // Each returns whether there is something; a pose is always required.
  virtual const double* VisitVector(const PortText& port, int size,
                                    Need need) = 0;
  virtual bool VisitPose(const PortText& port, Pose* value) = 0;
  virtual bool VisitMessage(const PortText& port, MessageTag tag,
                            Message* value) = 0;
  virtual bool VisitNormals(const PortText& port, Eigen::Matrix3Xd* value) = 0;
  virtual bool VisitReaction(const PortText& port, int joint,
                             Eigen::Matrix<double, 6, 1>* value) = 0;
};

/** What a port's value follows from beside the memory. */
struct Direct {
  std::initializer_list<const char*> inputs{};
  bool time{false};
};

/** Visits the output ports of a block, which declares them or writes the one
that is asked for. */
class OutputPorts {
 public:
  using VectorRef = Eigen::Ref<Eigen::VectorXd>;

  virtual ~OutputPorts() = default;

  /** `write(vector)` is called if the port is asked for. */
  template <typename Write>
  void PutVector(const PortText& port, int size, Write write,
                 const Direct& direct = {}) {
    if (Visit(port, PortType::kVector, size, 0, direct)) write(vector());
  }

  void PutVector(const PortText& port,
                 const Eigen::Ref<const Eigen::VectorXd>& value) {
    const auto size = static_cast<int>(value.size());
    if (Visit(port, PortType::kVector, size, 0, {})) vector() = value;
  }

  void PutScalar(const PortText& port, double value) {
    if (Visit(port, PortType::kVector, 1, 0, {})) vector()[0] = value;
  }

  /** Integers, as they are. */
  void PutCounts(const PortText& port,
                 std::initializer_list<std::int64_t> counts) {
    const auto size = static_cast<int>(counts.size());
    if (!Visit(port, PortType::kVector, size, 0, {})) return;
    double* target = vector().data();
    for (const std::int64_t count : counts) {
      *target++ = static_cast<double>(count);
    }
  }

  /** Row by row. */
  void PutMatrix(const PortText& port, const Eigen::Matrix3d& value) {
    if (!Visit(port, PortType::kVector, 9, 0, {})) return;
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(vector().data()) =
        value;
  }

  /** `calc()` is called if the port is asked for. */
  template <typename Calc>
  void PutPose(const PortText& port, Calc calc, const Direct& direct = {}) {
    if (Visit(port, PortType::kPose, 0, 0, direct)) Set(calc());
  }

  template <typename Calc>
  void PutMessage(const PortText& port, MessageTag tag, Calc calc,
                  const Direct& direct = {}) {
    if (Visit(port, PortType::kMessage, 0, tag, direct)) Set(calc());
  }

  void PutNormals(const PortText& port,
                  const Eigen::Ref<const Eigen::Matrix3Xd>& value) {
    if (Visit(port, PortType::kNormals, 0, 0, {})) Set(value);
  }

 protected:
  /** Returns whether the port is asked for: then its value is given to vector()
  or Set(). */
  virtual bool Visit(const PortText& port, PortType type, int size,
                     MessageTag tag, const Direct& direct) = 0;
  virtual VectorRef vector() = 0;
  virtual void Set(const Pose& value) = 0;
  virtual void Set(const Message& value) = 0;
  virtual void Set(const Eigen::Ref<const Eigen::Matrix3Xd>& value) = 0;
};

/** What a block remembers from step to step. */
class BlockMemory {
 public:
  virtual ~BlockMemory() = default;
};

/** As it is in a simulator's contexts, which share it: nobody changes it. */
using SharedMemory = std::shared_ptr<const BlockMemory>;

/** When a block steps, and which step its outputs show. */
struct BlockTiming {
  double period{0};  ///< s; 0: it has no memory, and does not step.
  double offset{0};  ///< s, of the first step.
  /** true: an output at t is what the step at t gives, from the inputs at t.
  false: it is that of the last step. */
  bool feedthrough{false};
};

/** See the file. Its functions may be called from several threads. */
class Block {
 public:
  virtual ~Block() = default;
  Block(const Block&) = delete;
  Block& operator=(const Block&) = delete;
  Block(Block&&) = delete;
  Block& operator=(Block&&) = delete;

  /** For error messages. */
  const std::string& name() const { return name_; }
  const BlockTiming& timing() const { return timing_; }

  /** Before the first step. */
  const SharedMemory& start() const { return start_; }

  /** The memory after a step; the one before is as it was.
  @throws std::exception as InputPorts. */
  SharedMemory Step(double time, const SharedMemory& before,
                    InputPorts* inputs) const;

  virtual void VisitInputs(InputPorts* ports) const = 0;

  /** @param inputs  read for what Direct names. */
  virtual void VisitOutputs(double time, const BlockMemory& memory,
                            InputPorts* inputs, OutputPorts* outputs) const = 0;

  /** What is in its port `signals`, if it has one. */
  virtual const std::vector<SignalSlice>& layout() const;

 protected:
  Block(std::string name, const BlockTiming& timing)
      : name_(std::move(name)), timing_(timing) {}

  void set_start(SharedMemory start) { start_ = std::move(start); }

 private:
  virtual std::shared_ptr<BlockMemory> Clone(const BlockMemory& from) const = 0;
  virtual void Copy(const BlockMemory& from, BlockMemory* to) const = 0;
  virtual void DoStep(double time, InputPorts* inputs,
                      BlockMemory* memory) const = 0;

  std::shared_ptr<BlockMemory> TakeSpare(const BlockMemory& from) const;

  std::string name_;
  BlockTiming timing_;
  SharedMemory start_;
  mutable std::mutex mutex_;
  // As many as there are contexts, and one: a step takes one that nobody holds.
  mutable std::vector<std::shared_ptr<BlockMemory>> spares_;
};

/** A block by its kinds of input and memory, both plain values. */
template <typename Input, typename Memory>
class BlockOf : public Block {
 public:
  void VisitInputs(InputPorts* ports) const final {
    Input input;
    ReadInputs(ports, &input);
  }

  void VisitOutputs(double time, const BlockMemory& memory, InputPorts* inputs,
                    OutputPorts* outputs) const final {
    WriteOutputs(time, Get(memory), inputs, outputs);
  }

  static const Memory& Get(const BlockMemory& memory) {
    return static_cast<const Holder&>(memory).value;
  }

 protected:
  using Block::Block;

  /** Sets the memory before the first step. */
  void set_start(Memory start) {
    Block::set_start(std::make_shared<const Holder>(std::move(start)));
  }

  /** Visits all input ports, in their order. */
  virtual void ReadInputs(InputPorts* ports, Input* input) const = 0;

  /** Advances by a period. */
  virtual void Update(double time, const Input& input,
                      Memory* memory) const = 0;

  /** Visits all output ports, in their order. */
  virtual void WriteOutputs(double time, const Memory& memory,
                            InputPorts* inputs, OutputPorts* outputs) const = 0;

 private:
  struct Holder final : BlockMemory {
    explicit Holder(Memory from) : value(std::move(from)) {}
    Memory value;
  };

  std::shared_ptr<BlockMemory> Clone(const BlockMemory& from) const final {
    return std::make_shared<Holder>(Get(from));
  }

  void Copy(const BlockMemory& from, BlockMemory* to) const final {
    static_cast<Holder*>(to)->value = Get(from);
  }

  void DoStep(double time, InputPorts* inputs,
              BlockMemory* memory) const final {
    Input input;
    ReadInputs(inputs, &input);
    Update(time, input, &static_cast<Holder*>(memory)->value);
  }
};

/** The ports of a block, in their order. */
std::vector<PortInfo> ListInputs(const Block& block);
std::vector<PortInfo> ListOutputs(const Block& block);

}  // namespace dual_proxy
