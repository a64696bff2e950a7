// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/workspace_map.h"

#include <limits>

#include <gtest/gtest.h>

#include "no_alloc.h"
#include "test_support.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

WorkspaceMapParams RandomParams(RandomStream* random) {
  WorkspaceMapParams params;
  params.R_DB = RandomRotation(2.0, random);
  params.p_cw = RandomVector(1.0, random);
  params.R_cw = RandomRotation(2.0, random);
  params.scale = 0.1 + 10.0 * random->Uniform();
  return params;
}

TEST(WorkspaceMapTest, EquationsByHand) {
  // D is turned by 90 deg about z: B's x is D's y, B's y is D's -x.
  WorkspaceMapParams params;
  params.R_DB << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  params.p_cw = Vector3d(0.5, 0.0, 0.3);
  params.scale = 2.5;
  const WorkspaceMap dut(params);
  // One centimetre along D's y is 2.5 cm along B's x.
  const Pose robot = dut.RobotProxy({0, 0.01, 0}, Matrix3d::Identity());
  EXPECT_TRUE(robot.p.isApprox(Vector3d(0.525, 0, 0.3), 1e-15));
  EXPECT_TRUE(robot.R.isIdentity(1e-15));
  // A turn of the handle about D's x is a turn of the robot about B's -y.
  const double angle = 0.4;
  const Pose turned =
      dut.RobotProxy(Vector3d::Zero(), ExpRotation({angle, 0, 0}));
  EXPECT_TRUE(LogRotation(turned.R).isApprox(Vector3d(0, -angle, 0), 1e-12));
  // Force space along B's x is force space along D's y.
  EXPECT_TRUE(dut.HapticSelection(Direction(Vector3d::UnitX()))
                  .isApprox(Direction(Vector3d::UnitY()), 1e-15));
}

TEST(WorkspaceMapTest, HomeMapsToTheClutchPose) {
  RandomStream random(1);
  const WorkspaceMapParams params = RandomParams(&random);
  const WorkspaceMap dut(params);
  const Pose pose = dut.RobotProxy(Vector3d::Zero(), Matrix3d::Identity());
  EXPECT_EQ(pose.p, params.p_cw);
  EXPECT_TRUE(pose.R.isApprox(params.R_cw, 1e-14));
}

TEST(WorkspaceMapTest, TheTwoPoseMapsAreInverses) {
  RandomStream random(2);
  for (int i = 0; i < 1000; ++i) {
    const WorkspaceMap dut(RandomParams(&random));
    const Vector3d x = RandomVector(0.1, &random);
    const Matrix3d R = RandomRotation(2.0, &random);
    const Pose robot = dut.RobotProxy(x, R);
    const Pose back = dut.HapticProxy(robot.p, robot.R);
    // Rounding of p_cw (metres) comes back divided by the scale (>= 0.1).
    ASSERT_LT((back.p - x).norm(), 1e-13) << i;
    ASSERT_LT((back.R - R).norm(), 1e-13) << i;
    const Pose haptic = dut.HapticProxy(x, R);
    const Pose forth = dut.RobotProxy(haptic.p, haptic.R);
    ASSERT_LT((forth.p - x).norm(), 1e-13) << i;
    ASSERT_LT((forth.R - R).norm(), 1e-13) << i;
  }
}

TEST(WorkspaceMapTest, SelectionAndDisplacementAreMappedAlike) {
  // Where a robot displacement lies in force space, so does the device's.
  RandomStream random(3);
  for (int i = 0; i < 1000; ++i) {
    const WorkspaceMapParams params = RandomParams(&random);
    const WorkspaceMap dut(params);
    const Matrix3d Omega = RandomSelection(&random);
    const Matrix3d Omega_h = dut.HapticSelection(Omega);
    ASSERT_TRUE(Omega_h.isApprox(Omega_h.transpose(), 1e-12) ||
                Omega_h.isZero(1e-12));
    ASSERT_LT((Omega_h * Omega_h - Omega_h).norm(), 1e-12) << i;
    ASSERT_NEAR(Omega_h.trace(), Omega.trace(), 1e-12) << i;
    const Vector3d a = RandomVector(1.0, &random);
    const Vector3d b = RandomVector(1.0, &random);
    const Matrix3d R = Matrix3d::Identity();
    const Vector3d d = dut.HapticProxy(a, R).p - dut.HapticProxy(b, R).p;
    const Vector3d e =
        dut.HapticProxy(Omega * a, R).p - dut.HapticProxy(Omega * b, R).p;
    ASSERT_LT((Omega_h * d - e).norm(), 1e-12) << i;
  }
}

TEST(WorkspaceMapTest, NotFiniteStaysNotFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const WorkspaceMap dut{WorkspaceMapParams{}};
  EXPECT_FALSE(dut.RobotProxy({nan, 0, 0}, Matrix3d::Identity()).p.allFinite());
  EXPECT_FALSE(
      dut.HapticProxy({0, nan, 0}, Matrix3d::Identity()).p.allFinite());
}

TEST(WorkspaceMapTest, DoesNotAllocate) {
  const WorkspaceMap dut{WorkspaceMapParams{}};
  Pose pose;
  Matrix3d Omega = Matrix3d::Identity();
  ScopedNoAlloc guard;
  pose = dut.RobotProxy(pose.p, pose.R);
  pose = dut.HapticProxy(pose.p, pose.R);
  Omega = dut.HapticSelection(Omega);
  EXPECT_EQ(guard.count(), 0);
}

TEST(WorkspaceMapParamsTest, InvalidParametersAreNamed) {
  const auto message = [](const WorkspaceMapParams& params) {
    return InvalidArgument([&] { WorkspaceMap{params}; });
  };
  WorkspaceMapParams params;
  params.scale = 0.0;
  EXPECT_NE(message(params).find("WorkspaceMapParams: field `scale`"),
            std::string::npos);
  params = {};
  params.R_DB = -Matrix3d::Identity();  // A reflection.
  EXPECT_NE(message(params).find("`R_DB`"), std::string::npos);
  params = {};
  params.R_cw(0, 1) = 0.1;
  EXPECT_NE(message(params).find("`R_cw`"), std::string::npos);
  params = {};
  params.p_cw.z() = std::numeric_limits<double>::infinity();
  EXPECT_NE(message(params).find("`p_cw`"), std::string::npos);
}

}  // namespace
}  // namespace dual_proxy
