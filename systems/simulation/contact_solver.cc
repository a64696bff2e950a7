// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/contact_solver.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>

#include "dual_proxy/common/elementary.h"

namespace dual_proxy {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

constexpr int kMaxSweeps = 40;
// Of what the contacts do to the twist: a sweep that changes it by less is the
// last.
constexpr double kTolerance = 1e-6;
// 1/kg, of a direction: a singular arm has some that it can not move in.
constexpr double kLeastInverseMass = 1e-9;

/** One direction of a contact. */
struct Direction {
  Direction() = default;
  Direction(const Vector3d& axis_in, const Vector3d& p,
            const Matrix6d& inverse_inertia)
      : axis(axis_in) {
    row << axis, p.cross(axis);
    response = inverse_inertia * row;
    inverse_mass = std::max(row.dot(response), kLeastInverseMass);
  }

  Vector3d axis;
  Vector6d row;       // The contact's velocity along `axis` is row . twist.
  Vector6d response;  // What an impulse of 1 along `axis` takes off the twist.
  double inverse_mass;  // What it takes off the velocity, 1/kg.
};

/** A contact's directions, and the impulses along them. */
struct Constraint {
  Constraint() = default;
  Constraint(const PointContact& contact, const Matrix6d& inverse_inertia)
      : normal(contact.normal, contact.p, inverse_inertia),
        normal_impulse(std::max(0.0, contact.normal.dot(contact.impulse))) {
    // The two tangents that do not act on each other.
    const Vector3d t1 = contact.normal.unitOrthogonal();
    const Vector3d t2 = contact.normal.cross(t1);
    const Direction first(t1, contact.p, inverse_inertia);
    const Direction second(t2, contact.p, inverse_inertia);
    const double angle = 0.5 * Atan2(2 * first.row.dot(second.response),
                                     first.inverse_mass - second.inverse_mass);
    const auto [sin, cos] = CalcSinCos(angle);
    const Vector3d t = cos * t1 + sin * t2;
    tangents = {Direction(t, contact.p, inverse_inertia),
                Direction(contact.normal.cross(t), contact.p, inverse_inertia)};
    friction_impulse << tangents[0].axis.dot(contact.impulse),
        tangents[1].axis.dot(contact.impulse);
  }

  /** N s, in B: of the tool on the surface. */
  Vector3d CalcImpulse() const {
    return normal_impulse * normal.axis +
           friction_impulse.x() * tangents[0].axis +
           friction_impulse.y() * tangents[1].axis;
  }

  Direction normal;
  std::array<Direction, 2> tangents;
  double normal_impulse;
  Vector2d friction_impulse;
};

/** The normal impulse gamma >= 0 with
gamma = h k (x + h u)_+ (1 + d u)_+, u = velocity - inverse_mass gamma. */
double CalcNormalImpulse(const PointContact& contact, double step,
                         double inverse_mass, double velocity) {
  const double depth = contact.penetration + step * velocity;
  const double damping = 1 + contact.dissipation * velocity;
  if (!(depth > 0 && damping > 0)) return 0;
  // The smaller root of a quadratic, at which both brackets are positive.
  const double gain = step * contact.stiffness;
  const double depth_slope = step * inverse_mass;
  const double damping_slope = contact.dissipation * inverse_mass;
  const double a = gain * depth_slope * damping_slope;
  const double b = 1 + gain * (depth_slope * damping + damping_slope * depth);
  const double c = gain * depth * damping;
  return 2 * c / (b + std::sqrt(std::max(0.0, b * b - 4 * a * c)));
}

/** The friction impulse, |gamma| <= limit, after which the velocity
u = velocity - inverse_mass gamma (by component) is zero, or parallel to gamma
and |gamma| = limit. */
Vector2d CalcFrictionImpulse(const Vector2d& velocity,
                             const Vector2d& inverse_mass, double limit) {
  if (limit == 0) return Vector2d::Zero();
  const Vector2d sticking = velocity.cwiseQuotient(inverse_mass);
  if (sticking.squaredNorm() <= limit * limit) return sticking;
  // With the speed s of sliding, gamma = limit e, where
  // e = velocity / (s + limit inverse_mass) is a unit vector. Newton's method
  // on 1 / |e| - 1, which is nearly linear in s, from a speed that is too low.
  const Vector2d offset = limit * inverse_mass;
  double speed = std::max(0.0, velocity.norm() - offset.maxCoeff());
  Vector2d e;
  for (int i = 0; i < 20; ++i) {
    const Vector2d sum = offset.array() + speed;
    e = velocity.cwiseQuotient(sum);
    const double size = e.norm();
    const double change =
        (size - 1) * size * size / e.cwiseAbs2().cwiseQuotient(sum).sum();
    speed += change;
    if (!(std::abs(change) > 1e-14 * (speed + offset.maxCoeff()))) break;
  }
  return limit * e.normalized();
}

}  // namespace

void SolveContacts(double step, const Matrix6d& inverse_inertia,
                   std::span<PointContact> contacts, Vector6d* twist) noexcept {
  std::array<Constraint, kMaxPointContacts> constraints;
  const std::size_t count =
      std::min(contacts.size(), std::size_t{kMaxPointContacts});
  const Vector6d free_twist = *twist;
  for (std::size_t i = 0; i < count; ++i) {
    constraints[i] = Constraint(contacts[i], inverse_inertia);
    Vector6d wrench;
    const Vector3d impulse = constraints[i].CalcImpulse();
    wrench << impulse, contacts[i].p.cross(impulse);
    *twist -= inverse_inertia * wrench;
  }
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
    const Vector6d last_twist = *twist;
    for (std::size_t i = 0; i < count; ++i) {
      const PointContact& contact = contacts[i];
      Constraint& constraint = constraints[i];
      const Direction& normal = constraint.normal;
      const double last = constraint.normal_impulse;
      constraint.normal_impulse = CalcNormalImpulse(
          contact, step, normal.inverse_mass,
          normal.row.dot(*twist) + normal.inverse_mass * last);
      const double change = constraint.normal_impulse - last;
      *twist -= change * normal.response;

      const auto& [first, second] = constraint.tangents;
      const Vector2d last_friction = constraint.friction_impulse;
      const Vector2d inverse_mass(first.inverse_mass, second.inverse_mass);
      const Vector2d velocity(first.row.dot(*twist), second.row.dot(*twist));
      constraint.friction_impulse = CalcFrictionImpulse(
          velocity + inverse_mass.cwiseProduct(last_friction), inverse_mass,
          contact.friction * constraint.normal_impulse);
      const Vector2d friction_change =
          constraint.friction_impulse - last_friction;
      *twist -= friction_change.x() * first.response +
                friction_change.y() * second.response;
    }
    if ((*twist - last_twist).squaredNorm() <=
        kTolerance * kTolerance * (*twist - free_twist).squaredNorm()) {
      break;
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    contacts[i].impulse = constraints[i].CalcImpulse();
  }
}

}  // namespace dual_proxy
