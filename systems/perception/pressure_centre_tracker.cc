// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/perception/pressure_centre_tracker.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "dual_proxy/common/elementary.h"
#include "dual_proxy/common/rotation.h"
#include "dual_proxy/common/validate.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// What depends on neither sensor nor tool.
constexpr double kSmoothingTime = 0.04;  // s: moment and force.
constexpr double kMemoryTime = 2;        // s: where the edge is.
constexpr double kTippingTime = 0.5;     // s: rotation is looked at over it.
constexpr double kLossTime = 0.2;        // s: without a moment.
constexpr double kLeastForce = 0.3;      // N: a lever is none with less.
constexpr double kSpread = 0.005;        // m: along an edge, until it is seen.
constexpr double kSlack = 0.05;          // Of a moment, and of a twist: what a
                                         // normal that is not exact makes seem
                                         // across.

/** `value`, at most as long as `limit`. */
Vector3d Shortened(const Vector3d& value, double limit) noexcept {
  const double norm = value.norm();
  return norm > limit ? Vector3d(value * (limit / norm)) : value;
}

/** Of `value` what is across the unit vector `normal`. */
Vector3d Across(const Vector3d& normal, const Vector3d& value) noexcept {
  return value - normal.dot(value) * normal;
}

/** The unit vector across the line that fits points of this mean and covariance
best among lines that miss the origin by `distance` (less where that is not
possible), from the origin to the line. As long as the points do not show where
it runs, that is straight across the mean. */
Vector2d FitLine(const Vector2d& mean, Matrix2d covariance,
                 double distance) noexcept {
  const double reach = mean.norm();
  if (!(reach > 0)) return Vector2d::UnitX();
  const Vector2d along = mean / reach;
  const Vector2d aside(-along.y(), along.x());
  covariance += kSpread * kSpread * aside * aside.transpose();
  const double angle =
      0.5 * Atan2(2 * covariance(0, 1), covariance(0, 0) - covariance(1, 1));
  const auto [sin, cos] = CalcSinCos(angle);
  const Vector2d across(-sin, cos);
  const double offset = across.dot(mean);
  if (std::abs(offset) >= distance) return offset < 0 ? -across : across;
  const double cosine = std::min(1.0, distance / reach);
  const double sine = std::sqrt(1 - cosine * cosine);
  const Vector2d left = cosine * along + sine * aside;
  const Vector2d right = cosine * along - sine * aside;
  return left.dot(covariance * left) < right.dot(covariance * right) ? left
                                                                     : right;
}

}  // namespace

void PressureCentreParams::Validate() const {
  ValidateFields("PressureCentreParams", *this);
}

Matrix3d PressureCentreState::CalcSelection() const noexcept {
  switch (dimension) {
    case 0:
      return Matrix3d::Zero();
    case 1:
      return axes.col(0) * axes.col(0).transpose();
    default:
      return Matrix3d::Identity() - axes.col(2) * axes.col(2).transpose();
  }
}

PressureCentreTracker::PressureCentreTracker(const Params& params,
                                             double period)
    : params_((params.Validate(), params)),
      period_(period),
      smoothing_gain_(-ExpMinusOne(-period / kSmoothingTime)),
      memory_decay_(Exp(-period / kMemoryTime)),
      tipping_decay_(Exp(-period / kTippingTime)) {
  ThrowUnlessIn("PressureCentreTracker", "period", period, Above(0));
}

void PressureCentreTracker::Update(const PressureCentreInput& input,
                                   State* state) const noexcept {
  if (!std::isfinite(input.moment.squaredNorm()) ||
      !std::isfinite(input.angular_velocity.squaredNorm()) ||
      !std::isfinite(input.force.squaredNorm()) ||
      !std::isfinite(input.normal.squaredNorm())) {
    ++state->bad_inputs;
    return;
  }
  ++state->updates;
  TurnWithTool(input, state);
  const Vector3d sensed = Shortened(input.moment, 1e6);
  const Vector3d& normal = input.normal;
  if (normal.isZero(0)) {
    LearnBias(sensed, state);
    return;
  }

  const Vector3d moment = Across(normal, sensed - state->bias);
  const double force = std::clamp(normal.dot(input.force), 0.0, 1e6);
  const double gain = state->touched ? smoothing_gain_ : 1;
  state->touched = true;
  state->moment = Across(normal, state->moment);
  state->moment += gain * (moment - state->moment);
  state->force += gain * (force - state->force);
  Decide(normal, state);

  Matrix3d& U = state->axes;
  if (state->dimension == 0) {
    U.setIdentity();
  } else {
    U.col(2) = normal;
    const double size = state->moment.norm();
    U.col(0) = size > 0 ? Vector3d(state->moment / size)
                        : Vector3d(normal.unitOrthogonal());
    U.col(1) = U.col(2).cross(U.col(0));
  }
}

void PressureCentreTracker::LearnBias(const Vector3d& moment,
                                      State* state) const noexcept {
  ++state->free_inputs;
  const double gain = std::max(1.0 / static_cast<double>(state->free_inputs),
                               std::min(1.0, period_ / params_.bias_time));
  state->bias += gain * (moment - state->bias);
  if (!state->touched) return;
  State free;
  free.bias = state->bias;
  free.free_inputs = state->free_inputs;
  free.updates = state->updates;
  free.bad_inputs = state->bad_inputs;
  *state = free;
}

void PressureCentreTracker::TurnWithTool(const PressureCentreInput& input,
                                         State* state) const noexcept {
  // The sensor and the edges turn with the tool.
  const Vector3d& w = input.angular_velocity;
  const Matrix3d R = ExpRotation(period_ * Shortened(w, 1e3));
  state->bias = R * state->bias;
  if (!state->touched) return;
  state->moment = R * state->moment;
  state->lever = R * state->lever;
  state->scatter = R * state->scatter * R.transpose();
  state->tipped += period_ * Across(input.normal, w);
  state->tipped *= tipping_decay_;
  state->twisted += period_ * std::abs(input.normal.dot(w));
  state->twisted *= tipping_decay_;
}

bool PressureCentreTracker::IsTipping(const State& state) const noexcept {
  return state.tipped.norm() > params_.tipping_angle + kSlack * state.twisted;
}

bool PressureCentreTracker::PressesInside(const Vector3d& normal,
                                          const State& state) const noexcept {
  Eigen::Matrix<double, 3, 2> plane;
  plane.col(0) = normal.unitOrthogonal();
  plane.col(1) = normal.cross(plane.col(0));
  const Vector2d lever = plane.transpose() * state.lever;
  const Matrix2d scatter = plane.transpose() * state.scatter * plane;
  const Vector2d across =
      FitLine(lever, scatter / state.weight, params_.edge_distance);
  const Vector2d moment = plane.transpose() * state.moment;
  const double less = across.dot(state.force * lever - moment);
  return less > params_.inside_moment + kSlack * moment.norm();
}

void PressureCentreTracker::FindEdge(State* state) const noexcept {
  state->dimension = 1;
  state->inside = state->idle = state->weight = 0;
  state->lever.setZero();
  state->scatter.setZero();
  LearnEdge(state);
}

void PressureCentreTracker::LearnEdge(State* state) const noexcept {
  state->weight *= memory_decay_;
  state->scatter *= memory_decay_;
  const double force = std::max(state->force, kLeastForce);
  const double weight = period_ * force * force;
  const Vector3d change = state->moment / force - state->lever;
  state->weight += weight;
  state->lever += (weight / state->weight) * change;
  state->scatter +=
      weight * change * (state->moment / force - state->lever).transpose();
}

void PressureCentreTracker::Decide(const Vector3d& normal,
                                   State* state) const noexcept {
  const double size = state->moment.norm();
  if (state->dimension == 0) {
    if (size > params_.contact_moment &&
        size > params_.edge_distance * state->force) {
      FindEdge(state);
    }
  } else if (state->dimension == 2) {
    if (IsTipping(*state)) FindEdge(state);
  } else {
    const bool inside = PressesInside(normal, *state);
    if (!inside) LearnEdge(state);
    const auto count = [this](bool is, double* time) {
      *time = is ? *time + period_ : std::max(0.0, *time - period_);
    };
    count(inside, &state->inside);
    count(size < params_.loss_moment, &state->idle);
    if (state->idle > kLossTime) {
      state->dimension = 0;
    } else if (state->inside > params_.inside_time) {
      state->dimension = 2;
      state->tipped.setZero();
      state->twisted = 0;
    }
  }
}

}  // namespace dual_proxy
