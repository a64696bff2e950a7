// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "dual_proxy/common/random.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/perception/force_torque_adapter.h"

namespace dual_proxy {

/** Parameters of ForceTorqueSensor: of what is simulated, and of the adapter
behind it. */
struct ForceTorqueSensorParams : ForceTorqueAdapterParams {
  double force_noise_std{0.2};
  double moment_noise_std{0.005};
  Eigen::Vector3d force_bias{Eigen::Vector3d::Zero()};
  Eigen::Vector3d moment_bias{Eigen::Vector3d::Zero()};

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
    ForceTorqueAdapterParams::Serialize(a);
  }
};

/** What the sensor remembers, and its last output. */
struct ForceTorqueSensorState {
  /** [force; moment], N and N m, in S: after noise, bias and low-pass. */
  Eigen::Matrix<double, 6, 1> measured{Eigen::Matrix<double, 6, 1>::Zero()};
  /** Its `wrench` is the output. */
  ForceTorqueAdapterState adapter;
  RandomStream random;
  /** False until the first good sample, with which the low-pass starts. */
  bool is_started{false};
};

/** A simulated six-axis force/torque sensor between the arm and its tool:

    measured = lowpass(reaction_S + bias + noise)

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
  Params params_;
  ForceTorqueAdapter adapter_;
  double gain_{1};
};

}  // namespace dual_proxy
