// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/contact_surface.h"

#include <algorithm>
#include <cmath>

#include "dual_proxy/common/norm.h"

namespace dual_proxy {
namespace {

/** Distance of a point to a shape (negative inside) and the unit vector away
from the shape there, in the shape's frame. */
struct Distance {
  double value{0};
  Eigen::Vector3d outward{Eigen::Vector3d::UnitZ()};
};

// From something that has no inside: a point, the x axis, a part of it.
Distance DistanceToCore(const Eigen::Vector3d& from_core,
                        double radius) noexcept {
  const double r = from_core.norm();
  if (r == 0) return {-radius, Eigen::Vector3d::UnitZ()};
  return {r - radius, from_core / r};
}

Distance DistanceToEndlessCylinder(const Eigen::Vector3d& p,
                                   double radius) noexcept {
  return DistanceToCore({0, p.y(), p.z()}, radius);
}

Distance DistanceToCylinder(const Eigen::Vector3d& p, double radius,
                            double half_length) noexcept {
  const Distance side = DistanceToEndlessCylinder(p, radius);
  const Distance end{std::abs(p.x()) - half_length,
                     Eigen::Vector3d(std::copysign(1.0, p.x()), 0, 0)};
  if (side.value > 0 && end.value > 0) {
    const double value = StableNorm(Eigen::Vector2d(side.value, end.value));
    return {value,
            (side.value * side.outward + end.value * end.outward) / value};
  }
  return side.value > end.value ? side : end;
}

Distance DistanceToCapsule(const Eigen::Vector3d& p, double radius,
                           double half_length) noexcept {
  const double nearest = std::clamp(p.x(), -half_length, half_length);
  return DistanceToCore({p.x() - nearest, p.y(), p.z()}, radius);
}

Distance DistanceToBox(const Eigen::Vector3d& p,
                       const Eigen::Vector3d& half_size) noexcept {
  const Eigen::Vector3d nearest = p.cwiseMin(half_size).cwiseMax(-half_size);
  const double distance = (p - nearest).norm();
  if (distance > 0) return {distance, (p - nearest) / distance};
  Eigen::Index axis{};
  const double depth = (half_size - p.cwiseAbs()).minCoeff(&axis);
  return {-depth, std::copysign(1.0, p(axis)) * Eigen::Vector3d::Unit(axis)};
}

Distance DistanceTo(const ContactSurfaceParams& surface,
                    const Eigen::Vector3d& p) noexcept {
  switch (surface.shape) {
    case SurfaceShape::kBox:
      return DistanceToBox(p, surface.half_size);
    case SurfaceShape::kSphere:
      return DistanceToCore(p, surface.radius);
    case SurfaceShape::kCylinder: {
      if (surface.length > 0) {
        return DistanceToCylinder(p, surface.radius, surface.length / 2);
      }
      const Distance solid = DistanceToEndlessCylinder(p, surface.radius);
      if (surface.hollow) return {-solid.value, -solid.outward};
      return solid;
    }
    case SurfaceShape::kCapsule:
      return DistanceToCapsule(p, surface.radius, surface.length / 2);
    default:
      return {p.z(), Eigen::Vector3d::UnitZ()};
  }
}

}  // namespace

void ContactSurfaceParams::Validate() const {
  constexpr const char* kWho = "ContactSurfaceParams";
  ValidateFields(kWho, *this);
  if (shape == SurfaceShape::kCapsule) {
    ThrowUnlessIn(kWho, "length", length, Above(0));
  }
  if (hollow && !(shape == SurfaceShape::kCylinder && length == 0)) {
    ThrowInvalidField(kWho, "hollow", "0 but for an endless cylinder", 1);
  }
}

ContactSurface::ContactSurface(const Params& params) : params_(params) {
  params_.Validate();
}

SurfaceDistance ContactSurface::CalcDistance(
    const Eigen::Vector3d& p) const noexcept {
  const Distance distance = DistanceTo(
      params_, params_.rotation.transpose() * (p - params_.position));
  return {distance.value, -(params_.rotation * distance.outward)};
}

SurfaceContact ContactSurface::Calc(const Eigen::Vector3d& p,
                                    const Eigen::Vector3d& v,
                                    double tool_radius) const noexcept {
  const SurfaceDistance distance = CalcDistance(p);
  SurfaceContact contact;
  contact.penetration = tool_radius - distance.value;
  contact.normal = distance.normal;
  if (!(contact.penetration > 0)) return contact;

  const double sinking = contact.normal.dot(v);
  contact.normal_force = params_.stiffness * contact.penetration *
                         std::max(0.0, 1 + params_.dissipation * sinking);
  const Eigen::Vector3d sliding = v - sinking * contact.normal;
  const double slip = std::max(sliding.norm(), params_.stiction_speed);
  contact.force = contact.normal_force *
                  (contact.normal + params_.friction / slip * sliding);
  return contact;
}

}  // namespace dual_proxy
