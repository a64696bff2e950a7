// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <numbers>
#include <utility>

#include <Eigen/Core>

#include "dual_proxy/common/enum_strings.h"
#include "dual_proxy/common/serialize.h"

namespace dual_proxy {

/** How a reference force starts in a direction that has just come under force
control. */
enum class Handover {
  /// It grows from where it is, as in the paper: from zero at the rate limit.
  /// On the robot the contact force collapses for tens of milliseconds.
  kPrinted,
  /// It starts from the force that is sensed there.
  kBumpless,
};

template <>
struct EnumStrings<Handover> {
  static constexpr std::pair<Handover, const char*> kValues[] = {
      {Handover::kPrinted, "printed"}, {Handover::kBumpless, "bumpless"}};
};

/** Parameters of a VirtualSpring; of forces, or with N m and rad of moments. */
struct VirtualSpringParams {
  double stiffness{500.0};
  double max_force{20.0};
  /// It is what holds a robot that leaves its proxy by its own doing.
  double leash{0.0};
  double rate{50.0};
  Handover handover{Handover::kPrinted};
  /// It tells another surface from one surface that bends away.
  double new_direction_angle{std::numbers::pi / 3.0};
  double period{0.001};

  /** @throws std::invalid_argument naming the field. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("stiffness", &stiffness, AtLeast(0), "N/m", "k_vir"));
    a->Visit(Field("max_force", &max_force, AtLeast(0), "N",
                   "bound on the norm of the force; 0 is off"));
    a->Visit(Field("leash", &leash, AtLeast(0), "m",
                   "displacement beyond which max_force bounds no more, and "
                   "the force grows on with the stiffness; 0 is off"));
    a->Visit(Field("rate", &rate, Above(0), "N/s",
                   "bound on the change of the force"));
    VisitEnum(a, "VirtualSpringParams", "handover", &handover,
              "how the force starts in a new direction");
    a->Visit(Field("new_direction_angle", &new_direction_angle,
                   Between(Open(0), Open(std::numbers::pi / 2)), "rad",
                   "a direction is new if the last force space holds nothing "
                   "within this angle of it"));
    a->Visit(Field("period", &period, Above(0), "s", "between updates"));
  }
};

struct VirtualSpringState {
  /// The reference force or moment, N or N m.
  Eigen::Vector3d reference{Eigen::Vector3d::Zero()};
  /// The selection of the last call.
  Eigen::Matrix3d selection{Eigen::Matrix3d::Zero()};
};

/** The spring between proxy and robot (or hand) in force space, eq. (4), (5):

    F = -k Ω (x - x_p)

saturated to a maximum (but for displacements beyond the leash) and then
rate-limited, both on the norm. So F changes by
at most rate x period per tick whatever happens to x, x_p and Ω, with one
exception: with Handover::kBumpless, when Ω takes in new directions and a sensed
force is given, the part of F along these starts from the sensed force. Where Ω
has lost a direction F fades from it at the rate limit; when it has settled it
is exactly Ω's. The same for moments with the rotation vector. */
class VirtualSpring {
 public:
  /** @throws std::invalid_argument for parameters out of range. */
  explicit VirtualSpring(VirtualSpringParams params);

  const VirtualSpringParams& params() const { return params_; }

  VirtualSpringState MakeState() const { return {}; }

  /** Advances by one period.
  @param displacement x - x_p, m (or rotation vector of R R_pᵀ, rad).
  @param selection Ω, 3x3 orthogonal projection onto force (moment) space.
  @param sensed force (moment) on the environment, N (N m), or nullptr: there is
      no hand-over then.
  @param active false: the reference fades to zero (or to what the leash asks
      for), and there is no hand-over.
  @pre `selection` and `*sensed` are finite. A displacement that is not finite
  counts as none.  No heap, no throw. */
  void Update(const Eigen::Vector3d& displacement,
              const Eigen::Matrix3d& selection, const Eigen::Vector3d* sensed,
              bool active, VirtualSpringState* state) const noexcept;

 private:
  VirtualSpringParams params_;
  double new_direction_sine2_{};
};

}  // namespace dual_proxy
