// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "dual_proxy/common/pose.h"
#include "dual_proxy/experiment/scene_params.h"

namespace dual_proxy {

/** @file
A scene as Drake's plant takes it, as plain numbers without Drake: what its
faces in C++ and in Python have in common. */

/** Contact properties of one geometry. Drake combines those of two. */
struct DrakeMaterial {
  double stiffness{0};        ///< N/m: point_contact_stiffness.
  double dissipation{0};      ///< s/m: hunt_crossley_dissipation.
  double friction{0};         ///< Static and dynamic.
  double relaxation_time{0};  ///< s.
};

/** A surface, its shape in Drake's frame of that: cylinder and capsule lie
along z. Nothing is endless but the half space. */
struct DrakeSurface {
  std::string name;
  SurfaceShape shape{SurfaceShape::kHalfSpace};
  Pose X_BG;
  Eigen::Vector3d size{Eigen::Vector3d::Zero()};  ///< m: of a box.
  double radius{0};  ///< m: of a sphere, cylinder or capsule.
  double length{0};  ///< m: of a cylinder or capsule, without its round ends.
  Eigen::Vector4d color{Eigen::Vector4d::Zero()};
  DrakeMaterial material{};
};

/** All of a scene that touches. */
struct DrakeScene {
  DrakeMaterial ball;  ///< Of each ball of the tool.
  std::vector<DrakeSurface> surfaces;
};

/** Makes what touches, so that a contact of a ball with a surface has that
surface's own stiffness (the balls of the tool share it), dissipation and
friction, whatever the others have.

@throws ScenarioError if there is something that Drake has not. */
DrakeScene MakeDrakeScene(const SceneParams& params);

/** Makes what is to be seen: the surfaces, but half spaces as slabs. It is no
matter whether Drake has what they stand for. */
std::vector<DrakeSurface> MakePicture(const SceneParams& params);

/** What is said of a geometry whose contacts would be wrong; `geometry`, `body`
and `model` are its names. */
std::string EllipsoidProblem(const std::string& geometry,
                             const std::string& body, const std::string& model);

}  // namespace dual_proxy
