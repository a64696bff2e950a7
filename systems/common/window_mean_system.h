// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/common/face.h"
#include "dual_proxy/common/window_mean.h"

namespace dual_proxy {

/** Mean of a 3-vector over the current window, what a slower system samples:
WindowMean as a system.

@system
name: WindowMeanSystem
input_ports:
- value
output_ports:
- mean
@endsystem

Input port: `value`, 3, of any unit and frame.

Output port: `mean`, 3, of the same.

Steps every `period`; the mean is that of the last step, zero before the first,
without feedthrough. Windows are [k window, (k + 1) window): a system that runs
every `window` sees the mean over the window that just ended. Samples that are
not finite are left out. */
class WindowMeanSystem final : public Face<WindowMeanState<3>> {
 public:
  /** @param window s, > 0.
  @param period s, > 0, between samples.
  @throws std::invalid_argument if one of them is not. */
  explicit WindowMeanSystem(double window = 1 / 15.0, double period = 0.001);

  const InputPort& get_value_input_port() const { return get_input_port(0); }
  const OutputPort& get_mean_output_port() const { return get_output_port(0); }

 private:
  void Step(const Context& context, WindowMeanState<3>* state) const override;

  WindowMean<3> mean_;
};

}  // namespace dual_proxy
