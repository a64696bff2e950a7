// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/window_mean_system.h"

#include "dual_proxy/common/validate.h"

namespace dual_proxy {

WindowMeanSystem::WindowMeanSystem(double window, double period)
    : Face(Feedthrough::kNo), mean_(window) {
  ThrowUnlessIn("WindowMeanSystem", "period", period, Above(0));
  DeclareVectorInputPort("value", 3);
  DeclareMemory(mean_.MakeState(), period);
  DeclareVectorOutput(
      "mean", 3,
      [](const WindowMeanState<3>& state, Vector mean) { mean = state.mean; });
}

void WindowMeanSystem::Step(const Context& context,
                            WindowMeanState<3>* state) const {
  mean_.Update(context.get_time(), get_value_input_port().Eval(context), state);
}

}  // namespace dual_proxy
