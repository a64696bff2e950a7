// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "dual_proxy/common/serialize.h"
#include "dual_proxy/control/robot.h"
#include "dual_proxy/simulation/contact_scene.h"

namespace dual_proxy {

/** Parameters of PointRobot; the default is the paper's unit mass. */
struct PointRobotParams {
  double mass{1};
  double period{0.001};
  int substeps{4};

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("mass", &mass, Above(0), "kg", "of the robot"));
    a->Visit(Field("period", &period, Above(0), "s",
                   "of control, over which the force is held"));
    a->Visit(Field(
        "substeps", &substeps, Between(1, 1000), "",
        "integration steps per period: the contact is stable while stiffness "
        "(period / substeps)^2 / mass < 4, and accurate well below"));
  }
};

/** Where the point robot is and what it touches there. */
struct PointRobotState {
  Eigen::Vector3d position{Eigen::Vector3d::Zero()};  ///< m, in B.
  Eigen::Vector3d velocity{Eigen::Vector3d::Zero()};  ///< m/s, in B.
  SceneContact contact;        ///< At this position and velocity.
  std::int64_t bad_inputs{0};  ///< Updates with a force that was not finite.
};

/** The paper's simulated robot (section V.C): a mass without gravity that is
pushed by its control force and by the scene,

    m a = F_control - F_contact,

F_contact being what it exerts on the scene; semi-implicit Euler steps. A
control force that is not finite is counted and acts as zero. */
class PointRobot {
 public:
  using Robot = PointMass;
  using Params = PointRobotParams;
  using State = PointRobotState;

  /** @throws std::invalid_argument if a parameter is invalid. */
  explicit PointRobot(const Params& params = {},
                      const ContactSceneParams& scene = {});

  const Params& params() const { return params_; }
  const ContactScene& scene() const { return scene_; }

  /** At rest at `position` (m, in B). */
  State MakeState(
      const Eigen::Vector3d& position = Eigen::Vector3d::Zero()) const;

  /** Advances by one period under `control_force` (3-vector, N, in B).
  No heap, no throw. */
  void Update(const Eigen::Vector3d& control_force,
              State* state) const noexcept;

 private:
  Params params_;
  ContactScene scene_;
};

}  // namespace dual_proxy
