// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/workspace.h"

#include <utility>

#include <gtest/gtest.h>
#include <Eigen/Core>

namespace dual_proxy {
namespace {

TEST(WorkspaceTest, ACopyHasTheRoomAndKeepsItsOwnContent) {
  Workspace<Eigen::VectorXd> source;
  source->setConstant(3, 7);
  const Workspace<Eigen::VectorXd> copy = source;
  EXPECT_EQ(copy->size(), 3);

  Workspace<Eigen::VectorXd> target;
  target->setConstant(3, 5);
  const double* place = target->data();
  target = source;
  EXPECT_EQ(target->data(), place);
  EXPECT_EQ((*target)(2), 5);

  target->setConstant(2, 5);
  target = source;
  EXPECT_EQ(target->size(), 3);
}

TEST(WorkspaceTest, AMoveTakesTheContent) {
  Workspace<Eigen::MatrixXd> source;
  source->setConstant(2, 3, 7);
  const Workspace<Eigen::MatrixXd> target = std::move(source);
  EXPECT_EQ((*target)(1, 2), 7);
}

}  // namespace
}  // namespace dual_proxy
