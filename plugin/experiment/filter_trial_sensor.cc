// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/filter_trial_sensor.h"

#include <numbers>

#include <Eigen/Geometry>

#include "dual_proxy/common/quantise.h"
#include "dual_proxy/experiment/filter_trial_setting.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;

constexpr double kHumRate = 2 * std::numbers::pi * 50;  // rad/s
constexpr double kSpikeTime = 0.002;                    // s

Vector3d DrawDirection(RandomStream* random) {
  return DrawNormal3(random).normalized();
}

}  // namespace

FilterTrialSensor::FilterTrialSensor(const FilterTrialParams& params)
    : params_(params),
      random_(SplitSeed(params.seed, 2)),
      bias_(params.sensor_bias * DrawDirection(&random_)),
      bias_axis_(DrawDirection(&random_)),
      hum_(params.sensor_hum * DrawDirection(&random_)),
      hum_phase_(DrawUniform(0, 2 * std::numbers::pi, &random_)),
      next_spike_(DrawUniform(0.3, 0.9, &random_)) {}

Vector3d FilterTrialSensor::CalcSpike() {
  const double time = kFilterTrialStep * samples_;
  if (time > next_spike_ + kSpikeTime - 0.5 * kFilterTrialStep) {
    next_spike_ = time + DrawUniform(0.3, 0.9, &random_);
    spike_ = params_.spike * DrawDirection(&random_);
  }
  return time > next_spike_ - 0.5 * kFilterTrialStep ? spike_
                                                     : Vector3d::Zero();
}

Vector3d FilterTrialSensor::Measure(const Vector3d& force) {
  const double time = kFilterTrialStep * samples_;
  const Eigen::AngleAxisd turned(params_.bias_turn * time, bias_axis_);
  Vector3d measured = force + turned * bias_ + CalcSpike();
  measured += params_.sensor_noise * DrawNormal3(&random_);
  measured += std::sin(kHumRate * time + hum_phase_) * hum_;
  ++samples_;
  return Quantise(measured, params_.sensor_step);
}

}  // namespace dual_proxy
