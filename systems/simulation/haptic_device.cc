// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/haptic_device.h"

#include <algorithm>
#include <cmath>

#include "dual_proxy/common/low_pass.h"
#include "dual_proxy/common/quantise.h"
#include "dual_proxy/common/rotation.h"
#include "dual_proxy/proxy/vector_rate_limiter.h"

namespace dual_proxy {
namespace {

/** exp(A) by scaling, a Taylor series to rounding, and squaring. */
Eigen::Matrix3d MatrixExponential(const Eigen::Matrix3d& A) {
  const double norm = A.cwiseAbs().rowwise().sum().maxCoeff();
  const int squarings = std::max(0, std::ilogb(norm + 1e-300) + 2);
  const Eigen::Matrix3d scaled = A * std::ldexp(1.0, -squarings);
  Eigen::Matrix3d term = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d result = term;
  constexpr int kTerms = 16;  // 0.5^16 / 16! is below the rounding of 1.
  for (int i = 1; i <= kTerms; ++i) {
    term = term * scaled / i;
    result += term;
  }
  for (int i = 0; i < squarings; ++i) result = result * result;
  return result;
}

}  // namespace

void SimulatedHapticDeviceParams::Validate() const {
  ValidateFields("SimulatedHapticDeviceParams", *this);
}

SimulatedHapticDevice::SimulatedHapticDevice(const Params& params)
    : params_(params) {
  params_.Validate();
  const double mass = params_.hand_mass + params_.device_mass;
  Eigen::Matrix3d A;
  A << 0, 1, 0,  //
      -params_.hand_stiffness / mass,
      -(params_.hand_damping + params_.device_damping) / mass, 1,  //
      0, 0, 0;
  transition_ = MatrixExponential(A * params_.period).topRows<2>();
  mobility_ = transition_(1, 2) / mass;
  velocity_gain_ = LowPassGain(params_.velocity_cutoff, params_.period);
}

SimulatedHapticDeviceState SimulatedHapticDevice::MakeState(
    const Pose& pose) const {
  State state;
  state.pose = {ClampToWorkspace(pose.p), pose.R};
  state.read_pose = {Quantise(state.pose.p, params_.resolution), pose.R};
  state.intended = state.pose;
  return state;
}

void SimulatedHapticDevice::Update(
    const Pose& intended, const Eigen::Vector3d& intended_velocity,
    const Eigen::Matrix<double, 6, 1>& device_wrench, State* state,
    bool yields) const noexcept {
  const bool has_intention =
      IsValidPose(intended) && intended_velocity.allFinite();
  const bool has_wrench = device_wrench.allFinite();
  if (!has_intention || !has_wrench) ++state->bad_inputs;
  if (has_intention) state->intended = intended;
  Eigen::Vector3d v_intended =
      has_intention ? intended_velocity : Eigen::Vector3d::Zero();
  if (yields) {
    v_intended = state->velocity;
    state->yielded =
        state->pose.p + params_.period * v_intended - state->intended.p;
  }
  const Eigen::Vector3d p_intended = state->intended.p + state->yielded;
  const Eigen::Vector3d force =
      has_wrench ? Saturate(device_wrench.head<3>(), params_.max_force)
                 : Eigen::Vector3d::Zero();

  // Relative to the intention, which moves steadily to where it is at the end.
  const double mass = params_.hand_mass + params_.device_mass;
  const Eigen::Vector3d start = p_intended - params_.period * v_intended;
  Eigen::Matrix3d inputs;
  inputs.row(0) = state->pose.p - start;
  inputs.row(1) = state->velocity - v_intended;
  inputs.row(2) = (force - params_.device_damping * v_intended) / mass;
  Eigen::Matrix<double, 2, 3> next = transition_ * inputs;
  Eigen::Vector3d friction = Eigen::Vector3d::Zero();
  if (params_.device_friction > 0) {
    const Eigen::Vector3d sliding = next.row(1).transpose() + v_intended;
    friction = Saturate(-sliding / mobility_, params_.device_friction);
    next += transition_.col(2) * (friction / mass).transpose();
  }
  const Eigen::Vector3d p_start = state->pose.p;
  const Eigen::Vector3d v_start = state->velocity;
  const Eigen::Vector3d p = next.row(0).transpose() + p_intended;
  state->velocity = next.row(1).transpose() + v_intended;
  const Eigen::Vector3d v_free = state->velocity;
  state->pose.p = ClampToWorkspace(p);
  const Eigen::Vector3d outward = p - state->pose.p;
  if (outward.squaredNorm() > 0) {
    const Eigen::Vector3d axial = Eigen::Vector3d::UnitX();
    // The two walls of the cylinder, each stops only what moves into it.
    for (const Eigen::Vector3d& wall :
         {Eigen::Vector3d(outward.x() * axial),
          Eigen::Vector3d(outward - outward.x() * axial)}) {
      const double speed = wall.dot(state->velocity);
      if (speed > 0) state->velocity -= speed / wall.squaredNorm() * wall;
    }
  }
  // What is left of all that acts on the device, its ends included, beside what
  // its mass takes.
  const Eigen::Vector3d end_stop =
      mass / params_.period * (state->velocity - v_free);
  state->handle_force =
      force + friction + end_stop -
      params_.device_damping / params_.period * (state->pose.p - p_start) -
      params_.device_mass / params_.period * (state->velocity - v_start);
  state->pose.R = state->intended.R;
  state->hand_force = params_.hand_stiffness * (p_intended - state->pose.p) +
                      params_.hand_damping * (v_intended - state->velocity);

  const Eigen::Vector3d p_read = Quantise(state->pose.p, params_.resolution);
  Eigen::Matrix<double, 6, 1> difference;
  difference.head<3>() = (p_read - state->read_pose.p) / params_.period;
  difference.tail<3>() =
      LogRotation(state->pose.R * state->read_pose.R.transpose()) /
      params_.period;
  state->read_velocity += velocity_gain_ * (difference - state->read_velocity);
  state->read_pose = {p_read, state->pose.R};
}

Eigen::Vector3d SimulatedHapticDevice::ClampToWorkspace(
    const Eigen::Vector3d& p) const noexcept {
  Eigen::Vector3d clamped = p;
  clamped.x() = std::clamp(p.x(), -params_.workspace_half_length,
                           params_.workspace_half_length);
  const double radius = p.tail<2>().norm();
  if (radius > params_.workspace_radius) {
    clamped.tail<2>() *= params_.workspace_radius / radius;
  }
  return clamped;
}

}  // namespace dual_proxy
