// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "dual_proxy/common/random.h"
#include "dual_proxy/experiment/filter_trial.h"

namespace dual_proxy {

/** The force sensor of a trial, 1 kHz: what it adds to the true force is its
bias, white noise, hum and spikes; then it is quantised. */
class FilterTrialSensor {
 public:
  /** @param params  valid; its seed is the sensor's. */
  explicit FilterTrialSensor(const FilterTrialParams& params);

  /** Takes the next sample, N in B. */
  Eigen::Vector3d Measure(const Eigen::Vector3d& force);

 private:
  Eigen::Vector3d CalcSpike();

  FilterTrialParams params_;
  RandomStream random_;
  Eigen::Vector3d bias_;       ///< N, at the beginning.
  Eigen::Vector3d bias_axis_;  ///< About which it turns.
  Eigen::Vector3d hum_;        ///< N
  double hum_phase_;
  Eigen::Vector3d spike_{Eigen::Vector3d::Zero()};  ///< N
  double next_spike_;                               ///< s
  int samples_{0};
};

}  // namespace dual_proxy
