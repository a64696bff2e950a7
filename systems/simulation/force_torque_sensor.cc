// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/force_torque_sensor.h"

#include "dual_proxy/common/low_pass.h"

namespace dual_proxy {

void ForceTorqueSensorParams::Validate() const {
  ValidateFields("ForceTorqueSensorParams", *this);
}

ForceTorqueSensor::ForceTorqueSensor(const Params& params)
    : params_((params.Validate(), params)),
      adapter_(params),
      gain_(LowPassGain(params.cutoff, params.period)) {}

ForceTorqueSensorState ForceTorqueSensor::MakeState(std::uint64_t seed) const {
  State state;
  state.adapter = adapter_.MakeState();
  state.random = RandomStream(seed);
  return state;
}

Eigen::Matrix<double, 6, 1> ForceTorqueSensor::Update(
    const ForceTorqueAdapterInput& input, State* state) const noexcept {
  ForceTorqueAdapterInput sample = input;
  if (!input.measured.allFinite()) {
    adapter_.Update(sample, &state->adapter);  // Which refuses it.
    return state->adapter.wrench;
  }
  sample.measured.head<3>() += params_.force_bias;
  sample.measured.tail<3>() += params_.moment_bias;
  for (int i = 0; i < 6; ++i) {
    sample.measured(i) +=
        (i < 3 ? params_.force_noise_std : params_.moment_noise_std) *
        state->random.Normal();
  }
  const double gain = state->is_started ? gain_ : 1;
  state->is_started = true;
  state->measured += gain * (sample.measured - state->measured);
  sample.measured = state->measured;
  adapter_.Update(sample, &state->adapter);
  return state->adapter.wrench;
}

}  // namespace dual_proxy
