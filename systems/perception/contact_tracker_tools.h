// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "dual_proxy/perception/contact_tracker.h"

// What the files of ContactTracker share.

namespace dual_proxy {

inline constexpr double kSettledSlide =
    0.002;                                   // m: the normal is known by then.
inline constexpr double kTilt = 0.12;        // rad: usual tilt by friction.
inline constexpr double kSinkingTime = 0.1;  // s: sinking is looked at over it.
inline constexpr double kOnsetTime = 1;      // s: of finding the mean force,
inline constexpr double kOnsetImpulse = 0.6;  // N s: enough for the mean force.

inline double CalcStd(const TrackedContact& contact) noexcept {
  return std::sqrt(std::max(0.0, contact.covariance.trace()));
}

/** Whether its normal still follows the mean force. */
inline bool Begins(const TrackedContact& contact) noexcept {
  return contact.onset < kOnsetTime || contact.pressed < kOnsetImpulse;
}

/** Unit vector across `normal`, along `direction` if that has such a part. */
inline Eigen::Vector3d MakeTangent(const Eigen::Vector3d& normal,
                                   const Eigen::Vector3d& direction) noexcept {
  const Eigen::Vector3d tangent = direction - direction.dot(normal) * normal;
  return tangent.norm() > 1e-9 ? tangent.normalized() : normal.unitOrthogonal();
}

/** m/N: what a contact gives, as far as it has been seen to. */
inline double CalcGiven(const TrackedContact& contact) noexcept {
  constexpr double kNothing = 2;  // N^2: weight of giving nothing, at first.
  return contact.give / (kNothing + contact.give_weight);
}

/** Along both surfaces of two contacts. */
inline Eigen::Vector3d CalcFreeAxis(const ContactTrackerState& state) noexcept {
  return state.contacts[0].normal.cross(state.contacts[1].normal).normalized();
}

/** Of `value` what is along the surfaces that are touched. */
inline Eigen::Vector3d CalcFreePart(const Eigen::Vector3d& value,
                                    const ContactTrackerState& state) noexcept {
  const Eigen::Vector3d& first = state.contacts[0].normal;
  if (state.count == 1) return value - value.dot(first) * first;
  if (state.count > 2) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d axis = CalcFreeAxis(state);
  return value.dot(axis) * axis;
}

}  // namespace dual_proxy
