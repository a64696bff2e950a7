// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/force_torque_sensor.h"

#include <cmath>

#include "dual_proxy/common/low_pass.h"
#include "dual_proxy/common/quantise.h"

namespace dual_proxy {

using Vector6 = Eigen::Matrix<double, 6, 1>;

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
  state.late.setZero(
      6, static_cast<Eigen::Index>(std::round(params_.delay / params_.period)));
  return state;
}

Eigen::Matrix<double, 6, 1> ForceTorqueSensor::Update(
    const ForceTorqueAdapterInput& input, State* state) const noexcept {
  ForceTorqueAdapterInput sample = input;
  if (!input.measured.allFinite()) {
    adapter_.Update(sample, &state->adapter);  // Which refuses it.
    return state->adapter.wrench;
  }
  AddErrors(&sample.measured, state);
  const double gain = state->samples > 0 ? gain_ : 1;
  state->filtered += gain * (sample.measured - state->filtered);
  // Drawn in any case: what else is random does not depend on it.
  const bool comes =
      params_.dropout == 0 || state->random.Uniform() >= params_.dropout;
  const Vector6 newest = Delayed(Quantised(state->filtered), state);
  if (comes) state->measured = newest;
  ++state->samples;
  sample.measured = state->measured;
  adapter_.Update(sample, &state->adapter);
  return state->adapter.wrench;
}

void ForceTorqueSensor::AddErrors(Vector6* measured,
                                  State* state) const noexcept {
  const double time = params_.period * static_cast<double>(state->samples);
  measured->head<3>() += params_.force_bias + time * params_.force_drift;
  measured->tail<3>() += params_.moment_bias;
  for (int i = 0; i < 6; ++i) {
    (*measured)(i) +=
        (i < 3 ? params_.force_noise_std : params_.moment_noise_std) *
        state->random.Normal();
  }
  if (params_.spike_rate == 0) return;
  if (state->random.Uniform() < params_.spike_rate * params_.period) {
    Eigen::Vector3d direction;
    for (double& element : direction) element = state->random.Normal();
    measured->head<3>() += params_.spike_force * direction.normalized();
  }
}

Vector6 ForceTorqueSensor::Quantised(const Vector6& measured) const noexcept {
  Vector6 result;
  result << Quantise(measured.head<3>(), params_.force_step),
      Quantise(measured.tail<3>(), params_.moment_step);
  return result;
}

Vector6 ForceTorqueSensor::Delayed(const Vector6& measured,
                                   State* state) const noexcept {
  const Eigen::Index length = state->late.cols();
  if (length == 0) return measured;
  // Until the first has come, it stands for those before.
  if (state->samples == 0) state->late.colwise() = measured;
  auto oldest = state->late.col(state->samples % length);
  const Vector6 result = oldest;
  oldest = measured;
  return result;
}

}  // namespace dual_proxy
