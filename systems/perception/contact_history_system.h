// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/common/face.h"
#include "dual_proxy/perception/contact_history.h"

namespace dual_proxy {

/** What a ContactHistorySystem keeps. */
struct ContactHistoryMemory {
  ContactHistoryState state;
  RememberedContacts prior;  ///< Of the last step.
};

/** Remembers what the filter believed where, and gives it as a prior:
ContactHistory as a system.

@system
name: ContactHistorySystem
input_ports:
- robot_pose
- force_selection
- force_direction
output_ports:
- prior
@endsystem

Input ports:
- `robot_pose`, abstract RigidTransformd: X_BE.
- `force_selection`, 9: Omega_f of the filter, row-major, in B
  (optional).
- `force_direction`, 3: U1 of the filter, in B (optional).

Output ports:
- `prior`, abstract Eigen::Matrix3Xd, k <= 8 columns: unit normals in B, into
  the surface, believed here on earlier visits; k = 0: nothing is known. To the
  filter's `prior`.

Without `force_direction` it notes nothing, without `force_selection` that one
direction. Steps every `params.period`, which is the filter's; the output is
that of the last step, without feedthrough, so that history and filter can be
wired in a ring. */
class ContactHistorySystem final : public Face<ContactHistoryMemory> {
 public:
  /** @throws std::invalid_argument if `params` is invalid. */
  explicit ContactHistorySystem(const ContactHistoryParams& params = {});

  const InputPort& get_robot_pose_input_port() const {
    return get_input_port(0);
  }
  const InputPort& get_force_selection_input_port() const {
    return get_input_port(1);
  }
  const InputPort& get_force_direction_input_port() const {
    return get_input_port(2);
  }
  const OutputPort& get_prior_output_port() const { return get_output_port(0); }

 private:
  void Step(const Context& context,
            ContactHistoryMemory* memory) const override;

  ContactHistory history_;
};

}  // namespace dual_proxy
