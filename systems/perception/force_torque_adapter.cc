// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/perception/force_torque_adapter.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "dual_proxy/common/low_pass.h"
#include "dual_proxy/common/possible.h"
#include "dual_proxy/common/rotation.h"

namespace dual_proxy {

using Eigen::Vector3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;

namespace {

/** Periods for which a pose that does not change may be an old one; then the
tool is at rest, or poses are missing. */
constexpr int kLongestHold = 10;
/** Samples in a row that may be refused before the last wrench is too old. */
constexpr std::int64_t kLongestOutage = 10;

}  // namespace

void ForceTorqueAdapterParams::Validate() const {
  ValidateFields("ForceTorqueAdapterParams", *this);
}

ForceTorqueAdapter::ForceTorqueAdapter(const Params& params)
    : params_((params.Validate(), params)),
      gain_(LowPassGain(params.cutoff, params.period)),
      samples_needed_(std::max<std::int64_t>(
          2, std::llround(std::min(1e9, params.tare_time / params.period)))) {}

ForceTorqueAdapterState ForceTorqueAdapter::MakeState() const noexcept {
  State state;
  state.ready = !params_.tare;
  state.taring = params_.tare;
  return state;
}

void ForceTorqueAdapter::NoteMotion(const Vector3d& com,
                                    const std::optional<Vector3d>& velocity,
                                    State* state) const noexcept {
  if (state->com_samples > 0) {
    state->com_periods = std::min(state->com_periods + 1, kLongestHold + 1);
    const bool held = state->com_periods > kLongestHold;
    if (held) {
      state->com_samples = 1;
      state->inertial_force -= gain_ * state->inertial_force;
    }
    if (velocity ? *velocity == state->com_velocity : com == state->com) return;
    if (!held) {
      const double time = state->com_periods * params_.period;
      const Vector3d v =
          velocity ? *velocity : Vector3d((com - state->com) / time);
      if (state->com_samples == 2) {
        const Vector3d acceleration = (v - state->com_velocity) / time;
        state->inertial_force +=
            gain_ * (params_.tool_mass * acceleration - state->inertial_force);
      }
      state->com_velocity = v;
      state->com_samples = 2;
    }
  } else {
    state->com_samples = 1;
  }
  if (velocity) {
    state->com_velocity = *velocity;
    state->com_samples = 2;
  }
  state->com = com;
  state->com_periods = 0;
}

void ForceTorqueAdapter::Tare(const Vector6d& net, bool at_rest,
                              State* state) const noexcept {
  if (!at_rest || state->rest_samples == 0) {
    state->rest_samples = 0;
    state->rest_sum.setZero();
    state->rest_squares.setZero();
    if (!at_rest) return;
  }
  ++state->rest_samples;
  state->rest_sum += net;
  state->rest_squares += net.head<3>().cwiseAbs2();
  if (state->rest_samples < samples_needed_) return;

  const auto count = static_cast<double>(state->rest_samples);
  state->rest_samples = 0;
  const Vector6d mean = state->rest_sum / count;
  const Vector3d variance =
      state->rest_squares / count - mean.head<3>().cwiseAbs2();
  const double noise = params_.tare_max_noise;
  if (mean.head<3>().norm() > params_.tare_max_force ||
      variance.maxCoeff() > noise * noise) {
    ++state->tares_refused;
    return;
  }
  state->bias = mean;
  state->taring = false;
  ++state->tares;
}

void ForceTorqueAdapter::Update(const ForceTorqueAdapterInput& input,
                                State* state) const noexcept {
  if (!IsWithin(input.measured.head<3>(), params_.max_force) ||
      !IsWithin(input.measured.tail<3>(), params_.max_moment) ||
      !IsValidPose(input.X_BE) || !input.p_SE.allFinite() ||
      (input.v_BE && !input.v_BE->allFinite())) {
    ++state->bad_inputs;
    state->com_samples = 0;
    state->inertial_force.setZero();
    state->rest_samples = 0;
    if (++state->outage > kLongestOutage) {
      state->ready = false;
      state->wrench.setZero();
    }
    return;
  }
  state->outage = 0;
  const Eigen::Matrix3d& R_BS = input.X_BE.R;
  const Vector3d p_EC = R_BS * (params_.tool_com - input.p_SE);
  const Vector3d com = input.X_BE.p + p_EC;
  std::optional<Vector3d> velocity;
  if (input.v_BE) {
    const Vector3d w = input.v_BE->tail<3>();
    velocity = input.v_BE->head<3>() + w.cross(p_EC);
  }
  const double speed =
      velocity ? velocity->norm() : (com - state->com).norm() / params_.period;
  const bool at_rest = state->com_samples > 0 && speed < params_.tare_speed;
  NoteMotion(com, velocity, state);

  // What the arm has to exert on the tool though nothing touches it.
  const Vector3d carried =
      -params_.tool_mass * params_.gravity * Vector3d::UnitZ() -
      state->inertial_force;
  const Vector3d carried_S = R_BS.transpose() * carried;
  Vector6d net = input.measured;
  net.head<3>() += carried_S;
  net.tail<3>() += params_.tool_com.cross(carried_S);

  if (input.tare && !state->tare_asked) {
    state->taring = true;
    state->rest_samples = 0;
  }
  state->tare_asked = input.tare;
  if (state->taring) Tare(net, at_rest, state);
  state->ready = !state->taring;
  if (!state->ready) {
    state->wrench.setZero();
    return;
  }
  net -= state->bias;
  const Vector3d force = R_BS * net.head<3>();
  state->wrench.head<3>() = force;
  state->wrench.tail<3>() =
      R_BS * net.tail<3>() - (R_BS * input.p_SE).cross(force);
}

}  // namespace dual_proxy
