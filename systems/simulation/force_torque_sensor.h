// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "dual_proxy/common/random.h"
#include "dual_proxy/common/serialize.h"

namespace dual_proxy {

/** Parameters of ForceTorqueSensor. S is the sensor frame, E the tool point. */
struct ForceTorqueSensorParams {
  /** N and N m, >= 0: standard deviation of white noise per axis and sample. */
  double force_noise_std{0.2};
  double moment_noise_std{0.005};
  /** N and N m, in S: constant error. */
  Eigen::Vector3d force_bias{Eigen::Vector3d::Zero()};
  Eigen::Vector3d moment_bias{Eigen::Vector3d::Zero()};
  /** Hz, >= 0: the sensor's own first-order low-pass, 0 for none. */
  double cutoff{0};
  /** kg, >= 0: mass beyond the sensor, whose weight is removed. */
  double tool_mass{0};
  /** m, in S: centre of that mass. */
  Eigen::Vector3d tool_com{Eigen::Vector3d::Zero()};
  /** m/s^2, >= 0: gravity, along -z of B. */
  double gravity{9.81};
  /** s, > 0: sample period. */
  double period{0.001};

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(MakeNameValue("force_noise_std", &force_noise_std));
    a->Visit(MakeNameValue("moment_noise_std", &moment_noise_std));
    a->Visit(MakeNameValue("force_bias", &force_bias));
    a->Visit(MakeNameValue("moment_bias", &moment_bias));
    a->Visit(MakeNameValue("cutoff", &cutoff));
    a->Visit(MakeNameValue("tool_mass", &tool_mass));
    a->Visit(MakeNameValue("tool_com", &tool_com));
    a->Visit(MakeNameValue("gravity", &gravity));
    a->Visit(MakeNameValue("period", &period));
  }
};

/** What the sensor remembers, and its last output. */
struct ForceTorqueSensorState {
  /** [force; moment], N and N m, in S: after noise, bias and low-pass. */
  Eigen::Matrix<double, 6, 1> measured{Eigen::Matrix<double, 6, 1>::Zero()};
  /** [force; moment] about E, N and N m, in B: of the robot on its environment.
   */
  Eigen::Matrix<double, 6, 1> wrench{Eigen::Matrix<double, 6, 1>::Zero()};
  RandomStream random;
  std::int64_t bad_inputs{0};
  /** False until the first good sample, with which the low-pass starts. */
  bool is_started{false};
};

/** A simulated six-axis force/torque sensor between the arm and its tool. The
arm's reaction on the tool, plus the tool's weight, is what the tool exerts on
its environment (but for the inertia of the tool's own acceleration, which the
sensor sees as a real one does):

    measured = lowpass(reaction_S + bias + noise)
    F_B = R_BS f_measured + m g_B
    M_B = R_BS m_measured + p_com x m g_B - p_SE x F_B          (about E)

This is the adapter of the project's sign: its output points INTO the surface
that the tool pushes on. Input that is not finite is counted, and the output
stays as it was. */
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
  @param reaction_S  [force; moment] about the origin of S, N and N m, in S: of
    the arm on the tool.
  @param R_BS  rotation of the sensor in B.
  @param p_SE_B  m, from the sensor's origin to the tool point, in B.
  @param[in,out] state  made by MakeState(); its `wrench` is the output.
  @returns the output, as in the state. No heap, no throw. */
  Eigen::Matrix<double, 6, 1> Update(
      const Eigen::Matrix<double, 6, 1>& reaction_S,
      const Eigen::Matrix3d& R_BS, const Eigen::Vector3d& p_SE_B,
      State* state) const noexcept;

 private:
  Params params_;
  double gain_{1};
};

}  // namespace dual_proxy
