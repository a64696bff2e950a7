// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include "dual_proxy/experiment/filter_trial_setting.h"
#include "dual_proxy/simulation/contact_surface.h"
#include "dual_proxy/simulation/point_robot.h"

namespace dual_proxy {

/** What one control period of a trial came to, in B. */
struct FilterTrialTick {
  Eigen::Vector3d velocity{Eigen::Vector3d::Zero()};       ///< m/s.
  Eigen::Vector3d sensed_force{Eigen::Vector3d::Zero()};   ///< N.
  Eigen::Vector3d motion_force{Eigen::Vector3d::Zero()};   ///< N: F_m.
  Eigen::Vector3d contact_force{Eigen::Vector3d::Zero()};  ///< N: F_f.
  SceneContact contact;                                    ///< The truth.
};

/** The point robot of the paper (section V.C) with its unified controller: a
spring and damper to the intended position in motion space, and in force space
the proxy's spring as the reference, which changes by 50 N/s and starts, in a
new direction, at the force that is there. */
class FilterTrialPointRobot {
 public:
  /** @param motion_stiffness  N/m, > 0: K_pm, critically damped. */
  FilterTrialPointRobot(const FilterTrialSetting& setting,
                        double motion_stiffness);

  const SceneContact& contact() const { return state_.contact; }

  /** @param goal  m: the intended position.
  @param Omega_f  selection of force space. */
  FilterTrialTick Update(const Eigen::Vector3d& goal,
                         const Eigen::Matrix3d& Omega_f);

 private:
  PointRobot robot_;
  PointRobotState state_;
  Eigen::Vector3d last_goal_;
  double stiffness_;
  double damping_;
  Eigen::Matrix3d last_Omega_f_{Eigen::Matrix3d::Zero()};
  Eigen::Vector3d reference_{Eigen::Vector3d::Zero()};
};

/** A tool without dynamics: where the path runs inside a surface, the tool is
where the spring to the path is at rest, and presses as that does. It moves by
no more than 1 m/s. */
class FilterTrialKinematicTool {
 public:
  explicit FilterTrialKinematicTool(const FilterTrialSetting& setting);

  /** @param goal  m: the intended position. */
  FilterTrialTick Update(const Eigen::Vector3d& goal);

 private:
  int num_surfaces() const { return static_cast<int>(surfaces_.size()); }
  SurfaceContact CalcTouch(int surface, const Eigen::Vector3d& position) const;
  Eigen::Vector3d CalcPosition(const Eigen::Vector3d& goal) const;
  SceneContact CalcContact(const Eigen::Vector3d& push) const;

  std::vector<ContactSurface> surfaces_;
  double tool_radius_;
  double friction_{0};
  Eigen::Vector3d position_;
};

/** A tool without inertia: a damper moves it until the spring to the path is in
balance with the contact. Each surface gives along its normal and, stuck, across
it, until friction slips: more than mu at rest, by `stiction`, which a sliding
speed of some 50 mm/s takes away. */
class FilterTrialQuasiStaticTool {
 public:
  explicit FilterTrialQuasiStaticTool(const FilterTrialSetting& setting);

  /** @param goal  m: the intended position.
  @param Omega_f  selection of force space, which splits the spring's force in
    commands. */
  FilterTrialTick Update(const Eigen::Vector3d& goal,
                         const Eigen::Matrix3d& Omega_f);

 private:
  SceneContact Advance(const Eigen::Vector3d& goal);

  struct Touched {
    ContactSurface surface;
    /** m: by which it is stretched across its normal, and m/s: how fast it
    slips. */
    Eigen::Vector3d stretch{Eigen::Vector3d::Zero()};
    double slip{0};
  };

  std::vector<Touched> surfaces_;
  double tool_radius_;
  double stiction_;
  Eigen::Vector3d position_;
  Eigen::Vector3d force_{Eigen::Vector3d::Zero()};
};

}  // namespace dual_proxy
