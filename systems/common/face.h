// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <utility>

#include <drake/common/value.h>
#include <drake/math/rigid_transform.h>
#include <drake/systems/framework/leaf_system.h>
#include <Eigen/Core>

#include "dual_proxy/common/drake_binary.h"
#include "dual_proxy/common/pose.h"

namespace dual_proxy {

/** A pose as Drake's type with the very same numbers: never throws, not even in
Drake's debug builds. Drake asks more of a rotation (orthonormal to 3e-14) than
the algorithms do, and what is no pose stays none: whoever acts on it refuses
it. */
inline drake::math::RigidTransformd ToRigidTransform(const Pose& X) {
  return {drake::math::RotationMatrixd::MakeUnchecked(X.R), X.p};
}

/** Drake's pose as the algorithms' type. */
inline Pose ToPose(const drake::math::RigidTransformd& X) {
  return {.p = X.translation(), .R = X.rotation().matrix()};
}

/** A vector port's value, zero if it is not connected. */
template <int kSize>
Eigen::Matrix<double, kSize, 1> EvalVector(
    const drake::systems::InputPort<double>& port,
    const drake::systems::Context<double>& context) {
  if (!port.HasValue(context)) return Eigen::Matrix<double, kSize, 1>::Zero();
  return port.Eval(context);
}

/** The 3x3 matrix of a row-major port, zero if it is not connected. */
Eigen::Matrix3d EvalMatrix(const drake::systems::InputPort<double>& port,
                           const drake::systems::Context<double>& context);

/** Whether a port of size 1 holds more than 0.5; `otherwise` if it is not
connected. */
inline bool EvalFlag(const drake::systems::InputPort<double>& port,
                     const drake::systems::Context<double>& context,
                     bool otherwise) {
  return port.HasValue(context) ? port.Eval(context)(0) > 0.5 : otherwise;
}

/** Writes a matrix row by row. */
template <typename Matrix>
void WriteRows(const Matrix& matrix, Eigen::Ref<Eigen::VectorXd> vector) {
  for (int i = 0; i < matrix.rows(); ++i) {
    vector.segment(i * matrix.cols(), matrix.cols()) =
        matrix.row(i).transpose();
  }
}

/** When the outputs of a Face show a step. */
enum class Feedthrough {
  /** The output at t is what the step at t gives, from the inputs at t. */
  kYes,
  /** The output is that of the last step. */
  kNo,
};

/** A system around one algorithm; it owns no mathematics.

The algorithm's memory, a copyable value that holds its state and its last
output, is abstract state of the Context: a diagram can be reset, cloned and run
again with the same bits. It steps every `period`.

With feedthrough, faces in a row all act on one tick's measurements, as the
fused faces do. Once the step at t has been taken its result stands for the rest
of the instant, whatever the inputs have become by then. So a Drake
ZeroOrderHold of the same period, which samples at t after all faces and the
plant have stepped, holds the result of the step at t: put one where the result
goes to hardware or to a plant.

An input that is not finite is no error here: it is handed to the algorithm,
which refuses it, counts it and goes to its safe output. */
template <typename Memory>
class Face : public drake::systems::LeafSystem<double> {
 public:
  using InputPort = drake::systems::InputPort<double>;
  using OutputPort = drake::systems::OutputPort<double>;

  Face(const Face&) = delete;
  Face& operator=(const Face&) = delete;
  Face(Face&&) = delete;
  Face& operator=(Face&&) = delete;

 protected:
  using Context = drake::systems::Context<double>;
  /** The value of a vector port, to be written. */
  using Vector = Eigen::Ref<Eigen::VectorXd>;

  explicit Face(Feedthrough feedthrough)
      : feedthrough_(feedthrough == Feedthrough::kYes) {}

  /** Reads the inputs and advances the memory in place. */
  virtual void Step(const Context& context, Memory* memory) const = 0;

  /** Declares the memory and its periodic step. Called when all inputs are
  declared and before the outputs. */
  void DeclareMemory(const Memory& start, double period, double offset = 0) {
    memory_ = this->DeclareAbstractState(drake::Value<Memory>(start));
    result_ticket_ = this->abstract_state_ticket(memory_);
    if (feedthrough_) {
      last_step_ = this->DeclareDiscreteState(Eigen::VectorXd::Constant(
          1, -std::numeric_limits<double>::infinity()));
      stepped_ = &this->DeclareCacheEntry(
          "stepped memory", start, &Face::CalcStepped,
          {this->all_input_ports_ticket(), this->all_state_ticket(),
           this->time_ticket()});
      result_ticket_ = stepped_->ticket();
    }
    this->DeclarePeriodicUnrestrictedUpdateEvent(period, offset,
                                                 &Face::Advance);
  }

  /** The memory that the outputs show. */
  const Memory& EvalResult(const Context& context) const {
    if (feedthrough_) return stepped_->template Eval<Memory>(context);
    return context.get_abstract_state<Memory>(memory_);
  }

  /** What EvalResult() depends on. */
  drake::systems::DependencyTicket result_ticket() const {
    return result_ticket_;
  }

  /** `read(memory, vector)` writes the port's value. */
  void DeclareVectorOutput(const std::string& name, int size,
                           std::function<void(const Memory&, Vector)> read) {
    this->DeclareVectorOutputPort(
        name, drake::systems::BasicVector<double>(size),
        [this, read = std::move(read)](
            const Context& context,
            drake::systems::BasicVector<double>* output) {
          read(EvalResult(context), output->get_mutable_value());
        },
        {result_ticket_});
  }

  /** `read(memory)` returns the port's value, of type T. */
  template <typename T, typename Read>
  void DeclareValueOutput(const std::string& name, Read read) {
    this->DeclareAbstractOutputPort(
        name, [] { return std::make_unique<drake::Value<T>>(); },
        [this, read = std::move(read)](const Context& context,
                                       drake::AbstractValue* output) {
          output->get_mutable_value<T>() = read(EvalResult(context));
        },
        {result_ticket_});
  }

  /** An input port for a value of type T. */
  template <typename T>
  void DeclareValueInput(const std::string& name) {
    this->DeclareAbstractInputPort(name, drake::Value<T>());
  }

 private:
  void CalcStepped(const Context& context, Memory* memory) const {
    *memory = context.get_abstract_state<Memory>(memory_);
    if (context.get_discrete_state(last_step_).value()[0] !=
        context.get_time()) {
      Step(context, memory);
    }
  }

  drake::systems::EventStatus Advance(
      const Context& context, drake::systems::State<double>* state) const {
    Memory& memory = state->template get_mutable_abstract_state<Memory>(
        static_cast<int>(memory_));
    if (feedthrough_) {
      memory = EvalResult(context);
      state->get_mutable_discrete_state(last_step_)[0] = context.get_time();
    } else {
      Step(context, &memory);
    }
    return drake::systems::EventStatus::Succeeded();
  }

  bool feedthrough_{};
  drake::systems::AbstractStateIndex memory_;
  drake::systems::DiscreteStateIndex last_step_;
  drake::systems::DependencyTicket result_ticket_;
  const drake::systems::CacheEntry* stepped_{};
};

}  // namespace dual_proxy
