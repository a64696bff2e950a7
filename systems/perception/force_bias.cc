// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/perception/force_bias.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "dual_proxy/common/elementary.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kTurning = 0.25;   // rad/sqrt(s): the tool, in B.
constexpr double kFastest = 0.3;    // N/s: a force that grows faster is none.
constexpr double kFreeDrift = 4;    // times the drift: the tool turns.
constexpr double kShownTime = 1;    // s: what the velocity showed is old,
constexpr double kShownWay = 0.05;  // m: or the surface another one.
constexpr double kNormalStd = 0.2;  // rad: of a normal that nothing shows,
constexpr double kShownStd = 0.01;  // and at best.
constexpr double kInputTime = 0.1;  // s: inputs within it say the same.
constexpr double kUnshownTime = 1;  // s: likewise, of a normal not shown.
constexpr double kAcross = 0.1;     // Friction is not exactly along.

}  // namespace

ForceBias::ForceBias(double std, double drift, double force_noise,
                     double velocity_noise, double period)
    : variance_(std * std),
      drift_variance_(drift * drift * period),
      force_variance_(force_noise * force_noise),
      velocity_noise_(velocity_noise),
      period_(period) {}

ForceBiasState ForceBias::MakeState() const {
  ForceBiasState state;
  state.covariance.diagonal().setConstant(variance_);
  return state;
}

double ForceBias::CalcStd(const ForceBiasState& state) noexcept {
  return std::sqrt(std::max(0.0, state.covariance.diagonal().maxCoeff()));
}

void ForceBias::Drift(ForceBiasState* state) const noexcept {
  // A weight that is compensated wrongly turns as the tool does.
  const double turning2 =
      kTurning * kTurning * period_ * state->mean.squaredNorm();
  for (int i = 0; i < 3; ++i) {
    state->covariance(i, i) = std::min(
        state->covariance(i, i) + drift_variance_ + turning2, variance_);
  }
}

void ForceBias::LearnFree(const Vector3d& force,
                          ForceBiasState* state) const noexcept {
  Matrix3d& P = state->covariance;
  for (int i = 0; i < 3; ++i) {
    P(i, i) += (kFreeDrift * kFreeDrift - 1) * drift_variance_;
  }
  // Alike in all directions: one gain does.
  const double variance = P.diagonal().maxCoeff();
  const double gain = variance / (variance + force_variance_);
  const double most = kFastest * period_ + gain * std::sqrt(variance);
  Vector3d change = gain * (force - state->mean);
  const double size = change.norm();
  if (size > most) change *= most / size;
  state->mean += change;
  P *= 1 - gain;
}

void ForceBias::LearnSliding(const Vector3d& force,
                             const SlidingContact& contact,
                             ForceBiasState* state) const noexcept {
  const double speed = contact.velocity.norm();
  const Vector3d along = contact.velocity / speed;
  const Vector3d across = contact.normal.cross(along).normalized();
  const double ratio = speed / velocity_noise_;
  state->shown *= Exp(-period_ / kShownTime - period_ * speed / kShownWay);
  state->shown += ratio * ratio * (along * along.transpose());

  const double shown = across.dot(state->shown * across);
  const double unshown2 = 1 / (1 / (kNormalStd * kNormalStd) + shown);
  const double normal2 = unshown2 * (kUnshownTime / period_) +
                         kShownStd * kShownStd * (kInputTime / period_);
  const double astray = kAcross * force.dot(along);
  const double noise2 =
      contact.force * contact.force * normal2 +
      (force_variance_ + astray * astray) * (kInputTime / period_);
  Matrix3d& P = state->covariance;
  const Vector3d Pc = P * across;
  const double total2 = across.dot(Pc) + noise2;
  const double residual = across.dot(force - state->mean);
  state->mean += Pc * (residual / total2);
  P -= Pc * (Pc / total2).transpose();
}

}  // namespace dual_proxy
