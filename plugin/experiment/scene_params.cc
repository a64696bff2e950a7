// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/scene_params.h"

#include <algorithm>
#include <initializer_list>
#include <set>

#include "dual_proxy/common/rotation.h"
#include "dual_proxy/common/validate.h"

namespace dual_proxy {

namespace {

// A length that some shapes need, and the others have no use for.
void CheckLength(SurfaceShape shape, const char* name, bool is_there,
                 std::initializer_list<SurfaceShape> shapes) {
  const bool is_needed =
      std::find(shapes.begin(), shapes.end(), shape) != shapes.end();
  if (is_there == is_needed) return;
  const std::string text = EnumToString(shape);
  throw InvalidField(
      "SurfaceParams", name,
      is_needed
          ? "expected a value, as a " + text + " needs it, got none"
          : "expected none, as a " + text + " has no use for it, got a value");
}

}  // namespace

void SurfaceParams::Validate() const {
  constexpr const char* kWho = "SurfaceParams";
  using enum SurfaceShape;
  ValidateFields(kWho, *this);
  CheckLength(shape, "size", size.has_value(), {kBox});
  CheckLength(shape, "radius", radius.has_value(),
              {kSphere, kCylinder, kCapsule});
  CheckLength(shape, "length", length.has_value(), {kCylinder, kCapsule});
  if (shape == kCapsule) ThrowUnlessIn(kWho, "length", *length, Above(0));
  if (hollow && !(shape == kCylinder && *length == 0)) {
    throw InvalidField(kWho, "hollow",
                       "expected false, as this is no cylinder of length 0, "
                       "got true");
  }
}

void SceneParams::Validate() const {
  constexpr const char* kWho = "SceneParams";
  ValidateFields(kWho, *this);
  std::set<std::string> names{"table"};
  std::string found;
  for (const SurfaceParams& surface : surfaces) {
    names.insert(surface.name);
    found += (found.empty() ? "'" : ", '") + surface.name + "'";
  }
  if (names.size() != surfaces.size() + 1 || names.contains("")) {
    throw InvalidField(kWho, "surfaces",
                       "expected names used once, not empty and not 'table', "
                       "got [" +
                           found + "]");
  }
}

std::vector<Eigen::Vector3d> SceneParams::Corners() const {
  const double half = tool_size / 2;
  return {{half, half, -kCornerRadius},
          {half, -half, -kCornerRadius},
          {-half, half, -kCornerRadius},
          {-half, -half, -kCornerRadius}};
}

std::vector<SurfaceParams> SceneParams::AllSurfaces() const {
  std::vector<SurfaceParams> all;
  if (table) {
    const double half = table_height / 2;
    all.push_back({.name = "table",
                   .shape = SurfaceShape::kBox,
                   .position = {table_center.x(), table_center.y(), half},
                   .size = Eigen::Vector3d(table_size.x(), table_size.y(),
                                           table_height)});
  }
  all.insert(all.end(), surfaces.begin(), surfaces.end());
  for (SurfaceParams& surface : all) {
    surface.stiffness = surface.stiffness.value_or(contact_stiffness);
    surface.dissipation = surface.dissipation.value_or(contact_dissipation);
    surface.friction = surface.friction.value_or(friction);
  }
  return all;
}

std::vector<ContactSurfaceParams> SceneParams::ContactSurfaces() const {
  std::vector<ContactSurfaceParams> result;
  for (const SurfaceParams& surface : AllSurfaces()) {
    ContactSurfaceParams params{.shape = surface.shape,
                                .position = surface.position,
                                .rotation = ExpRotation(surface.rotation),
                                .hollow = surface.hollow,
                                .stiffness = *surface.stiffness,
                                .dissipation = *surface.dissipation,
                                .friction = *surface.friction};
    if (surface.size) params.half_size = 0.5 * *surface.size;
    if (surface.radius) params.radius = *surface.radius;
    if (surface.length) params.length = *surface.length;
    result.push_back(params);
  }
  return result;
}

}  // namespace dual_proxy
