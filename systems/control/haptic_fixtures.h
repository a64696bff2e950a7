// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <utility>

#include <Eigen/Core>

#include "dual_proxy/common/enum_strings.h"
#include "dual_proxy/common/serialize.h"

namespace dual_proxy {

/** @file
Forces on the hand that do not come from the robot; all in D. They are added to
F_h before the device's limits, and neither is ever more than its maximum. */

/** Parameters of WorkspaceWall. */
struct WorkspaceWallParams {
  double stiffness{0};
  double damping{10};
  double radius{0.075};
  double half_length{0.05};
  double max_force{8};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("stiffness", &stiffness, AtLeast(0), "N/m", "0 is off"));
    a->Visit(Field("damping", &damping, AtLeast(0), "N s/m",
                   "of a hand that goes further out; at most as much as the "
                   "spring's force"));
    a->Visit(Field("radius", &radius, Above(0), "m",
                   "about the x axis of D, where the wall begins"));
    a->Visit(Field("half_length", &half_length, Above(0), "m",
                   "along the x axis of D, likewise"));
    a->Visit(Field("max_force", &max_force, AtLeast(0), "N", "of the wall"));
  }
};

/** The edge of the device's workspace, a cylinder about its x axis, as a soft
wall that is felt before the device's hard stops:

    F = -(k d + min(b v_out, k d)) n

with d the depth beyond it and n outward, for jacket and ends alike. It pushes
inward only. */
class WorkspaceWall {
 public:
  /** @throws std::invalid_argument if params are not valid. */
  explicit WorkspaceWall(const WorkspaceWallParams& params);

  bool on() const { return params_.stiffness > 0; }

  /** The wall's force on the hand, N.
  @param p  of the handle, m, from the device's own home.
  @param v  of the handle, m/s.
  Zero if one is not finite. No heap, no throw. */
  Eigen::Vector3d Calc(const Eigen::Vector3d& p,
                       const Eigen::Vector3d& v) const noexcept;

 private:
  WorkspaceWallParams params_;
};

/** What a hand is guided onto. */
enum class GuidanceShape { kNone, kLine, kPlane };

template <>
struct EnumStrings<GuidanceShape> {
  static constexpr std::pair<GuidanceShape, const char*> kValues[] = {
      {GuidanceShape::kNone, "none"},
      {GuidanceShape::kLine, "line"},
      {GuidanceShape::kPlane, "plane"}};
};

/** Parameters of Guidance. */
struct GuidanceParams {
  GuidanceShape shape{GuidanceShape::kNone};
  Eigen::Vector3d point{Eigen::Vector3d::Zero()};
  Eigen::Vector3d direction{Eigen::Vector3d::UnitZ()};
  double stiffness{300};
  double max_force{3};
  double force_rate{20};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    VisitEnum(a, "GuidanceParams", "shape", &shape,
              "what the hand is guided onto");
    a->Visit(Field("point", &point, Finite(), "m",
                   "in D, from the home that the clutch has moved: on it"));
    a->Visit(Field("direction", &direction, Finite(), "",
                   "in D, not zero: of the line, or the plane's normal"));
    a->Visit(Field("stiffness", &stiffness, AtLeast(0), "N/m",
                   "of the spring towards it"));
    a->Visit(Field("max_force", &max_force, AtLeast(0), "N",
                   "that a hand must overcome to leave it"));
    a->Visit(Field("force_rate", &force_rate, Above(0), "N/s",
                   "bound on the change of the force"));
  }
};

/** Memory of Guidance. */
struct GuidanceState {
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};  ///< N, on the hand.
};

/** A guidance virtual fixture (Rosenberg's): a spring towards the nearest point
of a line or a plane, saturated and then rate-limited, both on the norm. Along
line or plane there is no force. */
class Guidance {
 public:
  /** @param period  s, > 0: between two calls of Update().
  @throws std::invalid_argument if an argument is not valid. */
  Guidance(const GuidanceParams& params, double period);

  bool on() const { return params_.shape != GuidanceShape::kNone; }

  GuidanceState MakeState() const { return {}; }

  /** Advances by one period.
  @param p  of the handle, m, from the home that the clutch has moved.
  @param active  false: the force fades.
  A position that is not finite counts as not active. No heap, no throw. */
  const Eigen::Vector3d& Update(const Eigen::Vector3d& p, bool active,
                                GuidanceState* state) const noexcept;

 private:
  GuidanceParams params_;
  Eigen::Matrix3d guided_{Eigen::Matrix3d::Zero()};  // Where there is a spring.
  double max_step_{0};
};

/** Parameters of Homing. */
struct HomingParams {
  double speed{0.05};
  double max_force{4};
  double stiffness{500};
  double damping{20};
  double force_rate{200};
  double tolerance{0.002};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("speed", &speed, Above(0), "m/s", "on the way home"));
    a->Visit(Field("max_force", &max_force, AtLeast(0), "N",
                   "that a hand in the way feels"));
    a->Visit(Field("stiffness", &stiffness, Above(0), "N/m",
                   "of the spring that leads the handle"));
    a->Visit(Field("damping", &damping, AtLeast(0), "N s/m", "of the handle"));
    a->Visit(Field("force_rate", &force_rate, Above(0), "N/s",
                   "bound on the change of the force; one below what spring "
                   "and damping need makes a handle that is let go overshoot"));
    a->Visit(Field("tolerance", &tolerance, Above(0), "m",
                   "distance at which the handle is at home"));
  }
};

/** Memory of Homing. */
struct HomingState {
  Eigen::Vector3d target{Eigen::Vector3d::Zero()};  ///< m: on its way home.
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};   ///< N, on the hand.
  bool active{false};  ///< Whether the handle is led, or held at home.
  bool done{false};    ///< Whether it came home under this request.
};

/** Leads the handle to the device's home as long as it is asked to: by a spring
to a point that moves there at a limited speed, with a limited force. Where the
handle is held the point waits for it, so that a hand that lets go is not left
with a stretched spring. It is home when it is near and slow; there it is kept.
*/
class Homing {
 public:
  /** @param period  s, > 0: between two calls of Update().
  @throws std::invalid_argument if an argument is not valid. */
  Homing(const HomingParams& params, double period);

  HomingState MakeState() const { return {}; }

  /** Advances by one period; results are in `state`.
  @param p  of the handle, m, from the device's own home.
  @param v  of the handle, m/s.
  One that is not finite stops it until it is. No heap, no throw. */
  void Update(bool requested, const Eigen::Vector3d& p,
              const Eigen::Vector3d& v, HomingState* state) const noexcept;

 private:
  HomingParams params_;
  double period_;
  double leash_;  // m, of the point from the handle.
};

}  // namespace dual_proxy
