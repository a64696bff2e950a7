// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/selection_blend.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <stdexcept>
#include <string>

#include "dual_proxy/common/random.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Matrix3d Along(const Vector3d& axis) {
  const Vector3d unit = axis.normalized();
  return unit * unit.transpose();
}

class SelectionBlendTest : public ::testing::Test {
 protected:
  SelectionBlend dut_{{.blend_time = 0.03, .period = 0.001}};
  SelectionBlendState state_ = dut_.MakeState();
};

TEST_F(SelectionBlendTest, FirstSelectionIsTakenAtOnce) {
  const Matrix3d z = Along(Vector3d::UnitZ());
  EXPECT_EQ(dut_.Update(z, &state_), z);
}

TEST_F(SelectionBlendTest, ChangeIsLinearAndEndsExactly) {
  const Matrix3d z = Along(Vector3d::UnitZ());
  dut_.Update(Matrix3d::Zero(), &state_);
  for (int i = 1; i < 30; ++i) {
    EXPECT_NEAR(dut_.Update(z, &state_)(2, 2), i / 30.0, 1e-12);
  }
  dut_.Update(z, &state_);
  EXPECT_EQ(dut_.Update(z, &state_), z);
}

TEST_F(SelectionBlendTest, ChangeDuringABlendStartsWhereItIs) {
  const Matrix3d z = Along(Vector3d::UnitZ());
  dut_.Update(Matrix3d::Zero(), &state_);
  for (int i = 0; i < 15; ++i) dut_.Update(z, &state_);
  const Matrix3d before = state_.blended;
  const Matrix3d after = dut_.Update(Matrix3d::Zero(), &state_);
  EXPECT_LT((after - before).norm(), 1.001 * before.norm() / 30);
}

TEST_F(SelectionBlendTest, ZeroTimeSwitchesAtOnce) {
  const SelectionBlend dut{{.blend_time = 0}};
  SelectionBlendState state = dut.MakeState();
  dut.Update(Matrix3d::Zero(), &state);
  EXPECT_EQ(dut.Update(Matrix3d::Identity(), &state), Matrix3d::Identity());
}

TEST_F(SelectionBlendTest, EigenvaluesStayInTheUnitInterval) {
  RandomStream random(1);
  for (int i = 0; i < 5000; ++i) {
    Matrix3d selection = state_.to;
    if (random.Uniform() < 0.1) {
      const Vector3d axis(random.Normal(), random.Normal(), random.Normal());
      const double kind = random.Uniform();
      selection = kind < 0.2   ? Matrix3d::Zero()
                  : kind < 0.4 ? Matrix3d::Identity()
                  : kind < 0.7 ? Along(axis)
                               : Matrix3d(Matrix3d::Identity() - Along(axis));
    }
    const Matrix3d blended = dut_.Update(selection, &state_);
    const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(blended);
    EXPECT_GE(eigen.eigenvalues().minCoeff(), -1e-12);
    EXPECT_LE(eigen.eigenvalues().maxCoeff(), 1 + 1e-12);
    EXPECT_LT((blended - blended.transpose()).norm(), 1e-14);
  }
}

TEST_F(SelectionBlendTest, CopyContinuesAlikeWithoutAllocation) {
  dut_.Update(Matrix3d::Zero(), &state_);
  SelectionBlendState copy = state_;
  ScopedNoAlloc guard;
  for (int i = 0; i < 5; ++i) dut_.Update(Matrix3d::Identity(), &state_);
  EXPECT_EQ(guard.count(), 0);
  for (int i = 0; i < 5; ++i) dut_.Update(Matrix3d::Identity(), &copy);
  EXPECT_EQ(copy.blended, state_.blended);
}

TEST_F(SelectionBlendTest, InvalidParamsNameTheField) {
  EXPECT_EQ(ValidationError(SelectionBlendParams{.blend_time = -1}),
            "SelectionBlendParams: field `blend_time` expected a finite value "
            ">= 0, got -1");
  EXPECT_THROW(SelectionBlend({.period = 0}), std::invalid_argument);
}

}  // namespace
}  // namespace dual_proxy
