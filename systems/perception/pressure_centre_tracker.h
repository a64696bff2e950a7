// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <numbers>

#include "dual_proxy/common/serialize.h"

namespace dual_proxy {

/** Parameters of PressureCentreTracker: what is known of sensor and tool. None
is per update, so every period behaves alike. */
struct PressureCentreParams {
  double contact_moment{0.015};
  double loss_moment{0.007};
  double edge_distance{0.01};
  double inside_moment{0.01};
  double inside_time{0.04};
  double tipping_angle{0.03};
  double bias_time{2};

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("contact_moment", &contact_moment, Above(0), "N m",
                   "a moment across the normal that is larger is a direction"));
    a->Visit(Field("loss_moment", &loss_moment,
                   Between(0, Open({contact_moment, "contact_moment"})), "N m",
                   "a single direction is lost when it stays below"));
    a->Visit(Field("edge_distance", &edge_distance, Above(0), "m",
                   "of the tool's edges from the tool point, at least; a force "
                   "that presses nearer is no reason to turn the tool"));
    a->Visit(Field("inside_moment", &inside_moment, Above(0), "N m",
                   "a moment that is less than that of the edge by more shows "
                   "that the tool lies flat"));
    a->Visit(
        Field("inside_time", &inside_time, AtLeast(0), "s", "for so long"));
    a->Visit(Field("tipping_angle", &tipping_angle, Above(0), "rad",
                   "a flat tool that turns farther within half a second "
                   "tips over its edge"));
    a->Visit(Field("bias_time", &bias_time, Above(0), "s",
                   "in which the moment's bias is followed in free space"));
  }
};

/** Means over one period, in B; moments about E. */
struct PressureCentreInput {
  Eigen::Vector3d moment{Eigen::Vector3d::Zero()};            ///< M_s, N m.
  Eigen::Vector3d angular_velocity{Eigen::Vector3d::Zero()};  ///< rad/s.
  Eigen::Vector3d force{Eigen::Vector3d::Zero()};             ///< F_s, N.
  /** Unit vector INTO the surface, as the filter of forces has found it; zero
  while nothing is touched. */
  Eigen::Vector3d normal{Eigen::Vector3d::Zero()};
};

/** What PressureCentreTracker remembers, and its result. */
struct PressureCentreState {
  /** 0 to 2: number of directions in moment space. */
  int dimension{0};
  /** [U1 U2 U3] as columns, in B, right-handed: the moment's direction, the
  other one across the normal, and the normal. Identity at dimension 0. */
  Eigen::Matrix3d axes{Eigen::Matrix3d::Identity()};

  /** N m, in B: what is sensed when nothing touches; of that many inputs. */
  Eigen::Vector3d bias{Eigen::Vector3d::Zero()};
  std::int64_t free_inputs{0};
  /** Whether anything has been touched since the last input in free space. */
  bool touched{false};
  /** N m, in B, across the normal, and N, along it: smoothed. */
  Eigen::Vector3d moment{Eigen::Vector3d::Zero()};
  double force{0};
  /** The edge: mean (m, in B) and weighted covariance (m^2 N^2 s) of moment
  over force, and their weight (N^2 s). */
  Eigen::Vector3d lever{Eigen::Vector3d::Zero()};
  Eigen::Matrix3d scatter{Eigen::Matrix3d::Zero()};
  double weight{0};
  /** rad: how far the tool has lately turned, in B across the normal, and,
  either way, about it. */
  Eigen::Vector3d tipped{Eigen::Vector3d::Zero()};
  double twisted{0};
  /** s: how long the force has pressed inside of the edge, and how long there
  has been next to no moment. */
  double inside{0};
  double idle{0};

  std::int64_t updates{0};
  std::int64_t bad_inputs{0};

  /** Omega_tau = I - Omega_rot, in B: a projection of rank `dimension`. */
  Eigen::Matrix3d CalcSelection() const noexcept;
};

/** Finds in which directions the rotation of a tool that touches a surface is
blocked, from where the force presses: a likelihood of its own for moments,
which have no side and no cone.

Contacts of normal n at places p_i make the moment m = sum f_i p_i x n about the
tool point, across n: rotation about n is never blocked, and a moment about it
is friction's. With N = sum f_i, m / N is the centre of pressure, turned by a
quarter about n. It lies

    in a point   and does not move: a corner
    on a line    that misses the tool point by edge_distance: an edge
    in a plane   as soon as it has left that line: the tool lies flat.

So there is one direction when the moment is more than noise and the lever more
than edge_distance: about that moment, as an edge lets it be followed until the
tool lies flat. There are two when the centre of pressure has moved inside of
the edge, where it has been so far. They remain, however small the moment, until
the tool tips, or the filter of forces says that nothing is touched. While that
is so the sensor's bias is learned.

No heap, no throw; the cost does not depend on anything. */
class PressureCentreTracker {
 public:
  using Params = PressureCentreParams;
  using State = PressureCentreState;

  /** @param period  s, > 0, between inputs.
  @throws std::invalid_argument if a parameter is invalid. */
  PressureCentreTracker(const Params& params, double period);

  State MakeState() const { return {}; }

  /** Advances by one period. An input that is not finite, or whose square
  overflows, is refused and counted, and nothing else changes. */
  void Update(const PressureCentreInput& input, State* state) const noexcept;

 private:
  void LearnBias(const Eigen::Vector3d& moment, State* state) const noexcept;
  void TurnWithTool(const PressureCentreInput& input,
                    State* state) const noexcept;
  bool IsTipping(const State& state) const noexcept;
  bool PressesInside(const Eigen::Vector3d& normal,
                     const State& state) const noexcept;
  void FindEdge(State* state) const noexcept;
  void LearnEdge(State* state) const noexcept;
  void Decide(const Eigen::Vector3d& normal, State* state) const noexcept;

  Params params_;
  double period_;
  // Shares of the way that are gone, or left, in one period.
  double smoothing_gain_;
  double memory_decay_;
  double tipping_decay_;
};

}  // namespace dual_proxy
