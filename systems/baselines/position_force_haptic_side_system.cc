// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/baselines/position_force_haptic_side_system.h"

#include "dual_proxy/common/validate.h"

namespace dual_proxy {

using State = PositionForceHapticSideState;

PositionForceHapticSideSystem::PositionForceHapticSideSystem(
    const PositionForceHapticSideParams& params, double period)
    : Face(Feedthrough::kNo), side_(params) {
  ThrowUnlessIn("PositionForceHapticSideSystem", "period", period, Above(0));
  DeclareValueInput<ForceMessage>("force_message");
  DeclareMemory(side_.MakeState(), period);
  DeclareVectorOutput("device_wrench", 6,
                      [](const State& state, Vector wrench) {
                        wrench << state.reference_force, 0, 0, 0;
                      });
  DeclareVectorOutput("link_status", kLinkStatusSize,
                      [](const State& state, Vector status) {
                        status = LinkStatusVector(state.link);
                      });
  DeclareVectorOutput("link_counters", 5, [](const State& state, Vector count) {
    const LinkMonitorState& link = state.link;
    count << static_cast<double>(link.dropped + link.bad_inputs),
        static_cast<double>(link.bad_inputs), static_cast<double>(link.gaps),
        static_cast<double>(link.spikes), static_cast<double>(link.losses);
  });
}

void PositionForceHapticSideSystem::Step(const Context& context,
                                         State* state) const {
  side_.Update(context.get_time(),
               get_force_message_input_port().Eval<ForceMessage>(context),
               state);
}

}  // namespace dual_proxy
