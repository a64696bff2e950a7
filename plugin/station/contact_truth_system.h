// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <drake/multibody/plant/contact_results.h>
#include <drake/multibody/tree/multibody_tree_indexes.h>
#include <drake/systems/framework/leaf_system.h>
#include <Eigen/Core>

#include "dual_proxy/experiment/rotation_truth.h"

namespace dual_proxy {

/** What really touches, from the simulator. */
struct ContactTruth {
  /** N, in B: of the robot on its environment, friction included. */
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};
  /** Unit vector in B, INTO the surface; with several surfaces the direction of
  the normal forces' sum; zero without contact. */
  Eigen::Vector3d normal{Eigen::Vector3d::Zero()};
  /** Number of independent normals, 0 to 3 (normals within 10 deg of the
  others' span are not counted again). */
  int dimension{0};
};

/** Reads the tool's contacts from the plant's contact results. Touching without
force counts as no contact. No heap.
@param tool_body PandaScene::tool_body. */
ContactTruth CalcContactTruth(
    const drake::multibody::ContactResults<double>& results,
    drake::multibody::BodyIndex tool_body);

/** Which rotations the tool's contacts block. The arguments are those of
CalcContactTruth(). No heap. */
RotationTruth CalcRotationTruth(
    const drake::multibody::ContactResults<double>& results,
    drake::multibody::BodyIndex tool_body);

/** The tool's true contacts as a vector: CalcContactTruth() and, on request,
CalcRotationTruth() as a system.

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
- `truth`, 7: force 3, N; normal 3; dimension 1; in B. With `rotations` 11: and
  the number of rotations that are blocked 1, the axis of free rotation 3.

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
  bool rotations_{false};
};

}  // namespace dual_proxy
