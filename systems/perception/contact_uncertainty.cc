// SPDX-License-Identifier: BSD-3-Clause
// ContactTracker: how sure it is.
#include "dual_proxy/perception/contact_tracker.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "dual_proxy/common/elementary.h"
#include "dual_proxy/common/norm.h"
#include "dual_proxy/perception/contact_tracker_tools.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kFrictionTilt = 0.38;  // rad: friction's, with 95 %.
constexpr double kShapeLag = 0.0012;    // m: it is behind by this.

/** rad^2: square of how far friction may have tilted what never slid. */
double CalcTilt2(const TrackedContact& contact) noexcept {
  return contact.slid < kSettledSlide ? kFrictionTilt * kFrictionTilt : 0;
}

/** Noises are set larger than they are, and so are the clouds, those of normals
that sliding shows the most: this makes the 95 % come true. */
double CalcScale2(const TrackedContact& contact) noexcept {
  return contact.slid < kSettledSlide ? 0.2 : 0.08;
}

/** Along the principal axes of a plane. */
struct PlaneVariances {
  double largest{0};
  double smallest{0};
};

/** Those across `normal`. */
PlaneVariances CalcPlaneVariances(const Matrix3d& covariance,
                                  const Vector3d& normal) noexcept {
  const Vector3d x = MakeTangent(normal, Vector3d::UnitX());
  const Vector3d y = normal.cross(x);
  const double xx = x.dot(covariance * x);
  const double yy = y.dot(covariance * y);
  const double xy = x.dot(covariance * y);
  const double half = 0.5 * StableNorm(Eigen::Vector2d(xx - yy, 2 * xy));
  const double middle = 0.5 * (xx + yy);
  return {.largest = std::max(0.0, middle + half),
          .smallest = std::max(0.0, middle - half)};
}

/** rad^2: square of how far what fits badly may tilt the normal, with 95 %. */
double CalcMisfitTilt2(const ContactTrackerState& state) noexcept {
  const double force = std::max(1.0, state.contacts[0].smooth_force);
  // As a surface rises under it, the tool's way is not along the surface.
  const double rise =
      state.surface_speed / std::max(1e-3, state.velocity.norm());
  const double rolled = state.contacts[0].rolled;
  const double bend = kShapeLag * state.contacts[0].shape.norm();
  return std::min(
      1.0, 3.84 * (state.friction_variance + state.astray2 / (force * force) +
                   state.into2 + bend * bend) +
               rise * rise + 2 * rolled * rolled);
}

/** rad^2: square of how far what remains of a bias tilts the normal of the
contact that is pushed least, with 95 %. */
double CalcBiasTilt2(const ContactTrackerState& state) noexcept {
  const Matrix3d& P = state.bias.covariance;
  const Vector3d& normal = state.contacts[0].normal;
  double force = state.contacts[0].smooth_force;
  double variance = 0;
  if (state.count == 1) {
    variance = CalcPlaneVariances(P, normal).largest;
  } else {
    const Vector3d axis = CalcFreeAxis(state);
    force = std::min(force, state.contacts[1].smooth_force);
    variance = axis.dot(P * axis);
  }
  return std::min(3.84 * variance / std::max(force * force, 1.0), 1.0);
}

}  // namespace

double ContactTracker::CalcDirectionUncertainty(const State& state) noexcept {
  // Of a plane normal distribution with variances a >= b the radius that holds
  // 95 % is, within 1 %, the root of 3.84 a + 2.16 b.
  switch (state.count) {
    case 0:
      return 0.5 * std::numbers::pi;
    case 1: {
      const TrackedContact& contact = state.contacts[0];
      const PlaneVariances normal =
          CalcPlaneVariances(contact.covariance, contact.normal);
      return std::sqrt(CalcScale2(contact) *
                           (3.84 * normal.largest + 2.16 * normal.smallest) +
                       CalcTilt2(contact) + CalcBiasTilt2(state) +
                       CalcMisfitTilt2(state));
    }
    case 2: {
      const Vector3d axis = CalcFreeAxis(state);
      double square = 0;
      for (int i = 0; i < 2; ++i) {
        const TrackedContact& contact = state.contacts[i];
        square += CalcScale2(contact) * 3.84 *
                  std::max(0.0, axis.dot(contact.covariance * axis));
      }
      return std::sqrt(
          square +
          std::max(CalcTilt2(state.contacts[0]), CalcTilt2(state.contacts[1])) +
          CalcBiasTilt2(state) + CalcMisfitTilt2(state));
    }
    default:
      return 0;
  }
}

double ContactTracker::CalcCountConfidence(const State& state) const noexcept {
  double pending = state.evidence;
  for (int i = 0; i < state.count; ++i) {
    pending = std::max(pending, state.contacts[i].loss);
  }
  // How often the count was right at a share of the evidence that is needed.
  return 0.99 * Exp(-5 * pending / params_.evidence);
}

}  // namespace dual_proxy
