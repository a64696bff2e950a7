// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/arm_model.h"

#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include "dual_proxy/common/random.h"
#include "dual_proxy/common/rotation.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Matrix37 = Eigen::Matrix<double, 3, 7>;

const double kNan = std::numeric_limits<double>::quiet_NaN();
const double kInf = std::numeric_limits<double>::infinity();
// Central differences: truncation about kStep^2, rounding about 1e-15 / kStep.
constexpr double kStep = 1e-5;

template <typename Vector>
Vector RandomVector(RandomStream* random, double size) {
  Vector result;
  for (int i = 0; i < result.size(); ++i) result(i) = size * random->Normal();
  return result;
}

// Three point masses' inertia is that of a body.
Matrix3d RandomInertia(RandomStream* random) {
  Matrix3d inertia = Matrix3d::Zero();
  for (int i = 0; i < 3; ++i) {
    const Vector3d p = RandomVector<Vector3d>(random, 0.1);
    inertia += p.squaredNorm() * Matrix3d::Identity() - p * p.transpose();
  }
  return inertia;
}

ArmModelParams RandomParams(RandomStream* random) {
  ArmModelParams params;
  for (int i = 0; i < 7; ++i) {
    params.p_PJ.col(i) = RandomVector<Vector3d>(random, 0.2);
    params.R_PJ[i] = ExpRotation(RandomVector<Vector3d>(random, 1));
    params.mass(i) = 0.5 + 3 * random->Uniform();
    params.com.col(i) = RandomVector<Vector3d>(random, 0.05);
    params.inertia[i] = RandomInertia(random);
  }
  params.p_LE = RandomVector<Vector3d>(random, 0.1);
  params.R_LE = ExpRotation(RandomVector<Vector3d>(random, 1));
  params.gravity = RandomVector<Vector3d>(random, 6);
  return params;
}

// The textbook's way, link by link: geometric Jacobians and energies.
struct Reference {
  Reference(const ArmModelParams& params, const Vector7& q) {
    Matrix37 joints = Matrix37::Zero();
    Matrix37 axes = Matrix37::Zero();
    Pose X;
    for (int i = 0; i < 7; ++i) {
      X.p += X.R * params.p_PJ.col(i);
      X.R = X.R * params.R_PJ[i] *
            Eigen::AngleAxisd(q(i), Vector3d::UnitZ()).toRotationMatrix();
      joints.col(i) = X.p;
      axes.col(i) = X.R.col(2);
      const Vector3d com = X.p + X.R * params.com.col(i);
      Matrix37 linear = Matrix37::Zero();
      Matrix37 angular = Matrix37::Zero();
      for (int j = 0; j <= i; ++j) {
        linear.col(j) = axes.col(j).cross(com - joints.col(j));
        angular.col(j) = axes.col(j);
      }
      mass += params.mass(i) * linear.transpose() * linear +
              angular.transpose() * X.R * params.inertia[i] * X.R.transpose() *
                  angular;
      gravity += params.mass(i) * linear.transpose() * params.gravity;
      potential_energy -= params.mass(i) * params.gravity.dot(com);
    }
    X_BE.p = X.p + X.R * params.p_LE;
    X_BE.R = X.R * params.R_LE;
    for (int j = 0; j < 7; ++j) {
      J_BE.col(j) << axes.col(j).cross(X_BE.p - joints.col(j)), axes.col(j);
    }
  }

  Pose X_BE;
  Matrix67 J_BE{Matrix67::Zero()};
  Matrix7 mass{Matrix7::Zero()};
  Vector7 gravity{Vector7::Zero()};
  double potential_energy{0};
};

class ArmModelTest : public ::testing::Test {
 protected:
  ModelTerms Calc(const Vector7& q, const Vector7& v) {
    ModelTerms terms;
    dut_.Calc(q, v, &X_BE_, &terms);
    return terms;
  }

  RandomStream random_{5};
  ArmModelParams params_{RandomParams(&random_)};
  ArmModel dut_{params_};
  Pose X_BE_;
};

// All axes parallel; what is behind the second link weighs next to nothing.
GTEST_TEST(ArmModelPlanarTest, TwoLinksMatchTheirFormulas) {
  constexpr double kLength1 = 0.5;
  constexpr double kLength2 = 0.4;
  constexpr double kCom1 = 0.2;
  constexpr double kCom2 = 0.15;
  constexpr double kMass1 = 3;
  constexpr double kMass2 = 2;
  constexpr double kInertia1 = 0.05;
  constexpr double kInertia2 = 0.02;
  constexpr double kGravity = 9.81;
  ArmModelParams params;
  params.p_PJ(0, 1) = kLength1;
  params.mass.setConstant(1e-15);
  params.mass.head<2>() << kMass1, kMass2;
  params.com(0, 0) = kCom1;
  params.com(0, 1) = kCom2;
  params.inertia[0].diagonal() << 0.04, 0.04, kInertia1;
  params.inertia[1].diagonal() << 0.04, 0.04, kInertia2;
  params.p_LE(0) = kLength2;
  params.gravity = {0, -kGravity, 0};
  const ArmModel dut(params);

  RandomStream random(3);
  for (int k = 0; k < 50; ++k) {
    Vector7 q = Vector7::Zero();
    Vector7 v = Vector7::Zero();
    q.head<2>() = RandomVector<Eigen::Vector2d>(&random, 1);
    v.head<2>() = RandomVector<Eigen::Vector2d>(&random, 1);
    Pose X_BE;
    ModelTerms terms;
    dut.Calc(q, v, &X_BE, &terms);

    const double c1 = std::cos(q(0));
    const double s1 = std::sin(q(0));
    const double c2 = std::cos(q(1));
    const double s2 = std::sin(q(1));
    const double c12 = std::cos(q(0) + q(1));
    const double s12 = std::sin(q(0) + q(1));
    const double w12 = v(0) + v(1);
    const Vector3d e1(c1, s1, 0);
    const Vector3d e12(c12, s12, 0);
    const Vector3d n1(-s1, c1, 0);
    const Vector3d n12(-s12, c12, 0);
    EXPECT_LT((X_BE.p - kLength1 * e1 - kLength2 * e12).norm(), 1e-14);
    EXPECT_LT((X_BE.R.col(0) - e12).norm(), 1e-14);
    EXPECT_LT((X_BE.R.col(1) - n12).norm(), 1e-14);

    Vector6 column;
    column << kLength1 * n1 + kLength2 * n12, Vector3d::UnitZ();
    EXPECT_LT((terms.J_BE.col(0) - column).norm(), 1e-14);
    column << kLength2 * n12, Vector3d::UnitZ();
    EXPECT_LT((terms.J_BE.col(1) - column).norm(), 1e-14);
    column << -kLength1 * v(0) * v(0) * e1 - kLength2 * w12 * w12 * e12,
        Vector3d::Zero();
    EXPECT_LT((terms.Jdot_v - column).norm(), 1e-12);

    const double coupling = kMass2 * kLength1 * kCom2;
    const double m22 = kInertia2 + kMass2 * kCom2 * kCom2;
    const double m12 = m22 + coupling * c2;
    const double m11 = kInertia1 + kMass1 * kCom1 * kCom1 +
                       kMass2 * kLength1 * kLength1 + m22 + 2 * coupling * c2;
    EXPECT_NEAR(terms.mass(0, 0), m11, 1e-13);
    EXPECT_NEAR(terms.mass(0, 1), m12, 1e-13);
    EXPECT_NEAR(terms.mass(1, 1), m22, 1e-13);
    EXPECT_NEAR(terms.bias(0), coupling * s2 * (v(0) * v(0) - w12 * w12),
                1e-12);
    EXPECT_NEAR(terms.bias(1), coupling * s2 * v(0) * v(0), 1e-12);
    const double weight2 = kMass2 * kGravity * kCom2 * c12;
    EXPECT_NEAR(terms.gravity(0),
                -(kMass1 * kCom1 + kMass2 * kLength1) * kGravity * c1 - weight2,
                1e-12);
    EXPECT_NEAR(terms.gravity(1), -weight2, 1e-12);
  }
}

TEST_F(ArmModelTest, MatchesTheTextbookOnRandomArms) {
  for (int k = 0; k < 200; ++k) {
    params_ = RandomParams(&random_);
    dut_ = ArmModel(params_);
    const Vector7 q = RandomVector<Vector7>(&random_, 1.5);
    const ModelTerms terms = Calc(q, RandomVector<Vector7>(&random_, 1));
    const Reference expected(params_, q);
    EXPECT_LT((X_BE_.p - expected.X_BE.p).norm(), 1e-13);
    EXPECT_LT((X_BE_.R - expected.X_BE.R).norm(), 1e-13);
    EXPECT_LT((terms.J_BE - expected.J_BE).norm(), 1e-12);
    EXPECT_LT((terms.mass - expected.mass).norm(),
              1e-12 * expected.mass.norm());
    EXPECT_LT((terms.gravity - expected.gravity).norm(),
              1e-12 * (1 + expected.gravity.norm()));
  }
}

TEST_F(ArmModelTest, MassIsSymmetricAndPositiveDefinite) {
  for (int k = 0; k < 200; ++k) {
    dut_ = ArmModel(RandomParams(&random_));
    const Matrix7 mass = Calc(RandomVector<Vector7>(&random_, 1.5),
                              RandomVector<Vector7>(&random_, 1))
                             .mass;
    EXPECT_EQ(mass, mass.transpose());
    EXPECT_EQ(Eigen::LLT<Matrix7>(mass).info(), Eigen::Success);
  }
}

// d/dt (v A v / 2) = v (tau + g), and dU/dt = -v g, along a motion driven by
// the torque that the equation of motion asks for.
TEST_F(ArmModelTest, TorqueIsWhatChangesTheEnergy) {
  for (int k = 0; k < 200; ++k) {
    const Vector7 q = RandomVector<Vector7>(&random_, 1.5);
    const Vector7 v = RandomVector<Vector7>(&random_, 1);
    const Vector7 a = RandomVector<Vector7>(&random_, 1);
    const auto kinetic_energy = [&](double time) {
      const Vector7 v_t = v + time * a;
      const Vector7 q_t = q + time * v + 0.5 * time * time * a;
      return 0.5 * v_t.dot(Calc(q_t, v_t).mass * v_t);
    };
    const auto potential_energy = [&](double time) {
      return Reference(params_, q + time * v).potential_energy;
    };
    const ModelTerms terms = Calc(q, v);
    const Vector7 torque = terms.mass * a + terms.bias - terms.gravity;
    EXPECT_NEAR((kinetic_energy(kStep) - kinetic_energy(-kStep)) / (2 * kStep),
                v.dot(torque + terms.gravity), 1e-6);
    EXPECT_NEAR(
        (potential_energy(kStep) - potential_energy(-kStep)) / (2 * kStep),
        -v.dot(terms.gravity), 1e-6);
  }
}

TEST_F(ArmModelTest, BiasIsLagranges) {
  for (int k = 0; k < 50; ++k) {
    const Vector7 q = RandomVector<Vector7>(&random_, 1.5);
    const Vector7 v = RandomVector<Vector7>(&random_, 1);
    const auto mass_rate = [&](const Vector7& direction) {
      return Matrix7((Reference(params_, q + kStep * direction).mass -
                      Reference(params_, q - kStep * direction).mass) /
                     (2 * kStep));
    };
    Vector7 expected = mass_rate(v) * v;
    for (int i = 0; i < 7; ++i) {
      expected(i) -= 0.5 * v.dot(mass_rate(Vector7::Unit(i)) * v);
    }
    EXPECT_LT((Calc(q, v).bias - expected).norm(), 1e-6);
  }
  EXPECT_EQ(Calc(Vector7::Ones(), Vector7::Zero()).bias, Vector7::Zero());
}

TEST_F(ArmModelTest, JdotVIsTheJacobiansRate) {
  for (int k = 0; k < 200; ++k) {
    const Vector7 q = RandomVector<Vector7>(&random_, 1.5);
    const Vector7 v = RandomVector<Vector7>(&random_, 1);
    const Vector6 expected =
        (Calc(q + kStep * v, v).J_BE - Calc(q - kStep * v, v).J_BE) * v /
        (2 * kStep);
    EXPECT_LT((Calc(q, v).Jdot_v - expected).norm(), 1e-6);
  }
}

TEST_F(ArmModelTest, JacobianIsThePosesRate) {
  for (int k = 0; k < 200; ++k) {
    const Vector7 q = RandomVector<Vector7>(&random_, 1.5);
    const Vector7 v = RandomVector<Vector7>(&random_, 1);
    Calc(q - kStep * v, v);
    const Pose before = X_BE_;
    Calc(q + kStep * v, v);
    Vector6 expected;
    expected << X_BE_.p - before.p, LogRotation(X_BE_.R * before.R.transpose());
    expected /= 2 * kStep;
    EXPECT_LT((Calc(q, v).J_BE * v - expected).norm(), 1e-6);
  }
}

TEST_F(ArmModelTest, NotFiniteInputsShowInAllResults) {
  const ModelTerms good = Calc(Vector7::Ones(), Vector7::Ones());
  for (const double bad : {kNan, kInf, -kInf, 1e200}) {
    for (const bool in_q : {true, false}) {
      Vector7 q = Vector7::Ones();
      Vector7 v = Vector7::Ones();
      (in_q ? q : v)(2) = bad;
      const ModelTerms terms = Calc(q, v);
      EXPECT_TRUE(X_BE_.p.array().isNaN().all());
      EXPECT_TRUE(X_BE_.R.array().isNaN().all());
      EXPECT_TRUE(terms.J_BE.array().isNaN().all());
      EXPECT_TRUE(terms.mass.array().isNaN().all());
      EXPECT_TRUE(terms.bias.array().isNaN().all());
      EXPECT_TRUE(terms.gravity.array().isNaN().all());
      EXPECT_TRUE(terms.Jdot_v.array().isNaN().all());
    }
  }
  // Nothing of it stays.
  const ModelTerms again = Calc(Vector7::Ones(), Vector7::Ones());
  EXPECT_EQ(again.mass, good.mass);
  EXPECT_EQ(again.bias, good.bias);
}

TEST_F(ArmModelTest, DoesNotAllocate) {
  ModelTerms terms;
  ScopedNoAlloc guard;
  dut_.Calc(Vector7::Ones(), Vector7::Ones(), &X_BE_, &terms);
  EXPECT_EQ(guard.count(), 0);
}

TEST_F(ArmModelTest, ParamsNameTheirErrors) {
  const auto error = [this](auto&& change) {
    ArmModelParams params = params_;
    change(&params);
    return ValidationError(params);
  };
  using P = ArmModelParams;
  EXPECT_EQ(error([](P*) {}), "no exception");
  EXPECT_EQ(ValidationError(P{}),
            "ArmModelParams: field `mass[0]` expected a finite value > 0, "
            "got 0");
  EXPECT_THROW(ArmModel(P{}), std::invalid_argument);
  const auto contains = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  };
  EXPECT_TRUE(contains(error([](P* p) { p->p_PJ(1, 4) = kNan; }),
                       "field `p_PJ` expected finite values"));
  EXPECT_TRUE(contains(error([](P* p) { p->R_PJ[3] *= 2; }), "`R_PJ[3]`"));
  EXPECT_TRUE(contains(error([](P* p) { p->mass(6) = -1; }),
                       "`mass[6]` expected a finite value > 0, got -1"));
  EXPECT_TRUE(contains(error([](P* p) { p->com(0, 0) = kInf; }), "`com`"));
  EXPECT_TRUE(contains(error([](P* p) { p->inertia[1](0, 0) = kNan; }),
                       "`inertia[1]` expected finite values"));
  EXPECT_TRUE(contains(error([](P* p) { p->inertia[5](0, 1) += 0.1; }),
                       "`inertia[5]` expected a symmetric matrix"));
  EXPECT_TRUE(contains(
      error([](P* p) { p->inertia[2] = Vector3d(1, 1, -0.5).asDiagonal(); }),
      "`inertia[2]` expected principal moments >= 0, got "
      "-0.5"));
  EXPECT_TRUE(contains(
      error([](P* p) { p->inertia[2] = Vector3d(1, 4, 2).asDiagonal(); }),
      "`inertia[2]` expected no principal moment above the "
      "sum of the others, got 4"));
  EXPECT_TRUE(contains(error([](P* p) { p->p_LE(2) = kNan; }), "`p_LE`"));
  EXPECT_TRUE(contains(error([](P* p) { p->R_LE.setZero(); }), "`R_LE`"));
  EXPECT_TRUE(contains(error([](P* p) { p->gravity(2) = kInf; }), "`gravity`"));
}

}  // namespace
}  // namespace dual_proxy
