// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/rotation.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "dual_proxy/common/random.h"

namespace dual_proxy {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;

Vector3d RandomDirection(RandomStream* random) {
  return Vector3d(random->Normal(), random->Normal(), random->Normal())
      .normalized();
}

TEST(RotationTest, ExpAgreesWithAngleAxis) {
  RandomStream random(1);
  for (int i = 0; i < 1000; ++i) {
    const Vector3d axis = RandomDirection(&random);
    const double angle = 10.0 * random.Uniform();
    EXPECT_LT(
        (ExpRotation(angle * axis) - AngleAxisd(angle, axis).toRotationMatrix())
            .norm(),
        1e-14);
  }
}

TEST(RotationTest, LogInvertsExpFromTinyAnglesToPi) {
  RandomStream random(2);
  for (const double angle :
       {0.0, 1e-12, 1e-9, 1e-5, 1e-3, 1.0, 3.0, std::numbers::pi - 1e-6}) {
    for (int i = 0; i < 100; ++i) {
      const Vector3d vector = angle * RandomDirection(&random);
      EXPECT_LT((LogRotation(ExpRotation(vector)) - vector).norm(), 1e-9)
          << "angle " << angle;
    }
  }
}

TEST(RotationTest, ProjectionOfASumIsTheMiddleRotation) {
  const Matrix3d a = ExpRotation({0.2, 0, 0});
  const Matrix3d b = ExpRotation({0.6, 0, 0});
  EXPECT_LT((ProjectToRotation(a + b) - ExpRotation({0.4, 0, 0})).norm(),
            1e-14);
}

TEST(RotationTest, ProjectionIsAlwaysARotation) {
  RandomStream random(3);
  for (int i = 0; i < 1000; ++i) {
    Matrix3d M;
    for (double& entry : M.reshaped()) entry = random.Normal();
    EXPECT_TRUE(IsValidPose({Vector3d::Zero(), ProjectToRotation(M)}));
  }
  EXPECT_EQ(ProjectToRotation(
                Matrix3d::Constant(std::numeric_limits<double>::quiet_NaN())),
            Matrix3d::Identity());
}

TEST(RotationTest, ValidPoseRefusesNanReflectionAndScale) {
  EXPECT_TRUE(IsValidPose({}));
  EXPECT_FALSE(
      IsValidPose({Vector3d(0, std::numeric_limits<double>::infinity(), 0)}));
  EXPECT_FALSE(IsValidPose({Vector3d::Zero(), -Matrix3d::Identity()}));
  EXPECT_FALSE(IsValidPose({Vector3d::Zero(), 1.1 * Matrix3d::Identity()}));
}

}  // namespace
}  // namespace dual_proxy
