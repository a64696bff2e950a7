// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "dual_proxy/common/enum_strings.h"
#include "dual_proxy/common/serialize.h"
#include "dual_proxy/simulation/contact_surface.h"

namespace dual_proxy {

/** @file
The scene around an arm, as plain numbers. B is the robot's base, which is the
world. */

/** Radius of the tool's spherical tip around E, m. */
inline constexpr double kTipRadius = 0.010;
/** Mass beyond the flange, kg. */
inline constexpr double kToolMass = 0.2;
/** Its centre of mass, m, in the sensor's frame S. */
inline const Eigen::Vector3d kToolCom{0.0, 0.0, 0.035};
/** Its moments of inertia about that, along the axes of S, kg m^2, when its
mass is kToolMass. */
inline const Eigen::Vector3d kToolMoments{0.00019, 0.00019, 0.00008};
/** p_SE: position of the tool point from the sensor, m, in S. */
inline const Eigen::Vector3d kSensorToToolPoint{0, 0, 0.1};

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

/** A surface fixed in the world that the tool can touch. Of its lengths it has
those that its shape needs and no others. */
struct SurfaceParams {
  std::string name;
  SurfaceShape shape{SurfaceShape::kHalfSpace};
  Eigen::Vector3d position{Eigen::Vector3d::Zero()};
  Eigen::Vector3d rotation{Eigen::Vector3d::Zero()};
  std::optional<Eigen::Vector3d> size{};
  std::optional<double> radius{};
  std::optional<double> length{};
  bool hollow{false};
  std::optional<double> stiffness{};
  std::optional<double> dissipation{};
  std::optional<double> friction{};
  Eigen::Vector4d color{0.80, 0.70, 0.56, 1.0};

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    constexpr bool kRequired = true;
    a->Visit(Field("name", &name, "unique within the scene").Required());
    VisitEnum(a, "SurfaceParams", "shape", &shape,
              "in the surface's frame: a half_space is solid where z < 0, a "
              "box around the origin, cylinder and capsule lie along x",
              kRequired);
    a->Visit(Field("position", &position, Finite(), "m",
                   "in B: origin of the surface's frame")
                 .Required());
    a->Visit(Field("rotation", &rotation, Finite(), "rad",
                   "rotation vector of the surface's frame in B"));
    a->Visit(Field("size", &size, Between(1e-4, 10), "m",
                   "of a box: full edge lengths along its axes"));
    a->Visit(Field("radius", &radius, Between(1e-4, 10), "m",
                   "of a sphere, cylinder or capsule"));
    a->Visit(Field("length", &length, Between(0, 10), "m",
                   "along x: of a cylinder, endless at 0 (in Drake 20 m), or "
                   "between the centres of a capsule's round ends, > 0"));
    a->Visit(Field("hollow", &hollow,
                   "whether an endless cylinder is solid outside its radius, a "
                   "bore; with engine bare alone, as Drake has none"));
    a->Visit(Field("stiffness", &stiffness, Between(1, 1e8), "N/m",
                   "as the scene's contact_stiffness, which is the default"));
    a->Visit(Field("dissipation", &dissipation, Between(0, 1e3), "s/m",
                   "as the scene's contact_dissipation, which is the default"));
    a->Visit(Field("friction", &friction, Between(0, 5), "",
                   "as the scene's friction, which is the default"));
    a->Visit(
        Field("color", &color, Between(0, 1), "", "red, green, blue, opacity"));
  }
};

/** The simulated arm's surroundings and how contact is computed. */
struct SceneParams {
  bool table{true};
  double table_height{0.10};
  Eigen::Vector2d table_center{0.5, 0.0};
  Eigen::Vector2d table_size{0.6, 0.8};
  std::vector<SurfaceParams> surfaces;
  std::string model_directives;
  double friction{0.3};
  double contact_stiffness{3e4};
  double contact_dissipation{10.0};
  double relaxation_time{0.01};
  ContactApproximation contact_approximation{ContactApproximation::kLagged};
  double time_step{1e-3};
  Tool tool{Tool::kSphere};
  double tool_size{0.06};
  double tool_mass{kToolMass};
  double gravity{9.81};
  Eigen::Vector3d start_position{0.45, 0.0, 0.18};

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;

  /** The table, if there is one, followed by `surfaces`; each has a material.
   */
  std::vector<SurfaceParams> AllSurfaces() const;

  /** The same as geometry and material. */
  std::vector<ContactSurfaceParams> ContactSurfaces() const;

  /** Height of the tool point when the tool, pointing down, touches the table's
  top, m. */
  double contact_height() const {
    return tool == Tool::kSphere ? table_height + kTipRadius : table_height;
  }

  /** Centres of a flat tool's corners, m, in E. */
  std::vector<Eigen::Vector3d> Corners() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("table", &table, "whether there is one: a box"));
    a->Visit(Field("table_height", &table_height, Between(1e-3, 1.5), "m",
                   "of the table's top over B; the table stands on z = 0; with "
                   "or without it where recordings press"));
    a->Visit(Field("table_center", &table_center, Finite(), "m",
                   "x and y of the table's centre, in B"));
    a->Visit(Field("table_size", &table_size, Between(1e-3, 10), "m",
                   "the table's edge lengths along x and y"));
    a->Visit(Field("surfaces", &surfaces,
                   "further ones that the tool can touch (walls, pipes)"));
    a->Visit(Field("model_directives", &model_directives,
                   "file of Drake model directives: further models in the "
                   "scene, with engine drake; in a scenario's file relative to "
                   "that, else to the working directory; ~ is the home "
                   "directory"));
    a->Visit(Field("friction", &friction, Between(0, 5), "",
                   "Coulomb coefficient between the tool and a surface"));
    a->Visit(Field(
        "contact_stiffness", &contact_stiffness, Between(1, 1e8), "N/m",
        "of tool and surface together; the corners of a flat tool share it"));
    a->Visit(Field("contact_dissipation", &contact_dissipation, Between(0, 1e3),
                   "s/m",
                   "Hunt-Crossley coefficient d in f = k x (1 + d dx/dt); for "
                   "the approximations lagged and similar"));
    a->Visit(
        Field("relaxation_time", &relaxation_time, Between(0, 10), "s",
              "linear dissipation in place of contact_dissipation for sap"));
    VisitEnum(a, "SceneParams", "contact_approximation", &contact_approximation,
              "Drake's discrete one; the first two keep Coulomb's law without "
              "sap's gap of friction * time_step * slip");
    a->Visit(Field("time_step", &time_step, Between(1e-5, 1e-2), "s",
                   "of the plant; control has a period of its own"));
    VisitEnum(a, "SceneParams", "tool", &tool,
              "a ball around E, or a square pad, E in the middle of its face, "
              "that touches with a small ball in each corner");
    a->Visit(Field("tool_size", &tool_size, Between(0.005, 0.2), "m",
                   "between the corners of a flat tool along its edges"));
    a->Visit(
        Field("tool_mass", &tool_mass, Between(1e-3, 3), "kg",
              "of all that is beyond the flange; the inertia scales with it"));
    a->Visit(
        Field("gravity", &gravity, Between(0, 100), "m/s^2", "along -z of B"));
    a->Visit(Field("start_position", &start_position, Between(-2, 2), "m",
                   "in B, of the tool point at time 0"));
  }
};

}  // namespace dual_proxy
