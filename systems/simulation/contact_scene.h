// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "dual_proxy/common/serialize.h"
#include "dual_proxy/simulation/contact_surface.h"

namespace dual_proxy {

/** Parameters of ContactScene. */
struct ContactSceneParams {
  std::vector<ContactSurfaceParams> surfaces;
  double tool_radius{0};

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(
        Field("surfaces", &surfaces,
              "up to 8; two that meet make an inner corner; none: free space"));
    a->Visit(Field("tool_radius", &tool_radius, AtLeast(0), "m",
                   "of the spherical tool"));
  }
};

/** A tool's contact with a scene: the truth that estimates are measured
against. */
struct SceneContact {
  /** N, in B: of the robot on the scene, over all surfaces. */
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};
  /** Unit vector along the sum of the normal forces, INTO the surface, in B;
  zero without contact. */
  Eigen::Vector3d normal{Eigen::Vector3d::Zero()};
  /** Number of surfaces with a normal force; of each of them the normal (a
  column, INTO the surface, in B) and the normal force (N). */
  int count{0};
  Eigen::Matrix<double, 3, 8> normals{Eigen::Matrix<double, 3, 8>::Zero()};
  Eigen::Matrix<double, 8, 1> normal_forces{
      Eigen::Matrix<double, 8, 1>::Zero()};
  /** 0 to 3: number of independent normals, as ContactTruth counts them. */
  int dimension{0};
};

/** A few surfaces and the tool that touches them. */
class ContactScene {
 public:
  using Params = ContactSceneParams;

  static constexpr int kMaxSurfaces = 8;

  /** @throws std::invalid_argument if `params` is invalid. */
  explicit ContactScene(const Params& params = {});

  const Params& params() const { return params_; }

  /** @param p  m, in B: centre of the tool.
  @param v  m/s, in B: its velocity.
  Of input that is not finite there is no contact. No heap, no throw. */
  SceneContact Calc(const Eigen::Vector3d& p,
                    const Eigen::Vector3d& v) const noexcept;

 private:
  Params params_;
  std::vector<ContactSurface> surfaces_;
};

}  // namespace dual_proxy
