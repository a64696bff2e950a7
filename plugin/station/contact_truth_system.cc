// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/station/contact_truth_system.h"

#include <drake/common/value.h>

namespace dual_proxy {

using drake::multibody::BodyIndex;
using drake::multibody::ContactResults;

ContactTruth CalcContactTruth(const ContactResults<double>& results,
                              BodyIndex tool_body) {
  ContactTruth truth;
  for (int i = 0; i < results.num_point_pair_contacts(); ++i) {
    const auto& info = results.point_pair_contact_info(i);
    // Drake gives the force on body B and the normal from B into A.
    double sign{};
    if (info.bodyB_index() == tool_body) {
      sign = -1;
    } else if (info.bodyA_index() == tool_body) {
      sign = 1;
    } else {
      continue;
    }
    truth.Add(sign * info.contact_force(), -sign * info.point_pair().nhat_BA_W,
              info.contact_point());
  }
  return truth;
}

ContactTruthSystem::ContactTruthSystem(BodyIndex tool_body, bool rotations)
    : tool_body_(tool_body) {
  const auto& input = DeclareAbstractInputPort(
      "contact_results", drake::Value<ContactResults<double>>());
  DeclareVectorOutputPort("truth", rotations ? 14 : 10,
                          &ContactTruthSystem::CalcTruth, {input.ticket()});
}

void ContactTruthSystem::CalcTruth(
    const drake::systems::Context<double>& context,
    drake::systems::BasicVector<double>* output) const {
  const auto& results =
      get_contact_results_input_port().Eval<ContactResults<double>>(context);
  output->get_mutable_value() =
      CalcContactTruth(results, tool_body_).ToVector().head(output->size());
}

}  // namespace dual_proxy
