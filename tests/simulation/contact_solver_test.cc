// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/contact_solver.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "dual_proxy/common/random.h"
#include "no_alloc.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

constexpr double kStep = 1e-3;

Vector3d DrawVector(double scale, RandomStream* random) {
  Vector3d value;
  for (double& entry : value) entry = scale * random->Normal();
  return value;
}

// An arm's at its tool point: some kg in one direction, a tenth in another, and
// moments of inertia of some 0.01 kg m^2, all coupled.
Matrix6d DrawInverseInertia(RandomStream* random) {
  Eigen::Matrix<double, 6, 7> half;
  for (double& entry : half.reshaped()) entry = random->Normal();
  half.topRows<3>() *= 0.5;
  half.bottomRows<3>() *= 4;
  return half * half.transpose();
}

Vector3d CalcVelocity(const PointContact& contact, const Vector6d& twist) {
  return twist.head<3>() + twist.tail<3>().cross(contact.p);
}

// How far the laws are from being kept, as a share of the largest impulse; and
// for how many contacts which of them holds.
struct Check {
  double normal_error{0};
  double cone_error{0};
  double sliding_error{0};
  int open{0};
  int sticking{0};
  int sliding{0};
};

Check CheckLaws(const std::vector<PointContact>& contacts,
                const Vector6d& twist) {
  double largest = 1e-12;
  for (const PointContact& contact : contacts) {
    largest = std::max(largest, contact.impulse.norm());
  }
  Check result;
  for (const PointContact& contact : contacts) {
    const Vector3d u = CalcVelocity(contact, twist);
    const double u_n = contact.normal.dot(u);
    const Vector3d u_t = u - u_n * contact.normal;
    const double gamma_n = contact.normal.dot(contact.impulse);
    const Vector3d gamma_t = contact.impulse - gamma_n * contact.normal;
    const double law = kStep * contact.stiffness *
                       std::max(0.0, contact.penetration + kStep * u_n) *
                       std::max(0.0, 1 + contact.dissipation * u_n);
    EXPECT_GE(gamma_n, 0);
    result.normal_error =
        std::max(result.normal_error, std::abs(law - gamma_n) / largest);
    const double limit = contact.friction * gamma_n;
    result.cone_error =
        std::max(result.cone_error, (gamma_t.norm() - limit) / largest);
    if (gamma_n == 0) {
      ++result.open;
    } else if (gamma_t.norm() < limit * (1 - 1e-9)) {
      ++result.sticking;
      result.sliding_error = std::max(result.sliding_error, u_t.norm());
    } else {
      ++result.sliding;
      result.sliding_error =
          std::max(result.sliding_error,
                   (limit * u_t - u_t.norm() * gamma_t).norm() / largest);
    }
  }
  return result;
}

TEST(ContactSolverTest, OneContactOfABallHasAFormula) {
  // A mass of 2 kg without coupling sinks in at 0.1 m/s and slides at 0.3 m/s.
  const Matrix6d inverse_inertia = 0.5 * Matrix6d::Identity();
  PointContact contact;
  contact.penetration = 1e-3;
  contact.stiffness = 1e4;
  contact.friction = 0.5;
  Vector6d twist;
  twist << 0.3, 0, -0.1, 0, 0, 0;
  SolveContacts(kStep, inverse_inertia, {&contact, 1}, &twist);
  // gamma = h k (x + h (u - gamma / m)).
  const double gamma =
      kStep * 1e4 * (1e-3 + kStep * 0.1) / (1 + kStep * kStep * 1e4 / 2);
  EXPECT_NEAR(contact.impulse.z(), -gamma, 1e-12);
  EXPECT_NEAR(contact.impulse.x(), 0.5 * gamma, 1e-12);
  EXPECT_NEAR(twist(0), 0.3 - 0.25 * gamma, 1e-12);
  EXPECT_NEAR(twist(2), -0.1 + 0.5 * gamma, 1e-12);

  // With more friction it sticks.
  contact.friction = 60;
  twist << 0.3, 0, -0.1, 0, 0, 0;
  SolveContacts(kStep, inverse_inertia, {&contact, 1}, &twist);
  EXPECT_NEAR(contact.impulse.x(), 2 * 0.3, 1e-12);
  EXPECT_EQ(twist(0), 0);

  // Not there by the end of the step.
  contact.penetration = -2e-4;
  twist << 0.3, 0, -0.1, 0, 0, 0;
  SolveContacts(kStep, inverse_inertia, {&contact, 1}, &twist);
  EXPECT_EQ(contact.impulse, Vector3d::Zero());
  EXPECT_EQ(twist(0), 0.3);
}

TEST(ContactSolverTest, OneContactKeepsTheLaws) {
  RandomStream random(1);
  int sticking = 0;
  int sliding = 0;
  for (int i = 0; i < 5000; ++i) {
    const Matrix6d inverse_inertia = DrawInverseInertia(&random);
    PointContact contact;
    contact.normal = DrawVector(1, &random).normalized();
    contact.p = DrawVector(0.03, &random);
    contact.penetration = 1e-3 * random.Normal();
    contact.stiffness = std::pow(10, 2 + 3.5 * random.Uniform());
    contact.dissipation = 10 * random.Uniform();
    contact.friction = random.Uniform();
    Vector6d twist;
    twist << DrawVector(0.01, &random), DrawVector(0.1, &random);
    const Vector6d free_twist = twist;
    SolveContacts(kStep, inverse_inertia, {&contact, 1}, &twist);

    Vector6d impulse;
    impulse << contact.impulse, contact.p.cross(contact.impulse);
    EXPECT_LT((free_twist - inverse_inertia * impulse - twist).norm(), 1e-12);
    const Check check = CheckLaws({contact}, twist);
    EXPECT_LT(check.normal_error, 1e-5);
    EXPECT_LT(check.cone_error, 1e-14);
    EXPECT_LT(check.sliding_error, 1e-5);
    sticking += check.sticking;
    sliding += check.sliding;
    if (::testing::Test::HasFailure()) {
      FAIL() << "trial " << i << ", stiffness " << contact.stiffness;
    }
  }
  EXPECT_GT(sticking, 200);
  EXPECT_GT(sliding, 500);
}

// The corners of a flat tool that rests, slides or tips on planes, in a corner.
TEST(ContactSolverTest, ManyContactsKeepTheLaws) {
  RandomStream random(2);
  Check total;
  for (int i = 0; i < 2000; ++i) {
    const Matrix6d inverse_inertia = DrawInverseInertia(&random);
    const double stiffness = std::pow(10, 3 + 2 * random.Uniform());
    const bool in_corner = i % 2 == 0;
    const double friction = (in_corner ? 0.5 : 2) * random.Uniform();
    std::vector<PointContact> contacts;
    for (int j = 0; j < 4; ++j) {
      PointContact contact;
      contact.p = {(j & 1) ? 0.02 : -0.02, (j & 2) ? 0.02 : -0.02, -0.01};
      contact.penetration = 5e-4 + 1e-4 * random.Normal();
      contact.stiffness = stiffness;
      contact.dissipation = 5;
      contact.friction = friction;
      contacts.push_back(contact);
      if (in_corner && (j & 1)) {
        contact.normal = Vector3d::UnitX();
        contact.p.x() += 0.01;
        contact.p.z() = 0;
        contacts.push_back(contact);
      }
    }
    const double speed = in_corner ? 0.1 : 0.001;
    Vector6d twist;
    twist << DrawVector(speed, &random), DrawVector(10 * speed, &random);
    const Vector6d free_twist = twist;
    SolveContacts(kStep, inverse_inertia, contacts, &twist);

    Vector6d impulse = Vector6d::Zero();
    for (const PointContact& contact : contacts) {
      impulse.head<3>() += contact.impulse;
      impulse.tail<3>() += contact.p.cross(contact.impulse);
    }
    EXPECT_LT((free_twist - inverse_inertia * impulse - twist).norm(), 1e-12);
    const Check check = CheckLaws(contacts, twist);
    EXPECT_LT(check.cone_error, 1e-14);
    total.normal_error = std::max(total.normal_error, check.normal_error);
    total.sliding_error = std::max(total.sliding_error, check.sliding_error);
    total.open += check.open;
    total.sticking += check.sticking;
    total.sliding += check.sliding;
    if (::testing::Test::HasFailure()) FAIL() << "trial " << i;
  }
  EXPECT_LT(total.normal_error, 5e-3);
  EXPECT_LT(total.sliding_error, 5e-3);
  EXPECT_GT(total.open, 100);
  EXPECT_GT(total.sticking, 500);
  EXPECT_GT(total.sliding, 500);
}

// A singular arm can not move its tool in some directions at all.
TEST(ContactSolverTest, DirectionsWithoutMotionAreHarmless) {
  Matrix6d inverse_inertia = Matrix6d::Zero();
  for (const bool also_normal : {false, true}) {
    inverse_inertia(0, 0) = 0.5;
    inverse_inertia(2, 2) = also_normal ? 0 : 0.5;
    std::vector<PointContact> contacts(1);
    contacts[0].penetration = 1e-3;
    contacts[0].stiffness = 1e4;
    contacts[0].friction = 0.5;
    Vector6d twist;
    twist << 0.1, 0, also_normal ? 0 : -0.1, 0, 0, 0;
    SolveContacts(kStep, inverse_inertia, contacts, &twist);
    EXPECT_NEAR(contacts[0].impulse.x(), -0.5 * contacts[0].impulse.z(), 1e-12);
    EXPECT_NEAR(contacts[0].impulse.y(), 0, 1e-12);
    EXPECT_LT(CheckLaws(contacts, twist).normal_error, 1e-6);
  }
}

TEST(ContactSolverTest, DoesNotAllocate) {
  std::vector<PointContact> contacts(kMaxPointContacts);
  for (PointContact& contact : contacts) {
    contact.penetration = 1e-3;
    contact.friction = 0.3;
  }
  Vector6d twist = Vector6d::Ones();
  ScopedNoAlloc guard;
  SolveContacts(kStep, Matrix6d::Identity(), contacts, &twist);
  EXPECT_EQ(guard.count(), 0);
}

}  // namespace
}  // namespace dual_proxy
