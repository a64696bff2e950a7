// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

namespace dual_proxy {

/** @file
The scene of a Panda above a table, as plain numbers. B is the robot's base,
which is the world. */

/** Radius of the tool's spherical tip around E, m. */
inline constexpr double kTipRadius = 0.010;
/** Mass beyond the flange, kg. */
inline constexpr double kToolMass = 0.2;
/** Its centre of mass, m, in the sensor's frame S. */
inline const Eigen::Vector3d kToolCom{0.0, 0.0, 0.035};

/** Drake's discrete contact approximations. kLagged and kSimilar keep Coulomb's
law without kSap's gap of friction x time_step x slip. */
enum class ContactApproximation { kLagged, kSimilar, kSap };

/** A box fixed in the world that the tool can touch. */
struct BoxParams {
  /** Unique within the scene. */
  std::string name;
  /** m, in B. */
  Eigen::Vector3d center{0.5, 0.0, 0.1};
  /** Full edge lengths along the box's axes, m, 1e-4 to 10. */
  Eigen::Vector3d size{0.1, 0.1, 0.1};
  /** Rotation of the box about B's z, rad. */
  double yaw{0};
  /** Red, green, blue, opacity; 0 to 1. */
  Eigen::Vector4d color{0.80, 0.70, 0.56, 1.0};

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;
};

/** The simulated arm's surroundings and how contact is computed. */
struct PandaSceneParams {
  /** Height of the table's top over B, m, 1e-3 to 1.5; the table stands on
  z = 0. */
  double table_height{0.10};
  /** x and y of the table's centre, m, in B. */
  Eigen::Vector2d table_center{0.5, 0.0};
  /** The table's edge lengths along x and y, m, 1e-3 to 10. */
  Eigen::Vector2d table_size{0.6, 0.8};
  /** Further boxes that the tool can touch (walls, steps). */
  std::vector<BoxParams> boxes;
  /** Coulomb coefficient between the tool and everything, 0 to 5. */
  double friction{0.3};
  /** Of tool and surface together, N/m, 1 to 1e8. */
  double contact_stiffness{3e4};
  /** Hunt-Crossley coefficient d in f = k x (1 + d dx/dt), s/m, 0 to 1000; for
  the approximations lagged and similar. */
  double contact_dissipation{10.0};
  /** Linear dissipation in place of contact_dissipation for sap, s, 0 to 10. */
  double relaxation_time{0.01};
  ContactApproximation contact_approximation{ContactApproximation::kLagged};
  /** Step of the plant, and period of both sides' control, s, 1e-5 to 1e-2. */
  double time_step{1e-3};
  /** Of all that is beyond the flange, kg, 1e-3 to 3; the inertia scales with
  it. */
  double tool_mass{kToolMass};
  /** Along -z of B, m/s^2, 0 to 100. */
  double gravity{9.81};
  /** Of the tool point at time 0, m, in B, each -2 to 2. */
  Eigen::Vector3d start_position{0.45, 0.0, 0.18};

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;

  /** The table followed by `boxes`. */
  std::vector<BoxParams> AllBoxes() const;

  /** Height of the tool point when the tool touches the table, m. */
  double contact_height() const { return table_height + kTipRadius; }
};

}  // namespace dual_proxy
