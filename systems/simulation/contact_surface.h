// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <utility>

#include <Eigen/Core>

#include "dual_proxy/common/enum_strings.h"
#include "dual_proxy/common/serialize.h"

namespace dual_proxy {

/** The shape of a ContactSurface, in its own frame. There is no ellipsoid: the
distance to one has no closed form, and Drake's point contact takes the line
between the centres for its normal. */
enum class SurfaceShape {
  kHalfSpace,  ///< Solid where z < 0.
  kBox,        ///< Solid within +- half_size: a block, a step, an outer edge.
  kSphere,     ///< Solid within `radius` of the origin.
  /** Solid within `radius` of the x axis, between flat ends at +- length / 2;
  endless if `length` is 0. */
  kCylinder,
  /** Solid within `radius` of the x axis' part between +- length / 2: round
  ends. */
  kCapsule,
};

template <>
struct EnumStrings<SurfaceShape> {
  static constexpr std::pair<SurfaceShape, const char*> kValues[] = {
      {SurfaceShape::kHalfSpace, "half_space"},
      {SurfaceShape::kBox, "box"},
      {SurfaceShape::kSphere, "sphere"},
      {SurfaceShape::kCylinder, "cylinder"},
      {SurfaceShape::kCapsule, "capsule"}};
};

/** Parameters of ContactSurface. */
struct ContactSurfaceParams {
  SurfaceShape shape{SurfaceShape::kHalfSpace};
  Eigen::Vector3d position{Eigen::Vector3d::Zero()};
  Eigen::Matrix3d rotation{Eigen::Matrix3d::Identity()};
  double radius{0.1};
  double length{0};
  bool hollow{false};
  Eigen::Vector3d half_size{0.1, 0.1, 0.1};
  double stiffness{5000};
  double dissipation{2};
  double friction{0};
  double stiction_speed{0.01};

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    VisitEnum(a, "ContactSurfaceParams", "shape", &shape,
              "in the surface's frame: a half_space is solid where z < 0, "
              "cylinder and capsule lie along x");
    a->Visit(Field("position", &position, Finite(), "m",
                   "in B: origin of the surface's frame"));
    a->Visit(Field("rotation", &rotation, Rotation(), "",
                   "of the surface's frame in B"));
    a->Visit(Field("radius", &radius, Above(0), "m",
                   "of the sphere, cylinder or capsule"));
    a->Visit(Field("length", &length, AtLeast(0), "m",
                   "along x: of the cylinder, endless at 0, or between the "
                   "centres of the capsule's round ends, > 0"));
    a->Visit(Field("hollow", &hollow,
                   "whether the endless cylinder is solid outside its radius, "
                   "a bore, which Drake has not"));
    a->Visit(Field("half_size", &half_size, Above(0), "m", "of the box"));
    a->Visit(Field("stiffness", &stiffness, Above(0), "N/m",
                   "normal force per depth"));
    a->Visit(
        Field("dissipation", &dissipation, AtLeast(0), "s/m",
              "share by which the normal force grows per m/s of sinking in"));
    a->Visit(Field("friction", &friction, AtLeast(0), "",
                   "mu of Coulomb friction, static and kinetic"));
    a->Visit(Field("stiction_speed", &stiction_speed, Above(0), "m/s",
                   "below it friction grows linearly with the sliding speed, "
                   "which stands in for sticking"));
  }
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

/** How far a point is from a surface, and which way. */
struct SurfaceDistance {
  /** m: negative inside the solid. Exact for all shapes: the distance to the
  nearest point of the solid's boundary. */
  double value{0};
  /** Unit vector INTO the surface, in B: towards that point, and away from it
  inside. Where several points are nearest, towards one of them. */
  Eigen::Vector3d normal{-Eigen::Vector3d::UnitZ()};
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

  /** @param p  m, in B. No heap, no throw. */
  SurfaceDistance CalcDistance(const Eigen::Vector3d& p) const noexcept;

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
