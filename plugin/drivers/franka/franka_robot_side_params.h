// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <Eigen/Core>

#include "dual_proxy/common/serialize.h"
#include "dual_proxy/control/model_terms.h"

namespace dual_proxy {

/** What is beyond the flange F and not configured in the arm's own web pages
(Desk): the arm carries it. */
struct FrankaLoadParams {
  double mass{0};
  Eigen::Vector3d com{Eigen::Vector3d::Zero()};
  Eigen::Matrix3d inertia{Eigen::Matrix3d::Zero()};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("mass", &mass, Between(0, 5), "kg", "of all of it"));
    a->Visit(Field("com", &com, Between(-1, 1), "m",
                   "in F, the flange: centre of that mass"));
    a->Visit(Field("inertia", &inertia, Finite(), "kg m^2",
                   "about its centre, along the axes of F"));
  }
};

/** Where the arm says contact, and where it stops with a reflex. Three
directions and three rotations of the frame K that is set in the arm. */
struct FrankaCollisionParams {
  Vector7 contact_torque{Vector7::Constant(20)};
  Vector7 collision_torque{Vector7::Constant(40)};
  Vector6 contact_force{{20, 20, 20, 10, 10, 10}};
  Vector6 collision_force{{60, 60, 60, 20, 20, 20}};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("contact_torque", &contact_torque, Above(0), "N m",
                   "of each joint, beyond which the arm says contact"));
    a->Visit(Field("collision_torque", &collision_torque, Above(0), "N m",
                   "beyond which it stops; at least contact_torque"));
    a->Visit(Field("contact_force", &contact_force, Above(0), "N, N m",
                   "likewise of the wrench"));
    a->Visit(Field("collision_force", &collision_force, Above(0), "N, N m",
                   "likewise; well above what a task presses with"));
  }
};

/** Parameters of FrankaRobotSide. */
struct FrankaRobotSideParams {
  std::string host{"172.16.0.2"};
  bool real_time{true};
  FrankaLoadParams load;
  FrankaCollisionParams collision;
  bool push_test{true};
  double push_force{5};
  double push_time{60};
  int max_recoveries{3};
  double recovery_time{10};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("host", &host, "name or address of the arm"));
    a->Visit(Field("real_time", &real_time,
                   "whether a kernel and a priority that keep 1 kHz are "
                   "demanded; false: for tests"));
    a->Visit(Field("load", &load, "beyond the flange"));
    a->Visit(Field("collision", &collision, "when the arm stops by itself"));
    a->Visit(Field("push_test", &push_test,
                   "whether a person has to push the tool once before the "
                   "robot follows, which shows the sign of the force"));
    a->Visit(Field("push_force", &push_force, Between(2, 20), "N",
                   "that counts as a push"));
    a->Visit(Field("push_time", &push_time, Between(1, 600), "s",
                   "within which it has to come"));
    a->Visit(Field("max_recoveries", &max_recoveries, Between(0, 100), "",
                   "in a row: one more reflex ends the run"));
    a->Visit(Field("recovery_time", &recovery_time, Above(0), "s",
                   "without a reflex, after which a row has ended"));
  }
};

}  // namespace dual_proxy
