// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/contact_scene.h"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "dual_proxy/common/validate.h"

namespace dual_proxy {

void ContactSceneParams::Validate() const {
  constexpr const char* kWho = "ContactSceneParams";
  if (surfaces.size() > ContactScene::kMaxSurfaces) {
    ThrowInvalidField(kWho, "surfaces", "at most 8 surfaces",
                      static_cast<double>(surfaces.size()));
  }
  for (const ContactSurfaceParams& surface : surfaces) surface.Validate();
  ThrowUnlessNonNegative(kWho, "tool_radius", tool_radius);
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
  Eigen::Matrix3d second_moment = Eigen::Matrix3d::Zero();
  for (const ContactSurface& surface : surfaces_) {
    const SurfaceContact contact = surface.Calc(p, v, params_.tool_radius);
    if (!(contact.normal_force > 0)) continue;
    result.force += contact.force;
    result.normal += contact.normal_force * contact.normal;
    result.normals.col(result.count) = contact.normal;
    result.normal_forces(result.count) = contact.normal_force;
    ++result.count;
    second_moment += contact.normal * contact.normal.transpose();
  }
  if (result.normal.norm() > 0) result.normal.normalize();
  if (result.count > 0) {
    // Two unit vectors at an angle a have the eigenvalues 1 +- cos(a).
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(
        second_moment, Eigen::EigenvaluesOnly);
    const double threshold = 1 - std::cos(kIndependentAngle);
    result.dimension =
        static_cast<int>((solver.eigenvalues().array() > threshold).count());
  }
  return result;
}

}  // namespace dual_proxy
