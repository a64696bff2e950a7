// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/drake_scene.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "dual_proxy/experiment/scenario_error.h"

namespace dual_proxy {
namespace {

constexpr double kEndless = 20;  // m, of what has no end.
constexpr double kSlabSize = 4;  // m, of the picture of a half space.
constexpr double kSlabDepth = 0.02;

// Drake's cylinders and capsules lie along z, ours along x.
const Eigen::Matrix3d kAlongX{{0, 0, 1}, {0, 1, 0}, {-1, 0, 0}};

std::vector<DrakeSurface> MakeSurfaces(const SceneParams& params) {
  std::vector<DrakeSurface> result;
  const std::vector<SurfaceParams> surfaces = params.AllSurfaces();
  const std::vector<ContactSurfaceParams> contacts = params.ContactSurfaces();
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const ContactSurfaceParams& contact = contacts[i];
    DrakeSurface surface{.name = surfaces[i].name,
                         .shape = contact.shape,
                         .X_BG = {.p = contact.position, .R = contact.rotation},
                         .size = 2 * contact.half_size,
                         .radius = contact.radius,
                         .length = contact.length,
                         .color = surfaces[i].color};
    if (contact.shape == SurfaceShape::kCylinder ||
        contact.shape == SurfaceShape::kCapsule) {
      surface.X_BG.R *= kAlongX;
      if (contact.length == 0) surface.length = kEndless;
    }
    result.push_back(std::move(surface));
  }
  return result;
}

// Drake takes two bodies' stiffness in series, the mean of their dissipations,
// each weighted with the other's stiffness, the harmonic mean of their
// frictions and the sum of their relaxation times. All balls of the tool are
// alike, and there is one material of theirs with which every surface can have
// what it is to have. With k the surface's stiffness, s the share of it that a
// ball has, and r = k / K <= 1,
//
//   ball     k_t = 2 K s / (2 - s),  d_t <= every d,  m_t >= every m
//   surface  k_s = 2 k s / (2 - (2 - s) r)
//            d_s = d + (d - d_t) k_s / k_t
//            m_s = m / (2 - m / m_t)
//
// gives k_t k_s / (k_t + k_s) = k s, (k_s d_t + k_t d_s) / (k_t + k_s) = d and
// 2 m_t m_s / (m_t + m_s) = m, with nothing negative. Of surfaces that are all
// alike d_s = d_t = d, m_s = m_t = m and k_s = 2 K; without friction m_s = 0,
// and so is the mean. With the largest K, m_t and the smallest d_t of the
// scene, not larger or smaller ones, a further model meets a tool like its
// surroundings.
class MaterialRule {
 public:
  MaterialRule(const SceneParams& params,
               const std::vector<ContactSurfaceParams>& contacts)
      : share_(params.tool == Tool::kFlat
                   ? 1.0 / static_cast<double>(params.Corners().size())
                   : 1.0),
        stiffest_(params.contact_stiffness),
        ball_{.dissipation = params.contact_dissipation,
              .friction = params.friction,
              .relaxation_time = params.relaxation_time / 2} {
    for (const ContactSurfaceParams& contact : contacts) {
      stiffest_ = std::max(stiffest_, contact.stiffness);
      ball_.dissipation = std::min(ball_.dissipation, contact.dissipation);
      ball_.friction = std::max(ball_.friction, contact.friction);
    }
    ball_.stiffness = 2 * stiffest_ * share_ / (2 - share_);
  }

  const DrakeMaterial& ball() const { return ball_; }

  DrakeMaterial CalcSurface(const ContactSurfaceParams& contact) const {
    DrakeMaterial material{.relaxation_time = ball_.relaxation_time};
    material.stiffness = 2 * contact.stiffness * share_ /
                         (2 - (2 - share_) * (contact.stiffness / stiffest_));
    material.dissipation =
        contact.dissipation + (contact.dissipation - ball_.dissipation) *
                                  material.stiffness / ball_.stiffness;
    if (contact.friction > 0) {
      material.friction =
          contact.friction / (2 - contact.friction / ball_.friction);
    }
    return material;
  }

 private:
  double share_;
  double stiffest_;
  DrakeMaterial ball_;
};

}  // namespace

DrakeScene MakeDrakeScene(const SceneParams& params) {
  for (std::size_t i = 0; i < params.surfaces.size(); ++i) {
    if (params.surfaces[i].hollow) {
      throw ScenarioError("scene.surfaces[" + std::to_string(i) +
                          "].hollow: expected false with engine drake, which "
                          "has no bore (engine bare has), got true");
    }
  }
  const std::string& models = params.model_directives;
  if (!models.empty() && !std::filesystem::is_regular_file(models)) {
    throw ScenarioError("scene.model_directives: expected a file, got \"" +
                        models + "\"");
  }
  const std::vector<ContactSurfaceParams> contacts = params.ContactSurfaces();
  const MaterialRule rule(params, contacts);
  DrakeScene scene{.ball = rule.ball(), .surfaces = MakeSurfaces(params)};
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    scene.surfaces[i].material = rule.CalcSurface(contacts[i]);
  }
  return scene;
}

std::vector<DrakeSurface> MakePicture(const SceneParams& params) {
  std::vector<DrakeSurface> picture = MakeSurfaces(params);
  for (DrakeSurface& surface : picture) {
    if (surface.shape != SurfaceShape::kHalfSpace) continue;
    surface.shape = SurfaceShape::kBox;
    surface.size = {kSlabSize, kSlabSize, kSlabDepth};
    surface.X_BG.p -= kSlabDepth / 2 * surface.X_BG.R.col(2);
  }
  return picture;
}

std::string EllipsoidProblem(const std::string& geometry,
                             const std::string& body,
                             const std::string& model) {
  return "geometry '" + geometry + "' of body '" + body + "' of model '" +
         model +
         "' is an Ellipsoid, with which Drake's contact of a sphere takes the "
         "line between the centres for the normal, up to 22 degrees off; "
         "expected another shape (sphere, capsule, box)";
}

}  // namespace dual_proxy
