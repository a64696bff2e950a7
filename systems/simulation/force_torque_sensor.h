// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "dual_proxy/common/random.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/perception/force_torque_adapter.h"

namespace dual_proxy {

/** Longest delay of a simulated sensor, s. */
inline constexpr double kMaxSensorDelay = 0.1;

/** Parameters of ForceTorqueSensor: of what is simulated, and of the adapter
behind it. */
struct ForceTorqueSensorParams : ForceTorqueAdapterParams {
  double force_noise_std{0.2};
  double moment_noise_std{0.005};
  Eigen::Vector3d force_bias{Eigen::Vector3d::Zero()};
  Eigen::Vector3d moment_bias{Eigen::Vector3d::Zero()};
  Eigen::Vector3d force_drift{Eigen::Vector3d::Zero()};
  double force_step{0};
  double moment_step{0};
  double dropout{0};
  double spike_rate{0};
  double spike_force{20};
  double delay{0};

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("force_noise_std", &force_noise_std, AtLeast(0), "N",
                   "standard deviation of white noise per axis and sample"));
    a->Visit(Field("moment_noise_std", &moment_noise_std, AtLeast(0), "N m",
                   "likewise of moments"));
    a->Visit(Field("force_bias", &force_bias, Finite(), "N",
                   "in S: constant error"));
    a->Visit(Field("moment_bias", &moment_bias, Finite(), "N m",
                   "in S: constant error"));
    a->Visit(Field("force_drift", &force_drift, Finite(), "N/s",
                   "in S: by which force_bias goes on"));
    a->Visit(Field("force_step", &force_step, AtLeast(0), "N",
                   "between the values that the sensor can give"));
    a->Visit(Field("moment_step", &moment_step, AtLeast(0), "N m",
                   "likewise of moments"));
    a->Visit(Field("dropout", &dropout, Between(0, 1), "",
                   "share of samples that do not come: the last one stands"));
    a->Visit(Field("spike_rate", &spike_rate, Between(0, 100), "1/s",
                   "of spikes, each one sample long"));
    a->Visit(Field("spike_force", &spike_force, AtLeast(0), "N",
                   "size of a spike, in any direction"));
    a->Visit(Field("delay", &delay, Between(0, kMaxSensorDelay), "s",
                   "before a sample comes, in whole periods"));
    ForceTorqueAdapterParams::Serialize(a);
  }
};

/** What the sensor remembers, and its last output. */
struct ForceTorqueSensorState {
  /** [force; moment], N and N m, in S: as the sensor gives it. */
  Eigen::Matrix<double, 6, 1> measured{Eigen::Matrix<double, 6, 1>::Zero()};
  /** Its `wrench` is the output. */
  ForceTorqueAdapterState adapter;
  RandomStream random;
  /** After noise, bias and low-pass. */
  Eigen::Matrix<double, 6, 1> filtered{Eigen::Matrix<double, 6, 1>::Zero()};
  /** Samples on their way, a column each: as long as the delay, a ring. */
  Eigen::Matrix<double, 6, Eigen::Dynamic> late;
  std::int64_t samples{0};  ///< Good ones; the low-pass starts with the first.
};

/** A simulated six-axis force/torque sensor between the arm and its tool:

    measured = quantised(lowpass(reaction_S + bias + noise + spikes))

a delay later, but for samples that drop out,

and a ForceTorqueAdapter, which makes of it what the tool exerts on its
environment, and refuses what is not finite. */
class ForceTorqueSensor {
 public:
  using Params = ForceTorqueSensorParams;
  using State = ForceTorqueSensorState;

  /** @throws std::invalid_argument if `params` is invalid. */
  explicit ForceTorqueSensor(const Params& params = {});

  const Params& params() const { return params_; }

  /** Output zero; the same seed gives the same noise, bit for bit. */
  State MakeState(std::uint64_t seed = 0) const;

  /** Takes a sample.
  @param input  its `measured` is the true reaction of the arm on the tool.
  @param[in,out] state  made by MakeState().
  @returns the output, as in state->adapter. No heap, no throw. */
  Eigen::Matrix<double, 6, 1> Update(const ForceTorqueAdapterInput& input,
                                     State* state) const noexcept;

 private:
  using Vector6 = Eigen::Matrix<double, 6, 1>;

  void AddErrors(Vector6* measured, State* state) const noexcept;
  Vector6 Quantised(const Vector6& measured) const noexcept;
  /** Takes a sample and gives the one of a delay ago. */
  Vector6 Delayed(const Vector6& measured, State* state) const noexcept;

  Params params_;
  ForceTorqueAdapter adapter_;
  double gain_{1};
};

}  // namespace dual_proxy
