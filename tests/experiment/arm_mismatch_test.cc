// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/arm_mismatch.h"

#include <string>

#include <gtest/gtest.h>

#include "test_arm.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Vector3d;

SimulatedArmParams MakeTool() {
  SimulatedArmParams params;
  params.p_SE = {0, 0, 0.1};
  params.tool_mass = 0.5;
  params.tool_com = {0, 0, 0.04};
  params.tool_inertia = Vector3d(2e-4, 2e-4, 8e-5).asDiagonal();
  return params;
}

// The arm's terms at rest in a posture.
ModelTerms<7> Terms(const ArmModelParams<7>& arm) {
  Pose X_BE;
  ModelTerms<7> terms;
  ArmModel<7>(arm).Calc(kTestArmAtRest, Vector7::Zero(), &X_BE, &terms);
  return terms;
}

TEST(ArmMismatchTest, NoneChangesNothing) {
  ArmModelParams<7> arm = MakeTestArm();
  SimulatedArmParams params = MakeTool();
  ApplyMismatch({}, &arm, &params);
  EXPECT_EQ(arm.mass, MakeTestArm().mass);
  EXPECT_EQ(arm.com, MakeTestArm().com);
  EXPECT_EQ(arm.inertia[6], MakeTestArm().inertia[6]);
  EXPECT_EQ(params.tool_mass, MakeTool().tool_mass);
  EXPECT_EQ(params.tool_com, MakeTool().tool_com);
  EXPECT_TRUE(ArmMismatchParams().is_none());
}

TEST(ArmMismatchTest, TheToolIsNotScaled) {
  ArmModelParams<7> arm = MakeTestArm();
  SimulatedArmParams params = MakeTool();
  ApplyMismatch({.mass_scale = 1.3}, &arm, &params);
  EXPECT_NEAR(arm.mass(1), 1.3 * MakeTestArm().mass(1), 1e-12);
  EXPECT_NEAR(arm.mass(6), 1.3 * (1.2 - 0.5) + 0.5, 1e-12);
  EXPECT_EQ(params.tool_mass, 0.5);
}

TEST(ArmMismatchTest, APayloadIsAPointAtTheToolPoint) {
  ArmModelParams<7> arm = MakeTestArm();
  SimulatedArmParams params = MakeTool();
  const double payload = 0.8;
  ApplyMismatch({.payload = payload}, &arm, &params);
  // What a point adds to the arm's mass matrix and weight.
  const ModelTerms<7> before = Terms(MakeTestArm());
  const ModelTerms<7> after = Terms(arm);
  const auto J = before.J_BE.topRows<3>();
  EXPECT_TRUE(
      after.mass.isApprox(before.mass + payload * J.transpose() * J, 1e-12));
  const Vector7 weight = J.transpose() * (payload * MakeTestArm().gravity);
  EXPECT_TRUE((after.gravity - before.gravity).isApprox(weight, 1e-9));
  // The sensor carries it, about E as well.
  EXPECT_NEAR(params.tool_mass, 0.5 + payload, 1e-12);
  EXPECT_NEAR(params.tool_mass * params.tool_com.z(),
              0.5 * 0.04 + payload * 0.1, 1e-12);
}

TEST(ArmMismatchTest, TheRestGoesToThePlant) {
  ArmModelParams<7> arm = MakeTestArm();
  SimulatedArmParams params = MakeTool();
  ApplyMismatch({.tool_offset = {0, 0, 0.05},
                 .joint_friction = 0.3,
                 .torque_step = 0.01,
                 .torque_delay = 2},
                &arm, &params);
  EXPECT_EQ(Vector3d(params.p_EBall.col(0)), Vector3d(0, 0, 0.05));
  EXPECT_EQ(params.joint_friction, 0.3);
  EXPECT_EQ(params.torque_step, 0.01);
  EXPECT_EQ(params.torque_delay, 2);
}

TEST(ArmMismatchTest, InvalidOnesAreNamed) {
  EXPECT_NE(
      ValidationError(ArmMismatchParams{.mass_scale = 3}).find("`mass_scale`"),
      std::string::npos);
  EXPECT_NE(ValidationError(ArmMismatchParams{.torque_delay = 9})
                .find("`torque_delay`"),
            std::string::npos);
}

}  // namespace
}  // namespace dual_proxy
