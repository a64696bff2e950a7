// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include "dual_proxy/common/random.h"
#include "dual_proxy/experiment/filter_trial.h"
#include "dual_proxy/simulation/contact_scene.h"

namespace dual_proxy {

/** s: control period of a trial. */
inline constexpr double kFilterTrialStep = 0.001;

/** N/m: of the spring between the intended and the true position, which is the
robot-side proxy's. To press with a force, the intended position goes
force / kFilterTrialStiffness deep. */
inline constexpr double kFilterTrialStiffness = 500;

/** Uniform on [low, high). */
double DrawUniform(double low, double high, RandomStream* random);

/** Three standard normals. */
Eigen::Vector3d DrawNormal3(RandomStream* random);

/** What a trial's tool moves in, and where it is meant to go. */
struct FilterTrialSetting {
  ContactSceneParams scene;
  double stiction{0};  ///< By which mu is more at rest.
  /** m, in a frame that moves with the surfaces and begins as B: intended
  position of the tool's centre, one per control period; and that frame's
  velocity, m/s in B. */
  std::vector<Eigen::Vector3d> path;
  std::vector<Eigen::Vector3d> frame_velocity;
};

/** Sets up a valid trial's scene and path, turned at random. */
FilterTrialSetting MakeFilterTrialSetting(const FilterTrialParams& params,
                                          RandomStream* random);

}  // namespace dual_proxy
