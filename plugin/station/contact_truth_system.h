// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <drake/multibody/plant/contact_results.h>
#include <drake/multibody/tree/multibody_tree_indexes.h>
#include <drake/systems/framework/leaf_system.h>

#include "dual_proxy/simulation/contact_truth.h"

namespace dual_proxy {

/** Reads the tool's contacts from the plant's contact results. No heap.
@param tool_body PandaScene::tool_body. */
ContactTruth CalcContactTruth(
    const drake::multibody::ContactResults<double>& results,
    drake::multibody::BodyIndex tool_body);

/** The tool's true contacts as a vector: CalcContactTruth() as a system.

@system
name: ContactTruthSystem
input_ports:
- contact_results
output_ports:
- truth
@endsystem

Input port:
- `contact_results`, abstract ContactResults<double>: the plant's.

Output port:
- `truth`, 10: force 3, N; normal 3; dimension 1; axis of free motion 3; in B.
  With `rotations` 14: and the number of rotations that are blocked 1, the axis
  of free rotation 3.

No state; the output at t is of the input at t. */
class ContactTruthSystem final : public drake::systems::LeafSystem<double> {
 public:
  /** @param tool_body PandaScene::tool_body.
  @param rotations whether rotations are of interest. */
  explicit ContactTruthSystem(drake::multibody::BodyIndex tool_body,
                              bool rotations = false);

  const drake::systems::InputPort<double>& get_contact_results_input_port()
      const {
    return get_input_port(0);
  }
  const drake::systems::OutputPort<double>& get_truth_output_port() const {
    return get_output_port(0);
  }

 private:
  void CalcTruth(const drake::systems::Context<double>& context,
                 drake::systems::BasicVector<double>* output) const;

  drake::multibody::BodyIndex tool_body_;
};

}  // namespace dual_proxy
