// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/arm_model.h"

#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <type_traits>

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

template <int kJoints>
ArmModelParams<kJoints> RandomParams(RandomStream* random) {
  ArmModelParams<kJoints> params;
  for (int i = 0; i < kJoints; ++i) {
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
template <int kJoints>
struct Reference {
  using PerJoint = Eigen::Matrix<double, 3, kJoints>;

  Reference(const ArmModelParams<kJoints>& params,
            const JointVector<kJoints>& q) {
    PerJoint joints = PerJoint::Zero();
    PerJoint axes = PerJoint::Zero();
    Pose X;
    for (int i = 0; i < kJoints; ++i) {
      X.p += X.R * params.p_PJ.col(i);
      X.R = X.R * params.R_PJ[i] *
            Eigen::AngleAxisd(q(i), Vector3d::UnitZ()).toRotationMatrix();
      joints.col(i) = X.p;
      axes.col(i) = X.R.col(2);
      const Vector3d com = X.p + X.R * params.com.col(i);
      PerJoint linear = PerJoint::Zero();
      PerJoint angular = PerJoint::Zero();
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
    for (int j = 0; j < kJoints; ++j) {
      J_BE.col(j) << axes.col(j).cross(X_BE.p - joints.col(j)), axes.col(j);
    }
  }

  Pose X_BE;
  Jacobian<kJoints> J_BE{Jacobian<kJoints>::Zero()};
  JointMatrix<kJoints> mass{JointMatrix<kJoints>::Zero()};
  JointVector<kJoints> gravity{JointVector<kJoints>::Zero()};
  double potential_energy{0};
};

/** With as many joints as the type says. */
template <typename Count>
class ArmModelTest : public ::testing::Test {
 protected:
  static constexpr int kJoints = Count::value;
  using Joints = JointVector<kJoints>;
  using Mass = JointMatrix<kJoints>;
  using Terms = ModelTerms<kJoints>;
  using Model = ArmModel<kJoints>;

  static ArmModelParams<kJoints> RandomArm(RandomStream* random) {
    return RandomParams<kJoints>(random);
  }

  Joints RandomJoints(double size) {
    return RandomVector<Joints>(&random_, size);
  }

  Terms Calc(const Joints& q, const Joints& v) {
    Terms terms;
    dut_.Calc(q, v, &X_BE_, &terms);
    return terms;
  }

  RandomStream random_{5};
  ArmModelParams<kJoints> params_{RandomArm(&random_)};
  Model dut_{params_};
  Pose X_BE_;
};

using Counts = ::testing::Types<std::integral_constant<int, 6>,
                                std::integral_constant<int, 7>>;
TYPED_TEST_SUITE(ArmModelTest, Counts);

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
  ArmModelParams<7> params;
  params.p_PJ(0, 1) = kLength1;
  params.mass.setConstant(1e-15);
  params.mass.head<2>() << kMass1, kMass2;
  params.com(0, 0) = kCom1;
  params.com(0, 1) = kCom2;
  params.inertia[0].diagonal() << 0.04, 0.04, kInertia1;
  params.inertia[1].diagonal() << 0.04, 0.04, kInertia2;
  params.p_LE(0) = kLength2;
  params.gravity = {0, -kGravity, 0};
  const ArmModel<7> dut(params);

  RandomStream random(3);
  for (int k = 0; k < 50; ++k) {
    Vector7 q = Vector7::Zero();
    Vector7 v = Vector7::Zero();
    q.head<2>() = RandomVector<Eigen::Vector2d>(&random, 1);
    v.head<2>() = RandomVector<Eigen::Vector2d>(&random, 1);
    Pose X_BE;
    ModelTerms<7> terms;
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

TYPED_TEST(ArmModelTest, MatchesTheTextbookOnRandomArms) {
  using Joints = typename TestFixture::Joints;
  using Terms = typename TestFixture::Terms;
  using Model = typename TestFixture::Model;
  for (int k = 0; k < 200; ++k) {
    this->params_ = this->RandomArm(&this->random_);
    this->dut_ = Model(this->params_);
    const Joints q = this->RandomJoints(1.5);
    const Terms terms = this->Calc(q, this->RandomJoints(1));
    const Reference expected(this->params_, q);
    EXPECT_LT((this->X_BE_.p - expected.X_BE.p).norm(), 1e-13);
    EXPECT_LT((this->X_BE_.R - expected.X_BE.R).norm(), 1e-13);
    EXPECT_LT((terms.J_BE - expected.J_BE).norm(), 1e-12);
    EXPECT_LT((terms.mass - expected.mass).norm(),
              1e-12 * expected.mass.norm());
    EXPECT_LT((terms.gravity - expected.gravity).norm(),
              1e-12 * (1 + expected.gravity.norm()));
  }
}

TYPED_TEST(ArmModelTest, MassIsSymmetricAndPositiveDefinite) {
  using Mass = typename TestFixture::Mass;
  using Model = typename TestFixture::Model;
  for (int k = 0; k < 200; ++k) {
    this->dut_ = Model(this->RandomArm(&this->random_));
    const Mass mass =
        this->Calc(this->RandomJoints(1.5), this->RandomJoints(1)).mass;
    EXPECT_EQ(mass, mass.transpose());
    EXPECT_EQ(Eigen::LLT<Mass>(mass).info(), Eigen::Success);
  }
}

// d/dt (v A v / 2) = v (tau + g), and dU/dt = -v g, along a motion driven by
// the torque that the equation of motion asks for.
TYPED_TEST(ArmModelTest, TorqueIsWhatChangesTheEnergy) {
  using Joints = typename TestFixture::Joints;
  using Terms = typename TestFixture::Terms;
  for (int k = 0; k < 200; ++k) {
    const Joints q = this->RandomJoints(1.5);
    const Joints v = this->RandomJoints(1);
    const Joints a = this->RandomJoints(1);
    const auto kinetic_energy = [&](double time) {
      const Joints v_t = v + time * a;
      const Joints q_t = q + time * v + 0.5 * time * time * a;
      return 0.5 * v_t.dot(this->Calc(q_t, v_t).mass * v_t);
    };
    const auto potential_energy = [&](double time) {
      return Reference<TestFixture::kJoints>(this->params_, q + time * v)
          .potential_energy;
    };
    const Terms terms = this->Calc(q, v);
    const Joints torque = terms.mass * a + terms.bias - terms.gravity;
    EXPECT_NEAR((kinetic_energy(kStep) - kinetic_energy(-kStep)) / (2 * kStep),
                v.dot(torque + terms.gravity), 1e-6);
    EXPECT_NEAR(
        (potential_energy(kStep) - potential_energy(-kStep)) / (2 * kStep),
        -v.dot(terms.gravity), 1e-6);
  }
}

TYPED_TEST(ArmModelTest, BiasIsLagranges) {
  using Joints = typename TestFixture::Joints;
  using Mass = typename TestFixture::Mass;
  for (int k = 0; k < 50; ++k) {
    const Joints q = this->RandomJoints(1.5);
    const Joints v = this->RandomJoints(1);
    const auto mass_rate = [&](const Joints& direction) {
      return Mass(
          (Reference<TestFixture::kJoints>(this->params_, q + kStep * direction)
               .mass -
           Reference<TestFixture::kJoints>(this->params_, q - kStep * direction)
               .mass) /
          (2 * kStep));
    };
    Joints expected = mass_rate(v) * v;
    for (int i = 0; i < TestFixture::kJoints; ++i) {
      expected(i) -= 0.5 * v.dot(mass_rate(Joints::Unit(i)) * v);
    }
    EXPECT_LT((this->Calc(q, v).bias - expected).norm(), 1e-6);
  }
  EXPECT_EQ(this->Calc(Joints::Ones(), Joints::Zero()).bias, Joints::Zero());
}

TYPED_TEST(ArmModelTest, JdotVIsTheJacobiansRate) {
  using Joints = typename TestFixture::Joints;
  for (int k = 0; k < 200; ++k) {
    const Joints q = this->RandomJoints(1.5);
    const Joints v = this->RandomJoints(1);
    const Vector6 expected = (this->Calc(q + kStep * v, v).J_BE -
                              this->Calc(q - kStep * v, v).J_BE) *
                             v / (2 * kStep);
    EXPECT_LT((this->Calc(q, v).Jdot_v - expected).norm(), 1e-6);
  }
}

TYPED_TEST(ArmModelTest, JacobianIsThePosesRate) {
  using Joints = typename TestFixture::Joints;
  for (int k = 0; k < 200; ++k) {
    const Joints q = this->RandomJoints(1.5);
    const Joints v = this->RandomJoints(1);
    this->Calc(q - kStep * v, v);
    const Pose before = this->X_BE_;
    this->Calc(q + kStep * v, v);
    Vector6 expected;
    expected << this->X_BE_.p - before.p,
        LogRotation(this->X_BE_.R * before.R.transpose());
    expected /= 2 * kStep;
    EXPECT_LT((this->Calc(q, v).J_BE * v - expected).norm(), 1e-6);
  }
}

TYPED_TEST(ArmModelTest, NotFiniteInputsShowInAllResults) {
  using Joints = typename TestFixture::Joints;
  using Terms = typename TestFixture::Terms;
  const Terms good = this->Calc(Joints::Ones(), Joints::Ones());
  for (const double bad : {kNan, kInf, -kInf, 1e200}) {
    for (const bool in_q : {true, false}) {
      Joints q = Joints::Ones();
      Joints v = Joints::Ones();
      (in_q ? q : v)(2) = bad;
      const Terms terms = this->Calc(q, v);
      EXPECT_TRUE(this->X_BE_.p.array().isNaN().all());
      EXPECT_TRUE(this->X_BE_.R.array().isNaN().all());
      EXPECT_TRUE(terms.J_BE.array().isNaN().all());
      EXPECT_TRUE(terms.mass.array().isNaN().all());
      EXPECT_TRUE(terms.bias.array().isNaN().all());
      EXPECT_TRUE(terms.gravity.array().isNaN().all());
      EXPECT_TRUE(terms.Jdot_v.array().isNaN().all());
    }
  }
  // Nothing of it stays.
  const Terms again = this->Calc(Joints::Ones(), Joints::Ones());
  EXPECT_EQ(again.mass, good.mass);
  EXPECT_EQ(again.bias, good.bias);
}

TYPED_TEST(ArmModelTest, DoesNotAllocate) {
  using Joints = typename TestFixture::Joints;
  using Terms = typename TestFixture::Terms;
  Terms terms;
  ScopedNoAlloc guard;
  this->dut_.Calc(Joints::Ones(), Joints::Ones(), &this->X_BE_, &terms);
  EXPECT_EQ(guard.count(), 0);
}

TEST(ArmModelParamsTest, NameTheirErrors) {
  RandomStream random{5};
  const ArmModelParams<7> good = RandomParams<7>(&random);
  const auto error = [&good](auto&& change) {
    ArmModelParams<7> params = good;
    change(&params);
    return ValidationError(params);
  };
  using P = ArmModelParams<7>;
  EXPECT_EQ(error([](P*) {}), "no exception");
  EXPECT_EQ(ValidationError(P{}),
            "ArmModelParams: field `mass[0]` expected a finite value > 0, "
            "got 0");
  EXPECT_THROW(ArmModel<7>(P{}), std::invalid_argument);
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
