// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include <Eigen/Core>

namespace dual_proxy {

/** A place where a tool touches a surface, or is about to. All in B. */
struct PointContact {
  /** Unit vector INTO the surface. */
  Eigen::Vector3d normal{-Eigen::Vector3d::UnitZ()};
  /** m: from the tool point to the contact. */
  Eigen::Vector3d p{Eigen::Vector3d::Zero()};
  /** m, at the beginning of the step; negative is the distance. */
  double penetration{0};
  double stiffness{1};    ///< N/m, > 0.
  double dissipation{0};  ///< s/m, >= 0.
  double friction{0};     ///< mu, >= 0: static and kinetic.
  /** N s, of the tool on the surface, over the step: first a guess, as the last
  step's is a good one, then the solution. */
  Eigen::Vector3d impulse{Eigen::Vector3d::Zero()};
};

/** Most contacts that SolveContacts() takes. */
inline constexpr int kMaxPointContacts = 32;

/** Impulses of a rigid tool on what it touches in one step of time h, all of
them at once, so that the laws of contact hold at the end of the step:

    gamma_n = h k (x + h u_n)_+ (1 + d u_n)_+
    sticking:  u_t = 0,  |gamma_t| <= mu gamma_n
    sliding:   gamma_t = mu gamma_n u_t / |u_t|

with the contact's velocity u at the end, u_n into the surface, and the
penetration x at the beginning. Being implicit, it is stable at any stiffness,
and what sticks does not creep.

Solved by nonlinear Gauss-Seidel: in turn each normal impulse, for which there
is a formula, and each pair of tangential ones, which is what brings the contact
to rest or, where that takes too much, the one on the circle of friction that
the remaining velocity is parallel to. Friction is within the cone and no normal
impulse negative however far the iteration came.

@param step  s, > 0: h.
@param inverse_inertia  of the tool at its tool point, in B: Lambda^-1 =
    J A^-1 J^T, which turns a wrench's impulse [force; moment] into a change of
    the twist [linear; angular].
@param[in,out] contacts  at most kMaxPointContacts; their impulses are set.
@param[in,out] twist  [linear; angular], m/s and rad/s, of the tool point in B:
at the end of the step without contact; then with it. No heap, no throw. */
void SolveContacts(double step,
                   const Eigen::Matrix<double, 6, 6>& inverse_inertia,
                   std::span<PointContact> contacts,
                   Eigen::Matrix<double, 6, 1>* twist) noexcept;

}  // namespace dual_proxy
