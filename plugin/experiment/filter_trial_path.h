// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include <Eigen/Core>

#include "dual_proxy/experiment/filter_trial_setting.h"

namespace dual_proxy {

/** The intended positions of the tool, one for every control period. */
class FilterTrialPath {
 public:
  explicit FilterTrialPath(const Eigen::Vector3d& start) : points_{start} {}

  const std::vector<Eigen::Vector3d>& points() const { return points_; }
  const Eigen::Vector3d& end() const { return points_.back(); }

  /** Minimum jerk to `goal`, `speed` (m/s) on average. */
  void MoveTo(const Eigen::Vector3d& goal, double speed) {
    MoveSmoothly(goal, (goal - end()).norm(), speed);
  }

  /** Likewise, within `time` (s). */
  void MoveIn(const Eigen::Vector3d& goal, double time) {
    MoveSmoothly(goal, time, 1);
  }

  void Hold(double time) {
    const auto steps = static_cast<std::size_t>(time / kFilterTrialStep);
    points_.insert(points_.end(), steps, Eigen::Vector3d(end()));
  }

  /** Along the circle of `radius` about the x axis, from the angle where the
  path is to `goal` (rad, from z), moving `along` (m) in x. */
  void Turn(double radius, double goal, double along, double speed) {
    const Eigen::Vector3d start = end();
    const double begin = std::atan2(start.y(), start.z());
    MoveAlong(std::hypot((goal - begin) * radius, along), speed, [&](double u) {
      const double s = u * u * (3 - 2 * u);
      const double angle = begin + s * (goal - begin);
      return Eigen::Vector3d(start.x() + s * along, radius * std::sin(angle),
                             radius * std::cos(angle));
    });
  }

  /** By a quarter of a circle about `centre`, over its edge along y: from -x
  of it to +z. */
  void TurnOverEdge(const Eigen::Vector3d& centre, double speed) {
    const double radius = (end() - centre).norm();
    constexpr double kQuarter = std::numbers::pi / 2;
    MoveAlong(kQuarter * radius, speed, [&](double u) -> Eigen::Vector3d {
      return centre + radius * Eigen::Vector3d(-std::cos(kQuarter * u), 0,
                                               std::sin(kQuarter * u));
    });
  }

 private:
  void MoveSmoothly(const Eigen::Vector3d& goal, double length, double speed) {
    const Eigen::Vector3d start = end();
    MoveAlong(length, speed, [&](double u) -> Eigen::Vector3d {
      return start + u * u * u * (10 + u * (6 * u - 15)) * (goal - start);
    });
  }

  /** `point(u)` for u from 0 to 1 in as many steps as `length` (m) takes. */
  template <typename Point>
  void MoveAlong(double length, double speed, Point point) {
    const int steps = std::max(
        1, static_cast<int>(std::ceil(length / speed / kFilterTrialStep)));
    for (int i = 1; i <= steps; ++i) {
      points_.push_back(point(static_cast<double>(i) / steps));
    }
  }

  std::vector<Eigen::Vector3d> points_;
};

}  // namespace dual_proxy
