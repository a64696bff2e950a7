// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "dual_proxy/common/enum_strings.h"

namespace dual_proxy {

/** How an OperatorPath runs between its points. */
enum class PathInterpolation {
  kMinimumJerk,  ///< From rest to rest, as a person moves between places.
  kLinear,       ///< Straight, at constant speed.
  kCubic,        ///< Smooth velocity through all points: for recorded motion.
};

template <>
struct EnumStrings<PathInterpolation> {
  static constexpr std::pair<PathInterpolation, const char*> kValues[] = {
      {PathInterpolation::kMinimumJerk, "minimum_jerk"},
      {PathInterpolation::kLinear, "linear"},
      {PathInterpolation::kCubic, "cubic"}};
};

/** Parameters of OperatorPath. */
struct OperatorPathParams {
  /** n >= 1 times, s, finite and strictly increasing. */
  Eigen::VectorXd times{Eigen::VectorXd::Zero(1)};
  /** 3 x n, m, finite: where the operator wants the tool (in B) or the handle
  (in D) at each time. */
  Eigen::Matrix3Xd points{Eigen::Matrix3Xd::Zero(3, 1)};
  /** Between two points. A person's recorded motion is kCubic or kLinear. */
  PathInterpolation interpolation{PathInterpolation::kMinimumJerk};
  /** 3 x n, rad, finite, or 3 x 0 for no rotation: rotation vectors by which
  the operator wants to turn tool or handle from where it is at the start, in
  the frame of `points`. Between two of them their coordinates are interpolated.
*/
  Eigen::Matrix3Xd rotations{Eigen::Matrix3Xd::Zero(3, 0)};
  /** [start, end], s, each: the operator presses the clutch from start until
  end. */
  std::vector<Eigen::Vector2d> clutch{};
  /** [start, end], s, each: the operator asks for the way home from start until
  end, and gives way to it. */
  std::vector<Eigen::Vector2d> home{};
  /** [time, scale] each, times increasing, scales >= 0: the force scale that
  the operator asks for from then on; 1 before. */
  std::vector<Eigen::Vector2d> force_scale{};
  /** [time, opening] each, s, m, times increasing, openings >= 0: of the
  device's gripper from then on; none before. */
  std::vector<Eigen::Vector2d> gripper{};

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;
};

/** Checks the lists of OperatorPathParams.
@throws std::invalid_argument naming the field, its range and value. */
void ValidateButtons(const char* who,
                     const std::vector<Eigen::Vector2d>& clutch,
                     const std::vector<Eigen::Vector2d>& home,
                     const std::vector<Eigen::Vector2d>& force_scale,
                     const std::vector<Eigen::Vector2d>& gripper);

/** A point of an OperatorPath, in the frame of its points. */
struct OperatorPathSample {
  Eigen::Vector3d position{Eigen::Vector3d::Zero()};      ///< m.
  Eigen::Vector3d velocity{Eigen::Vector3d::Zero()};      ///< m/s.
  Eigen::Matrix3d rotation{Eigen::Matrix3d::Identity()};  ///< From the start.
  bool clutch{false};     ///< Whether it is pressed.
  bool home{false};       ///< Whether the way home is asked for.
  double force_scale{1};  ///< That is asked for.
  /** m, of the device's gripper; NaN: it has none. */
  double gripper_opening{std::numeric_limits<double>::quiet_NaN()};
};

/** What the simulated operator intends: a path through given points at given
times, from a script or from a recording. Before the first time it rests at the
first point and after the last time at the last. `velocity` is the derivative of
`position`; under kCubic the velocity at a point is that of the parabola through
it and its neighbours, and zero at both ends. */
class OperatorPath {
 public:
  /** @throws std::invalid_argument if `params` is invalid. */
  explicit OperatorPath(const OperatorPathParams& params = {});

  const OperatorPathParams& params() const { return params_; }

  /** The intended position, velocity and rotation at `time` (s). A time that is
  not a number gives the first point at rest. Cost O(log n). No heap, no throw.
  */
  OperatorPathSample Calc(double time) const noexcept;

 private:
  OperatorPathParams params_;
  // Rates of change at each point, m/s, and rad/s of the rotations'
  // coordinates; used by kCubic only.
  Eigen::Matrix3Xd tangents_;
  Eigen::Matrix3Xd rotation_tangents_;
};

}  // namespace dual_proxy
