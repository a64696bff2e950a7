// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include <drake/math/rigid_transform.h>
#include <drake/systems/framework/leaf_system.h>

#include "dual_proxy/common/pose.h"
#include "dual_proxy/faces/block.h"
#include "dual_proxy/faces/drake_binary.h"

namespace dual_proxy {

/** A pose as Drake's type with the very same numbers: never throws, not even in
Drake's debug builds. Drake asks more of a rotation (orthonormal to 3e-14) than
the algorithms do, and what is no pose stays none: whoever acts on it refuses
it. */
inline drake::math::RigidTransformd ToRigidTransform(const Pose& X) {
  return {drake::math::RotationMatrixd::MakeUnchecked(X.R), X.p};
}

/** A Block as a LeafSystem, whose ports GetInputPort() and GetOutputPort() find
by name: a pose is an abstract RigidTransformd, a message an abstract Message,
normals an abstract Eigen::Matrix3Xd, a reaction an abstract
std::vector<SpatialForce<double>>, as a MultibodyPlant has it.

The block's memory is abstract state of the Context: a diagram can be reset,
cloned and run again with the same bits.

With feedthrough, systems in a row all act on one tick's measurements, as the
fused ones do. Once the step at t has been taken its result stands for the rest
of the instant, whatever the inputs have become by then. So a Drake
ZeroOrderHold of the same period, which samples at t after all of these systems
and the plant have stepped, holds the result of the step at t: put one where the
result goes to hardware or to a plant.

An input that is not finite is no error here: it is handed to the algorithm,
which refuses it, counts it and goes to its safe output. A required input that
is not connected is one, and so is a message of another kind: both are
std::exceptions at the first step, naming system and port. */
class BlockSystem : public drake::systems::LeafSystem<double> {
 public:
  explicit BlockSystem(std::shared_ptr<const Block> block);

  const Block& block() const { return *block_; }

 private:
  using Context = drake::systems::Context<double>;
  // Drake's values copy with `=`.
  struct Memory {
    SharedMemory shared;
  };

  void DeclareInputs();
  void DeclareStep();
  void DeclareOutputs();
  const BlockMemory& EvalMemory(const Context& context) const;
  void CalcStepped(const Context& context, Memory* memory) const;
  drake::systems::EventStatus Advance(
      const Context& context, drake::systems::State<double>* state) const;

  std::shared_ptr<const Block> block_;
  drake::systems::AbstractStateIndex memory_;
  drake::systems::DiscreteStateIndex last_step_;
  drake::systems::DependencyTicket memory_ticket_;
  const drake::systems::CacheEntry* stepped_{};
};

}  // namespace dual_proxy
