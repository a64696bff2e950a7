// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/contact_surface.h"

#include <algorithm>
#include <cmath>

namespace dual_proxy {
namespace {

/** Distance of a point to a shape (negative inside) and the unit vector away
from the shape there, in the shape's frame. */
struct Distance {
  double value{0};
  Eigen::Vector3d outward{Eigen::Vector3d::UnitZ()};
};

Distance DistanceToCylinder(const Eigen::Vector3d& p, double radius) noexcept {
  const double r = p.tail<2>().norm();
  if (r == 0) return {-radius, Eigen::Vector3d::UnitZ()};
  return {r - radius, Eigen::Vector3d(0, p.y() / r, p.z() / r)};
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
    case SurfaceShape::kCylinder:
      return DistanceToCylinder(p, surface.radius);
    case SurfaceShape::kBox:
      return DistanceToBox(p, surface.half_size);
    default:
      return {p.z(), Eigen::Vector3d::UnitZ()};
  }
}

}  // namespace

void ContactSurfaceParams::Validate() const {
  ValidateFields("ContactSurfaceParams", *this);
}

ContactSurface::ContactSurface(const Params& params) : params_(params) {
  params_.Validate();
}

SurfaceContact ContactSurface::Calc(const Eigen::Vector3d& p,
                                    const Eigen::Vector3d& v,
                                    double tool_radius) const noexcept {
  const Distance distance = DistanceTo(
      params_, params_.rotation.transpose() * (p - params_.position));
  SurfaceContact contact;
  contact.penetration = tool_radius - distance.value;
  contact.normal = -(params_.rotation * distance.outward);
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
