// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/contact_scene.h"

#include "dual_proxy/common/validate.h"
#include "dual_proxy/simulation/contact_truth.h"

namespace dual_proxy {

void ContactSceneParams::Validate() const {
  constexpr const char* kWho = "ContactSceneParams";
  if (surfaces.size() > ContactScene::kMaxSurfaces) {
    ThrowInvalidField(kWho, "surfaces", "at most 8 surfaces",
                      static_cast<double>(surfaces.size()));
  }
  ValidateFields(kWho, *this);
}

ContactScene::ContactScene(const Params& params) : params_(params) {
  params_.Validate();
  for (const ContactSurfaceParams& surface : params_.surfaces) {
    surfaces_.emplace_back(surface);
  }
}

SceneContact ContactScene::Calc(const Eigen::Vector3d& p,
                                const Eigen::Vector3d& v) const noexcept {
  SceneContact result;
  if (!p.allFinite() || !v.allFinite()) return result;
  ContactTruth truth;
  for (const ContactSurface& surface : surfaces_) {
    const SurfaceContact contact = surface.Calc(p, v, params_.tool_radius);
    if (!(contact.normal_force > 0)) continue;
    result.normals.col(result.count) = contact.normal;
    result.normal_forces(result.count) = contact.normal_force;
    ++result.count;
    truth.Add(contact.force, contact.normal);
  }
  result.force = truth.force();
  result.normal = truth.CalcNormal();
  result.dimension = truth.dimension();
  return result;
}

}  // namespace dual_proxy
