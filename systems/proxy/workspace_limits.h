// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <utility>

#include <Eigen/Core>

#include "dual_proxy/common/enum_strings.h"
#include "dual_proxy/common/serialize.h"

namespace dual_proxy {

/** Where the robot proxy may go; in the robot base frame B. */
struct WorkspaceLimitsParams {
  enum class Shape {
    kNone,      ///< Anywhere.
    kBox,       ///< Sides along the axes of B.
    kSphere,    ///< A ball.
    kCylinder,  ///< A solid cylinder whose axis is B's z.
  };

  Shape shape{Shape::kNone};
  Eigen::Vector3d center{Eigen::Vector3d::Zero()};
  Eigen::Vector3d half_size{Eigen::Vector3d::Constant(0.5)};
  double radius{0.5};
  double half_height{0.5};

  /** @throws std::invalid_argument naming the field. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    VisitEnum(a, "WorkspaceLimitsParams", "shape", &shape,
              "a box along the axes of B, a cylinder about its z");
    a->Visit(Field("center", &center, Finite(), "m", "of the shape, in B"));
    a->Visit(Field("half_size", &half_size, AtLeast(0), "m",
                   "box: half of each side"));
    a->Visit(Field("radius", &radius, Above(0), "m", "of sphere and cylinder"));
    a->Visit(
        Field("half_height", &half_height, AtLeast(0), "m", "of a cylinder"));
  }
};

template <>
struct EnumStrings<WorkspaceLimitsParams::Shape> {
  using Shape = WorkspaceLimitsParams::Shape;
  static constexpr std::pair<Shape, const char*> kValues[] = {
      {Shape::kNone, "none"},
      {Shape::kBox, "box"},
      {Shape::kSphere, "sphere"},
      {Shape::kCylinder, "cylinder"}};
};

/** Keeps positions inside a convex workspace. */
class WorkspaceLimits {
 public:
  /** @throws std::invalid_argument for parameters out of range. */
  explicit WorkspaceLimits(WorkspaceLimitsParams params);

  const WorkspaceLimitsParams& params() const { return params_; }

  /** The point of the workspace nearest to p (m, in B): p itself inside. Two
  clamped points are never farther apart than the points were. */
  Eigen::Vector3d Clamp(const Eigen::Vector3d& p) const noexcept;

  /** True if p (m, in B) is inside, or outside by rounding only (1e-9 m). */
  bool Contains(const Eigen::Vector3d& p) const noexcept;

 private:
  WorkspaceLimitsParams params_;
};

}  // namespace dual_proxy
