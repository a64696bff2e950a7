// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <utility>

#include <Eigen/Core>

#include "dual_proxy/common/enum_strings.h"

namespace dual_proxy {

/** The shape of a ContactSurface, in its own frame. */
enum class SurfaceShape {
  kPlane,     ///< Solid where z < 0.
  kCylinder,  ///< Solid within `radius` of the x axis; endless.
  kBox,       ///< Solid within +- half_size: a block, a step, an outer edge.
};

template <>
struct EnumStrings<SurfaceShape> {
  static constexpr std::pair<SurfaceShape, const char*> kValues[] = {
      {SurfaceShape::kPlane, "plane"},
      {SurfaceShape::kCylinder, "cylinder"},
      {SurfaceShape::kBox, "box"}};
};

/** Parameters of ContactSurface. */
struct ContactSurfaceParams {
  SurfaceShape shape{SurfaceShape::kPlane};
  /** m, in B: origin of the surface's frame. */
  Eigen::Vector3d position{Eigen::Vector3d::Zero()};
  /** Rotation of the surface's frame in B. */
  Eigen::Matrix3d rotation{Eigen::Matrix3d::Identity()};
  /** m, > 0: of the cylinder. */
  double radius{0.1};
  /** m, each > 0: of the box. */
  Eigen::Vector3d half_size{0.1, 0.1, 0.1};
  /** N/m, > 0. */
  double stiffness{5000};
  /** s/m, >= 0: the normal force grows by this share per m/s of sinking in. */
  double dissipation{2};
  /** mu, >= 0: Coulomb friction, static and kinetic. */
  double friction{0};
  /** m/s, > 0: below it friction grows linearly with the sliding speed, which
  stands in for sticking. */
  double stiction_speed{0.01};

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;
};

/** A tool's contact with one surface. */
struct SurfaceContact {
  /** m: depth of the tool in the surface; negative is the distance to it. */
  double penetration{0};
  /** Unit vector INTO the surface, in B, at the nearest point; also defined
  without contact. */
  Eigen::Vector3d normal{-Eigen::Vector3d::UnitZ()};
  /** N, >= 0; zero without contact. */
  double normal_force{0};
  /** N, in B: of the robot on the surface, normal force and friction. */
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};
};

/** An analytic surface that a spherical tool (or a point, of radius zero)
touches, frictionless or not:

    f_n = k delta (1 + d delta_dot), never negative
    F = f_n n + mu f_n v_t / max(|v_t|, v_s)

with penetration delta, normal n INTO the surface and sliding velocity v_t. */
class ContactSurface {
 public:
  using Params = ContactSurfaceParams;

  /** @throws std::invalid_argument if `params` is invalid. */
  explicit ContactSurface(const Params& params = {});

  const Params& params() const { return params_; }

  /** @param p  m, in B: centre of the tool.
  @param v  m/s, in B: its velocity.
  @param tool_radius  m, >= 0.
  No heap, no throw. */
  SurfaceContact Calc(const Eigen::Vector3d& p, const Eigen::Vector3d& v,
                      double tool_radius) const noexcept;

 private:
  Params params_;
};

}  // namespace dual_proxy
