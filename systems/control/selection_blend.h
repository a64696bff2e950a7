// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "dual_proxy/common/serialize.h"

namespace dual_proxy {

/** Parameters of SelectionBlend. */
struct SelectionBlendParams {
  double blend_time{0.03};
  double period{0.001};

  /** @throws std::invalid_argument naming field, range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("blend_time", &blend_time, AtLeast(0), "s",
                   "in which a new selection takes over; 0 switches at once"));
    a->Visit(Field("period", &period, Above(0), "s", "between updates"));
  }
};

/** Memory of SelectionBlend; 3x3 matrices in B. */
struct SelectionBlendState {
  Eigen::Matrix3d from{Eigen::Matrix3d::Zero()};     ///< Blend at last change.
  Eigen::Matrix3d to{Eigen::Matrix3d::Zero()};       ///< Selection asked for.
  Eigen::Matrix3d blended{Eigen::Matrix3d::Zero()};  ///< What is in force now.
  double progress{1};       ///< 0 at the change, 1 when it is complete.
  bool initialized{false};  ///< The first selection is taken without a blend.
};

/** Replaces the switch of a selection matrix Omega by a linear blend, from the
matrix that is in force to the one asked for:

    Omega_b = from + progress (to - from),  progress: 0 to 1 in blend_time.

A convex combination of projections is symmetric with eigenvalues in [0, 1], so
Omega_b and I - Omega_b still share every direction without a gap or an excess.
A switch at once asks the arm for 1e4 to 1e5 N m/s of torque rate. */
class SelectionBlend {
 public:
  /** @throws std::invalid_argument if params are not valid. */
  explicit SelectionBlend(SelectionBlendParams params = {});

  const SelectionBlendParams& params() const { return params_; }

  SelectionBlendState MakeState() const noexcept { return {}; }

  /** Advances by one period and returns Omega_b (also state->blended).
  @pre selection is an orthogonal projection (IsSelection()). */
  const Eigen::Matrix3d& Update(const Eigen::Matrix3d& selection,
                                SelectionBlendState* state) const noexcept;

 private:
  SelectionBlendParams params_;
};

}  // namespace dual_proxy
