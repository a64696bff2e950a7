// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/control/arm_kinematics_system.h"

#include "dual_proxy/common/face.h"

namespace dual_proxy {

ArmKinematicsSystem::ArmKinematicsSystem(const ArmModelParams<7>& arm)
    : arm_(arm) {
  DeclareVectorInputPort("robot_state", 14);
  DeclareAbstractOutputPort("robot_pose", &ArmKinematicsSystem::CalcPose,
                            {get_robot_state_input_port().ticket()});
  DeclareVectorOutputPort("robot_velocity", 6,
                          &ArmKinematicsSystem::CalcVelocity,
                          {get_robot_state_input_port().ticket()});
}

void ArmKinematicsSystem::CalcPose(const Context& context,
                                   drake::math::RigidTransformd* X_BE) const {
  const Eigen::VectorXd& x = get_robot_state_input_port().Eval(context);
  Pose pose;
  ModelTerms<7> terms;
  arm_.Calc(x.head<7>(), x.tail<7>(), &pose, &terms);
  *X_BE = ToRigidTransform(pose);
}

void ArmKinematicsSystem::CalcVelocity(
    const Context& context,
    drake::systems::BasicVector<double>* velocity) const {
  const Eigen::VectorXd& x = get_robot_state_input_port().Eval(context);
  Pose pose;
  ModelTerms<7> terms;
  arm_.Calc(x.head<7>(), x.tail<7>(), &pose, &terms);
  velocity->get_mutable_value() = CalcTwist<7>(terms, x.tail<7>());
}

}  // namespace dual_proxy
