// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "dual_proxy/common/enum_strings.h"
#include "dual_proxy/common/serialize.h"

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

/** What of the tool touches. */
enum class Tool {
  kSphere,  ///< A ball of kTipRadius around E.
  /** A square pad across the tool's axis, E in the middle of its face. It
  touches with four small balls, one in each corner. */
  kFlat,
};

template <>
struct EnumStrings<Tool> {
  static constexpr std::pair<Tool, const char*> kValues[] = {
      {Tool::kSphere, "sphere"}, {Tool::kFlat, "flat"}};
};

/** Radius of the balls in the corners of a flat tool, m. */
inline constexpr double kCornerRadius = 0.005;

/** Drake's discrete contact approximations. kLagged and kSimilar keep Coulomb's
law without kSap's gap of friction x time_step x slip. */
enum class ContactApproximation { kLagged, kSimilar, kSap };

template <>
struct EnumStrings<ContactApproximation> {
  static constexpr std::pair<ContactApproximation, const char*> kValues[] = {
      {ContactApproximation::kLagged, "lagged"},
      {ContactApproximation::kSimilar, "similar"},
      {ContactApproximation::kSap, "sap"}};
};

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

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(MakeRequired("name", &name));
    a->Visit(MakeRequired("center", &center));
    a->Visit(MakeRequired("size", &size));
    a->Visit(MakeNameValue("yaw", &yaw));
    a->Visit(MakeNameValue("color", &color));
  }
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
  /** Of tool and surface together, N/m, 1 to 1e8; the corners of a flat tool
  share it. */
  double contact_stiffness{3e4};
  /** Hunt-Crossley coefficient d in f = k x (1 + d dx/dt), s/m, 0 to 1000; for
  the approximations lagged and similar. */
  double contact_dissipation{10.0};
  /** Linear dissipation in place of contact_dissipation for sap, s, 0 to 10. */
  double relaxation_time{0.01};
  ContactApproximation contact_approximation{ContactApproximation::kLagged};
  /** Step of the plant, s, 1e-5 to 1e-2; control has a period of its own. */
  double time_step{1e-3};
  Tool tool{Tool::kSphere};
  /** Between the corners of a flat tool along its edges, m, 0.005 to 0.2. */
  double tool_size{0.06};
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

  /** Height of the tool point when the tool, pointing down, touches the table,
  m. */
  double contact_height() const {
    return tool == Tool::kSphere ? table_height + kTipRadius : table_height;
  }

  /** Centres of a flat tool's corners, m, in E. */
  std::vector<Eigen::Vector3d> Corners() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(MakeNameValue("table_height", &table_height));
    a->Visit(MakeNameValue("table_center", &table_center));
    a->Visit(MakeNameValue("table_size", &table_size));
    a->Visit(MakeNameValue("boxes", &boxes));
    a->Visit(MakeNameValue("friction", &friction));
    a->Visit(MakeNameValue("contact_stiffness", &contact_stiffness));
    a->Visit(MakeNameValue("contact_dissipation", &contact_dissipation));
    a->Visit(MakeNameValue("relaxation_time", &relaxation_time));
    VisitEnum(a, "PandaSceneParams", "contact_approximation",
              &contact_approximation);
    a->Visit(MakeNameValue("time_step", &time_step));
    VisitEnum(a, "PandaSceneParams", "tool", &tool);
    a->Visit(MakeNameValue("tool_size", &tool_size));
    a->Visit(MakeNameValue("tool_mass", &tool_mass));
    a->Visit(MakeNameValue("gravity", &gravity));
    a->Visit(MakeNameValue("start_position", &start_position));
  }
};

}  // namespace dual_proxy
