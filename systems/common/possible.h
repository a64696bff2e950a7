// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <limits>

#include <Eigen/Core>

namespace dual_proxy {

/** @file
What an input can be at all. A number beyond these bounds was never measured: it
is refused as one that is not finite is, by turning it into NaN where it comes
in (the sides, and IsValid() of what comes over the link). They are far beyond
any robot, so that nothing that is true is refused, and far below where a square
overflows. */

/** m, rad: where a tool may be, and a joint. */
inline constexpr double kMaxPosition = 1e3;
/** m/s, rad/s: how fast a joint, a tool or a handle may be. */
inline constexpr double kMaxSpeed = 100;
/** m: how far a haptic device's handle may be from its home. */
inline constexpr double kMaxDevicePosition = 10;
/** N, N m: what a force sensor may feel. Its own range, which is less, is its
adapter's to know (ForceTorqueAdapterParams). */
inline constexpr double kMaxForce = 1e4;
/** SI units: any entry of a model's terms. */
inline constexpr double kMaxModelTerm = 1e6;
/** s: any clock's reading, those that count from 1970 included. */
inline constexpr double kMaxTime = 1e11;
/** SI units: sums over a run that travel over the link, of energies and waves.
 */
inline constexpr double kMaxSum = 1e9;

/** Whether all numbers are within +-bound; no number is not. */
inline bool IsWithin(double value, double bound) noexcept {
  return std::abs(value) <= bound;
}
template <typename Derived>
bool IsWithin(const Eigen::MatrixBase<Derived>& values, double bound) noexcept {
  return (values.array().abs() <= bound).all();
}

/** Makes NaN of numbers that are finite, but not all within +-bound. */
inline void RefuseBeyond(double bound, double* value) noexcept {
  if (std::isfinite(*value) && !IsWithin(*value, bound)) {
    *value = std::numeric_limits<double>::quiet_NaN();
  }
}
template <typename Derived>
void RefuseBeyond(double bound, Eigen::MatrixBase<Derived>* values) noexcept {
  if (values->allFinite() && !IsWithin(*values, bound)) {
    values->setConstant(std::numeric_limits<double>::quiet_NaN());
  }
}

/** Stores a number, or a vector, in a memory unless it is not finite. */
inline void StoreIfFinite(double value, double* memory) noexcept {
  if (std::isfinite(value)) *memory = value;
}
inline void StoreIfFinite(const Eigen::Vector3d& value,
                          Eigen::Vector3d* memory) noexcept {
  if (value.allFinite()) *memory = value;
}

}  // namespace dual_proxy
