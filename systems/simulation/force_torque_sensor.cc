// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/force_torque_sensor.h"

#include <Eigen/Geometry>

#include "dual_proxy/common/low_pass.h"
#include "dual_proxy/common/validate.h"

namespace dual_proxy {

void ForceTorqueSensorParams::Validate() const {
  constexpr const char* kWho = "ForceTorqueSensorParams";
  ThrowUnlessNonNegative(kWho, "force_noise_std", force_noise_std);
  ThrowUnlessNonNegative(kWho, "moment_noise_std", moment_noise_std);
  ThrowUnlessFinite(kWho, "force_bias", force_bias);
  ThrowUnlessFinite(kWho, "moment_bias", moment_bias);
  ThrowUnlessNonNegative(kWho, "cutoff", cutoff);
  ThrowUnlessNonNegative(kWho, "tool_mass", tool_mass);
  ThrowUnlessFinite(kWho, "tool_com", tool_com);
  ThrowUnlessNonNegative(kWho, "gravity", gravity);
  ThrowUnlessPositive(kWho, "period", period);
}

ForceTorqueSensor::ForceTorqueSensor(const Params& params) : params_(params) {
  params_.Validate();
  gain_ = LowPassGain(params_.cutoff, params_.period);
}

ForceTorqueSensorState ForceTorqueSensor::MakeState(std::uint64_t seed) const {
  State state;
  state.random = RandomStream(seed);
  return state;
}

Eigen::Matrix<double, 6, 1> ForceTorqueSensor::Update(
    const Eigen::Matrix<double, 6, 1>& reaction_S, const Eigen::Matrix3d& R_BS,
    const Eigen::Vector3d& p_SE_B, State* state) const noexcept {
  if (!reaction_S.allFinite() || !R_BS.allFinite() || !p_SE_B.allFinite()) {
    ++state->bad_inputs;
    return state->wrench;
  }
  Eigen::Matrix<double, 6, 1> sample = reaction_S;
  sample.head<3>() += params_.force_bias;
  sample.tail<3>() += params_.moment_bias;
  for (int i = 0; i < 6; ++i) {
    sample(i) += (i < 3 ? params_.force_noise_std : params_.moment_noise_std) *
                 state->random.Normal();
  }
  const double gain = state->is_started ? gain_ : 1;
  state->is_started = true;
  state->measured += gain * (sample - state->measured);

  const Eigen::Vector3d weight =
      -params_.tool_mass * params_.gravity * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d force = R_BS * state->measured.head<3>() + weight;
  state->wrench.head<3>() = force;
  state->wrench.tail<3>() = R_BS * state->measured.tail<3>() +
                            (R_BS * params_.tool_com).cross(weight) -
                            p_SE_B.cross(force);
  return state->wrench;
}

}  // namespace dual_proxy
